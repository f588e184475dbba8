"""Writes mouth cues and captions: Rhubarb's .tsv, .xml and .json, Moho's .dat, .srt and .vtt."""

from __future__ import annotations

import json
import re
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

from elocute.errors import InputError, OutputError, printable
from elocute.files.atomic import write_atomically
from elocute.speech.cues.mouth_cues import BLAIR, MouthCue
from elocute.speech.times.labels import Label

DAT_FPS = 24.0
LINE_LETTERS, LINES = 42, 2
CAPTION_S, PAUSE_S, SENTENCE_PAUSE_S = 6.0, 0.6, 0.2
"""A caption ends before it is longer, and at a pause; at a shorter one after a sentence."""
SENTENCE_ENDS = (".", "!", "?", "…", "。", "！", "？")

JOINERS = ("\u200c", "\u200d")
"""Persian and Hindi write them within words."""
UNSPACED = re.compile(
    "[\u0e00-\u0eff\u1000-\u109f\u1780-\u17ff\u2e80-\u30ff\u31f0-\u31ff\u3400-\u4dbf\u4e00-\u9fff"
    "\uf900-\ufaff\uff00-\uffef\U00020000-\U0003ffff]"
)
"""Thai, Lao, Burmese, Khmer, Chinese, Japanese: what is written without spaces."""
MARKS = re.compile(r"[^\w\s]*(?:\s+[!?;:…»”.]+(?=\s|$))?")
"""Behind a word; French has a space before some."""


@dataclass(frozen=True)
class CueSheet:
    """What `write_cues` writes: one cue or more without gaps, and what is known of the words.

    `words` are start in s, end in s and word; `text` is the text that they are the words of, for
    the captions' punctuation; `sound` is the name of the sound's file, told in .json and .xml;
    `fps` are the frames per second of .dat.
    """

    cues: Sequence[MouthCue]
    words: Sequence[Label] = ()
    text: str = ""
    sound: str = ""
    fps: float = DAT_FPS

    @property
    def duration_s(self) -> float:
        return self.cues[-1].end_s


def write_cues(sheet: CueSheet, path: str | Path) -> None:
    """Write cues, or captions of words, as the suffix says.

    .tsv, .xml and .json are as Rhubarb Lip Sync writes them; .dat is for Moho, OpenToonz and other
    readers of Papagayo's names, with frames counted from 1; .srt and .vtt are captions of the
    words.

    Raises
    ------
    OutputError
        For another suffix, and a place that cannot be written.
    InputError
        For captions where no words are known.
    """
    path = Path(path)
    write = WRITERS.get(path.suffix.lower())
    if write is None:
        allowed = " ".join(WRITERS)
        raise OutputError.about(path, found=f"suffix {path.suffix!r}", allowed=allowed)
    text = write(sheet)
    with write_atomically(path) as draft:
        draft.write_text(text, encoding="utf-8", newline="\n")


def _tsv(sheet: CueSheet) -> str:
    """Start and shape; the last line is the end."""
    lines = [f"{cue.start_s:.2f}\t{cue.shape}\n" for cue in sheet.cues]
    return "".join([*lines, f"{sheet.duration_s:.2f}\t{sheet.cues[-1].shape}\n"])


def _xml(sheet: CueSheet) -> str:
    cues = "".join(
        f'    <mouthCue start="{cue.start_s:.2f}" end="{cue.end_s:.2f}">{cue.shape}</mouthCue>\n'
        for cue in sheet.cues
    )
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n<rhubarbResult>\n  <metadata>\n'
        f"    <soundFile>{escape(printable(sheet.sound))}</soundFile>\n"
        f"    <duration>{sheet.duration_s:.2f}</duration>\n  </metadata>\n"
        f"  <mouthCues>\n{cues}  </mouthCues>\n</rhubarbResult>\n"
    )


def _json(sheet: CueSheet) -> str:
    record = {
        "metadata": {"soundFile": printable(sheet.sound), "duration": sheet.duration_s},
        "mouthCues": [
            {"start": cue.start_s, "end": cue.end_s, "value": cue.shape} for cue in sheet.cues
        ],
    }
    return json.dumps(record, indent=2, ensure_ascii=False) + "\n"


def _dat(sheet: CueSheet) -> str:
    """A line for each change, at the frame that is shown then; the first frame is 1."""
    named: dict[int, str] = {}
    for cue in sheet.cues:
        named[1 + round(cue.start_s * sheet.fps)] = BLAIR[cue.shape]
    lines, before = [], ""
    for frame, name in sorted(named.items()):
        if name != before:
            lines.append(f"{frame} {name}\n")
        before = name
    return "".join(["MohoSwitch1\n", *lines])


def _srt(sheet: CueSheet) -> str:
    return "\n".join(
        f"{number}\n{_clock(start, ',')} --> {_clock(end, ',')}\n{text}\n"
        for number, (start, end, text) in enumerate(_captions(sheet), 1)
    )


def _vtt(sheet: CueSheet) -> str:
    cues = "\n".join(
        f"{_clock(start, '.')} --> {_clock(end, '.')}\n{escape(text)}\n"
        for start, end, text in _captions(sheet)
    )
    return f"WEBVTT\n\n{cues}"


def _captions(sheet: CueSheet) -> list[Label]:
    """Words as lines of captions."""
    if not sheet.words:
        raise InputError.about(
            "captions", found="no words", allowed="a speech whose `text` is known"
        )
    lines: list[Label] = []
    for (start, end, word), space in _written(sheet.words, sheet.text):
        word = " ".join(caption_text(word).split()).replace("-->", "→")
        if lines and not _ends(lines[-1], start, end, word):
            begun, _, text = lines.pop()
            start, word = begun, f"{text}{space}{word}"
        lines.append((start, end, word))
    return [(start, end, _in_lines(text)) for start, end, text in lines]


def caption_text(word: str) -> str:
    """A word as a caption shows it: without soft hyphens and controls, joiners kept."""
    parts = re.split("([\u200c\u200d])", word.replace("\u00ad", ""))
    return "".join(part if part in JOINERS else printable(part) for part in parts)


def space_between(before: str, after: str) -> str:
    """What stands between two words of captions whose text is not known: a space or nothing."""
    first, last = before[-1:], after[:1]
    if not first or not last:
        return ""
    both = UNSPACED.fullmatch(first) and UNSPACED.fullmatch(last)
    is_wide_mark = UNSPACED.fullmatch(first) and unicodedata.category(first).startswith("P")
    return "" if both or is_wide_mark else " "


def _in_lines(text: str) -> str:
    """A long caption as two lines of about the same length."""
    if _width(text) <= LINE_LETTERS:
        return text
    gaps = [place for place, letter in enumerate(text) if letter == " "]
    middle = min(gaps, key=lambda place: abs(2 * place - len(text)), default=None)
    if middle is not None:
        return f"{text[:middle]}\n{text[middle + 1 :]}"
    middle = next((at for at in range(len(text) // 2, len(text)) if text[at].isalnum()), len(text))
    return f"{text[:middle]}\n{text[middle:]}".strip() if _width(text) > len(text) else text


def _width(text: str) -> int:
    """How many Latin letters are as wide: a letter of Chinese is two."""
    return sum(2 if unicodedata.east_asian_width(letter) in "WF" else 1 for letter in text)


def _ends(line: Label, start: float, end: float, word: str) -> bool:
    """Whether a caption ends before a word."""
    begun, until, text = line
    if _width(text) + 1 + _width(word) > LINES * LINE_LETTERS or end - begun > CAPTION_S:
        return True
    pause = SENTENCE_PAUSE_S if text.rstrip("\"'”’»)").endswith(SENTENCE_ENDS) else PAUSE_S
    return start - until >= pause


def as_written(words: Sequence[Label], text: str) -> list[Label]:
    """Words with the marks that stand round them in their text; as they are where it lacks them."""
    return [label for label, _ in _written(words, text)]


def _written(words: Sequence[Label], text: str) -> list[tuple[Label, str]]:
    """Words as `as_written` has them, each with what stands before it: a space or nothing."""
    placed, at, before = [], 0, ""
    for start, end, word in words:
        space = space_between(before, word)
        if at:
            space = " " if text[at : at + 1].isspace() else ""
        before = word
        place = text.find(word, at)
        if place >= 0 and not any(map(str.isalnum, text[at:place])):
            marks = MARKS.match(text, place + len(word))
            stop = marks.end() if marks else place + len(word)
            word, at = text[at:stop].strip(), stop
        placed.append(((start, end, word), space))
    rest = " ".join(text[at:].split())
    if at and rest and not any(map(str.isalnum, rest)):
        (start, end, word), space = placed.pop()
        placed.append(((start, end, f"{word} {rest}"), space))
    return placed


def _clock(seconds: float, point: str) -> str:
    milliseconds = round(seconds * 1000)
    whole, rest = divmod(milliseconds, 1000)
    return f"{whole // 3600:02d}:{whole // 60 % 60:02d}:{whole % 60:02d}{point}{rest:03d}"


WRITERS: dict[str, Callable[[CueSheet], str]] = {
    ".tsv": _tsv,
    ".xml": _xml,
    ".json": _json,
    ".dat": _dat,
    ".srt": _srt,
    ".vtt": _vtt,
}
