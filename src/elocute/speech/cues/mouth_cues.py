"""Makes mouth cues for drawn characters: which of nine mouth pictures is shown when.

The pictures are those of Rhubarb Lip Sync and of Preston Blair's chart, so that software that
reads either shows ours:

    A  lips pressed (p, b, m)          MBP     F  puckered (oo, w)           U
    B  slightly open, teeth together   etc     G  lower lip at the teeth     FV
    C  open (eh, ae)                   E       H  tongue raised, open (l)    L
    D  wide open (ah)                  AI      X  at rest                    rest
    E  slightly rounded (aw, er)       O
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from elocute.speech.times.labels import Label
from elocute.speech.times.write import TimedSpeech

SHAPES = tuple("ABCDEFGHX")
BLAIR = dict(zip(SHAPES, ("MBP", "etc", "E", "AI", "O", "U", "FV", "L", "rest"), strict=True))
"""Names of Preston Blair's chart."""
BASIC = {"G": "A", "H": "C", "X": "A"}
"""What stands for the three shapes that a character may lack."""
REST, SHUT = "X", "A"
_MEMBERS = {
    "A": "P B M",
    "B": "IY IH S Z T D N K G NG CH JH SH ZH TH DH Y HH R",
    "C": "EH AE AH EY",
    "D": "AA AY AW",
    "E": "AO ER UH OY",
    "F": "UW OW W",
    "G": "F V",
    "H": "L",
}
SHAPE_OF = {phone: shape for shape, phones in _MEMBERS.items() for phone in phones.split()}
HANDED_ON = {"AY": "B", "EY": "B", "OY": "B", "AW": "F", "OW": "F"}
"""What the second half of a diphthong shows."""
DIPHTHONG_S = 0.12
"""A shorter diphthong shows its first half alone."""
LEAST_S = 0.06
"""No picture but those of lips that touch is shown for less."""
CONTACT_S = 0.04
PAUSE_S = 0.2
"""Over a shorter pause the mouth before stays."""
CONTACTS = ("A", "G")


@dataclass(frozen=True)
class MouthCue:
    """One picture: start and end in s, and its letter, one of SHAPES."""

    start_s: float
    end_s: float
    shape: str


def mouth_cues(speech: TimedSpeech, *, basic: bool = False) -> list[MouthCue]:
    """The pictures of a speech, without gaps from 0 to its end, in hundredths of a second as
    Rhubarb has them; neighbours differ.

    With `basic`, A to F alone are used, for characters that lack G, H and X.
    """
    end = max(round(speech.duration_s, 2), 0.01)
    spans = _lasting(_joined(_over_pauses(_shown(speech.phones), end)))
    if basic:
        spans = _joined([(a, b, BASIC.get(shape, shape)) for a, b, shape in spans])
    return [MouthCue(*span) for span in _joined(_whole_hundredths(spans, end))]


def _shown(phones: Sequence[Label]) -> list[Label]:
    """A picture for each phone, two for a diphthong."""
    spans: list[Label] = []
    for start, end, phone in phones:
        shape = SHAPE_OF.get(phone, "B")
        if phone in HANDED_ON and end - start >= DIPHTHONG_S:
            middle = (start + end) / 2
            spans += [(start, middle, shape), (middle, end, HANDED_ON[phone])]
        else:
            spans.append((start, end, shape))
    return spans


def _over_pauses(spans: list[Label], end: float) -> list[Label]:
    """Rest in pauses, at the start and at the end; a short pause belongs to what is before it."""
    filled: list[Label] = []
    at = 0.0
    for start, stop, shape in spans:
        if start - at >= PAUSE_S or (start > at and not filled):
            filled.append((at, start, REST))
        elif start > at:
            before = filled.pop()
            filled.append((before[0], start, before[2]))
        filled.append((max(start, at), stop, shape))
        at = max(at, stop)
    if at < end:
        filled.append((at, end, REST))
    return filled


def _joined(spans: Sequence[Label]) -> list[Label]:
    """Neighbours of one shape as one."""
    joined: list[Label] = []
    for start, end, shape in spans:
        if joined and joined[-1][2] == shape:
            joined[-1] = (joined[-1][0], end, shape)
        elif end > start:
            joined.append((start, end, shape))
    return joined


def _lasting(spans: list[Label]) -> list[Label]:
    """Pictures that would flash give way to the longer of their neighbours; contacts never do."""
    kept = list(spans)
    while True:
        short = [
            (span[1] - span[0], place)
            for place, span in enumerate(kept)
            if span[1] - span[0] < LEAST_S and span[2] not in CONTACTS
        ]
        if not short or len(kept) == 1:
            return _contacts_seen(kept)
        place = min(short)[1]
        start, end, _ = kept.pop(place)
        before = kept[place - 1] if place else None
        after = kept[place] if place < len(kept) else None
        if after is None or (before and before[1] - before[0] >= after[1] - after[0]):
            assert before
            kept[place - 1] = (before[0], end, before[2])
        else:
            kept[place] = (start, after[1], after[2])
        kept = _joined(kept)


def _contacts_seen(spans: list[Label]) -> list[Label]:
    """A contact lasts CONTACT_S at least; it takes the time from what is before it."""
    widened: list[Label] = []
    for start, end, shape in spans:
        if shape in CONTACTS and end - start < CONTACT_S and widened:
            before = widened.pop()
            start = max(before[0], end - CONTACT_S)
            if start > before[0]:
                widened.append((before[0], start, before[2]))
        widened.append((start, end, shape))
    return widened


def _whole_hundredths(spans: list[Label], end: float) -> list[Label]:
    starts = [round(start, 2) for start, _, _ in spans]
    stops = [*starts[1:], end]
    return [
        (start, stop, shape)
        for start, stop, (_, _, shape) in zip(starts, stops, spans, strict=True)
        if stop > start
    ]
