"""Curves: named values over time, and ARKit's 52 names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import MachineError, MotionError
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion, check_motion
from elocute.numerics.input_checks import check_kind, floats_of, real_number
from elocute.one_line_repr import brief

# Apple's names in the order of the Live Link Face recordings.
ARKIT_NAMES: tuple[str, ...] = (
    "eyeBlinkLeft",
    "eyeLookDownLeft",
    "eyeLookInLeft",
    "eyeLookOutLeft",
    "eyeLookUpLeft",
    "eyeSquintLeft",
    "eyeWideLeft",
    "eyeBlinkRight",
    "eyeLookDownRight",
    "eyeLookInRight",
    "eyeLookOutRight",
    "eyeLookUpRight",
    "eyeSquintRight",
    "eyeWideRight",
    "jawForward",
    "jawLeft",
    "jawRight",
    "jawOpen",
    "mouthClose",
    "mouthFunnel",
    "mouthPucker",
    "mouthLeft",
    "mouthRight",
    "mouthSmileLeft",
    "mouthSmileRight",
    "mouthFrownLeft",
    "mouthFrownRight",
    "mouthDimpleLeft",
    "mouthDimpleRight",
    "mouthStretchLeft",
    "mouthStretchRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "mouthPressLeft",
    "mouthPressRight",
    "mouthLowerDownLeft",
    "mouthLowerDownRight",
    "mouthUpperUpLeft",
    "mouthUpperUpRight",
    "browDownLeft",
    "browDownRight",
    "browInnerUp",
    "browOuterUpLeft",
    "browOuterUpRight",
    "cheekPuff",
    "cheekSquintLeft",
    "cheekSquintRight",
    "noseSneerLeft",
    "noseSneerRight",
    "tongueOut",
)


@dataclass(frozen=True, eq=False)
class Curves:
    """Named curves over time; frame f is at time f / fps.

    Parameters
    ----------
    values : (frame, curve) float32
        One column per name.
    names : tuple of str
        Each name once; ARKit's names on the built-in head.
    fps : float
        Frames per second.

    Raises
    ------
    MotionError
        Where names and columns differ in number, a name occurs twice, or a value is not finite.
    """

    values: NDArray[np.float32]
    names: tuple[str, ...]
    fps: float

    def __post_init__(self) -> None:
        allowed = "(frame, curve) of floats"
        values = floats_of(self.values, "curves", error=MotionError, allowed=allowed)
        if values.ndim != 2 or values.shape[1] != len(self.names):
            raise MotionError(
                f"curves: found shape {values.shape} for {len(self.names)} names; "
                f"allowed: (frames, {len(self.names)})"
            )
        _checked_names(self.names)
        if not np.isfinite(values).all():
            raise MotionError("curves: found NaN or infinity")
        fps = real_number(self.fps)
        if fps is None or fps <= 0:
            raise MotionError.about(
                "curves", found=f"fps {brief(self.fps)}", allowed="a number above 0"
            )
        if not isinstance(self.fps, int | float):
            object.__setattr__(self, "fps", fps)
        object.__setattr__(self, "values", values)

    def __repr__(self) -> str:
        return f"Curves({len(self.values)} frames at {self.fps:g} fps, {len(self.names)} curves)"

    def __getitem__(self, name: str) -> NDArray[np.float32]:
        """(frame,) values of one curve. Raises KeyError, which says the nearest name."""
        try:
            return self.values[:, self.names.index(name)]
        except ValueError:
            raise KeyError(_unknown(name, self.names)) from None

    @property
    def times_s(self) -> NDArray[np.float64]:
        """(frame,) seconds."""
        return np.arange(len(self.values)) / self.fps

    def to_pandas(self) -> Any:
        """The curves as a data frame of pandas.

        Returns
        -------
        pandas.DataFrame
            A column for each curve; its index is `time_s`.

        Raises
        ------
        MachineError
            Where pandas is not installed.
        """
        frame = data_frame(self.values, columns=self.names)
        return frame.set_index(data_frame(self.times_s, columns=("time_s",))["time_s"])

    def select(self, names: tuple[str, ...]) -> Curves:
        """The curves of these names, in this order.

        Parameters
        ----------
        names : tuple of str
            A curve that is missing is zero throughout.

        Returns
        -------
        Curves
        """
        values = np.zeros((len(self.values), len(_checked_names(names))), np.float32)
        into, of = _shared(tuple(self.names), tuple(names))
        values[:, into] = self.values[:, of]
        return Curves(values, names, self.fps)


def _checked_names(names: Any) -> tuple[str, ...]:
    """Names of curves. Raises MotionError for what is no text, and for one that occurs twice."""
    check_kind("curves", names, tuple | list, "a tuple of names", MotionError)
    given = tuple(names)
    try:
        texts, once = _kind_of_names(given)
    except TypeError:  # what cannot be hashed is no text
        texts, once = False, True
    if not texts:
        raise MotionError.about("curves", found=brief(given), allowed="names that are text")
    if not once:
        raise MotionError("curves: found a name twice; allowed: each name once")
    return given


@lru_cache(256)
def _kind_of_names(names: tuple[object, ...]) -> tuple[bool, bool]:
    """Whether all are text, and whether each occurs once."""
    return all(isinstance(name, str) for name in names), len(set(names)) == len(names)


@lru_cache(256)
def _shared(
    names: tuple[str, ...], wanted: tuple[str, ...]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Columns of `wanted` that are there, and those of `names` that they are read from."""
    places = {name: place for place, name in enumerate(names)}
    pairs = [(into, places[name]) for into, name in enumerate(wanted) if name in places]
    into, of = np.array(pairs, np.intp).reshape(-1, 2).T
    return into, of


def _unknown(name: object, names: tuple[str, ...]) -> str:
    """No curve of a name, and the nearest one, in whatever case."""
    lower = {each.lower(): each for each in names}
    near = get_close_matches(str(name)[:100].lower(), lower, n=1, cutoff=0.6)
    allowed = f"nearest: {lower[near[0]]}" if near else f"there are {', '.join(names)[:200]}"
    return f"no curve {brief(name)}; {allowed}"


def motion_from_curves(head: HeadModel, curves: Curves) -> Motion:
    """Drive the expression basis of a head by curves of the same names.

    Parameters
    ----------
    head : HeadModel
        The head to move.
    curves : Curves
        A curve that is zero throughout needs no shape.

    Returns
    -------
    Motion

    Raises
    ------
    MotionError
        Where a curve that moves has no shape of its name.
    """
    check_kind("curves", curves, Curves, "Curves", MotionError)
    check_kind("head", head, HeadModel, "a HeadModel", MotionError)
    unknown = [
        name
        for name, peak in zip(
            curves.names, np.abs(curves.values).max(axis=0, initial=0), strict=True
        )
        if peak > 0 and name not in head.expression_names
    ]
    if unknown:
        raise MotionError(
            f"curves: found {', '.join(unknown)} without a shape on this head; "
            f"allowed: {', '.join(head.expression_names)}"
        )
    return Motion(head, curves.select(head.expression_names).values, curves.fps)


def curves_from_motion(motion: Motion) -> Curves:
    """The weights of a motion as curves named after its components.

    Parameters
    ----------
    motion : Motion
        Its rotations are left out.

    Returns
    -------
    Curves

    Raises
    ------
    MotionError
        For anything but a Motion.
    """
    check_motion(motion)
    return Curves(motion.weights, motion.names, motion.fps)


def data_frame(rows: Any, columns: Sequence[str]) -> Any:
    """A data frame of pandas. Raises MachineError where that is not installed."""
    try:
        import pandas
    except ImportError as problem:
        raise MachineError("data frames need pandas; install it: pip install pandas") from problem
    return pandas.DataFrame(rows, columns=list(columns))
