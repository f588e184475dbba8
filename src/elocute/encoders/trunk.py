"""Runs the trunk: sound in, measures of a mouth and phones out, 50 times a second.

There is one way through it, the stream; a whole file is a stream fed once. Each layer keeps what it
heard, so every row is computed once, and how the sound is cut makes no difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, IntArray
from elocute.audio import whisper_mel
from elocute.audio.waveform import SPEECH_RATE
from elocute.encoders.phones_and_visemes import PHONES, SILENCE
from elocute.encoders.protocol import FEATURE_RATE
from elocute.errors import ModelError
from elocute.files.json_records import parse_json
from elocute.files.onnx_session import open_session
from elocute.files.reading import FileKind

KIND = "trunk"
SHIPPED_PATH = Path(__file__).parent / "assets" / "trunk.onnx"
TRUNK_FILE = FileKind("a trunk", 64_000_000, ModelError)
MOUTH_FIELDS = ("opening", "width", "protrusion", "jaw", "upper_lip", "lower_lip", "shut")
"""Deviations from a person's mean; whether the lips are shut as a logit."""
ROW_SAMPLES = round(SPEECH_RATE / FEATURE_RATE)
CONTEXT = 2  # frames of 10 ms on both sides of a row
RUN_BLOCKS = 64  # at most, so that memory stays bounded
REST_ROWS = 10  # of silence put before and after
FAR = np.float32(-1e4)
SILENT_DECADES = 4.5
"""Sound 45 dB below the loudest so far is no speech, but the noise of a room or street."""
QUIET_ROWS = 10  # on both sides, of which none may be louder: a stop is no rest
SILENCE_ALONE = np.log(np.where(np.arange(len(PHONES)) == SILENCE, 0.96, 1e-3)).astype(np.float32)
SIZES_MAX = {
    "width": 2048,
    "layers": 24,
    "mouth_layer": 24,
    "history": 1500,
    "period": 3000,
    "mouth_ahead": 100,
    "live_late": 100,
    "live_channels": 1024,
    "mouth_channels": 1024,
    "phone_channels": 1024,
    "reach": 200,
}
"""Whole numbers that the record of a trunk has, and the most that each may be."""


@dataclass(frozen=True)
class Pace:
    """How soon a trunk answers.

    Parameters
    ----------
    ahead : int
        Rows that each layer sees ahead.
    block_rows : int
        Rows that are attended together; how many blocks a run has changes nothing.
    together : int
        Frames of 10 ms whose bands are computed together.
    live : bool
        Whether the head tells the mouth that was taught to be soon, with one row ahead a layer.
    """

    ahead: int = 4
    block_rows: int = 4
    together: int = whisper_mel.TOGETHER
    live: bool = False


WHOLE = Pace()
LIVE_PACES = tuple(Pace(1, rows, whisper_mel.LIVE_TOGETHER, live=True) for rows in (8, 4, 2))
"""Where sound is answered at once, the cheapest first."""


class TrunkNetwork:
    """The ONNX file of a trunk, as `recipes.train_trunk` writes it.

    A session may be given where the file was opened before. When it is first used, it raises
    ModelError for a file that is missing or no trunk.
    """

    def __init__(self, path: str | Path, session: Any = None) -> None:
        self.path, self._opened = Path(path), session

    @cached_property
    def session(self) -> Any:
        """Of onnxruntime."""
        return self._opened or open_session(self.path, TRUNK_FILE)

    @cached_property
    def record(self) -> dict[str, Any]:
        """What training wrote into the file."""
        try:
            entry = self.session.get_modelmeta().custom_metadata_map.get("elocute", "{}")
        except UnicodeDecodeError:
            entry = "{}"
        parsed = parse_json(entry, self.path, allowed="a trunk", error=ModelError)
        record = parsed if isinstance(parsed, dict) else {}
        sizes = [record.get(name) for name in SIZES_MAX]
        sized = all(
            type(size) is int and 0 < size <= most
            for size, most in zip(sizes, SIZES_MAX.values(), strict=True)
        )
        if (
            record.get("kind") != KIND
            or not sized
            or record["width"] % 2
            or record["mouth_layer"] > record["layers"]
        ):
            raise ModelError.about(
                self.path, found="another network", allowed="a trunk of recipes.train_trunk"
            )
        return record

    @cached_property
    def _outputs(self) -> list[str]:
        return [output.name for output in self.session.get_outputs()]

    def run(self, inputs: dict[str, Float32Array]) -> dict[str, Float32Array]:
        """Named arrays in and out.

        Raises ModelError for a network of another form, and for NaN or infinity in its answers.
        """
        try:
            answers = self.session.run(self._outputs, inputs)
        except Exception as error:  # onnxruntime has no common base of its own
            raise ModelError.about(
                self.path, found="a network of another form", allowed="a trunk"
            ) from error
        outputs = dict(zip(self._outputs, answers, strict=True))
        rows = len(inputs["positions"])
        for name, columns in (*self.answers.items(), ("live_mouth", len(MOUTH_FIELDS))):
            answer = outputs.get(name)
            if answer is None or answer.shape != (rows, columns) or not np.isfinite(answer).all():
                raise ModelError.about(
                    self.path, found=f"no {name} of (rows, {columns})", allowed="a trunk"
                )
        return outputs

    @cached_property
    def answers(self) -> dict[str, int]:
        """Values in a row of each answer."""
        return {
            "hidden": self.record["width"],
            "mouth": len(MOUTH_FIELDS),
            "phones": len(PHONES),
        }

    @cached_property
    def positions(self) -> Float32Array:
        """(period, width) sinusoids, each a whole number of turns in a period."""
        period, half = self.record["period"], self.record["width"] // 2
        radians = np.exp(-np.log(10_000.0) / (half - 1) * np.arange(half))
        turns = np.round(radians * period / (2 * np.pi))
        angle = np.arange(period)[:, None] * turns * (2 * np.pi / period)
        return np.concatenate([np.sin(angle), np.cos(angle)], axis=1).astype(np.float32)


@cache
def builtin_trunk() -> TrunkNetwork:
    """The trunk that ships, opened once in a process."""
    return TrunkNetwork(SHIPPED_PATH)


def trunk_lookahead_s(network: TrunkNetwork | None = None, pace: Pace = WHOLE) -> float:
    """How much later than a row's own time the sound must be known, s, its block included.

    Of the trunk that ships where none is given.
    """
    late = max(_rows_late((network or builtin_trunk()).record, pace).values())
    heard_s = whisper_mel.lookahead_s(pace.together) + CONTEXT / 100
    return heard_s + (late + pace.block_rows) / FEATURE_RATE


def live_pace(network: TrunkNetwork, within_s: float) -> Pace:
    """The cheapest pace whose look-ahead is within so many seconds, or else the quickest."""
    soon = [pace for pace in LIVE_PACES if trunk_lookahead_s(network, pace) <= within_s + 1e-6]
    return soon[0] if soon else LIVE_PACES[-1]


def _rows_late(record: dict[str, Any], pace: Pace) -> dict[str, int]:
    """Rows by which each answer is late."""
    hidden, phones = (record[name] * pace.ahead for name in ("mouth_layer", "layers"))
    mouth = record["live_late"] if pace.live else max(hidden + record["mouth_ahead"], phones)
    return {"hidden": hidden, "mouth": mouth, "phones": phones}


@dataclass(frozen=True, eq=False)
class TrunkRows:
    """What the trunk hears in some rows of 20 ms.

    Where the sound is far below the loudest so far, phones are silence and the middle is zero.

    Parameters
    ----------
    hidden : (row, width) float32
        The rows after the mouth's layer, normalised.
    mouth : (row, 7) float32
        `MOUTH_FIELDS`.
    phones : (row, 40) float32
        Log-posteriors.
    """

    hidden: Float32Array
    mouth: Float32Array
    phones: Float32Array

    def part(self, first: int, stop: int | None) -> TrunkRows:
        """Some of the rows."""
        return TrunkRows(*(values[first:stop] for values in vars(self).values()))

    @classmethod
    def joined(cls, parts: Sequence[TrunkRows]) -> TrunkRows:
        """One after the other."""
        columns = zip(*(vars(one).values() for one in parts), strict=True)
        return cls(*map(np.concatenate, columns))


class TrunkStream:
    """Push sound at 16 kHz, take rows as soon as they are certain; flush at the end.

    Raises ModelError for a network of another form.
    """

    def __init__(self, network: TrunkNetwork, pace: Pace = WHOLE) -> None:
        self._network, record = network, network.record
        self._block, ahead = pace.block_rows, pace.ahead
        self._ahead, self._history, self._layers = ahead, record["history"], record["layers"]
        self._window = self._history + ahead + self._block  # rows that a block may look at
        late = _rows_late(record, pace)
        self._late = max(late.values())  # rows by which the answers are late
        self._waiting = {  # for the last of them
            name: _nothing(self._late - late[name], columns)
            for name, columns in network.answers.items()
        }
        width, kept = record["width"], self._history + ahead
        # The mouth is predicted from both, of which one may have to wait for the other.
        mouth = late["hidden"] + record["mouth_ahead"]
        self._kept = {
            "hidden_before": _nothing(max(0, late["phones"] - mouth), width),
            "last_before": _nothing(max(0, mouth - late["phones"]), width),
        }
        for head, kind in (("mouth", "mouth"), ("live_mouth", "live"), ("phones", "phone")):
            channels = record[f"{kind}_channels"]
            self._kept[f"{head}_before"] = _nothing(record["reach"], channels)
        for number in range(self._layers):
            self._kept[f"rows_{number}"] = self._kept[f"queries_{number}"] = _nothing(ahead, width)
            self._kept[f"keys_{number}"] = self._kept[f"values_{number}"] = _nothing(kept, width)
        self._told = "live_mouth" if pace.live else "mouth"
        self._mel = whisper_mel.WhisperMel(pace.together)
        self._bands = np.full((CONTEXT, whisper_mel.BANDS), whisper_mel.LEAST, np.float32)
        self._samples = self._fed = 0
        self._total: int | None = None
        self._near = min(QUIET_ROWS, self._late)
        # Two frames a row, from `_near` rows before the next answer on.
        self._peaks = np.full(2 * (self._late + self._near), -np.inf, np.float32)
        self._loudest = np.float32(whisper_mel.QUIET)
        self._listen(_rest())

    def push(self, samples: Float32Array) -> TrunkRows:
        """Take a block of sound (sample,) at 16 kHz, give the rows that are now certain."""
        self._samples += len(samples)
        return self._listen(samples)

    def flush(self) -> TrunkRows:
        """The remaining rows, as `push` gives them."""
        rows = -(-self._samples // ROW_SAMPLES)
        # What comes after the last row is not there: no row attends to it.
        self._total = 2 * REST_ROWS + rows
        short = rows * ROW_SAMPLES - self._samples
        padding = np.zeros(short + (self._late + self._block) * ROW_SAMPLES, np.float32)
        returned = max(0, self._fed - self._late - REST_ROWS)
        return self._listen(np.concatenate([_rest(), padding])).part(0, rows - returned)

    @property
    def coming_phones(self) -> Float32Array:
        """(row, 40) log-posteriors behind the rows that were given: mouths come later."""
        return self._waiting["phones"]

    def _listen(self, samples: Float32Array) -> TrunkRows:
        """Run all whole blocks."""
        self._bands = np.concatenate([self._bands, self._mel.push(samples)])
        self._peaks = np.concatenate([self._peaks, self._mel.peaks])
        parts = [TrunkRows(*(_nothing(0, n) for n in self._network.answers.values()))]
        while blocks := (len(self._bands) - 2 * CONTEXT + 1) // (2 * self._block):
            before = max(0, REST_ROWS + self._late - self._fed)  # heard, but not given
            parts.append(self._run(min(blocks, RUN_BLOCKS)).part(before, None))
        return TrunkRows.joined(parts)

    def _run(self, blocks: int) -> TrunkRows:
        """The next rows through all layers."""
        network, fed, rows = self._network, self._fed, blocks * self._block
        starts = self._block * np.arange(blocks)
        places = (fed + np.arange(rows)) % network.record["period"]
        inputs = {
            "bands": self._bands[: 2 * rows + 2 * CONTEXT - 1],
            "positions": network.positions[places],
            "windows": starts[:, None] + np.arange(self._window),
            **self._kept,
        }
        for number in range(self._layers):
            inputs[f"seen_{number}"] = self._seen(fed - number * self._ahead + starts)
        outputs = network.run(inputs)
        outputs["hidden_new"], outputs["mouth"] = outputs["hidden"], outputs[self._told]
        for name, kept in self._kept.items():
            self._kept[name] = _moved_on(kept, outputs[f"{name.removesuffix('_before')}_new"])
        self._bands = self._bands[2 * rows :]
        self._fed += rows
        quiet, ready = self._quiet(rows)[:, None], dict[str, Float32Array]()
        for name, waiting in self._waiting.items():
            joined = np.concatenate([waiting, outputs[name]])
            ready[name], self._waiting[name] = joined[:rows], joined[rows:]
        return TrunkRows(
            np.where(quiet, np.float32(0), ready["hidden"]),
            ready["mouth"],
            np.where(quiet, SILENCE_ALONE, ready["phones"]),
        )

    def _quiet(self, rows: int) -> NDArray[np.bool_]:
        """(row,) where the next rows and those near them are far below the loudest so far."""
        reach = 2 * self._near + 1
        peaks = self._peaks[: 2 * (rows + reach - 1)].reshape(-1, 2).max(axis=1)
        self._peaks = self._peaks[2 * rows :]
        near = np.lib.stride_tricks.sliding_window_view(peaks, reach).max(axis=1)
        now = peaks[self._near :][:rows]
        loudest = np.maximum.accumulate(np.append(self._loudest, now))
        self._loudest = loudest[-1]
        return near < loudest[1:] - SILENT_DECADES

    def _seen(self, starts: IntArray) -> Float32Array:
        """(block, 1, query, key) 0 where a row attends to another, `FAR` elsewhere.

        `starts` (block,) are the newest rows with which blocks begin.
        """
        key = starts[:, None] - self._history - self._ahead + np.arange(self._window)
        query = starts[:, None] - self._ahead + np.arange(self._block)
        apart = key[:, None] - query[:, :, None]
        there = (key >= 0) & (key < (self._total or np.inf))
        seen = (apart >= -self._history) & (apart <= self._ahead) & there[:, None]
        return np.where(seen, np.float32(0), FAR)[:, None]


def _rest() -> Float32Array:
    return np.zeros(REST_ROWS * ROW_SAMPLES, np.float32)


def _nothing(*shape: int) -> Float32Array:
    return np.zeros(shape, np.float32)


def _moved_on(kept: Float32Array, new: Float32Array) -> Float32Array:
    """The last rows, as many as before."""
    joined = np.concatenate([kept, new])
    return joined[len(joined) - len(kept) :]
