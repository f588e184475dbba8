"""The spectrum of a sound in a few bands, at the rate of the phones: what a sound is like.

Causal and block-wise, so a stream gives what a whole sound gives.
"""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.front_end import BANDS as FINE_BANDS
from elocute.audio.front_end import FFT, WINDOW, mel_weights, power_scale
from elocute.audio.loudness import ROW
from elocute.numerics.windows import hann

BANDS = 16
FLOOR = 1e-9  # power below it is silence: -90 dB of full scale


class BandLevels:
    """Samples at 16 kHz in, rows at 50 Hz out; `flush` ends the sound.

    A row has the natural logarithms of the power in `BANDS` mel bands. Row k is centred on sample
    320·k; n samples give ceil(n / 320) rows, however they are cut.
    """

    def __init__(self) -> None:
        self._window = hann(WINDOW).astype(np.float32)
        fine = mel_weights() * np.float32(power_scale())
        self._filters = fine.reshape(len(fine), BANDS, FINE_BANDS // BANDS).sum(axis=2)
        self._pending = np.zeros(WINDOW // 2, np.float32)
        self._samples = self._rows = 0

    def push(self, samples: Float32Array) -> Float32Array:
        """(sample,) at 16 kHz; returns the (row, band) that are now certain."""
        self._samples += len(samples)
        self._pending = np.concatenate([self._pending, np.asarray(samples, np.float32)])
        return self._take(max(0, (len(self._pending) - WINDOW) // ROW + 1))

    def flush(self) -> Float32Array:
        """The last rows, silence behind them."""
        self._pending = np.concatenate([self._pending, np.zeros(WINDOW + ROW, np.float32)])
        return self._take(-(-self._samples // ROW) - self._rows)

    def _take(self, count: int) -> Float32Array:
        if count <= 0:
            return np.zeros((0, BANDS), np.float32)
        views = np.lib.stride_tricks.sliding_window_view(self._pending, WINDOW)[::ROW][:count]
        power = np.abs(np.fft.rfft(views * self._window, FFT, axis=1)) ** 2
        self._pending = self._pending[count * ROW :]
        self._rows += count
        return np.log(power @ self._filters + FLOOR).astype(np.float32)
