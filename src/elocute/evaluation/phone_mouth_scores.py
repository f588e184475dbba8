"""Scores of a mouth against phones whose times are known, in any language.

Lips must be sealed on p, b and m, the lower lip at the upper teeth on f and v, rounded vowels
narrower and further forward than spread ones, and the mouth at rest in silence. Phones are IPA
symbols, or ARPAbet's where they are capitals.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.articulation.contacts_and_rest import REST_AFTER_S, SETTLE_S, WAKE_S, runs
from elocute.errors import HeadError
from elocute.evaluation.lip_closures import CLOSED_MM, TOLERANCE_S, short_runs
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.numerics.correlation import pearson
from elocute.speech.times.labels import Label

LABIODENTAL_MM = 2.0  # lower lip this near the edge of the upper incisors touches it
INCISORS_M = 0.007  # they lie no further than this from the middle of the face
EDGE_VERTICES = 12
WIDE_TOLERANCE_S = 2 * TOLERANCE_S  # a contact this far from any phone of its kind is false

BILABIAL = frozenset("pbmɓ")
LABIODENTAL = frozenset("fvɱ")
EITHER = frozenset("βɸʋⱱ")  # lips come near each other, or near the teeth, and need not touch
ROUNDED = frozenset("yʏøœuʉʊoɔɵ")
SPREAD = frozenset("iɪeɛ")
VOWELS = ROUNDED | SPREAD | frozenset("aæɑɒɐəɜɘɚɝʌɤɯɨᵻɶɞ")
ARPABET = {
    **dict.fromkeys(("P", "B", "M"), "bilabial"),
    **dict.fromkeys(("F", "V"), "labiodental"),
    **dict.fromkeys(("AO", "OW", "UW", "UH"), "rounded"),
    **dict.fromkeys(("IY", "IH", "EH", "EY"), "spread"),
    "SIL": "silence",
}


def mouth_class(symbol: str) -> str:
    """What a phone asks of a mouth.

    Parameters
    ----------
    symbol : str
        IPA, with any diacritics, or ARPAbet in capitals.

    Returns
    -------
    str
        "bilabial", "labiodental", "either" (contacts may be there or not, as on β and pf),
        "rounded", "spread", "silence" or "other". A diphthong is rounded or spread where all of
        its vowels are.
    """
    if symbol in ARPABET or (symbol.isascii() and symbol.isupper()):
        return ARPABET.get(symbol, "other")
    if symbol.startswith("(") or not symbol.strip("_:| "):
        return "silence"
    letters = [
        letter
        for letter in unicodedata.normalize("NFD", symbol)
        if unicodedata.category(letter) in ("Ll", "Lo")
    ]
    kinds = {_letter_class(letter) for letter in letters}
    if "vowel" in kinds or kinds & {"rounded", "spread"}:
        return next(iter(kinds)) if kinds in ({"rounded"}, {"spread"}) else "other"
    contacts = kinds - {"other"}
    if not contacts:
        return "other"
    return next(iter(contacts)) if len(contacts) == 1 else "either"


def _letter_class(letter: str) -> str:
    named = {
        "bilabial": BILABIAL,
        "labiodental": LABIODENTAL,
        "either": EITHER,
        "rounded": ROUNDED,
        "spread": SPREAD,
        "vowel": VOWELS,
    }
    return next((name for name, letters in named.items() if letter in letters), "other")


@dataclass(frozen=True)
class SpokenTake:
    """A predicted motion, the phones that were said, and what it is compared with.

    Parameters
    ----------
    motion : Motion
        On a head with lips, landmarks and teeth.
    phones : sequence of (float, float, str)
        Start in s, end in s and symbol of each phone, in order; what none covers is silence.
    reference : Motion, optional
        The same speech moved in another way, such as by the rules with exact phone times.
    """

    motion: Motion
    phones: Sequence[Label]
    reference: Motion | None = None


@dataclass(frozen=True)
class ContactCount:
    """Contacts that phones ask for, and contacts made.

    Attributes
    ----------
    wanted, met : int
        Stretches of such phones, and those during which, or `TOLERANCE_S` around, there is contact.
    made, right : int
        Short contacts made, and those near such a phone, or near one that allows them.
    """

    wanted: int
    met: int
    made: int
    right: int

    @property
    def recall(self) -> float:
        """Share of wanted contacts that are met; NaN without any."""
        return self.met / self.wanted if self.wanted else np.nan

    @property
    def precision(self) -> float:
        """Share of contacts made that are right; NaN without any."""
        return self.right / self.made if self.made else np.nan


@dataclass(frozen=True)
class PhoneMouthScore:
    """A mouth judged by phones.

    Attributes
    ----------
    seconds : float
        Of speech.
    closures, labiodentals : ContactCount
        Sealed lips, on p, b and m; the lower lip at the upper teeth, on f and v.
    narrowing_mm, protrusion_mm : float
        How much narrower, and further forward, the lips are on rounded vowels than on spread
        ones, mm; NaN without both.
    rounding_told : float
        How often, of all pairs of a rounded and a spread vowel, the rounded one is narrower:
        1 always, 0.5 by chance.
    opening_r : float
        Correlation of the opening with that of the reference, mean over takes; NaN without one.
    rest : float
        Share of silence, `SETTLE_S` after speech and `WAKE_S` before it, in which the lips touch;
        NaN without any.
    """

    seconds: float
    closures: ContactCount
    labiodentals: ContactCount
    narrowing_mm: float
    protrusion_mm: float
    rounding_told: float
    opening_r: float
    rest: float


@dataclass
class _Tally:
    """What is gathered over takes."""

    closures: Float64Array = field(default_factory=lambda: np.zeros(4))
    labiodentals: Float64Array = field(default_factory=lambda: np.zeros(4))
    rounded: list[tuple[float, float]] = field(default_factory=list)
    spread: list[tuple[float, float]] = field(default_factory=list)
    correlations: list[float] = field(default_factory=list)
    resting: list[NDArray[np.bool_]] = field(default_factory=list)
    seconds: float = 0.0


def phone_mouth_score(takes: Iterable[SpokenTake]) -> PhoneMouthScore:
    """Judge predicted mouths by the phones that were said, all takes together.

    Parameters
    ----------
    takes : iterable of SpokenTake
        One or more.

    Returns
    -------
    PhoneMouthScore

    Raises
    ------
    HeadError
        For a head without lips, landmarks or teeth.
    """
    tally = _Tally()
    for take in takes:
        _add(tally, take)
    rounded, spread = np.array(tally.rounded), np.array(tally.spread)
    narrowing = protrusion = narrower = np.nan
    if len(rounded) and len(spread):
        narrowing = float(spread[:, 0].mean() - rounded[:, 0].mean())
        protrusion = float(rounded[:, 1].mean() - spread[:, 1].mean())
        narrower = float((rounded[:, None, 0] < spread[None, :, 0]).mean())
    return PhoneMouthScore(
        seconds=tally.seconds,
        closures=ContactCount(*map(int, tally.closures)),
        labiodentals=ContactCount(*map(int, tally.labiodentals)),
        narrowing_mm=narrowing,
        protrusion_mm=protrusion,
        rounding_told=narrower,
        opening_r=float(np.mean(tally.correlations)) if tally.correlations else np.nan,
        rest=float(np.concatenate(tally.resting).mean()) if tally.resting else np.nan,
    )


def _add(tally: _Tally, take: SpokenTake) -> None:
    motion, fps = take.motion, take.motion.fps
    count = motion.frame_count
    measures = measure_mouth(motion)
    opening = measures["opening_mm"].astype(np.float64)
    kinds = [(start, end, mouth_class(symbol)) for start, end, symbol in take.phones]
    silent = _silence(kinds, count, fps)
    lips, teeth = opening < CLOSED_MM, labiodental_gap(motion) < LABIODENTAL_MM
    tally.closures += _contacts(lips, kinds, "bilabial", silent, fps)
    tally.labiodentals += _contacts(teeth, kinds, "labiodental", silent, fps)
    for start, end, kind in kinds:
        frame = min(round((start + end) / 2 * fps), count - 1)
        if kind in ("rounded", "spread"):
            here = float(measures["width_mm"][frame]), float(measures["protrusion_mm"][frame])
            (tally.rounded if kind == "rounded" else tally.spread).append(here)
    if take.reference is not None:
        wanted = measure_mouth(take.reference)["opening_mm"].astype(np.float64)
        tally.correlations.append(pearson(opening, wanted))
    resting = _well_within(silent, fps)
    if resting.any():
        tally.resting.append(lips[resting])
    tally.seconds += count / fps


def labiodental_gap(motion: Motion) -> Float64Array:
    """How far the middle of the lower lip is from the edge of the upper incisors.

    Returns
    -------
    (frame,) float64
        Millimetres, in the plane that divides left from right.

    Raises
    ------
    HeadError
        For a head that does not say where its lips and teeth are.
    """
    head = motion.head
    edge = _incisor_edge(head)
    lip = head.inner_lip_lower[len(head.inner_lip_lower) // 2]
    used = np.array([lip, *edge])
    basis = head.expression_basis[:, used].reshape(len(head.expression_names), -1)
    points = (motion.weights @ basis).reshape(-1, len(used), 3) + head.template[used]
    offset = points[:, 0, 1:] - points[:, 1:, 1:].mean(axis=1)
    return 1000 * np.linalg.norm(offset, axis=1).astype(np.float64)


def _incisor_edge(head: HeadModel) -> NDArray[np.integer]:
    teeth = head.regions.get("teeth_upper", np.zeros(0, np.int64))
    if not len(head.inner_lip_lower) or not len(teeth):
        raise HeadError.about(
            f"head {head.name!r}",
            found="no list of its lips and teeth",
            allowed="a head that names both, such as the built-in one",
        )
    places = head.template[teeth]
    incisors = teeth[np.abs(places[:, 0]) < INCISORS_M]
    return incisors[np.argsort(head.template[incisors, 1])][:EDGE_VERTICES]


def count_contacts(
    touching: NDArray[np.bool_], phones: Sequence[Label], wanted: str, fps: float
) -> ContactCount:
    """Contacts that phones ask for, "bilabial" or "labiodental", and contacts made.

    touching: (frame,) whether the lips, or lip and teeth, touch. phones: in order; what none covers
    is silence.
    """
    kinds = [(start, end, mouth_class(symbol)) for start, end, symbol in phones]
    silent = _silence(kinds, len(touching), fps)
    return ContactCount(*map(int, _contacts(touching, kinds, wanted, silent, fps)))


def silent_frames(phones: Sequence[Label], count: int, fps: float) -> NDArray[np.bool_]:
    """(frame,) whether no phone is said, of as many frames as `count` says."""
    kinds = [(start, end, mouth_class(symbol)) for start, end, symbol in phones]
    return _silence(kinds, count, fps)


def _contacts(
    touching: NDArray[np.bool_],
    kinds: Sequence[tuple[float, float, str]],
    wanted: str,
    silent: NDArray[np.bool_],
    fps: float,
) -> Float64Array:
    """(4,) contacts wanted, met, made and right."""
    stretches = _merged([(a, b) for a, b, kind in kinds if kind == wanted])
    near = round(TOLERANCE_S * fps)

    def touched(stretch: tuple[float, float]) -> bool:
        first, last = round(stretch[0] * fps), round(stretch[1] * fps)
        return bool(touching[max(0, first - near) : last + near + 1].any())

    allowed = silent.copy()
    wide = round(WIDE_TOLERANCE_S * fps)
    for start, end, kind in kinds:
        if kind in (wanted, "either"):
            allowed[max(0, round(start * fps) - wide) : round(end * fps) + wide + 1] = True
    contacts = [run for run in short_runs(touching, fps) if not silent[run[0] : run[1]].all()]
    right = sum(bool(allowed[first:last].any()) for first, last in contacts)
    return np.array(
        [len(stretches), sum(map(touched, stretches)), len(contacts), right], np.float64
    )


def _merged(stretches: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Stretches that follow each other at once as one: mb, pp."""
    merged: list[tuple[float, float]] = []
    for start, end in stretches:
        if merged and start - merged[-1][1] < TOLERANCE_S:
            merged[-1] = (merged[-1][0], end)
        else:
            merged.append((start, end))
    return merged


def _silence(
    kinds: Sequence[tuple[float, float, str]], count: int, fps: float
) -> NDArray[np.bool_]:
    """(frame,) whether no phone is said."""
    silent = np.ones(count, np.bool_)
    for start, end, kind in kinds:
        if kind != "silence":
            silent[round(start * fps) : round(end * fps)] = False
    return silent


def _well_within(silent: NDArray[np.bool_], fps: float) -> NDArray[np.bool_]:
    """(frame,) those of long silences in which a mouth has settled and does not wake yet."""
    within = np.zeros(len(silent), np.bool_)
    for first, last in runs(silent):
        start = first + round((SETTLE_S + TOLERANCE_S) * fps) if first else 0
        stop = last - round((WAKE_S + TOLERANCE_S) * fps) if last < len(silent) else last
        if (last - first) / fps > REST_AFTER_S and start < stop:
            within[start:stop] = True
    return within
