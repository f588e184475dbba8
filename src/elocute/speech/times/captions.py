"""Reads subtitles: SubRip (.srt), WebVTT (.vtt), YouTube's .sbv, .ass and .lrc."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise

from elocute.errors import InputError
from elocute.speech.text.script_text import (
    left_out_note,
    speakers_of,
    spoken_lines,
    spoken_script,
)
from elocute.speech.times.labels import CLOCK, LABELS_MAX, OPEN_S, Label, Labels, clock_seconds

HEAD_MAX = 20_000
ROLLING_SHARE = 0.25
"""Of the captions of a text that repeat the line before above a new one: captions that roll up."""
_TIMES = re.compile(
    rf"^[ \t]*({CLOCK})[ \t]*(?:(-->)|,)[ \t]*({CLOCK})(?(2)|[ \t]*$)", re.MULTILINE
)
# As programs write them that are less strict: of -1 s, with spaces, ->, or a colon before ms.
_LOOSE = re.compile(
    r"^([ \t]{0,20}-?\d{1,3}(?:[:.,] ?\d{1,3}){1,3})[ \t]{0,20}--?>"
    r"[ \t]{0,20}(-?\d{1,3}(?:[:.,] ?\d{1,3}){1,3})(?=\s|$)",
    re.MULTILINE,
)
_NOTES = re.compile(r"\s*(?:NOTE(?=\s|$)|(?:STYLE|REGION)[ \t]*(?:\n|$))")
"""Begins a paragraph of WebVTT that no times stand above, and that is not shown."""
_MARK = re.compile(rf"<({CLOCK})>")
# With the small letters above ruby, which say the word below them again.
_TAGS = re.compile(r"<r[tp]\b[^<>]*>[^<>]*</r[tp]>|<(?:/|[a-zA-Z]|\d+:)[^<>]*>|\{\\[^{}]*\}")
_LIT = re.compile(r"<(u|b|i|font)\b[^<>]*>([^<>]+)</\1>")
_FIRST_MARK, MARKS_MAX = 0xE000, 6400
"""Letters of private use stand for the times in a caption while its text is cleaned."""
_MARKS = re.compile(r"[\ue000-\uf8ff]")
_ASS_HEAD = re.compile(r"\s*\[(?:script info|v4\+? styles|events)\]", re.IGNORECASE)
_ASS_EVENT = re.compile(r"^Dialogue:.*\d:\d\d:\d\d\.\d", re.MULTILINE)
_STYLED = re.compile(r"\\(?:1?c|r|[biu]\d|fs|fsc[xy]|1?a|alpha|bord|shad)(?![a-z])")
_LRC = re.compile(rf"^(?:[ \t]*\[{CLOCK}\])+", re.MULTILINE)
_LRC_HEAD = re.compile(rf"\s*(?:\[[a-z#]{{1,10}}:[^\]\n]*\]\s*)*\[{CLOCK}\]", re.IGNORECASE)
_LRC_OFFSET = re.compile(r"^\[offset:[ \t]*([+-]?\d{1,7})\]", re.MULTILINE | re.IGNORECASE)


@dataclass(frozen=True)
class _Caption:
    """What stands in a file: start in s, end in s, and lines, with letters for the times in them.

    A letter `chr(_FIRST_MARK + i)` stands for `marks[i]`, in s.
    """

    start: float
    end: float
    lines: tuple[str, ...]
    marks: tuple[float, ...]

    def shown(self) -> list[str]:
        """Its lines without times."""
        return [" ".join(_MARKS.sub("", line).split()) for line in self.lines]


def is_captions(text: str) -> bool:
    """Whether a text is one of subtitles: it has lines that begin with their times."""
    head = _plain_lines(text[:HEAD_MAX])
    return bool(_TIMES.search(head) or _LRC_HEAD.match(head)) or _is_ass(text)


def captions_of(text: str) -> list[Label]:
    """The captions of subtitles (SubRip, WebVTT, SubStation Alpha) or lyrics (LRC).

    They are start in s, end in s and what is said, without tags, speakers and stage directions, and
    without what captions that roll up repeat of the one before. Raises InputError for times that go
    back, and too many captions.
    """
    return [(each.start, each.end, _MARKS.sub("", said)) for each, said in _said(text)[0]]


def words_of_captions(text: str) -> Labels:
    """The words of subtitles, as `captions_of` has these, in order, and notes of what was left out.

    Where captions have no times for words, it is that of the caption: a word is said somewhere
    there.
    """
    from elocute.speech.text.text_words import words_of_text

    captions, notes = _said(text)
    labels = Labels(notes=notes)
    for caption, said in captions:
        plain, marks = "", [(0, caption.start)]
        for part in re.split(f"({_MARKS.pattern})", said):
            if _MARKS.fullmatch(part):
                marks += [(len(plain), caption.marks[ord(part) - _FIRST_MARK])]
            else:
                plain += part
        for word in words_of_text(plain):
            if not word.is_sign:
                start = next(at for place, at in reversed(marks) if place <= word.start)
                later = (at for place, at in marks if place >= word.end)
                labels.words.append((start, next(later, caption.end), word.text))
    return labels


def said_text(text: str) -> tuple[str, list[str]]:
    """What is said of subtitles, a script, SSML or a plain text, and notes of what was left out."""
    if is_captions(text):
        captions, notes = _said(text)
        return "\n".join(_MARKS.sub("", said) for _, said in captions), notes
    said, left_out = spoken_script(text)
    return said, left_out_note(left_out)


def _said(text: str) -> tuple[list[tuple[_Caption, str]], list[str]]:
    """The captions of a text that say something, what they say, times in it as letters, and notes
    of what was left out."""
    captions = [*_without_repeats(_captions(_plain_lines(text)))]
    names = speakers_of("\n".join(line for caption in captions for line in caption.shown()))
    spoken, left_out = list[tuple[_Caption, str]](), list[str]()
    for caption in captions:
        said, aside = spoken_lines("\n".join(caption.lines), names)
        left_out += (_MARKS.sub("", each) for each in aside)
        if _MARKS.sub("", said).strip():
            spoken.append((caption, said))
    return spoken, left_out_note(left_out)


def _captions(text: str) -> list[_Caption]:
    """The captions of a text as they stand there. Raises InputError."""
    parse = _ass if _is_ass(text) else _timed if _TIMES.search(text) else _lyrics
    captions = []
    for number, (start, end, body) in enumerate(_lit_up(parse(text)), 1):
        if number > LABELS_MAX:
            raise InputError(f"more than {LABELS_MAX} captions; allowed: up to {LABELS_MAX}")
        if end < start:
            found_at = f"{start:g} to {end:g} s"
            raise InputError.about(f"caption {number}", found=found_at, allowed="start <= end")
        captions.append(_caption(start, end, body))
    # Of layers that show the same, one.
    return sorted(dict.fromkeys(captions), key=lambda each: each.start)


def _caption(start: float, end: float, body: str) -> _Caption:
    """A caption without tags. Times in it that go back, or out of it, are brought within."""
    said, marks = "", [start]
    for number, part in enumerate(_MARK.split(body)):
        if number % 2 == 0:
            plain = html.unescape(_TAGS.sub("", part)).replace("\\h", " ")
            said += _MARKS.sub("", re.sub(r"\\[Nn]", "\n", plain))
        elif len(marks) <= MARKS_MAX:
            said += chr(_FIRST_MARK + len(marks) - 1)
            marks.append(min(max(clock_seconds(part) or 0.0, marks[-1]), end))
    lines = tuple(line for line in said.split("\n") if line.strip())
    return _Caption(start, end, lines, tuple(marks[1:]))


def _without_repeats(captions: list[_Caption]) -> Iterator[_Caption]:
    """Captions without the lines of the one before that they still show, where they roll up."""
    shown = [each.shown() for each in captions]
    rolling = sum(len(after) > 1 and before[-1:] == after[:1] for before, after in pairwise(shown))
    if not any(each.marks for each in captions) and rolling <= ROLLING_SHARE * len(captions):
        yield from captions
        return
    before: list[str] = []
    for caption, lines in zip(captions, shown, strict=True):
        # A line with times of its own is said, whatever was said before.
        still = next((n for n, line in enumerate(caption.lines) if _MARKS.search(line)), len(lines))
        most = min(still, len(before))
        same = next((n for n in range(most, 0, -1) if before[-n:] == lines[:n]), 0)
        before = lines or before
        yield _Caption(caption.start, caption.end, caption.lines[same:], caption.marks)


def _lit_up(cues: Iterable[Label]) -> Iterator[Label]:
    """Captions that come again for each word, which is lit up while it is said, as one each."""
    for text, again in groupby(cues, key=lambda cue: _TAGS.sub("", cue[2]).strip("\n")):
        group = list(again)
        times: dict[int, list[float]] = {}
        for start, end, body in group:
            lit = list(_LIT.finditer(body.strip("\n")))
            if len(lit) == 1:
                place = len(_TAGS.sub("", body.strip("\n")[: lit[0].start()]))
                times.setdefault(place, []).append(start)
                times.setdefault(place + len(_TAGS.sub("", lit[0][2])), []).insert(0, end)
        if len(times) <= 2:  # none, or always the same
            yield from group
            continue
        for place in sorted(times, reverse=True):
            text = text[:place] + "".join(map(_tag, times[place])) + text[place:]
        yield group[0][0], group[-1][1], text


def _timed(text: str) -> Iterator[Label]:
    """SubRip, WebVTT and .sbv: a line of two times, and the lines of the caption."""
    marks = list(_TIMES.finditer(text))
    has_notes = text.lstrip().startswith("WEBVTT")
    for mark, after in zip(marks, [*marks[1:], None], strict=True):
        start, end = (clock_seconds(mark[group]) or 0.0 for group in (1, 3))
        body = text[mark.end() : after.start() if after else None].partition("\n")[2]
        yield start, end, _own(body, is_last=after is None, has_notes=has_notes)


def _own(body: str, is_last: bool, has_notes: bool) -> str:
    """The lines of a caption, without the number or name of the next one and without notes."""
    first, *parts = re.split(r"(?:\A|\n)[ \t]*\n", f"{body}\n")
    parts = [part for part in parts if part.strip() and not (has_notes and _NOTES.match(part))]
    parts = [first, *parts] if first.strip() else parts
    if parts and not is_last:
        *lines, last = parts[-1].strip("\n").split("\n")
        if last.strip().isdigit() or (not lines and len(parts) > 1):
            parts[-1] = "\n".join(lines)
    return "\n".join(parts)


def _is_ass(text: str) -> bool:
    return _ASS_HEAD.match(text) is not None or _ASS_EVENT.search(text[:HEAD_MAX]) is not None


def _ass(text: str) -> Iterator[Label]:
    """SubStation Alpha: events in columns, the last of them the text; karaoke has its times."""
    names = ["layer", "start", "end", *["style"] * 6, "text"]
    for line in text.split("\n"):
        kind, _, rest = line.partition(":")
        fields = [field.strip() for field in rest.split(",", len(names) - 1)]
        if kind.strip().lower() == "format" and "start" in rest.lower():
            names = [field.strip().lower() for field in rest.split(",")]
        elif kind.strip().lower() == "dialogue":
            row = dict(zip(names, fields, strict=False))
            start, end = (clock_seconds(row.get(name, "")) for name in ("start", "end"))
            if start is None or end is None or len(fields) != len(names):
                allowed = ",".join(names)[:80]
                raise InputError.about("event", found=repr(line[:60]), allowed=allowed)
            yield start, end, _ass_text(fields[-1], start)


def _ass_text(text: str, start: float) -> str:
    """A text with its syllables' times as WebVTT has them, without tags and drawings."""
    plain, at, is_drawing, is_lit = "", start, False, False
    for number, part in enumerate(re.split(r"\{([^{}]*)\}", text)):
        if number % 2 == 0:
            plain += "" if is_drawing else part
            continue
        *before, last = [0, *map(int, re.findall(r"\\[kK][of]?(\d{1,6})", part))]
        plain += _tag(at + sum(before) / 100) if before else ""
        at += (sum(before) + last) / 100
        if _STYLED.search(part):  # and the next one ends it
            plain += "</u>" if is_lit else "<u>"
            is_lit = not is_lit
        for size in re.findall(r"\\p(\d)", part):
            is_drawing = size != "0"
    return plain + "</u>" * is_lit


def _lyrics(text: str) -> Iterator[Label]:
    """LRC: lines that begin with the times at which they are sung, each until the next one."""
    offset_ms = _LRC_OFFSET.search(text)
    sooner = int(offset_ms[1]) / 1000 if offset_ms else 0.0

    def moved(time: str) -> float:
        return max(round((clock_seconds(time) or 0.0) - sooner, 3), 0.0)

    marks = list(_LRC.finditer(text))
    stops = [*(mark.start() for mark in marks[1:]), len(text)][: len(marks)]
    lines = [
        (moved(time), _MARK.sub(lambda at: _tag(moved(at[1])), text[mark.end() : stop]))
        for mark, stop in zip(marks, stops, strict=True)
        for time in re.findall(CLOCK, mark[0])
    ]
    lines.sort(key=lambda each: each[0])
    starts = [start for start, _ in lines]
    ends = [*starts[1:], *(start + OPEN_S * len(line.split()) for start, line in lines[-1:])]
    yield from ((start, end, line) for (start, line), end in zip(lines, ends, strict=True))


def _tag(seconds: float) -> str:
    return f"<{int(seconds // 3600)}:{int(seconds // 60 % 60):02}:{seconds % 60:06.3f}>"


def _plain_lines(text: str) -> str:
    """A text with plain ends of lines and plain times. Raises InputError for times in frames."""
    plain = text.replace("\r\n", "\n").replace("\r", "\n")
    return _LOOSE.sub(lambda times: " --> ".join(map(_plain_time, times.groups())), plain)


def _plain_time(time: str) -> str:
    plain = "".join(time.split())
    if re.fullmatch(r"-?\d+:\d+:\d+:\d\d?", plain):
        allowed, remedy = (
            "hours, minutes and seconds",
            "save them as .srt or .vtt with milliseconds",
        )
        raise InputError.about(f"time {plain}", found="frames", allowed=allowed, remedy=remedy)
    if plain.startswith("-"):
        return "0:00:00"
    return re.sub(r":(\d)(?=[.,]|$)", r":0\1", re.sub(r":(\d{3})$", r".\1", plain))
