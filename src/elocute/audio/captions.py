"""Subtitles as texts with times: SubRip (.srt), WebVTT (.vtt) and YouTube's .sbv."""

from __future__ import annotations

import html
import re

from elocute.audio.script_text import left_out_note, spoken_script
from elocute.audio.timed_labels import LABELS_MAX, Label
from elocute.errors import InputError

HEAD_MAX = 20_000
_CLOCK = r"(?:(\d{1,3}):)?(\d{1,2}):(\d{2})[,.](\d{1,3})"
_TIMES = re.compile(rf"^[ \t]*{_CLOCK}[ \t]*(?:-->|,)[ \t]*{_CLOCK}", re.MULTILINE)
_NOTES = re.compile(r"(NOTE|STYLE|REGION)\b")
_TAGS = re.compile(r"<[^<>]*>|\{\\[^{}]*\}")


def is_captions(text: str) -> bool:
    """Whether a text is one of subtitles: it has lines of two times."""
    return _TIMES.search(text[:HEAD_MAX]) is not None


def captions_of(text: str) -> list[Label]:
    """The captions of a text of subtitles, without tags, speakers and stage directions.

    Parameters
    ----------
    text : str
        SubRip or WebVTT.

    Returns
    -------
    list of (float, float, str)
        Start in s, end in s and what is said.

    Raises
    ------
    InputError
        For times that go back, and too many captions.
    """
    found: list[Label] = []
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    marks = list(_TIMES.finditer(text))
    if len(marks) > LABELS_MAX:
        raise InputError(f"{len(marks)} captions; allowed: up to {LABELS_MAX}")
    for number, mark in enumerate(marks, 1):
        start, end = _seconds(*mark.groups()[:4]), _seconds(*mark.groups()[4:])
        if end < start:
            found_at = f"{start:g} to {end:g} s"
            raise InputError.about(f"caption {number}", found=found_at, allowed="start <= end")
        stop = marks[number].start() if number < len(marks) else None
        body = text[mark.end() : stop].partition("\n")[2]
        said, _ = spoken_script(html.unescape(_TAGS.sub("", _own(body, is_last=stop is None))))
        if said:
            found.append((start, end, said))
    return found


def _own(body: str, is_last: bool) -> str:
    """The lines of a caption, without the number or name of the next one and without notes."""
    parts = [part for part in re.split(r"\n[ \t]*\n", body) if part.strip()]
    if parts and not is_last:
        *lines, last = parts[-1].strip("\n").split("\n")
        if last.strip().isdigit() or (not lines and len(parts) > 1):
            parts[-1] = "\n".join(lines)
    return "\n".join(part for part in parts if not _NOTES.match(part.lstrip()))


def said_text(text: str) -> tuple[str, list[str]]:
    """What is said of a text as people have it, subtitles among them.

    Parameters
    ----------
    text : str
        Subtitles, a script, SSML, or a plain text.

    Returns
    -------
    said : str
        What is said.
    notes : list of str
        What was left out.
    """
    if is_captions(text):
        return "\n".join(said for _, _, said in captions_of(text)), []
    said, left_out = spoken_script(text)
    return said, left_out_note(left_out)


def words_of_captions(text: str) -> list[Label]:
    """The words of subtitles, each with the time of its whole caption: it is said somewhere there.

    Parameters
    ----------
    text : str
        SubRip or WebVTT.

    Returns
    -------
    list of (float, float, str)
        Start in s, end in s and word, in order.
    """
    from elocute.audio.text_words import words_of_text

    return [
        (start, end, word.text)
        for start, end, said in captions_of(text)
        for word in words_of_text(said)
        if not word.is_sign
    ]


def _seconds(hours: str | None, minutes: str, seconds: str, fraction: str) -> float:
    whole = int(hours or 0) * 3600 + int(minutes) * 60 + int(seconds)
    return whole + int(fraction) / 10 ** len(fraction)
