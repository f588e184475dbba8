"""Autocorrelation of short windows of sound, the input of Karras et al. 2017 (section 3.2).

Sound at 16 kHz is cut into stretches of 16 ms every 8 ms. The mean of each is removed, a Hann
window laid over it, and the first 32 coefficients of its autocorrelation are kept: enough for
formants and for pitch. A face sees 64 of these rows, 520 ms, half of them before its time.

The paper scales a track so that it uses the full range; here sound is divided by its peak.
"""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array, FloatArray
from elocute.audio.waveform import SPEECH_RATE
from elocute.numerics.windows import hann

STRETCH, HOP = 256, 128  # samples: 16 ms, 8 ms
COEFFICIENTS = 32
ROW_RATE = SPEECH_RATE / HOP
"""Rows per second; row k is centred on k / ROW_RATE."""
WINDOW_ROWS = 64
FFT = 512  # no shorter than two stretches, so that the correlation does not wrap around
BLOCK = 8192  # rows whose spectra are held at once


def rows_in(samples: int) -> int:
    """Rows that hear any of so many samples at 16 kHz."""
    return -(-samples // HOP) + 1


def autocorrelation(samples: Float32Array, first: int, count: int) -> Float32Array:
    """Autocorrelation of stretches of a sound at 16 kHz, silence beyond both ends.

    Parameters
    ----------
    samples : (sample,) float32
        The sound.
    first, count : int
        The rows wanted: row k is centred on sample 128 k.

    Returns
    -------
    (row, 32) float32
        Sums of products, for lags of 0 to 31 samples.

    References
    ----------
    Karras et al. 2017, section 3.2.
    """
    if count < 1:
        return np.zeros((0, COEFFICIENTS), np.float32)
    begin, end = first * HOP - HOP, (first + count) * HOP
    inside = samples[max(begin, 0) : max(end, 0)]
    before = min(max(-begin, 0), end - begin)
    padded = np.pad(inside, (before, end - begin - before - len(inside)))
    stretches = np.lib.stride_tricks.sliding_window_view(padded, STRETCH)[::HOP]
    parts = [_correlate(stretches[at : at + BLOCK]) for at in range(0, count, BLOCK)]
    return np.concatenate(parts)


def _correlate(stretches: FloatArray) -> Float32Array:
    """(row, 32) of (row, 256)."""
    centred = stretches - stretches.mean(axis=1, keepdims=True, dtype=np.float64)
    spectrum = np.fft.rfft(centred * hann(STRETCH), FFT)
    power = spectrum.real**2 + spectrum.imag**2
    return np.fft.irfft(power, FFT)[:, :COEFFICIENTS].astype(np.float32)
