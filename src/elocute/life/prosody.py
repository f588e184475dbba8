"""What life is made from: level, pitch and tilt of the voice, row by row, as the sound comes in.

Rows are computed in batches that always begin at the same sample, so that cutting the sound into
other blocks gives the same numbers bit for bit.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from elocute.array_types import Float32Array, Float64Array
from elocute.audio.waveform import SPEECH_RATE
from elocute.numerics.spectra import hann

ROW_RATE = 100.0
"""Rows per second."""
HOP = int(SPEECH_RATE / ROW_RATE)
WINDOW = 768  # samples: two periods of the lowest voice
BATCH = 10  # rows
SPECTRUM = 1024  # at least a window and the longest lag
PITCH_HZ = (70.0, 400.0)
BAND_HZ = (60.0, 1500.0)  # the harmonics that show the pitch, without hum
BRIGHT_HZ = (1000.0, 5000.0)  # louder against what is below it with more effort
OCTAVE_COST = 0.03  # of periodicity, for each octave that a period is longer
LEAST_POWER = 1e-20  # of silence: far below any recording, so that levels are relative
LEVEL, PITCH, VOICING, TILT = range(4)
SILENT_ROW = (-200.0, 0.0, 0.0, 0.0)
PROSODY_S = (WINDOW / 2 + BATCH * HOP) / SPEECH_RATE
"""A row comes no later than this after its own time."""

_WINDOW = hann(WINDOW)
_LAGS = np.arange(int(SPEECH_RATE / PITCH_HZ[1]), int(SPEECH_RATE / PITCH_HZ[0]) + 1)
_HZ = np.fft.rfftfreq(SPECTRUM, 1 / SPEECH_RATE)
_HARMONICS = (BAND_HZ[0] <= _HZ) & (BAND_HZ[1] >= _HZ)
_AUDIBLE = slice(int(np.searchsorted(_HZ, BAND_HZ[0])), None)
_BRIGHT = slice(*np.searchsorted(_HZ, BRIGHT_HZ).tolist())
_DARK = slice(_AUDIBLE.start, _BRIGHT.start)
_OWN = np.fft.irfft(np.abs(np.fft.rfft(_WINDOW, SPECTRUM)) ** 2)
_OWN = _OWN[_LAGS[0] - 1 : _LAGS[-1] + 2] / _OWN[0]


class ProsodyStream:
    """Batches of rows of level (dB of full scale), pitch (semitones above 100 Hz), voicing, tilt.

    Row k is at k / `ROW_RATE`, as far as a row of a periodic sound tells: pitch is 0 where
    voicing, the periodicity from 0 to 1, is 0. Tilt is how much louder, in dB, the band is that
    grows with effort than what is below it.
    """

    def __init__(self) -> None:
        self._samples: Float64Array = np.zeros(WINDOW // 2)  # the first row is at the first sample

    def push(self, samples: Float32Array) -> Iterator[Float64Array]:
        """Take sound at 16 kHz; give the batches (row, 4) that are certain now."""
        self._samples = np.concatenate([self._samples, samples.astype(np.float64)])
        reach = (BATCH - 1) * HOP + WINDOW
        first = 0
        while first + reach <= len(self._samples):
            yield prosody_rows(self._samples[first : first + reach])
            first += BATCH * HOP
        self._samples = self._samples[first:]

    def flush(self) -> Iterator[Float64Array]:
        """End the sound: the batch that its last samples are in, with silence behind them."""
        if len(self._samples) > WINDOW // 2:
            missing = (BATCH - 1) * HOP + WINDOW
            yield from self.push(np.zeros(missing, np.float32))


def prosody_rows(samples: Float64Array) -> Float64Array:
    """Level, pitch, voicing and tilt of overlapping windows, by the autocorrelation of each.

    Samples (sample,) are at 16 kHz. The autocorrelation is divided by that of the window, and
    longer periods cost a little (Boersma, "Accurate short-term analysis of the fundamental
    frequency", 1993).

    Returns
    -------
    (row, 4) float64
        A row for each window that fits.
    """
    frames = sliding_window_view(samples, WINDOW)[::HOP] * _WINDOW
    power = np.abs(np.fft.rfft(frames, SPECTRUM, axis=1)) ** 2
    level = 10 * np.log10(power[:, _AUDIBLE].sum(axis=1) / (WINDOW * SPECTRUM) + LEAST_POWER)
    wave = np.fft.irfft(power * _HARMONICS, SPECTRUM, axis=1)
    energy = np.maximum(wave[:, :1], LEAST_POWER)
    likeness = wave[:, _LAGS[0] - 1 : _LAGS[-1] + 2] / energy / _OWN
    middle = likeness[:, 1:-1]
    peaks = (middle > likeness[:, :-2]) & (middle >= likeness[:, 2:])
    score = np.where(peaks, middle - OCTAVE_COST * np.log2(_LAGS / _LAGS[0]), -1.0)
    best = score.argmax(axis=1)
    rows = np.arange(len(frames))
    periodic = score[rows, best] > -1
    height = np.where(periodic, middle[rows, best], 0.0)
    voicing = np.clip((height - 0.35) / 0.35, 0, 1)
    lag = _LAGS[best] + _vertex(likeness, rows, best)
    pitch = np.where(voicing > 0, 12 * np.log2(SPEECH_RATE / lag / 100), 0.0)
    bright, dark = (power[:, band].sum(axis=1) + LEAST_POWER for band in (_BRIGHT, _DARK))
    return np.stack([level, pitch, voicing, 10 * np.log10(bright / dark)], axis=1)


def _vertex(values: Float64Array, rows: NDArray[np.intp], best: NDArray[np.intp]) -> Float64Array:
    """(row,) where the parabola through a peak (at column best + 1) is highest, from the peak."""
    before, at, after = (values[rows, best + step] for step in range(3))
    bend = np.minimum(before - 2 * at + after, -1e-9)
    return np.clip(0.5 * (before - after) / bend, -0.5, 0.5)
