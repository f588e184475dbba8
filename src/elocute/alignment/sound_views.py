"""Speech as a view to be aligned: an encoder's features and their slopes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.audio.mel_with_deltas import CONTEXT, MARGIN, REACH, mel_columns, slopes
from elocute.audio.waveform import Waveform
from elocute.encoders.protocol import FEATURE_RATE
from elocute.encoders.registry import resolve_encoder
from elocute.errors import AlignmentError

DEFAULT = "fbank"
COLUMNS = 2  # of 10 ms in a frame
SILENT_DEVIATION = 1e-3  # of features in natural logarithms: nothing is said
WINDOWS = "windows"
"""Instead of an encoder: columns of windows of 41 x 128 x 3, for `DcawConfig(windows=True)`."""
FLOOR = -8.0
"""Natural logarithm below the maximum at which features are clipped: 35 dB of power."""


def speech_view(waveform: Waveform, encoder: str = DEFAULT) -> NDArray[np.float32]:
    """Features of speech to be aligned, normalised so that voice and microphone count for little.

    Parameters
    ----------
    waveform
        The sound, at any rate.
    encoder
        Name of a speech encoder: fbank, phones, or one with a file or folder; or `windows`.

    Returns
    -------
    ndarray
        (frame, 2 · feature) at 50 Hz: features and their slopes, each of mean 0 and deviation 1.
        Of `windows` (frame, 2 · 128 · 3): columns of log-mel bands with first and second
        derivatives, two for each frame, of which windows of 41 are made (`networks.dcaw`).

    Raises
    ------
    AlignmentError
        For silence.
    InputError
        For an unknown encoder.
    """
    if encoder == WINDOWS:
        return _window_view(waveform)
    values = resolve_encoder(encoder)(waveform).values
    values = np.maximum(values, values.max() + FLOOR)
    _check_change(values, waveform)
    padded = np.pad(values, ((REACH, REACH), (0, 0)), "edge")
    return np.concatenate([_normalised(values), _normalised(slopes(padded))], axis=1)


def check_view_name(encoder: str) -> None:
    """Raise InputError for a name that `speech_view` does not know."""
    if encoder != WINDOWS:
        resolve_encoder(encoder)


def _window_view(waveform: Waveform) -> NDArray[np.float32]:
    """(frame, 2 · 128 · 3): the two columns of 10 ms that start each frame of 20 ms."""
    static = mel_columns(waveform, FEATURE_RATE).static
    inner = static[CONTEXT + MARGIN :]
    frames = max(1, round(waveform.duration_s * FEATURE_RATE))
    values = np.maximum(inner[: COLUMNS * frames], inner.max() + FLOOR)
    values = np.pad(values, ((0, COLUMNS * frames - len(values)), (0, 0)), "edge")
    _check_change(values, waveform)
    first = slopes(np.pad(values, ((MARGIN, MARGIN), (0, 0)), "edge"))
    channels = (values, first[REACH:-REACH], slopes(first))
    joined = np.stack([_normalised(channel) for channel in channels], axis=2)
    return joined.reshape(frames, -1)


def _check_change(values: NDArray[np.floating], waveform: Waveform) -> None:
    """Raise AlignmentError for silence."""
    if values.std(axis=0).max() < SILENT_DEVIATION and len(values) > 1:
        raise AlignmentError.about(
            "sound",
            found=f"{waveform.duration_s:.2f} s in which nothing changes",
            allowed="speech",
            remedy="silence cannot be aligned",
        )


def _normalised(values: NDArray[np.floating]) -> NDArray[np.float32]:
    deviation = np.maximum(values.std(axis=0), SILENT_DEVIATION)
    return ((values - values.mean(axis=0)) / deviation).astype(np.float32)
