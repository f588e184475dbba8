"""The network of a recurrent model: mel columns and a state in, weights and a state out.

ONNX alone, no torch. `crnn_stream` feeds it sound.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.audio.mel_with_deltas import BANDS, CONTEXT, HOP, MARGIN, RATE
from elocute.errors import ModelError
from elocute.models.onnx_record import check_file, open_session, run_session, stored_record

Array = NDArray[np.float32]
SHIPPED = "crnn"
SHIPPED_PATH = Path(__file__).parent / "assets" / "crnn.onnx"
SPAN = 2 * (CONTEXT + MARGIN) + 1  # columns that one video frame needs
HIDDEN = 128
OUTPUTS_MAX = 10_000


@dataclass(frozen=True)
class CrnnRecord:
    """What training wrote into the file; topology names the head whose mesh it moves."""

    fps: float
    outputs: int
    topology: str
    vertices: int
    note: str


class CrnnNetwork:
    """`crnn`, the one that ships, or a file of one's own.

    Raises ModelError where the file is missing, too large or no recurrent model of Elocute.
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
                float(stored["fps"]),
                int(stored["outputs"]),
                str(stored["topology"]),
                int(stored["vertices"]),
                str(stored["note"]),
            )
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
    def basis(self) -> Array:
        """(component, vertex, 3) m that its weights weigh. Raises ModelError."""
        silence = np.zeros((SPAN, BANDS), np.float32)
        basis = self._run(["basis"], silence, np.zeros(1, np.int64), self.rest)[0]
        if basis.shape != (self.record.outputs, self.record.vertices, 3):
            raise ModelError.about(
                self.path,
                found=f"a basis of shape {basis.shape}",
                allowed=str((self.record.outputs, self.record.vertices, 3)),
            )
        return basis

    @property
    def rest(self) -> tuple[Array, Array]:
        """The LSTM's state before anything is heard."""
        return np.zeros((1, 1, HIDDEN), np.float32), np.zeros((1, 1, HIDDEN), np.float32)

    def step(
        self, columns: Array, starts: NDArray[np.int64], state: tuple[Array, Array]
    ) -> tuple[Array, tuple[Array, Array]]:
        """(column, 128) and (frame,) first columns of windows to (frame, component) and state."""
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
        columns: Array,
        starts: NDArray[np.int64],
        state: tuple[Array, Array],
    ) -> list[Array]:
        given = {"columns": columns, "starts": starts, "hidden": state[0], "cell": state[1]}
        return run_session(self.session, self.path, names, given)
