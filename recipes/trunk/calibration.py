"""From the trunk's mouth to millimetres on the head: sizes of movement as people have them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np

from elocute.array_types import Float64Array
from elocute.encoders.phones_and_visemes import SILENCE
from elocute.encoders.trunk import AHEAD
from elocute.head.builtin import load_builtin_head
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.mouth_measures import TRACKED_RESTING, measure_as_tracked
from recipes.trunk.judging import answers
from recipes.trunk.mouths import FIELDS, ROW_RATE, MouthClip, TalkerMouth
from recipes.trunk.network import Trunk

QUANTILES = (2, 10, 25, 50, 75, 90, 98, 99.5)
REST_ROWS = 15  # of rest that a clip must have to tell what speech differs from
SPEECH_ROWS = 15
PEAKS = 1.12  # of openings beyond the median, which a network that is unsure makes too small


def calibrate(
    trunk: Trunk, sources: Sequence[Sequence[MouthClip]], talkers: Sequence[TalkerMouth]
) -> dict[str, list]:
    """`middle_mm`, `spread_mm` and `opening_map` of `elocute.models.talkers`.

    A network that is unsure moves less than people do, and it is surer of some than of others.
    Each measure is widened by how much more people move in their clips, the geometric mean over
    the sources of clips; it lies as far from rest as people's do, the mean over them. The opening
    is given the distribution of the middle of people, quantile by quantile.
    """
    head = load_builtin_head()
    eyes_mm = 1000 * head.eye_distance_m
    still = Curves(np.zeros((1, 1), np.float32), ("jawOpen",), 1.0)
    rest = measure_as_tracked(motion_from_curves(head, still)).values[0]
    spoken = [_spoken(trunk, clips) for clips in sources]
    told_means = [np.mean([each.mean(axis=0) for each, *_ in clips], axis=0) for clips in spoken]
    moved = [np.nanmean([clip[2] for clip in clips], axis=0) * eyes_mm for clips in spoken]
    wider = [_deviation(1, clips) * eyes_mm / _deviation(0, clips) for clips in spoken]
    spread = np.exp(np.mean(np.log(wider), axis=0))
    middle = rest + np.mean(moved, axis=0) - spread * np.mean(told_means, axis=0)
    told, deviations = (np.concatenate([c[k][:, 0] for c in chain(*spoken)]) for k in (0, 3))
    knots = np.percentile(told, QUANTILES)
    mean, deviation = np.median([(one.mean[0], one.deviation[0]) for one in talkers], axis=0)
    gaps = mean + deviation * np.percentile(deviations, QUANTILES)
    values = eyes_mm * (gaps - TRACKED_RESTING)
    median = values[QUANTILES.index(50)]
    values += (PEAKS - 1) * np.maximum(values - median, 0)
    return {
        "middle_mm": np.round(middle, 3).tolist(),
        "spread_mm": np.round(spread, 3).tolist(),
        "opening_map": np.round([knots, np.maximum.accumulate(values)], 4).tolist(),
    }


def _deviation(k: int, clips: Sequence[tuple[Float64Array, ...]]) -> Float64Array:
    """(field,) root mean square of what differs from each clip's mean."""
    apart = np.concatenate([clip[k] - clip[k].mean(axis=0) for clip in clips])
    return apart.std(axis=0)


def _spoken(trunk: Trunk, clips: Sequence[MouthClip]) -> list[tuple[Float64Array, ...]]:
    """Of the rows in which somebody speaks, clip by clip: the network's measures, the person's,
    the mean of how far the person's are from rest (NaN where the clip has none), and the person's
    in deviations."""
    found = []
    for clip in clips:
        mouth, phones = answers(trunk, clip.samples, AHEAD)
        silence = np.exp(phones[:, SILENCE])
        inside, resting = clip.known & (silence < 0.5), clip.known & (silence > 0.9)
        if inside.sum() < SPEECH_ROWS:
            continue
        times = np.arange(len(silence)) / ROW_RATE
        rows = np.stack([np.interp(times, clip.times_s, each) for each in clip.tracked.T], axis=1)
        rest = np.median(rows[resting], axis=0) if resting.sum() >= REST_ROWS else np.nan
        told = mouth[inside, : len(FIELDS)].astype(np.float64)
        found.append((told, rows[inside], (rows[inside] - rest).mean(axis=0), clip.targets[inside]))
    return found
