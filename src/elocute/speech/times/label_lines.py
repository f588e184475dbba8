"""Reads times of phones and mouth pictures from lines of text, and from XML.

MBROLA (.pho), labels of Audacity, HTK (HTS), TIMIT and ESPS, lines of two times and a text,
Rhubarb's .tsv, Moho's .dat, Papagayo's .pgo.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator
from dataclasses import replace

from elocute.errors import InputError
from elocute.speech.phone_symbols import alphabet_of, phone_of
from elocute.speech.times.elan import ROOT as ELAN_ROOT, parse_eaf
from elocute.speech.times.labels import (
    CLOCK,
    LABELS_MAX,
    Label,
    Labels,
    clock_seconds,
    seconds_of,
    until_next,
)
from elocute.speech.times.tier_choice import TierChoice

MOHO_FPS = 24.0
HTK_S, TIMIT_S, GRID_S = 1e-7, 1 / 16_000, 1 / 25_000
HTK_STEP, GRID_STEP = 1000, 250
"""HTK's times are whole tenths of a millisecond, in units of 100 ns; those of the GRID corpus whole
hundredths of a second, thousandths of its 75 frames at 25 a second."""
GRID_ENDS = range(60_000, 75_001)
LRS_HEAD = "WORD START END ASDSCORE"
STRANGE_SHARE = 0.2
"""Of labels that are no phones, beyond which all are taken for words."""
_NUMBER = r"\d{1,15}(?:\.\d{0,20})?"
# Of lines in which single spaces part the fields.
_MBROLA = re.compile(rf"(\S+) ({_NUMBER})(?: \(?{_NUMBER}(?: ?, ?| ){_NUMBER}\)?)*")
_LABEL = re.compile(rf"({_NUMBER}) ({_NUMBER}) (\S.*)")
_LRS = re.compile(rf"(\S+) ({_NUMBER}) ({_NUMBER}) -?{_NUMBER}")
_ESPS = re.compile(rf"({_NUMBER}) \d{{1,4}}(?: ([^;]*)(?:;.*)?)?")
_FULL_CONTEXT = re.compile(r"[^\s^]+\^[^\s-]+-([^\s+]+)\+\S+=\S+")
"""HTS's, and Merlin's: the phone stands between - and +."""
_CUE = re.compile(rf"({_NUMBER}) ([A-HX])")
_FRAME = re.compile(r"(\d{1,9}) (AI|E|O|U|WQ|L|MBP|FV|etc|rest)")
PAPAGAYO, FPS_MAX = "lipsync version 1", 1000.0
_TIME = rf"({CLOCK}|\d{{1,15}}(?:[.,]\d{{1,20}})?)"
_MICRODVD = re.compile(r"\s*\{\d+\}\{\d+\}")
_POINTED = _TIME.replace("[.,]", "[.]")
_ROW = re.compile(
    rf"[\[(]?{_TIME}(?: ?(?:-->|->|[-–;|]) ?| ){_TIME}(?: ?[\]);:|] ?| )(.*)"
    rf"|{_POINTED} ?, ?{_POINTED} ?, ?(.*)"
)


def parse_lines(text: str) -> Labels | None:
    """Labels of lines of one of these formats; None for any other text. Raises InputError."""
    if _MICRODVD.match(text):
        allowed, remedy = "times in seconds", "save them as .srt or .vtt"
        raise InputError.about("subtitles", found="frames alone", allowed=allowed, remedy=remedy)
    lines = [" ".join(line.split()) for line in text.splitlines()]
    if lines and lines[0] == PAPAGAYO:
        return _papagayo(lines[1:])
    # Audacity has frequencies in lines of their own, behind a backslash.
    lines = [_in_seconds(line) for line in lines if line and line[0] not in ";\\"]
    if len(lines) > LABELS_MAX:
        raise InputError(f"{len(lines)} lines; allowed: up to {LABELS_MAX}")
    if lines and lines[0].startswith("MohoSwitch"):
        return _moho(_matched(_FRAME, lines[1:]))
    if LRS_HEAD in lines:  # of LRS2 and LRS3, below what is said
        rows = _matched(_LRS, lines[lines.index(LRS_HEAD) + 1 :])
        return Labels(words=[(float(row[2]), float(row[3]), row[1]) for row in rows])
    if "#" in lines and (rows := _matched(_ESPS, lines[lines.index("#") + 1 :])):
        return _ends(rows)
    for pattern, parse in _PARSERS.items():
        rows = _matched(pattern, lines)
        if rows:
            return parse(rows)
    return None


def parse_xml(text: str, choice: TierChoice) -> Labels:
    """Labels of Rhubarb's XML, or of a tier of ELAN's. Raises InputError for any other XML."""
    allowed = "mouth cues in Rhubarb's XML, or annotations of ELAN (.eaf)"
    if "<!" in text:  # a document type can name other files, and entities that grow
        raise InputError.about("XML", found="declarations", allowed=allowed)
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise InputError.about("XML", found=str(error), allowed=allowed) from None
    if root.tag == ELAN_ROOT:
        return parse_eaf(root, choice, phones_or_words)
    choice.check_unused()
    cues = [cue for cue in root.iter() if cue.tag.lower() == "mouthcue"]
    if not cues:
        remedy = "save subtitles as .srt or .vtt"
        raise InputError.about("XML", found=f"<{root.tag}>", allowed=allowed, remedy=remedy)
    return Labels(
        phones=[(_time(c.get("start")), _time(c.get("end")), (c.text or "").strip()) for c in cues],
        alphabet="rhubarb",
    )


def _time(value: str | None) -> float:
    if re.fullmatch(_NUMBER, value or "") is None:
        raise InputError.about("time of a mouth cue", found=repr(value)[:40], allowed="seconds")
    return seconds_of(float(value or 0), "time of a mouth cue")


def _matched(pattern: re.Pattern[str], lines: list[str]) -> list[re.Match[str]]:
    """What a pattern finds in the lines; nothing where one of them has another form."""
    matches = [pattern.fullmatch(line) for line in lines]
    return [match for match in matches if match] if all(matches) else []


def _in_seconds(line: str) -> str:
    """A line of two times and a text, however they are written, as one of seconds with points."""
    row = _ROW.fullmatch(line)
    if row is None:
        return line
    *times, text = (part for part in row.groups() if part is not None)
    seconds = (clock_seconds(time) for time in times)
    plain = [
        time.replace(",", ".") if at is None else f"{at:.6f}"
        for time, at in zip(times, seconds, strict=True)
    ]
    return " ".join([*plain, text])


def _mbrola(rows: list[re.Match[str]]) -> Labels:
    """MBROLA: a phone and its duration in ms on each line; pairs of pitch follow."""
    at, phones = 0.0, list[Label]()
    for row in rows:
        end = at + float(row[2]) / 1000
        phones.append((at, end, row[1]))
        at = end
    return Labels(phones=phones)


def _ends(rows: list[re.Match[str]]) -> Labels:
    """ESPS, as Festival and Buckeye have it: the end of each label, a colour, the label."""
    ends = [float(row[1]) for row in rows]
    texts = [(row[2] or "").strip() for row in rows]
    return phones_or_words(list(zip([0.0, *ends], ends, texts, strict=False)))


def phones_or_words(labels: list[Label]) -> Labels:
    """Labels of which nobody says whether they are phones or words."""
    _, strange = alphabet_of(text for _, _, text in labels)
    is_words = len(strange) > STRANGE_SHARE * len({text for _, _, text in labels})
    return Labels(words=labels) if is_words else Labels(phones=labels)


def _labels(rows: list[re.Match[str]]) -> Labels:
    """Start, end and label: s as Audacity has them, 100 ns as HTK, samples at 16 kHz as TIMIT."""
    times = [row[group] for row in rows for group in (1, 2)]
    unit, note = 1.0, ""
    if not any("." in time for time in times) and max(map(float, times)) > 1000:
        whole = [int(time) for time in times]
        unit, name = TIMIT_S, "samples at 16 kHz"
        if all(time % GRID_STEP == 0 for time in whole) and max(whole) in GRID_ENDS:
            unit, name = GRID_S, "thousandths of a frame at 25 a second, as GRID has them"
        elif all(time % HTK_STEP == 0 for time in whole):
            unit, name = HTK_S, "units of 100 ns"
        note = f"times were taken for {name}"
    labels = [
        (float(row[1]) * unit, float(row[2]) * unit, row[3].split(" ")[0] if unit != 1 else row[3])
        for row in rows
    ]
    centres = [_FULL_CONTEXT.fullmatch(text) for _, _, text in labels]
    if all(centres):
        labels = [
            (start, end, centre[1])
            for (start, end, _), centre in zip(labels, centres, strict=True)
            if centre
        ]
    return replace(phones_or_words(labels), notes=[note] if note else [])


def _rhubarb(rows: list[re.Match[str]]) -> Labels:
    """Rhubarb: the start of each cue, and one that says where the last one ends."""
    return Labels(
        phones=until_next((float(row[1]), row[2]) for row in rows)[:-1], alphabet="rhubarb"
    )


def _moho(rows: list[re.Match[str]]) -> Labels:
    """Moho, Papagayo: the frame at which each picture begins, from 1."""
    events = [((int(row[1]) - 1) / MOHO_FPS, row[2]) for row in rows if int(row[1]) > 0]
    note = f"frames were counted {MOHO_FPS:g} a second"
    return Labels(phones=until_next(events), alphabet="blair", notes=[note])


def _papagayo(lines: list[str]) -> Labels:
    """Papagayo's project: a sound, frames a second, frames, and voices, of which one is taken."""
    try:
        _, rate, _, voices, *rest = lines
        rows, fps = iter(rest), float(rate)
        voice_labels = [_voice(rows, fps) for _ in range(int(voices))]
    except (StopIteration, ValueError, ZeroDivisionError, OverflowError):
        allowed = "voices of phrases of words"
        raise InputError.about("Papagayo's project", found="others", allowed=allowed) from None
    spoken = [each for each in voice_labels if each.words] or [Labels()]
    if len(spoken) > 1:
        spoken[0].notes.append("of several voices the first is taken")
    return spoken[0]


def _voice(rows: Iterator[str], fps: float) -> Labels:
    """Words and their pictures, each at its frame from 0; a word lasts to the end of its last one.

    Raises StopIteration and ValueError for another form.
    """
    words, phones = list[Label](), list[Label]()
    _ = next(rows), next(rows)  # a name and all of the text
    for _ in range(int(next(rows))):
        _ = next(rows), next(rows), next(rows)  # the text of a phrase, and its frames
        for _ in range(int(next(rows))):
            word, first, last, count = next(rows).rsplit(" ", 3)
            end = (int(last) + 1) / fps
            words.append((int(first) / fps, end, word))
            pictures = [next(rows).split(" ", 1) for _ in range(int(count))]
            starts = [int(frame) / fps for frame, _ in pictures]
            names = [name for _, name in pictures]
            phones += zip(starts, [*starts[1:], end], names, strict=True)
    is_chart = all(phone_of(name, "blair") for _, _, name in phones)
    return Labels(phones, words, "blair" if is_chart else "")


_PARSERS: dict[re.Pattern[str], Callable[[list[re.Match[str]]], Labels]] = {
    _CUE: _rhubarb,
    _FRAME: _moho,
    _MBROLA: _mbrola,
    _LABEL: _labels,
}
