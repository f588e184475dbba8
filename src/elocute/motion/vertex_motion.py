"""Vertices over time in one topology, expanded block by block for measuring."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array, IntArray
from elocute.errors import MotionError
from elocute.files.array_file import ArrayFile
from elocute.motion.motion import checked_fps
from elocute.numerics.input_checks import array_of
from elocute.one_line_repr import one_line

BLOCK_FRAMES = 256
MM = 1000.0


@dataclass(frozen=True, eq=False)
class VertexMotion:
    """A motion to be measured: weights on a basis, or vertices, over a neutral face.

    Unlike a `Motion` it needs no head, only a topology.

    Parameters
    ----------
    values : (frame, component) or (frame, vertex, 3)
        Weights; or, where basis is None, vertices in m.
    template : (vertex, 3)
        The neutral face, m.
    fps : float
        Frames per second.
    basis : (component, vertex, 3), optional
        Shapes, m.

    Raises
    ------
    MotionError
        Where the shapes do not fit or there is no frame.
    """

    values: NDArray[np.floating] | ArrayFile
    template: NDArray[np.floating]
    fps: float
    basis: NDArray[np.floating] | None = None

    __repr__ = one_line

    def __post_init__(self) -> None:
        for name in ("values", "template", "basis"):
            field = getattr(self, name)
            if not isinstance(field, ArrayFile) and (name != "basis" or field is not None):
                object.__setattr__(self, name, _numbers(field, name))
        object.__setattr__(self, "fps", checked_fps(self.fps))
        shape = self.template.shape
        inner = shape if self.basis is None else (len(self.basis),)
        wrong_basis = self.basis is not None and self.basis.shape[1:] != shape
        if self.values.shape[1:] != inner or not len(self.values) or wrong_basis:
            basis = "no basis" if self.basis is None else f"a basis of shape {self.basis.shape}"
            raise MotionError.about(
                "motion",
                found=f"values of shape {self.values.shape} with {basis}",
                allowed=f"(frames, …) over a face of shape {shape}, one frame or more",
            )

    @property
    def frame_count(self) -> int:
        return len(self.values)

    @property
    def vertex_count(self) -> int:
        return len(self.template)

    def cut(self, frames: int) -> VertexMotion:
        """The beginning of a motion.

        Parameters
        ----------
        frames : int
            How many frames, at most as many as there are.

        Returns
        -------
        VertexMotion
        """
        values = self.values
        first = values.part(0, frames) if isinstance(values, ArrayFile) else values[:frames]
        return VertexMotion(first, self.template, self.fps, self.basis)

    def blocks(self, vertices: IntArray | None = None, overlap: int = 0) -> Iterator[Float64Array]:
        """Expand all or some vertices, a few seconds at a time.

        Parameters
        ----------
        vertices : (place,) of int, optional
            Which vertices; None for all.
        overlap : int
            Each block but the first repeats so many frames of the one before, so that
            differences in time see every neighbourhood once.

        Yields
        ------
        (frame, vertex, 3) float64
            Millimetres.
        """
        basis, kept = self.basis, slice(None) if vertices is None else vertices
        rest = np.asarray(self.template, np.float64)[kept] * MM
        shapes = None
        if basis is not None:
            shapes = np.asarray(basis)[:, kept].reshape(len(basis), -1).astype(np.float64) * MM
        for start in range(0, self.frame_count, BLOCK_FRAMES):
            first = max(0, start - overlap)
            values = np.asarray(self.values[first : start + BLOCK_FRAMES])
            if shapes is None:
                yield values[:, kept].astype(np.float64) * MM
            else:
                yield (values @ shapes).reshape(len(values), -1, 3) + rest


def _numbers(values: NDArray[np.floating], name: str) -> NDArray[np.floating]:
    array = array_of(values, f"track {name}", error=MotionError)
    if array.dtype.kind not in "fiub" or not array.ndim:
        raise MotionError.about(
            f"track {name}",
            found=f"{array.dtype} of shape {array.shape}",
            allowed="an array of numbers",
        )
    return array
