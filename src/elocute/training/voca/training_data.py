"""What the training loop reads: features, targets and styles of many clips in a row."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from elocute.audio.features import Features
from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_store import Corpus
from elocute.errors import CorpusError
from elocute.networks.voca import WINDOW
from elocute.training.voca.target_space import MotionSpace

Encode = Callable[[Waveform], Features]
Progress = Callable[[float], None]
LENGTH_TOLERANCE_S = 0.25  # sound may end this much before its motion


@dataclass(frozen=True, eq=False)
class Frames:
    """Clips one after another, each with the zeros that its windows reach into.

    features  (place, feature), WINDOW - 1 places more than frames for every clip
    targets   (frame, output)
    places    (frame,) where the window of a frame begins in `features`
    subjects  (frame,) the style that says it, -1 for somebody who is no style
    pairs     (pair,) frames whose predecessor belongs to the same clip
    """

    features: Tensor
    targets: Tensor
    places: Tensor
    subjects: Tensor
    pairs: Tensor

    def windows(self, frames: Tensor) -> Tensor:
        """(batch, WINDOW, feature)."""
        return self.features[self.places[frames][:, None] + torch.arange(WINDOW)]


def load_frames(
    corpus: Corpus,
    names: Sequence[str],
    styles: Sequence[str],
    encode: Encode,
    space: MotionSpace | None,
    progress: Progress | None = None,
) -> Frames:
    """Hear every clip and gather its motion; `space` None takes vertices in mm.

    Raises CorpusError naming the clip where sound and motion do not fit or numbers are not
    finite.
    """
    features, targets, places, subjects, pairs = [], [], [], [], []
    place = frame = 0
    for index, name in enumerate(names):
        values = clip_features(corpus, name, encode)
        target = _targets(corpus, name, space)
        if not (np.isfinite(values).all() and np.isfinite(target).all()):
            raise CorpusError.about(
                f"clip {name}", found="NaN or infinity", remedy="elocute corpus check"
            )
        count, subject = len(target), corpus.entry(name).subject
        before = WINDOW // 2
        features.append(np.pad(values, ((before, WINDOW - 1 - before), (0, 0))))
        targets.append(target)
        places.append(np.arange(place, place + count))
        subjects.append(np.full(count, styles.index(subject) if subject in styles else -1))
        pairs.append(np.arange(frame + 1, frame + count))
        place, frame = place + count + WINDOW - 1, frame + count
        if progress:
            progress((index + 1) / len(names))
    joined = [np.concatenate(part) for part in (features, targets, places, subjects, pairs)]
    return Frames(*(torch.from_numpy(part) for part in joined))


def clip_features(corpus: Corpus, name: str, encode: Encode) -> np.ndarray:
    """(frame, feature) at the corpus's frame rate, as many as the clip has frames of motion.

    Raises CorpusError where the sound is much shorter than the motion.
    """
    count = corpus.entry(name).frames
    sound = corpus.sound(name)
    if count / corpus.fps - sound.duration_s > LENGTH_TOLERANCE_S:
        raise CorpusError.about(
            f"clip {name}",
            found=f"{sound.duration_s:.2f} s of sound, {count / corpus.fps:.2f} s of motion",
            allowed=f"at most {LENGTH_TOLERANCE_S} s less",
            remedy="elocute corpus check",
        )
    return fit_length(encode(sound).resample(corpus.fps).values, count)


def fit_length(values: np.ndarray, count: int) -> np.ndarray:
    """(count, feature): cut, or the last row repeated."""
    missing = count - len(values)
    return np.pad(values, ((0, missing), (0, 0)), "edge") if missing > 0 else values[:count]


def _targets(corpus: Corpus, name: str, space: MotionSpace | None) -> np.ndarray:
    if space is not None:
        return space.coordinates(corpus, name)
    moved = corpus.displacements(name)
    return moved.reshape(len(moved), -1) * np.float32(1000)
