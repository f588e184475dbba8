"""A predicted mouth against a real talker's, tracked in video.

A folder holds `NAME.ogg` (or another sound) and `NAME.npz` with `t` (s), `inner_opening_mean`
and `lip_width` (in units of the outer eye-corner distance), `valid` and `words`, a JSON text of
[start s, end s, word]. The predictor is a plain callable, so any model can be measured.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.corpus.importers.grid import FIELDS_MAX_BYTES
from elocute.errors import InputError
from elocute.files.array_reading import read_npz
from elocute.files.json_records import parse_json
from elocute.motion.curves import Curves
from elocute.motion.mouth_measures import TRACKED_CLOSED
from elocute.numerics.correlation import pearson
from elocute.one_line_repr import one_line

MouthPredictor = Callable[[Path], Curves]
"""Sound file to `opening_mm, width_mm, …` as `measure_mouth` gives them."""

SOUNDS = (".ogg", ".wav", ".flac", ".mp3", ".m4a", ".opus")
LAG_MAX_S = 0.120
LAG_STEP_S = 0.020
# Around a word's start. With this window the tracked talker himself closes at 0.99 of his b/p
# words and 0.46 of the others.
CLOSURE_WINDOW_S = 0.080
TRACKED_FIELDS = ("t", "inner_opening_mean", "lip_width", "valid")
FIELDS = frozenset((*TRACKED_FIELDS, "words"))


@dataclass(frozen=True, eq=False)
class TrackedMouth:
    """The mouth of one tracked recording.

    Attributes
    ----------
    name : str
        Of the recording.
    sound : Path
        The sound beside it.
    times_s : (frame,) float64
        Time of each frame, s.
    opening, width : (frame,) float64
        Gap between the inner lips and width of the mouth, in units of the outer eye-corner
        distance.
    valid : (frame,) bool
        Whether the mouth was seen.
    words : list of (float, float, str)
        Start in s, end in s and word.
    """

    name: str
    sound: Path
    times_s: Float64Array
    opening: Float64Array
    width: Float64Array
    valid: NDArray[np.bool_]
    words: list[tuple[float, float, str]]

    __repr__ = one_line


@dataclass(frozen=True)
class MouthScore:
    """One predicted mouth against its recording.

    Attributes
    ----------
    name : str
        Of the recording.
    opening_r, width_r : float
        Pearson's correlation at no lag.
    opening_best_r, width_best_r : float
        The highest correlation within ±`LAG_MAX_S`.
    opening_lag_s : float
        The lag of that of the opening, s; positive where the prediction is late.
    closures_met, closures : int
        Words with b or p at whose start the predicted mouth closes, and all of them.
    false_met, others : int
        The same of other words, but for those with m.
    real_closures_met, real_false_met : int
        As `closures_met` and `false_met`, of the recorded mouth.
    """

    name: str
    opening_r: float
    opening_best_r: float
    opening_lag_s: float
    width_r: float
    width_best_r: float
    closures_met: int
    closures: int
    false_met: int
    others: int
    real_closures_met: int
    real_false_met: int


@dataclass(frozen=True)
class MeanMouthScore:
    """Means over recordings, with closures pooled over words.

    Attributes
    ----------
    takes : int
        Number of recordings.
    opening_r, opening_best_r, width_r, width_best_r : float
        Mean correlations.
    opening_lag_s : float
        Median lag, s.
    closure_recall, real_closure_recall : float
        Share of words with b or p at which the predicted, or the recorded, mouth closes; higher is
        better.
    false_closure, real_false_closure : float
        The same of other words; lower is better.
    """

    takes: int
    opening_r: float
    opening_best_r: float
    opening_lag_s: float
    width_r: float
    width_best_r: float
    closure_recall: float
    false_closure: float
    real_closure_recall: float
    real_false_closure: float


def find_tracked_mouths(folder: str | Path, names: list[str] | None = None) -> list[Path]:
    """Find the recordings of a folder.

    Parameters
    ----------
    folder : str or Path
        The folder.
    names : list of str, optional
        Recordings to take; all by default.

    Returns
    -------
    list of Path
        Their `.npz` files, sorted, or in the order of `names`.

    Raises
    ------
    InputError
        Where there is none, or one is missing.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError.about(folder, found="no folder", allowed="a folder of NAME.npz and sound")
    if names is None:
        paths = sorted(folder.glob("*.npz"))
    else:
        paths = [folder / f"{Path(name).name}.npz" for name in names]
    missing = [path for path in paths if not path.is_file()]
    if missing or not paths:
        found = f"{missing[0].name} is missing" if missing else "no .npz file"
        raise InputError.about(folder, found=found, allowed="NAME.npz with NAME.ogg beside it")
    return paths


def read_tracked_mouth(path: Path) -> TrackedMouth:
    """Read one recording.

    Parameters
    ----------
    path : Path
        Its `.npz`.

    Returns
    -------
    TrackedMouth
        The recorded mouth.

    Raises
    ------
    InputError
        For a missing field or sound, too few valid frames, or numbers that are not finite.
    """
    sound = next((s for s in (path.with_suffix(x) for x in SOUNDS) if s.is_file()), None)
    if sound is None:
        raise InputError.about(path, found="no sound beside it", allowed=" ".join(SOUNDS))
    allowed = "a short recording with the fields of grid_s1"
    fields = read_npz(path, max_bytes=FIELDS_MAX_BYTES, allowed=allowed, only=FIELDS)
    try:
        times_s, opening, width, valid = (
            np.asarray(fields[name], float) for name in TRACKED_FIELDS
        )
        rows = parse_json(str(fields["words"]), path, allowed=allowed)
        words = [(float(a), float(b), str(w)) for a, b, w in rows]
    except (KeyError, ValueError, TypeError) as error:
        raise InputError.about(
            path, found=f"no tracked mouth in it ({str(error)[:120]})", allowed=allowed
        ) from error
    tracks, seen = (times_s, opening, width), valid > 0.5
    if any(track.shape != valid.shape or track.ndim != 1 for track in tracks) or seen.sum() < 10:
        raise InputError.about(path, found="too few valid frames", allowed="10 frames or more")
    if not (np.isfinite(times_s).all() and all(np.isfinite(t[seen]).all() for t in tracks)):
        raise InputError.about(path, found="NaN or infinity in it", allowed="finite numbers")
    return TrackedMouth(path.stem, sound, times_s, opening, width, seen, words)


def score_mouth(recorded: TrackedMouth, predicted: Curves, eye_distance_mm: float) -> MouthScore:
    """Compare a prediction with its recording.

    Parameters
    ----------
    recorded : TrackedMouth
        The recording.
    predicted : Curves
        `opening_mm` and `width_mm`, as from `measure_mouth`.
    eye_distance_mm : float
        Distance of the outer eye corners of the predicted head, mm.

    Returns
    -------
    MouthScore
        Of this recording.
    """
    predicted_times = np.arange(len(predicted.values)) / predicted.fps
    opening = predicted["opening_mm"].astype(float) / eye_distance_mm
    width = predicted["width_mm"].astype(float) / eye_distance_mm
    opening_r, opening_best, lag_s = _correlate(
        recorded, recorded.opening, predicted_times, opening
    )
    width_r, width_best, _ = _correlate(recorded, recorded.width, predicted_times, width)
    met = _closures(recorded.words, predicted_times, opening)
    real = _closures(
        recorded.words, recorded.times_s[recorded.valid], recorded.opening[recorded.valid]
    )
    return MouthScore(
        recorded.name,
        opening_r,
        opening_best,
        lag_s,
        width_r,
        width_best,
        *met,
        real_closures_met=real[0],
        real_false_met=real[2],
    )


def mean_mouth_score(scores: list[MouthScore]) -> MeanMouthScore:
    """Means over recordings, with closures pooled over words.

    Parameters
    ----------
    scores : list of MouthScore
        One or more.

    Returns
    -------
    MeanMouthScore
        Of all recordings.
    """

    def mean(field: str) -> float:
        return float(np.nanmean([getattr(score, field) for score in scores]))

    def share(met: str, of: str) -> float:
        total = sum(getattr(score, of) for score in scores)
        return sum(getattr(score, met) for score in scores) / total if total else float("nan")

    return MeanMouthScore(
        takes=len(scores),
        opening_r=mean("opening_r"),
        opening_best_r=mean("opening_best_r"),
        opening_lag_s=float(np.median([score.opening_lag_s for score in scores])),
        width_r=mean("width_r"),
        width_best_r=mean("width_best_r"),
        closure_recall=share("closures_met", "closures"),
        false_closure=share("false_met", "others"),
        real_closure_recall=share("real_closures_met", "closures"),
        real_false_closure=share("real_false_met", "others"),
    )


def _correlate(
    recorded: TrackedMouth,
    tracked: Float64Array,
    predicted_times: Float64Array,
    predicted: Float64Array,
) -> tuple[float, float, float]:
    """Pearson r at no lag, the best r within ±LAG_MAX_S, and its lag (s, positive: late)."""
    times, real = recorded.times_s[recorded.valid], tracked[recorded.valid]
    steps = round(LAG_MAX_S / LAG_STEP_S)
    lags = np.arange(-steps, steps + 1) * LAG_STEP_S
    rs = [pearson(real, np.interp(times + lag, predicted_times, predicted)) for lag in lags]
    best = int(np.argmax(rs))
    return rs[steps], rs[best], float(lags[best])


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


def evaluate_tracked_mouths(
    folder: str | Path,
    predict: MouthPredictor,
    eye_distance_mm: float,
    *,
    names: list[str] | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[MeanMouthScore, list[MouthScore]]:
    """Measure a predictor on a folder of tracked recordings; this is `elocute evaluate real`.

    Parameters
    ----------
    folder : str or Path
        As the module describes it.
    predict : callable
        Takes a sound file and gives Curves of the mouth, as from `measure_mouth`.
    eye_distance_mm : float
        Distance of the outer eye corners of the predicted head, mm.
    names : list of str, optional
        Recordings to take; all by default.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Returns
    -------
    summary : MeanMouthScore
        Means over recordings.
    scores : list of MouthScore
        One for each recording.

    Raises
    ------
    InputError
        For a recording that is missing or cannot be used.
    """
    paths = find_tracked_mouths(folder, names)
    scores = []
    for done, path in enumerate(paths, 1):
        recorded = read_tracked_mouth(path)
        scores.append(score_mouth(recorded, predict(recorded.sound), eye_distance_mm))
        if progress:
            progress(done / len(paths))
    return mean_mouth_score(scores), scores
