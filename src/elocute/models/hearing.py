"""A whole sound as a model hears it, decoded once."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.audio.features import Features
from elocute.audio.waveform import Waveform
from elocute.models.ears import KnownPhones, Phones
from elocute.models.protocol import Ear, Ears, Heard, SpeechModel

Array = NDArray[np.float32]
Progress = Callable[[float], None]
"""Called with the share of the work done, 0…1."""


@dataclass(frozen=True, eq=False)
class SoundBlocks:
    """A sound that is read once: its rate, and blocks with the share of the whole they end at."""

    sample_rate: int
    blocks: Iterable[tuple[Array, float]]


def blocks_of(sound: Waveform) -> SoundBlocks:
    """A sound in memory as one block."""
    return SoundBlocks(sound.sample_rate, [(sound.samples, 1.0)])


def hear(
    model: SpeechModel,
    sound: Waveform | SoundBlocks,
    *,
    contacts: bool = True,
    phones: Phones | None = None,
    progress: Progress | None = None,
) -> tuple[Heard, float]:
    """What a model hears of a sound, and the sound's length in seconds.

    contacts  also hear what `curves` need, not only `weights`
    phones    their times, where they are known: heard instead of asking the encoder

    Raises AudioError, ModelError, MachineError.
    """
    source = blocks_of(sound) if isinstance(sound, Waveform) else sound
    level = None
    if model.needs_whole:
        whole = Waveform(np.concatenate([block for block, _ in source.blocks]), source.sample_rate)
        source, level = blocks_of(whole), model.level_of(whole)
    ears = model.ears(source.sample_rate, contacts=contacts, level=level)
    if phones is not None:
        ears = _told(ears, KnownPhones(source.sample_rate, phones))
    listeners = [ear for ear in (ears.features, ears.phones) if ear is not None]
    rows: list[list[Array]] = [[] for _ in listeners]
    samples = 0
    for block, share in source.blocks:
        samples += len(block)
        for ear, known in zip(listeners, rows, strict=True):
            known.append(ear.push(block))
        if progress:
            progress(share)
    features = [
        Features(np.concatenate([*known, ear.flush()]), ear.rate, ear.name)
        for ear, known in zip(listeners, rows, strict=True)
    ]
    heard = Heard(features[0], features[-1] if ears.phones is not None else None)
    return heard, samples / source.sample_rate


def _told(ears: Ears, known: Ear) -> Ears:
    """Ears whose phones are known."""
    if ears.features.name == "phones":
        ears = replace(ears, features=known)
    return ears if ears.phones is None else replace(ears, phones=known)
