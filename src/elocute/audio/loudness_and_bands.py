"""How loud a voice is, and in which bands, at the rate of the phones: what phones leave out.

Everything is causal and block-wise, so a stream gives exactly what a whole sound gives. The bands
are the speech encoder's (`front_end`), averaged; their slow mean is taken away, and with it level
and microphone. The loudness keeps its level, beside that of the loudest speech so far.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.audio.front_end import BANDS, FrontEnd
from elocute.audio.waveform import SPEECH_RATE

ROW_RATE = 50.0
ROW = round(SPEECH_RATE / ROW_RATE)  # samples
HALF_WINDOW = 200  # samples around a row's time
POOLED = 32  # bands
FLOOR_DB = -50.0  # speech is louder than this
DECAY_DB = 1.5 / ROW_RATE  # in a row: for so long a loud word counts
SMOOTHED_ROWS = 5  # a click is no speech
COLUMNS = 2 + POOLED
LOOKAHEAD_S = (SMOOTHED_ROWS // 2 + 1) / ROW_RATE + HALF_WINDOW / SPEECH_RATE
"""How much later than a row's own time the sound must be known."""


class LoudnessAndBands:
    """Samples at 16 kHz in, rows at 50 Hz out; `flush` ends the sound.

    A row has the loudness in dB of full scale, the loudest of the smoothed loudness so far (which
    is forgotten by 1.5 dB a second), and `POOLED` log-mel bands relative to their running mean.
    Row k is centred on sample 320·k; n samples give ceil(n / 320) rows, however they are cut.
    """

    def __init__(self) -> None:
        self._front_end = FrontEnd()
        self._bands = np.zeros((0, BANDS), np.float32)
        self._pending = np.zeros(HALF_WINDOW, np.float32)
        self._loudness: NDArray[np.float64] = np.zeros(0)  # of rows that are kept
        self._smoothed_ahead = 0  # rows of it that lie before the next row
        self._loudest = FLOOR_DB
        self._samples = self._rows = 0

    def push(self, samples: NDArray[np.float32]) -> NDArray[np.float32]:
        """(sample,) at 16 kHz; returns the (row, COLUMNS) that are now certain."""
        self._samples += len(samples)
        self._pending = np.concatenate([self._pending, np.asarray(samples, np.float32)])
        self._bands = np.concatenate([self._bands, self._front_end.push(samples)])
        self._measure(max(0, (len(self._pending) - 2 * HALF_WINDOW) // ROW + 1))
        ready = len(self._loudness) - self._smoothed_ahead - SMOOTHED_ROWS // 2
        return self._take(max(0, min(ready, len(self._bands) // 2)))

    def flush(self) -> NDArray[np.float32]:
        """The last rows, silence behind them."""
        left = -(-self._samples // ROW) - self._rows
        if left <= 0:
            return np.zeros((0, COLUMNS), np.float32)
        self._pending = np.concatenate([self._pending, np.zeros(2 * HALF_WINDOW, np.float32)])
        self._measure(left - (len(self._loudness) - self._smoothed_ahead))
        after = np.repeat(self._loudness[-1:], SMOOTHED_ROWS // 2)
        self._loudness = np.concatenate([self._loudness, after])
        bands = np.concatenate([self._bands, self._front_end.flush()])
        short = max(0, 2 * left - len(bands))
        self._bands = np.concatenate([bands, np.repeat(bands[-1:], short, axis=0)])
        return self._take(left)

    def _measure(self, count: int) -> None:
        """Loudness of so many more rows."""
        if count <= 0:
            return
        views = np.lib.stride_tricks.sliding_window_view(self._pending, 2 * HALF_WINDOW)
        power = (views[::ROW][:count].astype(np.float64) ** 2).mean(axis=1)
        found = 10 * np.log10(power + 1e-9)
        if not len(self._loudness):
            found = np.concatenate([np.repeat(found[:1], SMOOTHED_ROWS // 2), found])
            self._smoothed_ahead = SMOOTHED_ROWS // 2
        self._loudness = np.concatenate([self._loudness, found])
        self._pending = self._pending[count * ROW :]

    def _take(self, count: int) -> NDArray[np.float32]:
        if not count:
            return np.zeros((0, COLUMNS), np.float32)
        ahead = self._smoothed_ahead
        window = np.ones(SMOOTHED_ROWS) / SMOOTHED_ROWS
        smoothed = np.convolve(self._loudness[: count + 2 * (SMOOTHED_ROWS // 2)], window, "valid")
        rows = np.empty((count, COLUMNS), np.float32)
        rows[:, 0] = self._loudness[ahead : ahead + count]
        for place, loudness in enumerate(smoothed):
            self._loudest = max(self._loudest - DECAY_DB, float(loudness), FLOOR_DB)
            rows[place, 1] = self._loudest
        pooled = self._bands[: 2 * count].reshape(count, 2, POOLED, BANDS // POOLED)
        rows[:, 2:] = pooled.mean(axis=(1, 3))
        self._loudness, self._bands = self._loudness[count:], self._bands[2 * count :]
        self._rows += count
        return rows
