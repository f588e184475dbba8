"""Times of phones and of pictures of mouths in lines of plain text, and in Rhubarb's XML.

MBROLA (.pho), labels of Audacity, HTK and TIMIT, Rhubarb's .tsv, Moho's and Papagayo's .dat.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable

from elocute.audio.phone_symbols import alphabet_of
from elocute.audio.timed_labels import LABELS_MAX, Label, Labels, seconds_of, until_next
from elocute.errors import InputError

MOHO_FPS = 24.0
HTK_S, TIMIT_S, GRID_S = 1e-7, 1 / 16_000, 1 / 25_000
HTK_STEP, GRID_STEP = 1000, 250
"""HTK's times are whole tenths of a millisecond, in units of 100 ns; those of the GRID corpus whole
hundredths of a second, thousandths of its 75 frames at 25 a second."""
GRID_ENDS = range(60_000, 75_001)
LRS_HEAD = "WORD START END ASDSCORE"
STRANGE_SHARE = 0.2
_NUMBER = r"\d{1,15}(?:\.\d{0,20})?"
# Of lines in which single spaces part the fields.
_MBROLA = re.compile(rf"(\S+) ({_NUMBER})(?: \(?{_NUMBER}(?: ?, ?| ){_NUMBER}\)?)*")
_LABEL = re.compile(rf"({_NUMBER}) ({_NUMBER}) (\S.*)")
_LRS = re.compile(rf"(\S+) ({_NUMBER}) ({_NUMBER}) -?{_NUMBER}")
_CUE = re.compile(rf"({_NUMBER}) ([A-HX])")
_FRAME = re.compile(r"(\d{1,9}) (AI|E|O|U|WQ|L|MBP|FV|etc|rest)")


def parse_lines(text: str) -> Labels | None:
    """Labels of lines of one of these formats; None for any other text. Raises InputError."""
    lines = [" ".join(line.split()) for line in text.splitlines()]
    lines = [line for line in lines if line and not line.startswith(";")]
    if len(lines) > LABELS_MAX:
        raise InputError(f"{len(lines)} lines; allowed: up to {LABELS_MAX}")
    if lines and lines[0].startswith("MohoSwitch"):
        return _moho(_matched(_FRAME, lines[1:]))
    if LRS_HEAD in lines:  # of LRS2 and LRS3, below what is said
        rows = _matched(_LRS, lines[lines.index(LRS_HEAD) + 1 :])
        return Labels(words=[(float(row[2]), float(row[3]), row[1]) for row in rows])
    for pattern, parse in _PARSERS.items():
        rows = _matched(pattern, lines)
        if rows:
            return parse(rows)
    return None


def parse_cue_xml(text: str) -> Labels:
    """Labels of Rhubarb's XML. Raises InputError for any other XML."""
    allowed = "mouth cues in Rhubarb's XML"
    if "<!" in text:  # a document type can name other files, and entities that grow
        raise InputError.about("XML", found="declarations", allowed=allowed)
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise InputError.about("XML", found=str(error), allowed=allowed) from None
    cues = [cue for cue in root.iter() if cue.tag.lower() == "mouthcue"]
    if not cues:
        raise InputError.about("XML", found=f"<{root.tag}>", allowed=allowed)
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
    found = [pattern.fullmatch(line) for line in lines]
    return [match for match in found if match] if all(found) else []


def _mbrola(rows: list[re.Match[str]]) -> Labels:
    """MBROLA: a phone and its duration in ms on each line; pairs of pitch follow."""
    at, found = 0.0, list[Label]()
    for row in rows:
        end = at + float(row[2]) / 1000
        found.append((at, end, row[1]))
        at = end
    return Labels(phones=found)


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
    _, strange = alphabet_of(text for _, _, text in labels)
    is_words = len(strange) > STRANGE_SHARE * len({text for _, _, text in labels})
    notes = [note] if note else []
    return Labels(words=labels, notes=notes) if is_words else Labels(phones=labels, notes=notes)


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


_PARSERS: dict[re.Pattern[str], Callable[[list[re.Match[str]]], Labels]] = {
    _CUE: _rhubarb,
    _FRAME: _moho,
    _MBROLA: _mbrola,
    _LABEL: _labels,
}
