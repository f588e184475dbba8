"""What there is to see in a mouth that speaks, as numbers: timing, seals, and how it moves.

The same numbers are taken of people, whose mouths were tracked in video, and of heads. What is
usual among people is `people_seen.json`, made by `recipes.study_raters.people_seen`; it holds sixty
numbers and nobody's motion.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.audio.waveform import Waveform
from elocute.evaluation.lip_closures import CLOSED_MM
from elocute.evaluation.phone_mouth_scores import (
    LABIODENTAL_MM,
    ContactCount,
    count_contacts,
    mouth_class,
    silent_frames,
)
from elocute.numerics.correlation import pearson
from elocute.speech.times.labels import Label

Usual = tuple[float, float]
"""Middle and spread of a measure among people."""

SEEN_FPS = 25.0
"""At which people were tracked, and speed and jerk are taken of everybody."""
EXPECTED_RATE = 100.0
LOUD_RANGE_DB = 30.0
FREE_S = (0.0, 0.08)
"""How much later than the picture a sound may be and nobody minds.

Sound that is 45 ms early or 125 ms late is noticed (ITU-R BT.1359-1): the middle is 40 ms late, and
people's own mouths, which are in time, lie on the edge of what is free.
"""
LAG_MAX_S, LAG_STEP_S = 0.3, 0.02
BEST_LAGS_S = np.linspace(-LAG_MAX_S, LAG_MAX_S, 1 + round(2 * LAG_MAX_S / LAG_STEP_S))
FREE = np.abs(BEST_LAGS_S - np.mean(FREE_S)) <= (FREE_S[1] - FREE_S[0] + LAG_STEP_S) / 2
SHUT_LEAST, DEGREES_LEAST, LIDS_LEAST, SPEED_LEAST, OPENING_LEAST = 0.02, 0.05, 0.005, 1.0, 0.1
"""Shares, degrees, shares, mm/s and mm below which nobody sees a difference."""
WINDOW_S = 1.2
SILENCE = "SIL"


@dataclass(frozen=True)
class HeardSound:
    """What raters hear.

    Attributes
    ----------
    phones : sequence of (float, float, str)
        Start in s, end in s and phone, in order.
    expected : (row,) float64
        How far people open to it, mm, at `EXPECTED_RATE`.
    """

    phones: Sequence[Label]
    expected: Float64Array

    @property
    def duration_s(self) -> float:
        """Its length, s."""
        return len(self.expected) / EXPECTED_RATE

    def expected_at(self, times_s: Float64Array) -> Float64Array:
        """(frame,) what is expected at these moments, NaN outside of the sound."""
        rows = times_s * EXPECTED_RATE
        found = np.interp(rows, np.arange(len(self.expected)), self.expected)
        return np.where((rows >= 0) & (rows <= len(self.expected)), found, np.nan)


@dataclass(frozen=True, eq=False)
class SeenMouth:
    """What raters see of a face over time.

    Attributes
    ----------
    opening_mm : (frame,) float64
        Gap of the inner lips.
    fps : float
        Frames per second.
    start_s : float
        The moment of the sound that the first frame is shown at.
    lip_teeth_mm : (frame,) float64, optional
        From the lower lip to the upper incisors, of a head with teeth.
    turns_deg : (frame, 3) float64, optional
        Where the head is turned.
    lids : (frame,) float64, optional
        How far the eyes are open, 1 usual.
    """

    opening_mm: Float64Array
    fps: float
    start_s: float = 0.0
    lip_teeth_mm: Float64Array | None = None
    turns_deg: Float64Array | None = None
    lids: Float64Array | None = None

    @property
    def times_s(self) -> Float64Array:
        """(frame,) moments of the sound."""
        return self.start_s + np.arange(len(self.opening_mm)) / self.fps


@dataclass(frozen=True)
class Seen:
    """Measures of a clip; NaN of what cannot be measured in it.

    Attributes
    ----------
    fit : float
        Correlation of the opening with what people do to such sound, the sound being as late as
        nobody minds (`FREE_S`).
    best_fit : float
        The same, the sound being as late or early as suits the mouth.
    late_s : float
        How late the sound is by that, s; negative where it is early.
    missed_seals, missed_teeth : float
        Share of the stretches of p, b, m at which lips do not close, and of f, v at which the lower
        lip stays away from the incisors.
    false_seals : float
        Short closures where no such phone is heard, per second of speech.
    opening_mm : float
        99th percentile in speech.
    speed_mm_s, jerk_m_s3 : float
        95th percentile of the opening's speed, 99th of its third derivative.
    shut : float
        Share of speech with closed lips.
    head_deg : float
        Root mean square of the head's turning in windows of `WINDOW_S`, all axes.
    lids : float
        Standard deviation of how far the eyes are open, as share.
    """

    fit: float
    best_fit: float
    late_s: float
    missed_seals: float
    missed_teeth: float
    false_seals: float
    opening_mm: float
    speed_mm_s: float
    jerk_m_s3: float
    shut: float
    head_deg: float
    lids: float


@dataclass(frozen=True)
class PeopleSeen:
    """What is usual among people.

    Attributes
    ----------
    opening_mm : mapping of str to float
        How far each ARPAbet phone, and silence, opens the mouth.
    loud_mm : float
        And how much further from the quietest to the loudest.
    smooth_s, ahead_s : float
        How these run into each other, and how far ahead of the sound they are.
    usual : mapping of str to (float, float)
        Of each measure of `Seen` in `compared`, middle and spread.
    fit_least : float
        The fit that three of four clips of people have at least.
    sync_weight : float
        Logits for a loss of 1 in fit, by what delays people notice.
    """

    opening_mm: Mapping[str, float]
    loud_mm: float
    smooth_s: float
    ahead_s: float
    usual: Mapping[str, Usual]
    fit_least: float
    sync_weight: float


@cache
def people_seen() -> PeopleSeen:
    """What is usual among people, from the package's file."""
    stored = json.loads(Path(__file__).with_name("people_seen.json").read_text())
    usual = {name: (float(a), float(b)) for name, (a, b) in stored.pop("usual").items()}
    stored.pop("made_from", None)
    return PeopleSeen(usual=usual, **stored)


def hear(sound: Waveform, phones: Sequence[Label], people: PeopleSeen | None = None) -> HeardSound:
    """What raters expect to see with a sound.

    Parameters
    ----------
    sound : Waveform
        The sound.
    phones : sequence of (float, float, str)
        Its phones, as `find_phones` hears them; what none covers is silence.
    people : PeopleSeen, optional
        By default the package's own.

    Returns
    -------
    HeardSound
    """
    people = people or people_seen()
    named, loud = expectation_inputs(sound, phones, people.smooth_s, people.ahead_s)
    values = np.array([people.opening_mm[name] for name in people.opening_mm])
    order = [phone_names().index(name) for name in people.opening_mm]
    return HeardSound(phones, named[:, order] @ values + people.loud_mm * loud)


@cache
def phone_names() -> tuple[str, ...]:
    """The encoder's phones, with silence."""
    from elocute.encoders.phones_and_visemes import PHONES

    return (*(each for each in PHONES if each != SILENCE), SILENCE)


def expectation_inputs(
    sound: Waveform, phones: Sequence[Label], smooth_s: float, ahead_s: float
) -> tuple[Float64Array, Float64Array]:
    """What an expected opening is made of.

    Parameters
    ----------
    sound : Waveform
        The sound.
    phones : sequence of (float, float, str)
        Its phones.
    smooth_s, ahead_s : float
        As in `PeopleSeen`.

    Returns
    -------
    named : (row, phone) float64
        How much of each of `phone_names` there is, at `EXPECTED_RATE`.
    loud : (row,) float64
        Loudness, from 0, `LOUD_RANGE_DB` below the loudest, to 1.
    """
    names = phone_names()
    rows = max(1, round(sound.duration_s * EXPECTED_RATE))
    named = np.zeros((rows, len(names)))
    for start, end, phone in phones:
        bare = phone.rstrip("012")
        if bare in names:
            named[round(start * EXPECTED_RATE) : round(end * EXPECTED_RATE), names.index(bare)] = 1
    named[:, -1] += 1 - np.minimum(named.sum(axis=1), 1)
    step = sound.sample_rate / EXPECTED_RATE
    edges = np.round(np.arange(rows + 1) * step).astype(int).clip(0, len(sound.samples))
    power = np.concatenate([[0.0], np.cumsum(np.square(sound.samples, dtype=np.float64))])
    mean = (power[edges[1:]] - power[edges[:-1]]) / np.maximum(np.diff(edges), 1)
    level = 10 * np.log10(_smooth(mean[:, None], 0.02 * EXPECTED_RATE)[:, 0] + 1e-9)
    loud = np.clip((level - np.percentile(level, 98)) / LOUD_RANGE_DB + 1, 0, 1)
    both = _smooth(np.column_stack([named, loud]), smooth_s * EXPECTED_RATE)
    ahead = round(ahead_s * EXPECTED_RATE)
    both = both[np.clip(np.arange(rows) + ahead, 0, rows - 1)]
    return both[:, :-1], both[:, -1]


def _smooth(values: Float64Array, sd_rows: float) -> Float64Array:
    """Columns by a Gaussian, edges held."""
    reach = max(1, round(3 * sd_rows))
    kernel = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) / max(sd_rows, 1e-6)))
    kernel /= kernel.sum()
    padded = np.pad(values, ((reach, reach), (0, 0)), mode="edge")
    columns = [np.convolve(column, kernel, "valid") for column in padded.T]
    return np.stack(columns, axis=1)


def fit_at(mouth: SeenMouth, heard: HeardSound, lags_s: Float64Array) -> Float64Array:
    """How well a mouth fits its sound, had the sound been brought forward.

    Parameters
    ----------
    mouth : SeenMouth
        What is seen.
    heard : HeardSound
        What is heard.
    lags_s : (lag,) float64
        By how much, s.

    Returns
    -------
    (lag,) float64
        Pearson's correlation with what is expected, over the moments that the sound has.
    """
    times, found = mouth.times_s, np.zeros(len(lags_s))
    for place, lag in enumerate(lags_s):
        expected = heard.expected_at(times + lag)
        known = np.isfinite(expected)
        if known.sum() >= 5:
            found[place] = pearson(mouth.opening_mm[known], expected[known])
    return np.nan_to_num(found)


def look(mouth: SeenMouth, heard: HeardSound | None) -> Seen:
    """Measure a clip.

    Parameters
    ----------
    mouth : SeenMouth
        What is seen.
    heard : HeardSound, optional
        What is heard with it; None for a clip without sound.

    Returns
    -------
    Seen
    """
    speaking = _speaking(mouth, heard)
    opening, fps = _at(mouth, mouth.opening_mm), SEEN_FPS
    measures = {
        "opening_mm": float(np.percentile(mouth.opening_mm[speaking], 99)),
        "speed_mm_s": _percentile(np.abs(np.diff(opening)) * fps, 95),
        "jerk_m_s3": _percentile(np.abs(np.diff(opening, 3)) * fps**3 / 1000, 99),
        "shut": float(np.mean(mouth.opening_mm[speaking] < CLOSED_MM)),
        "head_deg": np.nan if mouth.turns_deg is None else turning(mouth.turns_deg, mouth.fps),
        "lids": np.nan if mouth.lids is None else float(np.std(mouth.lids)),
    }
    return Seen(**_timing(mouth, heard), **_contacts(mouth, heard), **measures)


def _speaking(mouth: SeenMouth, heard: HeardSound | None) -> NDArray[np.bool_]:
    """(frame,) whether somebody speaks; all where that is not known or never."""
    everything = np.ones(len(mouth.opening_mm), np.bool_)
    if heard is None:
        return everything
    speaking = np.zeros_like(everything)
    for start, end, phone in heard.phones:
        if mouth_class(phone) != "silence":
            speaking |= (mouth.times_s >= start) & (mouth.times_s < end)
    return speaking if speaking.any() else everything


def _at(mouth: SeenMouth, values: Float64Array) -> Float64Array:
    """Values at `SEEN_FPS`."""
    times = np.arange(len(values)) / mouth.fps
    count = max(1, round(len(values) / mouth.fps * SEEN_FPS))
    return np.interp(np.arange(count) / SEEN_FPS, times, values)


def _percentile(values: Float64Array, share: float) -> float:
    return float(np.percentile(values, share)) if len(values) else np.nan


def _timing(mouth: SeenMouth, heard: HeardSound | None) -> dict[str, float]:
    if heard is None:
        return dict.fromkeys(("fit", "best_fit", "late_s"), np.nan)
    fits = fit_at(mouth, heard, BEST_LAGS_S)
    best = int(np.argmax(fits))
    return {
        "fit": float(fits[FREE].max()),
        "best_fit": float(fits[best]),
        "late_s": float(BEST_LAGS_S[best]),
    }


def _contacts(mouth: SeenMouth, heard: HeardSound | None) -> dict[str, float]:
    found = {"missed_seals": np.nan, "missed_teeth": np.nan, "false_seals": np.nan}
    if heard is None:
        return found
    frames, fps = len(mouth.opening_mm), mouth.fps
    # In frames of the mouth, which may begin before the sound.
    phones = [(a - mouth.start_s, b - mouth.start_s, name) for a, b, name in heard.phones]
    phones = [(max(0.0, a), b, name) for a, b, name in phones if b > 0 and a * fps < frames - 1]
    seals = count_contacts(mouth.opening_mm < CLOSED_MM, phones, "bilabial", fps)
    found["missed_seals"] = _missed(seals)
    silent = silent_frames(phones, frames, fps)
    seconds = float((~silent).sum()) / fps
    found["false_seals"] = (seals.made - seals.right) / seconds if seconds > 0 else np.nan
    if mouth.lip_teeth_mm is not None:
        touching = mouth.lip_teeth_mm < LABIODENTAL_MM
        found["missed_teeth"] = _missed(count_contacts(touching, phones, "labiodental", fps))
    return found


def _missed(counted: ContactCount) -> float:
    return 1 - counted.met / counted.wanted if counted.wanted else np.nan


def turning(turns_deg: Float64Array, fps: float) -> float:
    """How much a head turns: root mean square, over windows, of its deviations together, degrees.

    Parameters
    ----------
    turns_deg : (frame, 3) float64
        Where it is turned.
    fps : float
        Frames per second.

    Returns
    -------
    float
    """
    size = max(2, min(round(WINDOW_S * fps), len(turns_deg)))
    starts = range(0, max(1, len(turns_deg) - size + 1), size)
    spread = [np.square(turns_deg[at : at + size].std(axis=0)).sum() for at in starts]
    return float(np.sqrt(np.mean(spread)))


def compared(seen: Seen) -> dict[str, float]:
    """The measures that have a usual size among people, on scales on which they spread evenly.

    Parameters
    ----------
    seen : Seen
        Of a clip.

    Returns
    -------
    dict of str to float
        False seals per second; logarithms of opening, speed, jerk, shut, head_deg and lids; NaN as
        in `seen`.
    """
    return {
        "false seals": seen.false_seals,
        "opening": float(np.log(max(seen.opening_mm, OPENING_LEAST))),
        "speed": float(np.log(max(seen.speed_mm_s, SPEED_LEAST))),
        "jerk": float(np.log(max(seen.jerk_m_s3, SPEED_LEAST))),
        "shut": float(np.log(seen.shut + SHUT_LEAST)),
        "head": float(np.log(np.fmax(seen.head_deg, DEGREES_LEAST)))
        if np.isfinite(seen.head_deg)
        else np.nan,
        "lids": float(np.log(np.fmax(seen.lids, LIDS_LEAST))) if np.isfinite(seen.lids) else np.nan,
    }


def unusual(seen: Seen, people: PeopleSeen) -> dict[str, float]:
    """How many spreads each measure is from the middle of people's.

    Parameters
    ----------
    seen : Seen
        Of a clip.
    people : PeopleSeen
        What is usual.

    Returns
    -------
    dict of str to float
        By the names of `compared`; NaN of what was not measured.
    """
    values: Sequence[tuple[str, float]] = list(compared(seen).items())
    return {
        name: (value - people.usual[name][0]) / people.usual[name][1]
        for name, value in values
        if name in people.usual
    }
