"""Praat's TextGrid: tiers of intervals, long and short text form, UTF-8 and UTF-16.

Both forms hold the same numbers, quoted texts and flags in the same order; the long one has labels
between them, which are skipped here.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from elocute.errors import AlignmentError, ElocuteWarning

FILE_TYPES = ("ooTextFile", "ooTextFile short")
"""Now and as old versions of Praat, and P2FA, begin the short form."""
TIERS_MAX, NAMES_TOLD = 1000, 10
HAIRLINE_S = 1e-3
"""A shorter rest is no rest: sums that differ in their last digits part two intervals so."""
BEGIN_MAX_S = 0.02
"""A sound begins at 0: Praat's `Extract part` can preserve times, a sound's file cannot."""
ITEMS_MAX = 1_000_000
"""Tiers, intervals and points, all together."""
# What stands free in a TextGrid: "text" with doubled quotes, a flag, a number. Names of fields,
# "[1]:" and comments are none of these.
# Nothing is tried twice: what is remembered for it would be a hundred times a long text.
TOKEN = re.compile(
    r'"((?:[^"]++|"")*+)"|<(exists|absent)>|(?<![^\s])([-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)(?!\S)'
    r"|(![^\n]*)|\S+"
)


@dataclass(frozen=True)
class TextGridInterval:
    """A labelled stretch of a tier; times in s."""

    start_s: float
    end_s: float
    text: str


def format_textgrid(tiers: Mapping[str, Sequence[TextGridInterval]], duration_s: float) -> str:
    """The long form of tiers, whose intervals are each in order and without overlap.

    Rests between intervals are empty intervals, as Praat wants them.
    """
    lines = [
        'File type = "ooTextFile"',
        'Object class = "TextGrid"',
        "",
        "xmin = 0",
        f"xmax = {duration_s!r}",
        "tiers? <exists>",
        f"size = {len(tiers)}",
        "item []:",
    ]
    for place, (name, spoken) in enumerate(tiers.items(), 1):
        lines += [f"    item [{place}]:", *_tier_lines(name, _gapless(spoken, duration_s))]
    return "\n".join(lines) + "\n"


def _tier_lines(name: str, rows: list[TextGridInterval]) -> list[str]:
    lines = [
        '        class = "IntervalTier"',
        f'        name = "{name}"',
        "        xmin = 0",
        f"        xmax = {rows[-1].end_s!r}",
        f"        intervals: size = {len(rows)}",
    ]
    for number, row in enumerate(rows, 1):
        quoted = row.text.replace('"', '""')
        lines += [
            f"        intervals [{number}]:",
            f"            xmin = {row.start_s!r}",
            f"            xmax = {row.end_s!r}",
            f'            text = "{quoted}"',
        ]
    return lines


def _gapless(spoken: Sequence[TextGridInterval], duration_s: float) -> list[TextGridInterval]:
    rows: list[TextGridInterval] = []
    at = 0.0
    for each in spoken:
        start, end = max(each.start_s, at), min(each.end_s, duration_s)
        if start - at > HAIRLINE_S:
            rows.append(TextGridInterval(at, start, ""))
        elif rows and start > at:
            rows[-1] = replace(rows[-1], end_s=start)
        else:
            start = at
        if end > start:
            rows.append(TextGridInterval(start, end, each.text))
            at = end
    if duration_s - at > HAIRLINE_S or not rows:
        rows.append(TextGridInterval(at, duration_s, ""))
    rows[-1] = replace(rows[-1], end_s=duration_s)
    return rows


def parse_textgrid(data: bytes, tier: str) -> tuple[list[TextGridInterval], float]:
    """Labelled intervals of the tier of that name, or of the only one, and the duration in s.

    Raises AlignmentError for any other file.
    """
    tiers, duration = parse_tiers(data)
    intervals = [(name, rows) for name, rows in tiers if rows is not None]
    chosen = [rows for name, rows in intervals if name == tier]
    if not chosen and len(intervals) == 1:
        chosen = [intervals[0][1]]
    if len(chosen) != 1:
        names = ", ".join(repr(name[:40]) for name, _ in tiers[:NAMES_TOLD]) or "none"
        names += ", …" if len(tiers) > NAMES_TOLD else ""
        raise _fault(f"tiers {names}", f"one interval tier called {tier!r}")
    return [row for row in chosen[0] if row.text.strip()], duration


def parse_tiers(data: bytes) -> tuple[list[tuple[str, list[TextGridInterval] | None]], float]:
    """Name and intervals of every tier, None for tiers of points, and the duration in s.

    Raises AlignmentError for any other file; warns of times that begin later than a sound.
    """
    tokens = _Tokens(_decoded(data))
    if tokens.text() not in FILE_TYPES or tokens.text() != "TextGrid":
        raise _fault("another kind of file")
    start, duration = tokens.number(), tokens.number()
    if start > BEGIN_MAX_S:
        warnings.warn(
            f"a TextGrid whose times begin at {start:g} s, not at 0, as those of a part of a longer"
            " sound; they are taken as they stand",
            ElocuteWarning,
            stacklevel=2,
        )
    if tokens.flag() != "exists":
        raise _fault("no tiers")
    count = tokens.count()
    if count > TIERS_MAX:
        raise _fault(f"{count} tiers", f"up to {TIERS_MAX}")
    tiers = [_tier(tokens) for _ in range(count)]
    return tiers, duration


def _tier(tokens: _Tokens) -> tuple[str, list[TextGridInterval] | None]:
    kind, name = tokens.text(), tokens.text()
    tokens.skip_numbers(2)
    if kind == "IntervalTier":
        rows, promised = list[TextGridInterval](), tokens.count()
        while len(rows) < promised or tokens.has_more():  # MFA has told too few
            rows.append(TextGridInterval(tokens.number(), tokens.number(), tokens.text().strip()))
        return name, rows
    if kind == "TextTier":  # points are skipped
        for _ in range(tokens.count()):
            tokens.skip_numbers(1)
            tokens.text()
        return name, None
    raise _fault(f"a tier of class {kind[:40]!r}", "IntervalTier, TextTier")


class _Tokens:
    """Numbers, texts and flags in the order in which they stand."""

    def __init__(self, text: str) -> None:
        self._found = (each for each in TOKEN.finditer(text) if each.lastindex in (1, 2, 3))
        self._ahead = next(self._found, None)
        self._items = 0

    def has_more(self) -> bool:
        """Whether another interval follows, which begins with a number, not a tier or the end."""
        more = self._ahead is not None and self._ahead.lastindex == 3
        self._items += more
        if self._items > ITEMS_MAX:
            raise _fault(f"more than {ITEMS_MAX} items", "fewer")
        return more

    def _next(self, group: int) -> str:
        match, self._ahead = self._ahead, next(self._found, None)
        if match is None:
            raise _fault("an early end")
        if match.lastindex != group:
            raise _fault(f"{match.group(0)[:40]!r} out of place")
        return match.group(group)

    def text(self) -> str:
        return self._next(1).replace('""', '"')

    def flag(self) -> str:
        return self._next(2)

    def number(self) -> float:
        value = float(self._next(3))
        if not math.isfinite(value):
            raise _fault(f"number {value}")
        return value

    def skip_numbers(self, count: int) -> None:
        for _ in range(count):
            self.number()

    def count(self) -> int:
        value = self.number()  # finite, so it has a whole part
        self._items += int(value)
        if value != int(value) or value < 0 or self._items > ITEMS_MAX:
            raise _fault(f"{value:g} items", f"0 to {ITEMS_MAX}, all together")
        return int(value)


def _decoded(data: bytes) -> str:
    """Praat writes UTF-16 with a mark where a text is not ASCII, else UTF-8 or ASCII."""
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        raise _fault("bytes that are not text", "UTF-8 or UTF-16") from error


def _fault(found: str, allowed: str = "a TextGrid as Praat saves it as text") -> AlignmentError:
    return AlignmentError(f"found {found}; allowed: {allowed}")
