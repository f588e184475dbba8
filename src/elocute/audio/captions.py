"""Subtitles as texts with times: SubRip (.srt) and WebVTT (.vtt)."""

from __future__ import annotations

import html
import re

from elocute.audio.script_text import left_out_note, spoken_script
from elocute.audio.timed_labels import LABELS_MAX, Label
from elocute.errors import InputError

_CLOCK = r"(?:(\d{1,3}):)?(\d{1,2}):(\d{2})[,.](\d{1,3})"
_TIMES = re.compile(rf"^\s*{_CLOCK}\s*-->\s*{_CLOCK}", re.MULTILINE)
_TAGS = re.compile(r"<[^<>]*>|\{\\[^{}]*\}")


def is_captions(text: str) -> bool:
    """Whether a text is one of subtitles: it has lines of two times and an arrow."""
    return _TIMES.search(text[:20_000]) is not None


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
    for block in re.split(r"\n\s*\n", text.replace("\r\n", "\n")):
        match = _TIMES.search(block)
        if match is None:
            continue
        start, end = _seconds(*match.groups()[:4]), _seconds(*match.groups()[4:])
        if end < start or len(found) >= LABELS_MAX:
            raise InputError.about(
                f"caption {len(found) + 1}",
                found=f"{start:g} to {end:g} s",
                allowed=f"start <= end, in {LABELS_MAX} captions at most",
            )
        lines = block[match.end() :].partition("\n")[2]
        said, _ = spoken_script(html.unescape(_TAGS.sub("", lines)))
        if said:
            found.append((start, end, said))
    return found


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
