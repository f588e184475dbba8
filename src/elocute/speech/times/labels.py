"""Timed labels: start, end and text."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import pairwise

from elocute.array_types import Float32Array
from elocute.errors import InputError
from elocute.files.json_records import finite_number

Label = tuple[float, float, str]
"""Start in s, end in s, and what is written: a word, or a phone."""
PhoneRefiner = Callable[[Float32Array, float], Float32Array]
"""Takes the encoder's log-posteriors (row, 40) of a whole sound and its duration in s; gives better
ones."""
BYTES_MAX = 50_000_000
LABELS_MAX = 1_000_000
BACK_S = 0.1
"""How far events may be out of order."""
LAST_S, OPEN_S = 0.15, 0.3
"""Seconds that the last event and the last word last where their ends are not given."""
CLOCK = r"(?:\d{1,3}:)?\d{1,3}:\d{2}(?:[.,]\d{1,9})?"
"""A time in hours, minutes and seconds."""


@dataclass(frozen=True)
class Labels:
    """What a file holds: phones, or words alone, as start in s, end in s and label.

    `alphabet` says how the phones are written, where the format says it; `notes` what was guessed.
    """

    phones: list[Label] = field(default_factory=list)
    words: list[Label] = field(default_factory=list)
    alphabet: str = ""
    notes: list[str] = field(default_factory=list)


def seconds_of(value: object, what: str, unit: float = 1.0) -> float:
    """A time in s. Raises InputError for anything but a finite number that is not negative."""
    number = finite_number(value)
    if number is None or number < 0:
        raise InputError.about(what, found=repr(value)[:40], allowed="a time from 0")
    return number * unit


def clock_seconds(text: str) -> float | None:
    """A time such as 1:02:03.456 or 02:03,456 in s; None for any other text."""
    if re.fullmatch(CLOCK, text) is None:
        return None
    parts = [float(part) for part in text.replace(",", ".").split(":")]
    return sum(part * 60**power for power, part in enumerate(reversed(parts)))


def until_next(events: Iterable[tuple[float, str]]) -> list[Label]:
    """Events that last until the next one. Raises InputError where their times begin again."""
    starts = list(events)
    for (before, _), (start, text) in pairwise(starts):
        if start < before - BACK_S:
            raise InputError.about(
                f"time of {text[:40]!r}",
                found=f"{start:.3f} s, behind one at {before:.3f} s",
                allowed="the events of one sound, in order",
            )
    ordered = sorted(starts, key=lambda event: event[0])
    ends = [start for start, _ in ordered[1:]] + [ordered[-1][0] + LAST_S] if ordered else []
    return [(start, end, text) for (start, text), end in zip(ordered, ends, strict=True)]
