"""How loud a voice is, beside its loudest so far, at the rate of the phones.

Everything is causal and block-wise, so a stream gives exactly what a whole sound gives.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.audio.waveform import SPEECH_RATE

ROW_RATE = 50.0
ROW = round(SPEECH_RATE / ROW_RATE)  # samples
HALF_WINDOW = 200  # samples around a row's time
FLOOR_DB = -50.0  # speech is louder than this
DECAY_DB = 1.5 / ROW_RATE  # in a row: for so long a loud word counts
SMOOTHED_ROWS = 5  # a click is no speech
BESIDE = SMOOTHED_ROWS // 2
COLUMNS = 2


class Loudness:
    """Samples at 16 kHz in, rows at 50 Hz out; `flush` ends the sound.

    A row has the loudness in dB of full scale, and the loudest of the smoothed loudness so far,
    which is forgotten by 1.5 dB a second. Row k is centred on sample 320·k; n samples give
    ceil(n / 320) rows, however they are cut.
    """

    def __init__(self) -> None:
        self._pending = np.zeros(HALF_WINDOW, np.float32)
        self._loudness: NDArray[np.float64] = np.zeros(0)  # from BESIDE before the next row on
        self._loudest = FLOOR_DB
        self._samples = self._rows = 0

    def push(self, samples: NDArray[np.float32]) -> NDArray[np.float32]:
        """(sample,) at 16 kHz; returns the (row, 2) that are now certain."""
        self._samples += len(samples)
        self._pending = np.concatenate([self._pending, np.asarray(samples, np.float32)])
        self._measure(max(0, (len(self._pending) - 2 * HALF_WINDOW) // ROW + 1))
        return self._take(max(0, len(self._loudness) - 2 * BESIDE))

    def flush(self) -> NDArray[np.float32]:
        """The last rows, silence behind them."""
        left = -(-self._samples // ROW) - self._rows
        if left <= 0:
            return np.zeros((0, COLUMNS), np.float32)
        self._pending = np.concatenate([self._pending, np.zeros(2 * HALF_WINDOW, np.float32)])
        self._measure(left - max(0, len(self._loudness) - BESIDE))
        after = np.repeat(self._loudness[-1:], BESIDE)
        self._loudness = np.concatenate([self._loudness, after])
        return self._take(left)

    def _measure(self, count: int) -> None:
        """Loudness of so many more rows."""
        if count <= 0:
            return
        views = np.lib.stride_tricks.sliding_window_view(self._pending, 2 * HALF_WINDOW)
        power = (views[::ROW][:count].astype(np.float64) ** 2).mean(axis=1)
        found = 10 * np.log10(power + 1e-9)
        before = np.repeat(found[:1], BESIDE if not len(self._loudness) else 0)
        self._loudness = np.concatenate([self._loudness, before, found])
        self._pending = self._pending[count * ROW :]

    def _take(self, count: int) -> NDArray[np.float32]:
        if not count:
            return np.zeros((0, COLUMNS), np.float32)
        window = np.ones(SMOOTHED_ROWS) / SMOOTHED_ROWS
        smoothed = np.convolve(self._loudness[: count + 2 * BESIDE], window, "valid")
        rows = np.empty((count, COLUMNS), np.float32)
        rows[:, 0] = self._loudness[BESIDE : BESIDE + count]
        for place, loudness in enumerate(smoothed):
            self._loudest = max(self._loudest - DECAY_DB, float(loudness), FLOOR_DB)
            rows[place, 1] = self._loudest
        self._loudness = self._loudness[count:]
        self._rows += count
        return rows
