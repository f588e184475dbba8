"""Scores of a predicted mouth against those of real talkers, tracked in video.

`tracked_mouths` reads the recordings. The predictor is a plain callable, so any model can be
measured. Correlations are of each clip; amplitudes, shares of time and jerks of all frames of a
group together: of a talker, a language, or everybody.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.articulation.contacts_and_rest import REST_AFTER_S, runs
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.phones_and_visemes import SILENCE
from elocute.encoders.protocol import FEATURE_RATE
from elocute.evaluation.lip_closures import CLOSED_MM, short_runs
from elocute.evaluation.phone_mouth_scores import WIDE_TOLERANCE_S, mouth_class
from elocute.evaluation.tracked_mouths import (
    TrackedClip,
    TrackedMouth,
    find_tracked_mouths,
    read_tracked_mouth,
)
from elocute.motion.curves import Curves
from elocute.motion.mouth_measures import TRACKED_CLOSED, TRACKED_RESTING
from elocute.numerics.correlation import pearson

MouthPredictor = Callable[[Path], Curves]
"""Sound file to `opening_mm, width_mm, …` as `measure_as_tracked` gives them."""
SpeechFinder = Callable[[Path], NDArray[np.bool_]]
"""Sound file to (row,) whether somebody speaks, at FEATURE_RATE."""

LAG_MAX_S = 0.120
LAG_STEP_S = 0.020
LAGS_S = np.arange(-round(LAG_MAX_S / LAG_STEP_S), round(LAG_MAX_S / LAG_STEP_S) + 1) * LAG_STEP_S
# Around a word's start. With this window the tracked talker himself closes at 0.99 of his b/p
# words and 0.46 of the others.
CLOSURE_WINDOW_S = 0.080
MEASURED = ("opening", "width", "protrusion")
MEDIAN, LARGE = 50, 99  # percentiles that stand for usual and for large movements
ALL = "all"
JERK_UNIT = 1000.0  # mm/s³ in m/s³


@dataclass(frozen=True)
class MouthScore:
    """One predicted mouth against its recording.

    Attributes
    ----------
    name, talker, language : str
        Of the recording.
    opening_r, width_r, protrusion_r : float
        Pearson's correlation at no lag; NaN of what was not tracked.
    opening_synced_r, width_synced_r, protrusion_synced_r : float
        The same with the recording's own offset between sound and picture taken out.
    opening_best_r, width_best_r, protrusion_best_r : float
        The highest correlation within ±`LAG_MAX_S` of that.
    opening_lag_s : float
        The lag of that of the opening, s; positive where the prediction is late.
    closures_met, closures : int
        Words with b or p at whose start the predicted mouth closes, and all of them.
    false_met, others : int
        The same of other words, but for those with m.
    real_closures_met, real_false_met : int
        As `closures_met` and `false_met`, of the recorded mouth.
    seals_right, seals_false, seals_missed : int or None
        Short closures of the predicted lips at a p, b or m and elsewhere, and stretches of p, b, m
        without; None where no phones are known.
    """

    name: str
    talker: str
    language: str
    opening_r: float
    opening_synced_r: float
    opening_best_r: float
    opening_lag_s: float
    width_r: float
    width_synced_r: float
    width_best_r: float
    protrusion_r: float
    protrusion_synced_r: float
    protrusion_best_r: float
    closures_met: int
    closures: int
    false_met: int
    others: int
    real_closures_met: int
    real_false_met: int
    seals_right: int | None
    seals_false: int | None
    seals_missed: int | None


@dataclass(frozen=True)
class GroupScore:
    """Recordings of a talker, of a language, or all of them.

    Attributes
    ----------
    group : str
        `all`, `language NAME` or `talker NAME`.
    takes : int
        Number of recordings.
    seconds : float
        Of valid frames.
    opening_r, opening_synced_r, opening_best_r, width_…, protrusion_… : float
        Means over recordings of what `MouthScore` has.
    opening_lag_s : float
        Median lag, s.
    opening_common_r : float
        The best mean correlation of the opening at one lag for all clips of a talker, mean over
        talkers: on clips of a second, a lag for each clip flatters.
    closure_recall, real_closure_recall : float
        Share of words with b or p at which the predicted, or the recorded, mouth closes; higher is
        better.
    false_closure, real_false_closure : float
        The same of other words; lower is better.
    seals_right, seals_false, seals_missed : int or None
        Sums of what `MouthScore` has.
    amplitude_p50, amplitude_p99 : float
        Percentiles of the predicted opening in speech, as multiples of the recorded ones.
    shut, real_shut : float
        Share of frames in speech in which the lips touch.
    zero : float
        Share of frames in speech in which the predicted opening is exactly zero.
    jerk_p50, real_jerk_p50, jerk_p99, real_jerk_p99 : float
        Percentiles of the third difference of the opening in speech, at the frame rate of the
        recording, m/s³. Of the recorded mouth, noise of tracking is part of it.
    pause_opening_mm, real_pause_opening_mm : float
        Mean opening in pauses of `REST_AFTER_S` and more, mm.
    pause_shut, real_pause_shut : float
        Share of frames in pauses in which the lips touch.
    """

    group: str
    takes: int
    seconds: float
    opening_r: float
    opening_synced_r: float
    opening_best_r: float
    opening_common_r: float
    opening_lag_s: float
    width_r: float
    width_synced_r: float
    width_best_r: float
    protrusion_r: float
    protrusion_synced_r: float
    protrusion_best_r: float
    closure_recall: float
    false_closure: float
    real_closure_recall: float
    real_false_closure: float
    seals_right: int | None
    seals_false: int | None
    seals_missed: int | None
    amplitude_p50: float
    amplitude_p99: float
    shut: float
    real_shut: float
    zero: float
    jerk_p50: float
    real_jerk_p50: float
    jerk_p99: float
    real_jerk_p99: float
    pause_opening_mm: float
    real_pause_opening_mm: float
    pause_shut: float
    real_pause_shut: float


@dataclass(frozen=True, eq=False)
class MeasuredMouth:
    """A predicted and a recorded mouth at the same moments.

    Attributes
    ----------
    lag_rs : (lag,) float64
        Correlation of the opening at `LAGS_S`.
    predicted_mm, recorded_mm : (frame,) float64
        Openings, mm.
    shut, real_shut : (frame,) bool
        Whether the lips touch.
    speaking : (frame,) bool
        Whether the frame belongs to speech, short pauses included.
    jerk, real_jerk : (number,) float64
        In m/s³, of speech alone.
    seconds : float
        Of valid frames.
    """

    score: MouthScore
    lag_rs: Float64Array
    predicted_mm: Float64Array
    recorded_mm: Float64Array
    shut: NDArray[np.bool_]
    real_shut: NDArray[np.bool_]
    speaking: NDArray[np.bool_]
    jerk: Float64Array
    real_jerk: Float64Array
    seconds: float


@dataclass(frozen=True, eq=False)
class TrackedMouthReport:
    """Scores of groups (everybody; then each language and talker, if several) and recordings."""

    groups: list[GroupScore]
    clips: list[MouthScore]

    @property
    def summary(self) -> GroupScore:
        """Of all recordings."""
        return self.groups[0]


def heard_speech(sound: Path) -> NDArray[np.bool_]:
    """Where somebody speaks in a sound file, as the phone encoder hears it. Raises AudioError.

    Returns
    -------
    (row,) bool
        At FEATURE_RATE. Pauses shorter than `REST_AFTER_S` belong to the speech around them.
    """
    samples = read_audio(sound, sample_rate=SPEECH_RATE).samples
    speaking = np.exp(builtin_encoder().encode(samples)[:, SILENCE]) < 0.5
    for start, stop in runs(~speaking):
        if start > 0 and stop < len(speaking) and (stop - start) / FEATURE_RATE < REST_AFTER_S:
            speaking[start:stop] = True
    return speaking


def measure_tracked_mouth(
    recorded: TrackedMouth,
    predicted: Curves,
    eye_distance_mm: float,
    speaking: NDArray[np.bool_],
) -> MeasuredMouth:
    """Compare a prediction with its recording.

    predicted: `opening_mm` and `width_mm`, perhaps `protrusion_mm`, as from `measure_as_tracked`.
    eye_distance_mm: between the outer eye corners of the predicted head. speaking: (row,) as from
    `heard_speech`.
    """
    times = np.arange(len(predicted.values)) / predicted.fps
    tracks = {
        name: predicted[f"{name}_mm"].astype(float) / eye_distance_mm
        for name in MEASURED
        if f"{name}_mm" in predicted.names
    }
    correlations = {
        name: _correlate(recorded, getattr(recorded, name), times, tracks.get(name))
        for name in MEASURED
    }
    opening, valid = tracks["opening"], recorded.valid
    met = _closures(recorded.words, times, opening)
    real = _closures(recorded.words, recorded.times_s[valid], recorded.opening[valid])
    best = {name: int(np.argmax(rs)) for name, (_, rs) in correlations.items()}
    middle = len(LAGS_S) // 2
    seals = _seals(recorded, opening * eye_distance_mm, predicted.fps)
    score = MouthScore(
        recorded.name,
        recorded.talker,
        recorded.language,
        **{f"{name}_r": raw for name, (raw, _) in correlations.items()},
        **{f"{name}_synced_r": float(rs[middle]) for name, (_, rs) in correlations.items()},
        **{f"{name}_best_r": float(rs[best[name]]) for name, (_, rs) in correlations.items()},
        opening_lag_s=float(LAGS_S[best["opening"]]),
        **dict(zip(("closures_met", "closures", "false_met", "others"), met, strict=True)),
        real_closures_met=real[0],
        real_false_met=real[2],
        **dict(zip(("seals_right", "seals_false", "seals_missed"), seals, strict=True)),
    )
    return _at_the_same_moments(
        recorded, score, correlations["opening"][1], times, opening, eye_distance_mm, speaking
    )


def _at_the_same_moments(
    recorded: TrackedMouth,
    score: MouthScore,
    lag_rs: Float64Array,
    times: Float64Array,
    opening: Float64Array,
    eye_distance_mm: float,
    speaking: NDArray[np.bool_],
) -> MeasuredMouth:
    moments = recorded.times_s - recorded.offset_s
    predicted_mm = np.interp(moments, times, opening) * eye_distance_mm
    recorded_mm = np.maximum(recorded.opening - TRACKED_RESTING, 0) * eye_distance_mm
    row = np.clip(np.round(moments * FEATURE_RATE).astype(int), 0, max(len(speaking) - 1, 0))
    inside = speaking[row] if len(speaking) else np.zeros(len(row), np.bool_)
    valid = recorded.valid
    fps = 1 / float(np.median(np.diff(recorded.times_s)))
    return MeasuredMouth(
        score,
        lag_rs,
        predicted_mm[valid],
        recorded_mm[valid],
        predicted_mm[valid] < CLOSED_MM,
        recorded.opening[valid] < TRACKED_CLOSED,
        inside[valid],
        _jerk(predicted_mm, valid & inside, fps),
        _jerk(recorded_mm, valid & inside, fps),
        float(valid.sum() / fps),
    )


def group_score(group: str, mouths: Sequence[MeasuredMouth]) -> GroupScore:
    """What one recording or more have in common; `group` is what they are called."""
    scores = [mouth.score for mouth in mouths]

    def mean(field: str) -> float:
        values = np.array([getattr(score, field) for score in scores], float)
        return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")

    def share(met: str, of: str) -> float:
        total = sum(getattr(score, of) for score in scores)
        return sum(getattr(score, met) for score in scores) / total if total else float("nan")

    def count(field: str) -> int | None:
        known = [n for n in (getattr(score, field) for score in scores) if n is not None]
        return sum(known) if known else None

    speech, pause = _Pooled(mouths, speaking=True), _Pooled(mouths, speaking=False)
    jerk, real_jerk = (
        np.concatenate([getattr(mouth, name) for mouth in mouths]) for name in ("jerk", "real_jerk")
    )
    return GroupScore(
        group=group,
        takes=len(scores),
        seconds=sum(mouth.seconds for mouth in mouths),
        **{f"{name}_{kind}": mean(f"{name}_{kind}") for name in MEASURED for kind in _CORRELATIONS},
        opening_common_r=_common_r(mouths),
        opening_lag_s=float(np.median([score.opening_lag_s for score in scores])),
        closure_recall=share("closures_met", "closures"),
        false_closure=share("false_met", "others"),
        real_closure_recall=share("real_closures_met", "closures"),
        real_false_closure=share("real_false_met", "others"),
        seals_right=count("seals_right"),
        seals_false=count("seals_false"),
        seals_missed=count("seals_missed"),
        amplitude_p50=_ratio(speech.predicted_mm, speech.recorded_mm, MEDIAN),
        amplitude_p99=_ratio(speech.predicted_mm, speech.recorded_mm, LARGE),
        shut=_mean(speech.shut),
        real_shut=_mean(speech.real_shut),
        zero=_mean(speech.predicted_mm == 0),
        jerk_p50=_percentile(jerk, MEDIAN),
        real_jerk_p50=_percentile(real_jerk, MEDIAN),
        jerk_p99=_percentile(jerk, LARGE),
        real_jerk_p99=_percentile(real_jerk, LARGE),
        pause_opening_mm=_mean(pause.predicted_mm),
        real_pause_opening_mm=_mean(pause.recorded_mm),
        pause_shut=_mean(pause.shut),
        real_pause_shut=_mean(pause.real_shut),
    )


_CORRELATIONS = ("r", "synced_r", "best_r")


class _Pooled:
    """The frames of several recordings, of speech or of pauses."""

    def __init__(self, mouths: Sequence[MeasuredMouth], *, speaking: bool) -> None:
        def pooled(name: str) -> NDArray:
            kept = [getattr(mouth, name)[mouth.speaking == speaking] for mouth in mouths]
            return np.concatenate(kept)

        self.predicted_mm, self.recorded_mm = pooled("predicted_mm"), pooled("recorded_mm")
        self.shut, self.real_shut = pooled("shut"), pooled("real_shut")


def _common_r(mouths: Sequence[MeasuredMouth]) -> float:
    talkers = dict.fromkeys(mouth.score.talker for mouth in mouths)
    best = [
        np.mean([mouth.lag_rs for mouth in mouths if mouth.score.talker == talker], axis=0).max()
        for talker in talkers
    ]
    return float(np.mean(best))


def _mean(values: NDArray) -> float:
    return float(values.mean()) if len(values) else float("nan")


def _percentile(values: Float64Array, percent: int) -> float:
    return float(np.percentile(values, percent)) if len(values) else float("nan")


def _ratio(predicted: Float64Array, recorded: Float64Array, percent: int) -> float:
    real = _percentile(recorded, percent)
    return _percentile(predicted, percent) / real if real > 0 else float("nan")


def _jerk(opening_mm: Float64Array, inside: NDArray[np.bool_], fps: float) -> Float64Array:
    """(frame,) sizes of third differences between frames that are all inside."""
    if len(opening_mm) < 4:
        return np.zeros(0)
    together = inside[3:] & inside[2:-1] & inside[1:-2] & inside[:-3]
    return np.abs(np.diff(opening_mm, 3))[together] * fps**3 / JERK_UNIT


def _correlate(
    recorded: TrackedMouth,
    tracked: Float64Array,
    predicted_times: Float64Array,
    predicted: Float64Array | None,
) -> tuple[float, Float64Array]:
    """Pearson's r at no lag, and at each of LAGS_S with the recording's offset taken out."""
    kept = recorded.valid & np.isfinite(tracked)
    if predicted is None or not kept.any():
        return float("nan"), np.full(len(LAGS_S), np.nan)
    times, real = recorded.times_s[kept], tracked[kept]

    def r(lag_s: float) -> float:
        return pearson(real, np.interp(times + lag_s, predicted_times, predicted))

    return r(0.0), np.array([r(lag - recorded.offset_s) for lag in LAGS_S])


def _closures(
    words: list[tuple[float, float, str]], times_s: Float64Array, opening: Float64Array
) -> tuple[int, int, int, int]:
    """Closed at b/p words, all b/p words, closed at other words, all others (without m)."""
    met = wanted = false = others = 0
    for start_s, _, word in words:
        if word in ("sil", "sp", "") or word[0] == "m":
            continue
        near = np.abs(times_s - start_s) <= CLOSURE_WINDOW_S
        if not near.any():
            continue
        closed = bool(opening[near].min() < TRACKED_CLOSED)
        if word[0] in "bp":
            wanted, met = wanted + 1, met + closed
        else:
            others, false = others + 1, false + closed
    return met, wanted, false, others


def _seals(
    recorded: TrackedMouth, opening_mm: Float64Array, fps: float
) -> tuple[int, int, int] | tuple[None, None, None]:
    """Short closures at a p, b or m, elsewhere, and such phones without one; None if unknown."""
    if recorded.phones is None:
        return None, None, None
    wanted = [(a, b) for a, b, phone in recorded.phones if mouth_class(phone) == "bilabial"]
    seals = [(a / fps, b / fps) for a, b in short_runs(opening_mm < CLOSED_MM, fps)]

    def meets(one: tuple[float, float], many: list[tuple[float, float]]) -> bool:
        return any(
            one[0] <= b + WIDE_TOLERANCE_S and a <= one[1] + WIDE_TOLERANCE_S for a, b in many
        )

    right = sum(meets(seal, wanted) for seal in seals)
    return right, len(seals) - right, sum(not meets(phone, seals) for phone in wanted)


def evaluate_tracked_mouths(
    folder: str | Path,
    predict: MouthPredictor,
    eye_distance_mm: float,
    *,
    names: list[str] | None = None,
    speech: SpeechFinder = heard_speech,
    progress: Callable[[float], None] | None = None,
) -> TrackedMouthReport:
    """Measure a predictor on tracked recordings; this is `elocute evaluate real`.

    Parameters
    ----------
    folder : str or Path
        In either layout of `tracked_mouths`.
    predict : callable
        Takes a sound file and gives Curves of the mouth, as from `measure_as_tracked`.
    eye_distance_mm : float
        Distance of the outer eye corners of the predicted head, mm.
    names : list of str, optional
        Recordings to take; all by default.
    speech : callable, optional
        Takes a sound file and tells where somebody speaks; by default as the encoder hears it.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Returns
    -------
    TrackedMouthReport
        Groups and single recordings.

    Raises
    ------
    InputError
        For a recording that is missing or cannot be used.
    """
    clips: list[TrackedClip] = find_tracked_mouths(folder, names)
    mouths = []
    for done, clip in enumerate(clips, 1):
        recorded = read_tracked_mouth(clip)
        predicted = predict(recorded.sound)
        speaking = speech(recorded.sound)
        mouths.append(measure_tracked_mouth(recorded, predicted, eye_distance_mm, speaking))
        if progress:
            progress(done / len(clips))
    return TrackedMouthReport(_groups(mouths), [mouth.score for mouth in mouths])


def _groups(mouths: list[MeasuredMouth]) -> list[GroupScore]:
    groups = [group_score(ALL, mouths)]
    if len({mouth.score.talker for mouth in mouths}) == 1:
        return groups
    for kind in ("language", "talker"):
        for name in sorted({getattr(mouth.score, kind) for mouth in mouths} - {""}):
            chosen = [mouth for mouth in mouths if getattr(mouth.score, kind) == name]
            groups.append(group_score(f"{kind} {name}", chosen))
    return groups
