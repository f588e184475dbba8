"""Motion: a head that moves, as weights on its shapes."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.errors import MotionError
from elocute.head.model import HeadModel
from elocute.head.skinning import skin
from elocute.numerics.quaternions import blend
from elocute.numerics.resampling import frame_places, neighbours, read_rows

FPS_MAX = 1000.0


@dataclass(frozen=True, eq=False)
class Motion:
    """Weights over time on the expression basis of one head.

    Vertices of frame f are `template + Σ weights[f, c] · basis[c]`, then turned by the joint
    rotations where there are any. Frame f is at time f / fps. The basis is linear, so this
    store is exact and about fifty times smaller than the vertices (VOCA 2019, section 4: the
    decoder is linear too).

    head       template (vertex, 3) m and expression basis (component, vertex, 3) m
    weights    (frame, component) float32, no unit
    fps        frames per second
    rotations  (frame, joint, 4) float32 quaternions wxyz, or None for the zero pose

    Raises MotionError where shapes, numbers or the frame rate do not fit.
    """

    head: HeadModel
    weights: NDArray[np.float32]
    fps: float
    rotations: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        try:
            weights = np.ascontiguousarray(self.weights, dtype=np.float32)
        except ValueError as error:
            raise MotionError(
                f"motion weights: found {error}; allowed: (frame, component) of floats"
            ) from None
        components = len(self.head.expression_names)
        if weights.ndim != 2 or weights.shape[1] != components or not len(weights):
            raise MotionError(
                f"motion weights: found shape {weights.shape}; allowed: (frames, {components}) "
                "with at least one frame"
            )
        if not np.isfinite(weights).all():
            frame = int(np.argwhere(~np.isfinite(weights))[0, 0])
            raise MotionError(f"motion weights: found NaN or infinity at frame {frame}")
        _check_fps(self.fps)
        object.__setattr__(self, "weights", weights)
        object.__setattr__(self, "fps", float(self.fps))
        if self.rotations is not None:
            object.__setattr__(self, "rotations", self._checked_rotations(self.rotations))

    def _checked_rotations(self, rotations: NDArray[np.float32]) -> NDArray[np.float32]:
        rotations = np.ascontiguousarray(rotations, dtype=np.float32)
        shape = (len(self.weights), len(self.head.joint_names), 4)
        if rotations.shape != shape or not np.isfinite(rotations).all():
            raise MotionError(
                f"motion rotations: found shape {rotations.shape}; allowed: {shape}, finite"
            )
        return rotations

    def __repr__(self) -> str:
        turned = "" if self.rotations is None else ", with rotations"
        return (
            f"Motion({self.frame_count} frames at {self.fps:g} fps, {self.duration_s:.2f} s, "
            f"{len(self.names)} components of {self.head!r}{turned})"
        )

    def _repr_html_(self) -> str:
        """The viewer, for notebooks."""
        # Named and not imported: what exports a motion lies above it.
        notebook = importlib.import_module("elocute.export.notebook")
        return notebook.viewer_frame(self, None, repr(self))

    @property
    def frame_count(self) -> int:
        return len(self.weights)

    @property
    def duration_s(self) -> float:
        return self.frame_count / self.fps

    @property
    def times_s(self) -> NDArray[np.float64]:
        """(frame,) seconds."""
        return np.arange(self.frame_count) / self.fps

    @property
    def names(self) -> tuple[str, ...]:
        """One name per component: ARKit's for the built-in head."""
        return self.head.expression_names

    def vertices(self, start: int = 0, stop: int | None = None) -> NDArray[np.float32]:
        """Expand frames start:stop to (frame, vertex, 3) m."""
        weights = self.weights[start:stop]
        # Components that stay at zero cost nothing: speech uses about half of them.
        used = np.flatnonzero(np.abs(weights).max(axis=0, initial=0.0))
        basis = self.head.expression_basis[used].reshape(len(used), self.head.template.size)
        points = weights[:, used] @ basis
        points += self.head.template.reshape(1, -1)
        points = points.reshape(len(weights), -1, 3)
        if self.rotations is None:
            return points
        head = self.head
        turned = skin(
            points,
            self.rotations[start:stop],
            head.joint_positions,
            head.joint_parents,
            head.skin_weights,
        )
        return turned.astype(np.float32)

    def blocks(self, frames: int = 120) -> Iterator[NDArray[np.float32]]:
        """Expand in blocks of at most `frames`, so that an hour fits in bounded memory."""
        for start in range(0, self.frame_count, frames):
            yield self.vertices(start, start + frames)

    def at_fps(self, fps: float) -> Motion:
        """The same motion at another frame rate, linear between frames. Raises MotionError."""
        _check_fps(fps)
        count = max(1, round(self.duration_s * fps))
        places = frame_places(0, count, self.fps, fps)
        rotations = None
        if self.rotations is not None:
            below, above, share = neighbours(places, self.frame_count)
            rotations = blend(self.rotations[below], self.rotations[above], share[:, None, None])
        return replace(self, weights=read_rows(self.weights, places), fps=fps, rotations=rotations)


def _check_fps(fps: float) -> None:
    if np.ndim(fps) or not (np.isfinite(fps) and 0 < fps <= FPS_MAX):
        raise MotionError(f"fps: found {fps}; allowed: above 0, at most {FPS_MAX:g}")
