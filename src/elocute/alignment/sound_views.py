"""Sound as a view to be aligned: an encoder's features and how they change."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.audio.mel_with_deltas import REACH, slopes
from elocute.audio.waveform import Waveform
from elocute.encoders.registry import resolve_encoder
from elocute.errors import AlignmentError

DEFAULT = "fbank"
SILENT_DEVIATION = 1e-3  # of features in natural logarithms: nothing is said
FLOOR = -8.0
"""Log-posteriors and log-energies are not told apart below this: the loudest minus 35 dB."""


def speech_view(waveform: Waveform, encoder: str = DEFAULT) -> NDArray[np.float32]:
    """(frame, 2 · feature) at 50 Hz: features and their slopes, each of mean 0 and deviation 1.

    Normalised per clip, so that voice, microphone and loudness count for little. Raises
    AlignmentError for silence, InputError for an encoder that there is not.
    """
    values = resolve_encoder(encoder)(waveform).values
    values = np.maximum(values, values.max() + FLOOR)
    if values.std(axis=0).max() < SILENT_DEVIATION and len(values) > 1:
        raise AlignmentError.about(
            "sound",
            found=f"{waveform.duration_s:.2f} s in which nothing changes",
            allowed="speech",
            remedy="silence cannot be aligned",
        )
    padded = np.pad(values, ((REACH, REACH), (0, 0)), "edge")
    return np.concatenate([_normalised(values), _normalised(slopes(padded))], axis=1)


def _normalised(values: NDArray[np.floating]) -> NDArray[np.float32]:
    deviation = np.maximum(values.std(axis=0), SILENT_DEVIATION)
    return ((values - values.mean(axis=0)) / deviation).astype(np.float32)
