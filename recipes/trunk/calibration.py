"""From the trunk's mouth to millimetres on the head: sizes of movement as people have them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.articulation.phone_targets import curve_names
from elocute.audio.phones_and_visemes import SILENCE
from elocute.encoders.trunk import AHEAD
from elocute.head.builtin import load_builtin_head
from elocute.models.talkers import rule_curves
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.mouth_measures import MEASURES, measure_mouth
from elocute.motion.mouth_response import builtin_response
from elocute.networks.trunk import Trunk
from recipes.trunk.judging import answers
from recipes.trunk.mouths import ROW_RATE, MouthClip, TalkerMouth

QUANTILES = (2, 10, 25, 50, 75, 90, 98, 99.5)
GAIN_MOST = 1.3
REST_ROWS = 15  # of rest that a clip must have to tell what speech differs from
PEAKS = 1.12  # of openings beyond the median, which a network that is unsure makes too small


def calibrate(
    trunk: Trunk, clips: Sequence[MouthClip], talkers: Mapping[str, TalkerMouth]
) -> dict[str, list]:
    """The record of a model of talkers: `middle_mm`, `spread_mm` and `opening_map`.

    A network that is unsure moves less than people do. Each measure is widened to the deviation of
    the middle of people; the opening is given their distribution, quantile by quantile.
    """
    head = load_builtin_head()
    count, eyes_mm = len(MEASURES), 1000 * head.eye_distance_m
    mean = np.median([one.mean for one in talkers.values()], axis=0)[:count]
    deviation = np.median([one.deviation for one in talkers.values()], axis=0)[:count] * eyes_mm
    told, true, moved, ruled = (
        np.concatenate(part) for part in zip(*_spoken(trunk, clips), strict=True)
    )
    gain = np.minimum(true.std(axis=0) / told.std(axis=0), GAIN_MOST)
    speaking = ruled.mean(axis=0)
    # Width and jaw are people's own: how they differ from rest in speech. Tracked depth is weak.
    rest = measure_mouth(
        motion_from_curves(head, Curves(np.zeros((1, 1), np.float32), ("jawOpen",), 1.0))
    )
    for name in ("width_mm", "jaw_mm"):
        place = MEASURES.index(name)
        speaking[place] = rest[name][0] + np.nanmean(moved[:, place]) * eyes_mm
    middle = speaking - gain * deviation * told.mean(axis=0)
    knots = np.percentile(told[:, 0], QUANTILES)
    values = mean[0] * eyes_mm + deviation[0] * np.percentile(true[:, 0], QUANTILES)
    median = values[QUANTILES.index(50)]
    values += (PEAKS - 1) * np.maximum(values - median, 0)
    return {
        "middle_mm": np.round(middle, 3).tolist(),
        "spread_mm": np.round(gain * deviation, 3).tolist(),
        "opening_map": np.round([knots, np.maximum.accumulate(values)], 4).tolist(),
    }


def _spoken(
    trunk: Trunk, clips: Sequence[MouthClip]
) -> Iterator[tuple[Float32Array, Float32Array, Float64Array, Float64Array]]:
    """Of the rows in which somebody speaks: the network's measures, the person's, how far the
    person's are from those at rest in the clip (NaN where it has none), the rules' in mm."""
    response, count = builtin_response(curve_names()), len(MEASURES)
    for clip in clips:
        mouth, phones = answers(trunk, clip.samples, AHEAD)
        silence = np.exp(phones[:, SILENCE])
        inside, resting = clip.known & (silence < 0.5), clip.known & (silence > 0.9)
        ruled = response.measures(rule_curves(phones, 0, 0, len(phones)))
        rows = np.stack(
            [
                np.interp(np.arange(len(silence)) / ROW_RATE, clip.times_s, column)
                for column in clip.tracked[:, :count].T
            ],
            axis=1,
        )
        rest = np.median(rows[resting], axis=0) if resting.sum() >= REST_ROWS else np.nan
        yield (
            mouth[inside, :count],
            clip.targets[inside, :count],
            rows[inside] - rest,
            ruled[inside],
        )
