"""Speech as a view to be aligned: an encoder's features and their slopes."""

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
"""Natural logarithm below the maximum at which features are clipped: 35 dB of power."""


def speech_view(waveform: Waveform, encoder: str = DEFAULT) -> NDArray[np.float32]:
    """Features of speech to be aligned, normalised so that voice and microphone count for little.

    Parameters
    ----------
    waveform
        The sound, at any rate.
    encoder
        Name of a speech encoder: fbank, phones, or one with a file or folder.

    Returns
    -------
    ndarray
        (frame, 2 · feature) at 50 Hz: features and their slopes, each of mean 0 and deviation 1.

    Raises
    ------
    AlignmentError
        For silence.
    InputError
        For an unknown encoder.
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
