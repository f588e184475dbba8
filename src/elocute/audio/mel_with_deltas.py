"""Log-mel windows with derivatives, the second paper's input: 41 x 128 x 3 per video frame.

128 log-mel bands of 20 ms windows every 10 ms, over 400 ms around each video frame, with their
first and second time derivatives (Tzirakis et al. 2019, section 5). Sound is taken at 44.1 kHz,
its mean removed and its peak set to one.

The paper leaves open: the logarithm (taken here, natural), the mel scale (HTK's), the FFT (2048
points, so that the lowest of 128 bands is no emptier than the rest), the derivatives (the slope
of a line fitted to five windows, per 10 ms) and the ends (silence beyond them).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.audio.spectral import mel_filterbank
from elocute.audio.waveform import Waveform
from elocute.errors import InputError
from elocute.numerics.spectra import hann
from elocute.one_line_repr import one_line

RATE = 44100
BANDS = 128
WINDOW, HOP, FFT = 882, 441, 2048  # 20 ms, 10 ms
CONTEXT = 20  # windows on each side of the middle one: 41 in all
FLOOR = 1e-6  # mel power, about 107 dB below a sine of the peak that the sound has
REACH = 2  # windows on each side that a derivative is fitted to
MARGIN = 2 * REACH  # columns beyond a window that derivatives of derivatives look at
BLOCK = 500  # windows whose spectra are held at once
SILENT_PEAK = 1e-6  # what rounding leaves of a constant is no sound


@dataclass(frozen=True, eq=False)
class MelDeltas:
    """The windows of all video frames, each computed once.

    Parameters
    ----------
    values : (window, 128, 3) float32
        Log-mel bands with their first and second derivative.
    index : (frame, 41)
        The windows that each video frame sees.
    """

    values: NDArray[np.float32]
    index: NDArray[np.intp]

    __repr__ = one_line

    def __len__(self) -> int:
        return len(self.index)

    def windows(self, first: int = 0, last: int | None = None) -> NDArray[np.float32]:
        """(frame, 41, 128, 3) of video frames `first` up to before `last`."""
        return self.values[self.index[first:last]]


def mel_deltas(waveform: Waveform, fps: float = 30.0) -> MelDeltas:
    """Log-mel windows with derivatives around each video frame, exact to the sample.

    Video frames whose windows fall on the same samples share them: at 30 frames per second that is
    300 windows a second instead of 1230.

    Parameters
    ----------
    waveform : Waveform
        Resampled to 44.1 kHz, its mean removed and its peak set to one.
    fps : float
        Video frames per second, up to 100; frame i is centred on i / fps.

    Returns
    -------
    MelDeltas

    Raises
    ------
    InputError
        For a frame rate out of range.

    References
    ----------
    Tzirakis et al. 2019, section 5.
    """
    _check_fps(fps)
    samples = _normalised(waveform)
    count = max(1, round(waveform.duration_s * fps))
    middles = np.round(np.arange(count) * RATE / fps).astype(np.intp)
    taps = middles[:, None] + HOP * np.arange(-CONTEXT, CONTEXT + 1)
    places, index = np.unique(taps, return_inverse=True)
    return MelDeltas(_with_slopes(samples, places), index.reshape(taps.shape))


@dataclass(frozen=True, eq=False)
class MelColumns:
    """Log-mel bands on a grid of 10 ms, and where the window of each video frame begins in it.

    Parameters
    ----------
    static : (column, 128) float32
        Windows of 41 columns, with MARGIN more on both sides.
    starts : (frame,) int64
        The first of the 41 + 2 · MARGIN columns that a video frame needs.
    """

    static: NDArray[np.float32]
    starts: NDArray[np.int64]

    __repr__ = one_line


def column_starts(count: int, fps: float, first: int = 0) -> NDArray[np.int64]:
    """(frame,) the grid's column nearest to frames `first` … of `fps`, 0 being frame 0's."""
    return np.floor(np.arange(first, first + count) * (RATE / HOP / fps) + 0.5).astype(np.int64)


def mel_columns(waveform: Waveform, fps: float = 30.0) -> MelColumns:
    """What `mel_deltas` computes before its derivatives, every video frame on the nearest 10 ms.

    Windows of neighbouring frames then share all their columns: 100 a second instead of 300, for
    5 ms at most between a frame and the middle of its window. Frames on the grid (each third one
    at 30 a second) see exactly what `mel_deltas` gives. Raises InputError.
    """
    _check_fps(fps)
    count = max(1, round(waveform.duration_s * fps))
    starts = column_starts(count, fps)
    middles = HOP * np.arange(-CONTEXT - MARGIN, int(starts[-1]) + CONTEXT + MARGIN + 1)
    return MelColumns(log_mel_at(_normalised(waveform), middles), starts)


def mel_delta_windows(waveform: Waveform, fps: float = 30.0) -> NDArray[np.float32]:
    """(frame, 41, 128, 3) of a whole sound: 1.9 MB for each second of it at 30 frames a second."""
    return mel_deltas(waveform, fps).windows()


def slopes(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """(…, time, band) → (…, time - 4, band): Σ n·(x[t+n] - x[t-n]) / (2 Σ n²), n = 1, 2."""
    time = values.shape[-2]
    steps = range(1, REACH + 1)
    weighted = [
        n
        * (
            values[..., REACH + n : time - REACH + n, :]
            - values[..., REACH - n : time - REACH - n, :]
        )
        for n in steps
    ]
    return np.sum(weighted, axis=0) / (2 * sum(n * n for n in steps))


def _check_fps(fps: float) -> None:
    if not (np.isfinite(fps) and 0 < fps <= RATE / HOP):
        raise InputError.about("fps", found=f"{fps}", allowed=f"above 0, up to {RATE / HOP:g}")


def _normalised(waveform: Waveform) -> NDArray[np.float32]:
    """At 44.1 kHz, without its mean, peak one; silence stays silence."""
    samples = waveform.resample(RATE).samples
    samples = samples - np.float32(samples.mean(dtype=np.float64))
    peak = float(np.abs(samples).max())
    return samples / np.float32(peak) if peak > SILENT_PEAK else np.zeros_like(samples)


def _with_slopes(samples: NDArray[np.float32], places: NDArray[np.intp]) -> NDArray[np.float32]:
    """(window, 128, 3) of windows centred on `places`."""
    # Derivatives of derivatives look twice as far.
    around = places[:, None] + HOP * np.arange(-2 * REACH, 2 * REACH + 1)
    known, where = np.unique(around, return_inverse=True)
    where = where.reshape(around.shape)
    static = log_mel_at(samples, known)
    out = np.empty((len(places), BANDS, 3), np.float32)
    for at in range(0, len(places), BLOCK):
        near = static[where[at : at + BLOCK]]
        first = slopes(near)
        out[at : at + BLOCK, :, 0] = near[:, 2 * REACH]
        out[at : at + BLOCK, :, 1] = first[:, REACH]
        out[at : at + BLOCK, :, 2] = slopes(first)[:, 0]
    return out


def log_mel_at(
    samples: NDArray[np.float32], middles: NDArray[np.integer], floor: float = FLOOR
) -> NDArray[np.float32]:
    """(window, 128) of windows centred on the given samples, silence beyond both ends."""
    before = max(0, WINDOW // 2 - int(middles.min()))
    after = max(0, int(middles.max()) + WINDOW // 2 - len(samples))
    views = np.lib.stride_tricks.sliding_window_view(np.pad(samples, (before, after)), WINDOW)
    starts = middles + before - WINDOW // 2
    window = hann(WINDOW).astype(np.float32)
    filters = mel_filterbank(RATE, FFT, BANDS).T.astype(np.float32)
    out = np.empty((len(middles), BANDS), np.float32)
    for at in range(0, len(middles), BLOCK):
        spectrum = np.fft.rfft(views[starts[at : at + BLOCK]] * window, FFT)
        power = (spectrum.real**2 + spectrum.imag**2).astype(np.float32)
        out[at : at + BLOCK] = np.log(np.maximum(power @ filters, floor))
    return out
