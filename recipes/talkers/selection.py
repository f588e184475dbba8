"""What networks are chosen by: talkers that none of them learned from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array
from elocute.motion.mouth_measures import MEASURES
from elocute.networks.talkers import TalkerNet
from recipes.talkers.clips import Clip, TalkerSpeech, by_talker
from recipes.talkers.fit import fit_at, told_by

EVERY, FIRST = 4, 3  # of the talkers by number of clips, those held out
SENTENCES_EVERY = 10  # of the sentences, sorted by name
LAGS_S = tuple(round(lag, 2) for lag in np.arange(-0.08, 0.081, 0.02))
QUANTILES = (2, 10, 25, 50, 75, 90, 98, 99.5)
GAIN_MOST = 1.3
PEAKS = 1.12  # of openings beyond the median: a finished model's 99th percentile was 0.87 of that
# of held-out talkers, and 0.93 of held-out sentences


def split_talkers(clips: Sequence[Clip]) -> tuple[list[Clip], list[Clip]]:
    """Clips to learn from, and those of talkers held out."""
    count = {talker: len(own) for talker, own in by_talker(clips).items()}
    ranked = sorted(count, key=lambda talker: (-count[talker], talker))
    held = set(ranked[FIRST::EVERY])
    return (
        [clip for clip in clips if clip.talker not in held],
        [clip for clip in clips if clip.talker in held],
    )


def split_sentences(clips: Sequence[Clip]) -> tuple[list[Clip], list[Clip]]:
    """Sentences to learn from, and those held out."""
    ordered = sorted(clips, key=lambda clip: clip.name)
    held = {clip.name for clip in ordered[::SENTENCES_EVERY]}
    return (
        [clip for clip in ordered if clip.name not in held],
        [clip for clip in ordered if clip.name in held],
    )


def correlations(networks: Sequence[TalkerNet], clips: Sequence[Clip]) -> dict[str, float]:
    """Mean over talkers of the correlation of each measure, at one lag a talker."""
    found = {}
    for measure, name in enumerate(MEASURES):
        best = []
        for own in by_talker(clips).values():
            tracks = [told_by(networks, clip.inputs)[:, measure] for clip in own]
            fits = [
                np.mean([fit_at(c, t, measure, lag) for c, t in zip(own, tracks, strict=True)])
                for lag in LAGS_S
            ]
            best.append(max(fits))
        found[name] = float(np.mean(best))
    return found


@dataclass(frozen=True, eq=False)
class Calibration:
    """From the network's outputs to millimetres on the head, as the model's record has it."""

    middle_mm: Float64Array
    spread_mm: Float64Array
    opening_map: Float64Array

    def record(self) -> dict[str, list]:
        """For JSON."""
        return {
            "middle_mm": np.round(self.middle_mm, 3).tolist(),
            "spread_mm": np.round(self.spread_mm, 3).tolist(),
            "opening_map": np.round(self.opening_map, 4).tolist(),
        }


def calibrate(
    networks: Sequence[TalkerNet],
    held: Sequence[Clip],
    speech: Mapping[str, TalkerSpeech],
    middle_of_rules_mm: Float64Array,
    eye_distance_mm: float,
) -> Calibration:
    """Sizes of movement as people have them: the median talker's, told from held-out talkers.

    A network that is unsure moves less than people do. Each measure is widened to their deviation;
    the opening is given their distribution, quantile by quantile.
    """
    mean = np.median([one.mean for one in speech.values()], axis=0)
    deviation = np.median([one.deviation for one in speech.values()], axis=0) * eye_distance_mm
    told, true = [], []
    for clip in held:
        inside = clip.known & clip.speaking
        told.append(told_by(networks, clip.inputs)[inside])
        true.append(clip.targets[inside])
    mine, theirs = np.concatenate(told), np.concatenate(true)
    gain = np.minimum(theirs[:, :-1].std(axis=0) / mine[:, :-1].std(axis=0), GAIN_MOST)
    centre = mine[:, :-1].mean(axis=0)
    middle = middle_of_rules_mm - gain * deviation * centre
    opening_mm = mean[0] * eye_distance_mm
    knots = np.percentile(mine[:, 0], QUANTILES)
    values = opening_mm + deviation[0] * np.percentile(theirs[:, 0], QUANTILES)
    median = values[QUANTILES.index(50)]
    values += (PEAKS - 1) * np.maximum(values - median, 0)
    return Calibration(middle, gain * deviation, np.stack([knots, np.maximum.accumulate(values)]))
