"""A moving face in FLAME's parameters, and its file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.files.array_reading import read_npz
from elocute.files.array_writing import write_npz
from elocute.files.reading import FileKind
from elocute.head.flame import FlameModel, flame_vertices
from elocute.one_line_repr import one_line

FILE_MAX_BYTES = 2_000_000_000
FILE_KEYS = ("shape", "expression", "pose", "translation", "fps")


@dataclass(frozen=True, eq=False)
class FlameParameters:
    """A moving face as FLAME's equations take it: `flame_vertices(model, shape, …)`.

    Parameters
    ----------
    shape : (identity,) float64
        Standard deviations; the same for all frames.
    expression : (frame, expression) float64
        Standard deviations.
    pose : (frame, 3 · joint) float64
        Rotation vectors in radians: root, neck, jaw, left eye, right eye.
    translation : (frame, 3) float64
        Metres.
    fps : float
        Frames per second.
    """

    shape: Float64Array
    expression: Float64Array
    pose: Float64Array
    translation: Float64Array
    fps: float = 60.0

    __repr__ = one_line

    def vertices(self, model: FlameModel) -> Float64Array:
        """The face by FLAME's equations.

        Parameters
        ----------
        model : FlameModel
            The model that these are parameters of.

        Returns
        -------
        (frame, vertex, 3) float64
            Metres.

        Raises
        ------
        HeadError
            For a model of other sizes.
        """
        return flame_vertices(model, self.shape, self.expression, self.pose, self.translation)


def save_flame_parameters(path: str | Path, parameters: FlameParameters) -> None:
    """Write parameters as .npz: `shape`, `expression`, `pose`, `translation` and `fps`.

    Parameters
    ----------
    path : str or Path
        The file; one of that name is replaced.
    parameters : FlameParameters
        What to write.

    Raises
    ------
    OutputError
        For a place that cannot be written.
    """
    arrays = {name: np.asarray(getattr(parameters, name), np.float64) for name in FILE_KEYS}
    write_npz(path, arrays)


def load_flame_parameters(path: str | Path) -> FlameParameters:
    """Read parameters that `save_flame_parameters` wrote.

    Parameters
    ----------
    path : str or Path
        The .npz file.

    Returns
    -------
    FlameParameters

    Raises
    ------
    HeadError
        For a file that is missing, damaged or something else.
    """
    allowed = f"FLAME parameters (.npz of {', '.join(FILE_KEYS)})"
    stored = read_npz(path, FileKind(allowed, FILE_MAX_BYTES, HeadError))
    axes = {"shape": 1, "expression": 2, "pose": 2, "translation": 2, "fps": 0}
    for name, count in axes.items():
        values = stored.get(name)
        if (
            values is None
            or values.dtype.kind != "f"
            or values.ndim != count
            or not np.isfinite(values).all()
        ):
            raise HeadError.about(path, found=f"no usable {name}", allowed=allowed)
    frames = {len(stored[name]) for name in ("expression", "pose", "translation")}
    if len(frames) != 1 or not float(stored["fps"]) > 0:
        raise HeadError.about(path, found="parts that do not fit each other", allowed=allowed)
    parts = {name: stored[name].astype(np.float64) for name in FILE_KEYS[:-1]}
    return FlameParameters(**parts, fps=float(stored["fps"]))
