"""From the trunk's mouth to millimetres on the head: sizes of movement as people have them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.phones_and_visemes import SILENCE
from elocute.head.builtin import load_builtin_head
from elocute.models.feature_extraction import extract_features
from elocute.models.talkers import TalkersModel
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.mouth_measures import TRACKED_RESTING, measure_as_tracked
from recipes.trunk.mouths import FIELDS, ROW_RATE, MouthClip

ROWS_LEAST = 15  # of speech that a clip must have, and of rest to tell what speech differs from


@dataclass(frozen=True, eq=False)
class Spoken:
    """Rows of a clip in which somebody speaks.

    Attributes
    ----------
    predicted : (row, field) float64
        The network's measures, in deviations.
    tracked : (row, field) float64
        The person's, in distances of the outer eye corners.
    moved : (field,) float64
        The mean of how far the person's are from rest; NaN where the clip has none.
    """

    predicted: Float64Array
    tracked: Float64Array
    moved: Float64Array


def calibrate(
    model: TalkersModel, strangers: Sequence[MouthClip], everybody: Sequence[Sequence[MouthClip]]
) -> dict[str, list[float]]:
    """`middle_mm` and `spread_mm` of `elocute.models.talkers`.

    strangers: clips of people from whom the network did not learn; everybody: of whom it did, by
    source, those whom it hears best last. A network that is unsure moves less than people do, and
    it is surer of some than of others. Each measure is widened by how much more people move, the
    geometric mean over strangers and those heard best; it lies as far from rest as theirs do, the
    mean over both. An opening is widened for those heard best alone, or it would be too wide for
    them, and is at the median what people's are, the mean over the sources of everybody.
    """
    head = load_builtin_head()
    eyes_mm = 1000 * head.eye_distance_m
    still = Curves(np.zeros((1, 1), np.float32), ("jawOpen",), 1.0)
    rest = measure_as_tracked(motion_from_curves(head, still)).values[0]
    heard = [[one for clip in clips if (one := _spoken(model, clip))] for clips in everybody]
    spoken = [[one for clip in strangers if (one := _spoken(model, clip))], heard[-1]]
    means = [np.mean([one.predicted.mean(axis=0) for one in clips], axis=0) for clips in spoken]
    moved = [np.nanmean([one.moved for one in clips], axis=0) * eyes_mm for clips in spoken]
    wider = [
        _deviation([one.tracked for one in clips])
        * eyes_mm
        / _deviation([one.predicted for one in clips])
        for clips in spoken
    ]
    spread = np.exp(np.mean(np.log(wider), axis=0))
    middle = rest + np.mean(moved, axis=0) - spread * np.mean(means, axis=0)
    openings = [
        np.concatenate([(one.predicted[:, 0], one.tracked[:, 0]) for one in clips], axis=1)
        for clips in heard
    ]
    predicted, seen = openings[-1]
    spread[0] = eyes_mm * seen.std() / predicted.std()
    medians_mm = [np.median(each, axis=1) * (1, eyes_mm) for each in openings]
    middle[0] = np.mean([there - spread[0] * told for told, there in medians_mm])
    middle[0] -= eyes_mm * TRACKED_RESTING
    return {
        "middle_mm": np.round(middle, 3).tolist(),
        "spread_mm": np.round(spread, 3).tolist(),
    }


def _deviation(rows: Sequence[Float64Array]) -> Float64Array:
    """(field,) root mean square of what differs from each clip's mean."""
    return np.concatenate([each - each.mean(axis=0) for each in rows]).std(axis=0)


def _spoken(model: TalkersModel, clip: MouthClip) -> Spoken | None:
    """What was said and seen of a clip; None where that is little."""
    speech, _ = extract_features(model, Waveform(clip.samples, SPEECH_RATE))
    assert speech.phones is not None
    silence = np.exp(speech.phones.values[:, SILENCE])
    times = np.arange(len(silence)) / ROW_RATE
    known = (times >= clip.times_s[0]) & (times <= clip.times_s[-1])
    inside, resting = known & (silence < 0.5), known & (silence > 0.9)
    if inside.sum() < ROWS_LEAST:
        return None
    seen = np.stack([np.interp(times, clip.times_s, each) for each in clip.tracked.T], axis=1)
    enough = resting.sum() >= ROWS_LEAST
    rest = np.median(seen[resting], axis=0) if enough else np.full(len(FIELDS), np.nan)
    predicted = speech.features.values[: len(times)][inside, : len(FIELDS)].astype(np.float64)
    return Spoken(predicted, seen[inside], (seen[inside] - rest).mean(axis=0))
