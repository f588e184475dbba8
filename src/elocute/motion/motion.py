"""Motion: a head that moves, as weights on its shapes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.errors import MotionError
from elocute.head.looks.dressing import dressed
from elocute.head.model import HeadModel
from elocute.notebook_repr import html_of
from elocute.numerics.input_checks import (
    NUMBERS_MAX,
    check_kind,
    floats_of,
    real_number,
    whole_number,
)
from elocute.numerics.quaternions import blend
from elocute.numerics.resampling import frame_places, neighbours, read_rows
from elocute.one_line_repr import brief

FPS_MIN, FPS_MAX = 0.001, 1000.0
AT_A_TIME = 8  # frames expanded together: enough for a fast product, few enough for the cache
REACH_MAX_M, TURN_SLACK = 10.0, 0.1
"""No vertex of a face goes so far, and no rotation's length is so far from one."""
WEIGHT_MAX = 1e6
"""Far beyond any shape's weight; sums and squares of such vertices still fit a float32."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Weights over time on the expression basis of one head.

    The vertices of frame f are `template + Σ weights[f, c] · basis[c]`, turned by the joint
    rotations where there are any. Frame f is at time f / fps.

    Parameters
    ----------
    head : HeadModel
        Its template (vertex, 3) in m and expression basis (component, vertex, 3) in m.
    weights : (frame, component) float32
        No unit.
    fps : float
        Frames per second, up to 1000.
    rotations : (frame, joint, 4) float32, optional
        Quaternions wxyz; None for the zero pose.

    Raises
    ------
    MotionError
        Where shapes, numbers or the frame rate do not fit.

    Notes
    -----
    The basis is linear, so weights are exact and about fifty times smaller than the vertices
    (VOCA 2019, section 4: its decoder is linear too).
    """

    head: HeadModel
    weights: NDArray[np.float32]
    fps: float
    rotations: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        check_kind("motion head", self.head, HeadModel, "a HeadModel", MotionError)
        allowed = "(frame, component) of floats"
        weights = floats_of(self.weights, "motion weights", error=MotionError, allowed=allowed)
        components = len(self.head.expression_names)
        if weights.ndim != 2 or weights.shape[1] != components or not len(weights):
            raise MotionError(
                f"motion weights: found shape {weights.shape}; allowed: (frames, {components}) "
                "with at least one frame"
            )
        if not np.isfinite(weights).all():
            frame = int(np.argwhere(~np.isfinite(weights))[0, 0])
            raise MotionError(f"motion weights: found NaN or infinity at frame {frame}")
        if max(weights.max(initial=0), -weights.min(initial=0)) > WEIGHT_MAX:
            frame = int(np.abs(weights).max(axis=1).argmax())
            raise MotionError.about(
                "motion weights",
                found=f"{np.abs(weights[frame]).max():g} at frame {frame}",
                allowed=f"up to {WEIGHT_MAX:g}",
            )
        object.__setattr__(self, "weights", weights)
        object.__setattr__(self, "fps", checked_fps(self.fps))
        if self.rotations is not None:
            object.__setattr__(self, "rotations", self._checked_rotations(self.rotations))

    def _checked_rotations(self, rotations: NDArray[np.float32]) -> NDArray[np.float32]:
        allowed = "(frame, joint, 4) of floats"
        rotations = floats_of(rotations, "motion rotations", error=MotionError, allowed=allowed)
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
        return html_of(self)

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
        """Expand frames to vertices.

        Parameters
        ----------
        start, stop : int
            The frames `start` up to, not including, `stop`, as slices count.

        Returns
        -------
        (frame, vertex, 3) float32
            Metres.

        Raises
        ------
        MotionError
            Where these are no frames of the motion.
        """
        self._check_frames(start, stop)
        weights = self.weights[start:stop]
        # Components that stay at zero cost nothing: speech uses about half of them.
        used = np.flatnonzero(np.abs(weights).max(axis=0, initial=0.0))
        basis = self.head.expression_basis[used].reshape(len(used), self.head.template.size)
        points = weights[:, used] @ basis
        points += self.head.template.reshape(1, -1)
        points = points.reshape(len(weights), -1, 3)
        if self.rotations is None:
            return points
        return self.head.posed(points, self.rotations[start:stop])

    def dressed(self) -> Motion:
        """The same motion of the head in its look; itself where the head has none.

        Returns
        -------
        Motion
            Of a head with more vertices and images; shapes and frames stay the same.
        """
        worn = dressed(self.head)
        return self if worn is self.head else replace(self, head=worn)

    def _check_frames(self, start: int, stop: int | None) -> None:
        bounds = (start, stop)
        if all(bound is None or whole_number(bound) is not None for bound in bounds) and len(
            range(*slice(start, stop).indices(self.frame_count))
        ):
            return
        raise MotionError.about(
            "motion frames",
            found=f"none from {brief(start)} to {brief(stop)}",
            allowed=f"whole numbers within 0 to {self.frame_count}, rising",
        )

    def blocks(self, frames: int = 120) -> Iterator[NDArray[np.float32]]:
        """Expand the motion in blocks, so that an hour fits in bounded memory.

        Parameters
        ----------
        frames : int
            How many a block has at most, from 1.

        Yields
        ------
        (frame, vertex, 3) float32
            Metres.

        Raises
        ------
        MotionError
            For blocks of less than a frame.
        """
        if (whole_number(frames) or 0) < 1:
            raise MotionError.about(
                "motion blocks", found=f"{brief(frames)} frames", allowed="a whole number from 1"
            )
        for start in range(0, self.frame_count, frames):
            yield self.vertices(start, start + frames)

    def faces(self, start: int = 0, stop: int | None = None) -> Iterator[NDArray[np.float32]]:
        """Expand frames to vertices one after the other, for what looks at one at a time.

        Parameters
        ----------
        start, stop : int
            The frames `start` up to, not including, `stop`, as slices count.

        Yields
        ------
        (vertex, 3) float32
            Metres.

        Raises
        ------
        MotionError
            Where these are no frames of the motion.
        """
        self._check_frames(start, stop)
        places = range(*slice(start, stop).indices(self.frame_count))
        for first in places[::AT_A_TIME]:
            yield from self.vertices(first, min(first + AT_A_TIME, places.stop))

    def at_fps(self, fps: float) -> Motion:
        """The same motion at another frame rate, linear between frames.

        Parameters
        ----------
        fps : float
            Frames per second, up to 1000.

        Returns
        -------
        Motion

        Raises
        ------
        MotionError
            For a rate out of range, or more frames than fit in memory.
        """
        fps = checked_fps(fps)
        count = max(1, round(self.duration_s * fps))
        if count * len(self.names) > NUMBERS_MAX:
            raise MotionError.about(
                "motion",
                found=f"{count} frames at {fps:g} fps",
                allowed=f"up to {NUMBERS_MAX // max(1, len(self.names))}",
            )
        places = frame_places(0, count, self.fps, fps)
        return read_frames(self, places, fps)


def read_frames(motion: Motion, places: NDArray[np.float64], fps: float) -> Motion:
    """A motion of the frames at these places, (frame,) numbers with fractions; linear between."""
    rotations = None
    if motion.rotations is not None:
        below, above, share = neighbours(places, motion.frame_count)
        rotations = blend(motion.rotations[below], motion.rotations[above], share[:, None, None])
    return replace(motion, weights=read_rows(motion.weights, places), fps=fps, rotations=rotations)


def checked_fps(fps: float) -> float:
    """Frames per second as a float. Raises MotionError for a rate out of range."""
    number = real_number(fps)
    if number is None or not FPS_MIN <= number <= FPS_MAX:
        raise MotionError.about(
            "fps", found=brief(fps), allowed=f"above 0 (from {FPS_MIN:g}), at most {FPS_MAX:g}"
        )
    return number


def check_reach(motion: Motion) -> None:
    """Raise MotionError where a motion of others takes a face where no face is.

    That is a vertex that goes further than `REACH_MAX_M`, and rotations that are none.
    """
    basis = motion.head.expression_basis
    reach = np.linalg.norm(basis, axis=2).max(axis=1, initial=0)
    frame = int((np.abs(motion.weights) @ reach).argmax())  # no frame moves a vertex further
    if np.abs(motion.weights[frame]) @ reach > REACH_MAX_M:
        moved = np.linalg.norm(np.tensordot(motion.weights[frame], basis, 1), axis=1).max()
        if moved > REACH_MAX_M:
            raise MotionError.about(
                "motion",
                found=f"a vertex {moved:.3g} m from where it rests, in frame {frame}",
                allowed=f"up to {REACH_MAX_M:g} m",
            )
    if motion.rotations is not None:
        with np.errstate(over="ignore"):
            lengths = np.linalg.norm(motion.rotations, axis=2)
        wrong = np.abs(lengths - 1).max(axis=1)
        if wrong.max() > TURN_SLACK:
            raise MotionError.about(
                "motion rotations",
                found=f"a length {wrong.max():.3g} off in frame {wrong.argmax()}",
                allowed="quaternions of length 1",
            )


def check_motion(given: object) -> None:
    """Raise MotionError for anything but a Motion."""
    if not isinstance(given, Motion):
        raise MotionError.about(
            "motion",
            found=f"a {type(given).__name__}, not a Motion",
            allowed="a Motion",
            remedy="elocute.animate(speech).motion or elocute.load_motion(path) gives one",
        )
