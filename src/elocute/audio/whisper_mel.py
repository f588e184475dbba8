"""Log-mel energies as Whisper's encoder takes them, computed as the sound comes in.

Whisper clips its bands 80 dB below the loudest of the whole sound. Here it is the loudest so far,
and never less than that of quiet speech, so that a stream gives what a whole file gives.
"""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.waveform import SPEECH_RATE
from elocute.numerics.spectra import hann, mel_points, triangles

HOP = 160  # 10 ms
WINDOW = 400  # 25 ms
TOGETHER = 4  # frames: sums of a product depend on how many rows it has
LIVE_TOGETHER = 2  # where sound is answered at once
BANDS = 80
FLOOR = 1e-10  # power of silence
RANGE = 8.0  # decades of power below the loudest, under which nothing is heard
QUIET = 0.0  # decades: the loudest band of quiet speech
LEAST = (QUIET - RANGE + 4) / 4
"""What silence gives before anything louder than quiet speech was heard."""


def lookahead_s(together: int = TOGETHER) -> float:
    """How much later than its middle the sound of a frame must be known, s: half a window, and what
    is waited for."""
    return (WINDOW / 2 + (together - 1) * HOP) / SPEECH_RATE


def mel_weights() -> Float32Array:
    """(201, 80) triangular filters on Slaney's mel scale, each of one area in Hz."""
    corners = mel_points(0.0, SPEECH_RATE / 2, BANDS + 2, "slaney")
    places = np.linspace(0, SPEECH_RATE / 2, WINDOW // 2 + 1)
    areas = 2 / (corners[2:] - corners[:-2])
    return (triangles(corners, places) * areas[:, None]).T.astype(np.float32)


def scaled(decades: Float32Array, loudest: Float32Array) -> Float32Array:
    """Log-10 powers as Whisper scales them: clipped `RANGE` below the loudest, about -1 to 1.5."""
    clipped = np.maximum(decades, loudest - np.float32(RANGE))
    return ((clipped + np.float32(4)) / np.float32(4)).astype(np.float32)


class WhisperMel:
    """Samples in, bands out; `flush` ends the sound. How it is cut changes no bit.

    Frames are (frame, 80) float32, frame t centred on sample 160·t; `together` of them are
    computed, and so waited for, together. A sound of n samples gives ceil(n / 160) frames, however
    it is cut into pieces. `peaks` are the loudest bands of the frames that the last call gave, in
    decades of power.
    """

    def __init__(self, together: int = TOGETHER) -> None:
        self._together = together
        self._window, self._mel = hann(WINDOW).astype(np.float32), mel_weights()
        self._pending = np.zeros(WINDOW // 2, np.float32)
        self._samples = self._frames = 0
        self._loudest = np.float32(QUIET)
        self.peaks = np.zeros(0, np.float32)

    def push(self, samples: Float32Array) -> Float32Array:
        """Bands of every frame whose window is now complete."""
        self._samples += len(samples)
        self._pending = np.concatenate([self._pending, np.asarray(samples, np.float32)])
        ready = max(0, (len(self._pending) - WINDOW) // HOP + 1)
        return self._take(ready // self._together * self._together)

    def flush(self) -> Float32Array:
        """The last frames, silence behind them."""
        left = -(-self._samples // HOP) - self._frames
        more = WINDOW + (self._together + 1) * HOP
        self._pending = np.concatenate([self._pending, np.zeros(more, np.float32)])
        bands = self._take(-(-left // self._together) * self._together)
        self.peaks = self.peaks[:left]
        return bands[:left]

    def _take(self, count: int) -> Float32Array:
        self.peaks = np.zeros(0, np.float32)
        if not count:
            return np.zeros((0, BANDS), np.float32)
        views = np.lib.stride_tricks.sliding_window_view(self._pending, WINDOW)[::HOP][:count]
        spectrum = np.fft.rfft(views * self._window).astype(np.complex64)
        power = spectrum.real**2 + spectrum.imag**2
        bands = (power.reshape(-1, self._together, power.shape[1]) @ self._mel).reshape(
            count, BANDS
        )
        decades = np.log10(np.maximum(bands, np.float32(FLOOR)))
        self.peaks = decades.max(axis=1)
        loudest = np.maximum.accumulate(np.append(self._loudest, self.peaks))[1:]
        self._loudest = loudest[-1]
        self._pending = self._pending[count * HOP :]
        self._frames += count
        return scaled(decades, loudest[:, None])
