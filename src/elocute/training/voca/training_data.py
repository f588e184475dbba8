"""What the training loop reads: features, targets and styles of all clips, one after another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import torch
from torch import Tensor

from elocute.audio.features import Features
from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_store import Corpus
from elocute.networks.voca import WINDOW
from elocute.training.corpus_data import (
    CorpusData,
    MotionSpace,
    Progress,
    check_finite,
    clip_sound,
    clip_style,
    clip_targets,
    load_parts,
)
from elocute.training.epochs import Report
from elocute.training.voca.settings import VocaTrainConfig

Encode = Callable[[Waveform], Features]


@dataclass(frozen=True, eq=False)
class TrainingFrames:
    """Clips one after another, each padded with the zeros that its windows reach into.

    features: (place, feature), WINDOW - 1 places more than frames for every clip. targets: (frame,
    output), what the network is to give. places: (frame,), where the window of a frame begins in
    `features`. subjects: (frame,), number of the speaker's style, -1 for a speaker without one.
    pairs: (pair,), frames whose predecessor belongs to the same clip.
    """

    features: Tensor
    targets: Tensor
    places: Tensor
    subjects: Tensor
    pairs: Tensor

    def windows(self, frames: Tensor) -> Tensor:
        """(batch, WINDOW, feature)."""
        places = self.places[frames][:, None]
        return self.features[places + torch.arange(WINDOW, device=places.device)]

    def to(self, device: torch.device | str) -> TrainingFrames:
        """The same frames on a device."""
        return TrainingFrames(*(value.to(device) for value in vars(self).values()))


def load_frames(
    corpus: Corpus,
    encode: Encode,
    names: Sequence[str],
    styles: Sequence[str],
    space: MotionSpace | None,
    progress: Progress | None = None,
) -> TrainingFrames:
    """Features and motion of every clip; without a `space`, targets are vertices in mm.

    Raises CorpusError naming the clip where sound and motion do not fit or numbers are not
    finite.
    """
    features, targets, places, subjects, pairs = [], [], [], [], []
    place = frame = 0
    for index, name in enumerate(names):
        values = clip_features(corpus, name, encode)
        target = clip_targets(corpus, name, space)
        check_finite(name, values, target)
        count, before = len(target), WINDOW // 2
        features.append(np.pad(values, ((before, WINDOW - 1 - before), (0, 0))))
        targets.append(target)
        places.append(np.arange(place, place + count))
        subjects.append(np.full(count, clip_style(corpus, name, styles)))
        pairs.append(np.arange(frame + 1, frame + count))
        place, frame = place + count + WINDOW - 1, frame + count
        if progress:
            progress((index + 1) / len(names))
    joined = [np.concatenate(part) for part in (features, targets, places, subjects, pairs)]
    return TrainingFrames(*(torch.from_numpy(part) for part in joined))


VocaTrainingData = CorpusData[TrainingFrames]


def prepare(
    corpus: Corpus,
    config: VocaTrainConfig,
    encode: Encode,
    split: str = "default",
    report: Report | None = None,
) -> VocaTrainingData:
    """Encode a corpus once and hold everything that the training reads in memory.

    split: its subjects in `train` become the styles. Raises CorpusError for a split that the corpus
    lacks, a clip whose sound does not fit its motion, or motion or features that are not finite.
    """
    return load_parts(
        corpus,
        split,
        partial(load_frames, corpus, encode),
        reduced=config.reduced,
        doing="encoding the corpus",
        report=report,
    )


def clip_features(corpus: Corpus, name: str, encode: Encode) -> np.ndarray:
    """(frame, feature) at the corpus's frame rate, as many as the clip has frames of motion.

    Raises CorpusError where the sound is much shorter than the motion.
    """
    sound = clip_sound(corpus, name)
    return fit_length(encode(sound).resample(corpus.fps).values, corpus.entry(name).frames)


def fit_length(values: np.ndarray, count: int) -> np.ndarray:
    """(count, feature): cut, or the last row repeated."""
    missing = count - len(values)
    return np.pad(values, ((0, missing), (0, 0)), "edge") if missing > 0 else values[:count]
