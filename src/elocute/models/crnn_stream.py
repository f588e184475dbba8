"""Sound to the recurrent model and back: whole, or in pieces as it comes in.

There is one way through: a whole sound is a stream fed once, so cutting makes no difference. A
window looks 0.25 s ahead, and a stream answers so much later.

The model hears sound whose peak is one and whose mean is zero. Of a whole sound both are known.
A live one's peak is the loudest so far, never less than LEAST_PEAK, so that silence is not made
loud; its mean is left alone, as sound cards remove it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.audio.mel_with_deltas import (
    BANDS,
    CONTEXT,
    FLOOR,
    HOP,
    MARGIN,
    RATE,
    SILENT_PEAK,
    WINDOW,
    column_starts,
    log_mel_at,
)
from elocute.audio.waveform import Waveform
from elocute.errors import ModelError
from elocute.models.crnn_network import SPAN, CrnnNetwork
from elocute.models.ears import Resampled

Array = NDArray[np.float32]
BLOCK = 10 * RATE  # samples in one run: memory stays bounded
LEAST_PEAK = 0.1
TINY = 1e-30  # mel power, before the peak is known that FLOOR is relative to
PIECE = 15  # frames (in the wild 2019, section 6.4)
JOINS = ("state", "pieces")
SMOOTHING = (0.25, 0.5, 0.25)  # of the frames on both sides of a join


def whole_level(samples: Array) -> tuple[float, float]:
    """Mean and peak of a sound, as `audio.mel3` takes them; the peak of silence is infinite."""
    mean = np.float32(samples.mean(dtype=np.float64))
    peak = float(np.abs(samples - mean).max())
    return float(mean), peak if peak > SILENT_PEAK else float("inf")


def level_of(sound: Waveform) -> tuple[float, float]:
    """Mean and peak of a whole sound at the network's rate."""
    return whole_level(sound.resample(RATE).samples)


def stream_weights(model: CrnnNetwork, sound: Waveform, joins: str = "state") -> Array:
    """(frame, component) of a whole sound at the model's frame rate, its peak known.

    joins: "state" lets the LSTM remember all that was; "pieces" begins anew every 15 frames and
    smooths over the joins, as the paper does for sentences (section 6.4). Raises ModelError.
    """
    samples = sound.resample(RATE).samples
    stream = CrnnStream(model, RATE, joins, whole_level(samples))
    parts = [stream.push(samples[at : at + BLOCK]) for at in range(0, len(samples), BLOCK)]
    return np.concatenate([*parts, stream.flush(sound.duration_s)])


class CrnnStream:
    """Sound in pieces of any length to frames, each as soon as its window is whole.

    level  (mean, peak) of the whole sound where it is known, else None. Raises ModelError for
           joins that there are not.
    """

    def __init__(
        self,
        model: CrnnNetwork,
        sample_rate: int,
        joins: str = "state",
        level: tuple[float, float] | None = None,
    ) -> None:
        if joins not in JOINS:
            raise ModelError.about(f"joins {joins!r}", found="unknown", allowed=", ".join(JOINS))
        self._model, self._rate, self._joins = model, sample_rate, joins
        self._fps = model.record.fps
        self._columns = _Columns(level)
        self._resampled = Resampled(sample_rate, RATE)
        self._heard = 0  # samples that came in, at their own rate
        self._frame = 0
        self._state = model.rest
        self._held = np.zeros((0, model.record.outputs), np.float32)
        self._given = 0  # how many of the frames held were given out already

    name = "crnn"

    @property
    def rate(self) -> float:
        """Frames per second."""
        return self._fps

    def push(self, samples: Array) -> Array:
        """(frame, component) that are ready now, perhaps none."""
        self._heard += len(samples)
        self._columns.push(self._resampled.push(samples))
        ready = self._ready()
        return self._joined(self._answer(ready), last=False)

    def flush(self, duration_s: float | None = None) -> Array:
        """The frames that were waiting for sound that did not come: silence stands for it."""
        duration_s = self._heard / self._rate if duration_s is None else duration_s
        self._columns.push(self._resampled.push(np.zeros(0, np.float32), last=True))
        total = max(1, round(duration_s * self._fps))
        self._columns.finish(int(column_starts(1, self._fps, total - 1)[0]) + SPAN)
        return self._joined(self._answer(total), last=True)

    def _ready(self) -> int:
        """Frames whose windows are whole."""
        count = self._frame
        while int(column_starts(1, self._fps, count)[0]) + SPAN <= self._columns.end:
            count += 1
        return count

    def _answer(self, until: int) -> Array:
        parts = [np.zeros((0, self._model.record.outputs), np.float32)]
        while self._frame < until:
            step = until - self._frame
            if self._joins == "pieces":
                step = min(step, PIECE - self._frame % PIECE)
                if self._frame % PIECE == 0:
                    self._state = self._model.rest
            starts = column_starts(step, self._fps, self._frame)
            columns = self._columns.of(int(starts[0]), int(starts[-1]) + SPAN)
            weights, self._state = self._model.step(columns, starts - starts[0], self._state)
            parts.append(weights)
            self._frame += step
        self._columns.forget(int(column_starts(1, self._fps, self._frame)[0]))
        return np.concatenate(parts)

    def _joined(self, weights: Array, *, last: bool) -> Array:
        """Smooth the frames on both sides of every join of pieces.

        A frame waits for the one after it, and the one before stays until then, as it was.
        """
        if self._joins == "state":
            return weights
        held = np.concatenate([self._held, weights])
        first, smooth = self._frame - len(held), held.copy()
        for place in range(1, len(held) - 1):
            if (first + place) % PIECE in (0, PIECE - 1):
                smooth[place] = np.asarray(SMOOTHING, np.float32) @ held[place - 1 : place + 2]
        stop = len(held) if last else max(len(held) - 1, self._given)
        out = smooth[self._given : stop]
        kept = max(stop - 1, 0)
        self._held, self._given = held[kept:], stop - kept
        return out


class _Columns:
    """Log-mel columns of what has come in, those that are still needed."""

    def __init__(self, level: tuple[float, float] | None) -> None:
        self._level = level
        self._peak = LEAST_PEAK
        self._samples = np.zeros(0, np.float32)
        self._offset = 0  # of the first sample kept
        self._values = np.zeros((0, BANDS), np.float32)
        self._first = 0  # of the first column kept
        self._total = 0

    @property
    def end(self) -> int:
        return self._first + len(self._values)

    def push(self, samples: Array) -> None:
        mean = 0.0 if self._level is None else self._level[0]
        self._samples = np.concatenate([self._samples, samples - np.float32(mean)])
        self._total += len(samples)
        self._compute((self._total - WINDOW // 2) // HOP + CONTEXT + MARGIN + 1)

    def finish(self, end: int) -> None:
        """All columns up to `end`, silence after the sound."""
        self._compute(end)

    def of(self, start: int, end: int) -> Array:
        return self._values[start - self._first : end - self._first]

    def forget(self, start: int) -> None:
        """Columns before `start` are not asked for again."""
        drop = max(0, min(start, self.end) - self._first)
        self._values, self._first = self._values[drop:], self._first + drop

    def _compute(self, end: int) -> None:
        """Column c is centred on sample (c - 24) · HOP."""
        if end <= self.end:
            return
        middles = HOP * (np.arange(self.end, end) - CONTEXT - MARGIN)
        peaks = self._peaks(middles)
        values = log_mel_at(self._samples, middles - self._offset, floor=TINY)
        levelled = values - 2 * np.log(peaks)[:, None]
        self._values = np.concatenate(
            [self._values, np.maximum(levelled, np.log(FLOOR)).astype(np.float32)]
        )
        drop = max(0, HOP * (end - CONTEXT - MARGIN) - WINDOW // 2 - self._offset)
        self._samples, self._offset = (
            self._samples[drop:],
            self._offset + min(drop, len(self._samples)),
        )

    def _peaks(self, middles: NDArray[np.integer]) -> NDArray[np.float64]:
        """(column,) what a column's peak is: the whole sound's, or the loudest up to its end."""
        if self._level is not None:
            return np.full(len(middles), self._level[1])
        ends = np.clip(middles + WINDOW // 2 - self._offset, 0, len(self._samples))
        loud = np.maximum.accumulate(np.abs(self._samples)) if len(self._samples) else np.zeros(1)
        found = np.where(ends > 0, loud[np.maximum(ends - 1, 0)], 0.0)
        peaks = np.maximum.accumulate(np.maximum(found, self._peak))
        self._peak = float(peaks[-1])
        return peaks.astype(np.float64)
