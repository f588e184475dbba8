"""The recurrent network and the stream that feeds it sound. ONNX alone, no torch.

There is one way through: a whole sound is a stream fed once, so cutting makes no difference. A
window looks 0.25 s ahead, and a stream answers so much later.

It hears mel bands, as published, or the trunk's middle layer. Mel bands are those of sound whose
peak is one and whose mean is zero. Of a whole sound both are known. A live one's peak is the
loudest so far, never less than LEAST_PEAK, so that silence is not made loud; its mean is left
alone, as sound cards remove it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.audio.mel_with_deltas import (
    BANDS,
    CONTEXT,
    FLOOR,
    HOP,
    MARGIN,
    RATE,
    WINDOW,
    column_starts,
    log_mel_at,
)
from elocute.audio.resampling_stream import ResamplingStream
from elocute.audio.sound_level import samples_level
from elocute.audio.waveform import Waveform
from elocute.encoders.protocol import FEATURE_RATE
from elocute.encoders.trunk import builtin_trunk
from elocute.errors import ModelError
from elocute.models.crnn_encoders import ENCODERS, MEL
from elocute.models.feature_extraction import HeardMiddle, Hearing
from elocute.models.model_file import check_file, open_session, run_session, stored_record

SHIPPED = "crnn"
SHIPPED_PATH = Path(__file__).parent / "assets" / "crnn.onnx"
WINDOW_COLUMNS = 2 * (CONTEXT + MARGIN) + 1  # columns that one video frame needs
HIDDEN = 128
OUTPUTS_MAX = 10_000
BLOCK = 10 * RATE  # samples in one run: memory stays bounded
OWN_COLUMN = {MEL: CONTEXT + MARGIN, HeardMiddle.name: WINDOW_COLUMNS - 7}
"""Where in its window a frame's own time is: rows of the trunk have heard what comes after them."""
ROW_COLUMNS = round(RATE / HOP / FEATURE_RATE)  # for which a row of the trunk stands
STEP_S = 60.0
"""The network takes at most so much at a time, however much is known: 300 MB."""
LEAST_PEAK = 0.1
TINY = 1e-30  # mel power, before the peak is known that FLOOR is relative to
PIECE = 15  # frames (in the wild 2019, section 6.4)
JOINS = ("state", "pieces")
SMOOTHING = (0.25, 0.5, 0.25)  # of the frames on both sides of a join


@dataclass(frozen=True)
class CrnnRecord:
    """What training wrote into the file; topology names the head whose mesh it moves."""

    encoder: str
    fps: float
    outputs: int
    topology: str
    vertices: int
    note: str


def column_features(encoder: str) -> int:
    """Values in a column. Raises ValueError for no encoder of the recurrent model."""
    if encoder not in ENCODERS:
        raise ValueError(f"encoder {encoder[:80]}")
    return BANDS if encoder == MEL else builtin_trunk().answers["hidden"]


class CrnnNetwork:
    """The network that ships (`crnn`), or a trained one from an .onnx.

    A session may be given where the file was opened before.

    Raises
    ------
    ModelError
        For a file that is missing or too large; when the network is first used, for one that is
        not a recurrent model of Elocute.
    """

    def __init__(self, path: str | Path, session: Any = None) -> None:
        self.path = SHIPPED_PATH if str(path) == SHIPPED else Path(path)
        self._opened = session  # of the same file, where it was opened before
        check_file(self.path, "make one: elocute train crnn SHARDS SOUNDS -o FOLDER")

    @cached_property
    def session(self) -> Any:
        return self._opened or open_session(self.path)

    @cached_property
    def record(self) -> CrnnRecord:
        stored = stored_record(self.session)
        try:
            if stored["kind"] != "crnn":
                raise ValueError(stored["kind"])
            record = CrnnRecord(
                encoder=str(stored.get("encoder", MEL)),  # files of before have mel bands
                fps=float(stored["fps"]),
                outputs=int(stored["outputs"]),
                topology=str(stored["topology"]),
                vertices=int(stored["vertices"]),
                note=str(stored["note"]),
            )
            column_features(record.encoder)
            if not 1 <= record.fps <= RATE / HOP or record.vertices < 1:
                raise ValueError(f"fps {record.fps}")
            if not 1 <= record.outputs <= OUTPUTS_MAX:
                raise ValueError(f"{record.outputs} outputs")
            return record
        except (ValueError, KeyError, TypeError, OverflowError) as error:
            raise ModelError.about(
                self.path,
                found="an ONNX file without the record of a recurrent model",
                allowed="a model that elocute train crnn wrote",
            ) from error

    @cached_property
    def basis(self) -> Float32Array:
        """(component, vertex, 3) m of its weights. Raises ModelError."""
        silence = np.zeros((WINDOW_COLUMNS, column_features(self.record.encoder)), np.float32)
        basis = self._run(["basis"], silence, np.zeros(1, np.int64), self.rest)[0]
        if basis.shape != (self.record.outputs, self.record.vertices, 3):
            raise ModelError.about(
                self.path,
                found=f"a basis of shape {basis.shape}",
                allowed=str((self.record.outputs, self.record.vertices, 3)),
            )
        return basis

    @property
    def rest(self) -> tuple[Float32Array, Float32Array]:
        """The LSTM's state before the sound begins."""
        return np.zeros((1, 1, HIDDEN), np.float32), np.zeros((1, 1, HIDDEN), np.float32)

    def step(
        self,
        columns: Float32Array,
        starts: NDArray[np.int64],
        state: tuple[Float32Array, Float32Array],
    ) -> tuple[Float32Array, tuple[Float32Array, Float32Array]]:
        """(column, feature) and (frame,) first columns of windows to weights and state."""
        names = ["weights", "hidden_after", "cell_after"]
        weights, hidden, cell = self._run(names, columns, starts, state)
        if weights.shape != (len(starts), self.record.outputs):
            raise ModelError.about(
                self.path,
                found=f"weights of shape {weights.shape}",
                allowed=str((len(starts), self.record.outputs)),
            )
        return weights, (hidden, cell)

    def _run(
        self,
        names: list[str],
        columns: Float32Array,
        starts: NDArray[np.int64],
        state: tuple[Float32Array, Float32Array],
    ) -> list[Float32Array]:
        inputs = {"columns": columns, "starts": starts, "hidden": state[0], "cell": state[1]}
        return run_session(self.session, self.path, names, inputs)


def stream_weights(model: CrnnNetwork, sound: Waveform, joins: str = "state") -> Float32Array:
    """The weights of a whole sound, normalised by its peak (Tzirakis et al. 2019, section 6.4).

    With joins "state" the LSTM remembers everything before; "pieces" restarts it every 15 frames
    and smooths over the joins, as the paper does for sentences. Raises ModelError for other joins,
    and for a file that is no such network.

    Returns
    -------
    (frame, component) float32
        At the model's frame rate.
    """
    if model.record.encoder == MEL:
        sound = sound.resample(RATE)
    samples = sound.samples
    stream = CrnnStream(model, sound.sample_rate, joins, samples_level(samples))
    parts = [stream.push(samples[at : at + BLOCK]) for at in range(0, len(samples), BLOCK)]
    return np.concatenate([*parts, stream.flush(sound.duration_s)])


class CrnnStream:
    """Sound in blocks of any length to frames of weights, each as soon as its window is complete.

    With joins "state" the LSTM's state is carried on; "pieces" restarts it every 15 frames and
    smooths the joins; ModelError is raised for others. Mel bands are relative to the level, mean
    and peak of the whole sound, where that is known. `hearing` is that of the trunk, where its
    phones are wanted too.
    """

    def __init__(
        self,
        model: CrnnNetwork,
        sample_rate: int,
        joins: str = "state",
        level: tuple[float, float] | None = None,
        hearing: Hearing | None = None,
    ) -> None:
        if joins not in JOINS:
            raise ModelError.about(f"joins {joins!r}", found="unknown", allowed=", ".join(JOINS))
        self._model, self._rate, self._joins = model, sample_rate, joins
        self._fps = model.record.fps
        self._columns, self._middle = _Columns(level), None
        if model.record.encoder != MEL:
            hearing = hearing or Hearing(builtin_trunk(), sample_rate, phones=False)
            self._columns, self._middle = HeardColumns(), HeardMiddle(hearing)
        self._resampled = ResamplingStream(sample_rate, RATE)
        self._samples_in = 0  # samples that came in, at their own rate
        self._frame = 0
        self._state = model.rest
        self._held = np.zeros((0, model.record.outputs), np.float32)
        self._given = 0  # how many of the frames held were given out already

    name = "crnn"

    @property
    def rate(self) -> float:
        """Frames per second."""
        return self._fps

    def push(self, samples: Float32Array) -> Float32Array:
        """(frame, component) that are ready now, perhaps none."""
        self._samples_in += len(samples)
        heard = self._middle or self._resampled
        self._columns.push(heard.push(samples))
        ready = self._ready()
        return self._joined(self._answer(ready), last=False)

    def flush(self, duration_s: float | None = None) -> Float32Array:
        """The frames that were waiting for sound that did not come: silence stands for it."""
        duration_s = self._samples_in / self._rate if duration_s is None else duration_s
        if self._middle:
            self._columns.push(self._middle.flush())
        else:
            self._columns.push(self._resampled.push(np.zeros(0, np.float32), last=True))
        total = max(1, round(duration_s * self._fps))
        self._columns.finish(int(column_starts(1, self._fps, total - 1)[0]) + WINDOW_COLUMNS)
        return self._joined(self._answer(total), last=True)

    def _ready(self) -> int:
        """Frames whose windows are whole."""
        count = self._frame
        while int(column_starts(1, self._fps, count)[0]) + WINDOW_COLUMNS <= self._columns.end:
            count += 1
        return count

    def _answer(self, until: int) -> Float32Array:
        parts = [np.zeros((0, self._model.record.outputs), np.float32)]
        while self._frame < until:
            step = min(until - self._frame, max(1, round(STEP_S * self._fps)))
            if self._joins == "pieces":
                step = min(step, PIECE - self._frame % PIECE)
                if self._frame % PIECE == 0:
                    self._state = self._model.rest
            starts = column_starts(step, self._fps, self._frame)
            columns = self._columns.of(int(starts[0]), int(starts[-1]) + WINDOW_COLUMNS)
            weights, self._state = self._model.step(columns, starts - starts[0], self._state)
            parts.append(weights)
            self._frame += step
        self._columns.forget(int(column_starts(1, self._fps, self._frame)[0]))
        return np.concatenate(parts)

    def _joined(self, weights: Float32Array, *, last: bool) -> Float32Array:
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

    def push(self, samples: Float32Array) -> None:
        mean = 0.0 if self._level is None else self._level[0]
        self._samples = np.concatenate([self._samples, samples - np.float32(mean)])
        self._total += len(samples)
        self._compute((self._total - WINDOW // 2) // HOP + CONTEXT + MARGIN + 1)

    def finish(self, end: int) -> None:
        """All columns up to `end`, silence after the sound."""
        self._compute(end)

    def of(self, start: int, end: int) -> Float32Array:
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
        loudest = np.where(ends > 0, loud[np.maximum(ends - 1, 0)], 0.0)
        peaks = np.maximum.accumulate(np.maximum(loudest, self._peak))
        self._peak = float(peaks[-1])
        return peaks.astype(np.float64)


class HeardColumns(_Columns):
    """Rows of the trunk's middle layer, each for two columns, zeros around the sound."""

    def __init__(self) -> None:
        super().__init__(None)
        before, features = OWN_COLUMN[HeardMiddle.name], column_features(HeardMiddle.name)
        self._values = np.zeros((before, features), np.float32)

    def push(self, samples: Float32Array) -> None:
        """The next rows."""
        more = np.repeat(samples, ROW_COLUMNS, axis=0)
        self._values = np.concatenate([self._values, more])

    def finish(self, end: int) -> None:
        missing = max(0, end - self.end)
        self._values = np.pad(self._values, ((0, missing), (0, 0)))
