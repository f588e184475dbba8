"""The interface of a renderer, and the choice of an engine."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError, MachineError
from elocute.head.model import HeadModel
from elocute.numerics.input_checks import whole_number
from elocute.one_line_repr import brief
from elocute.render.backends_and_views import BACKENDS
from elocute.render.camera import Camera, portrait
from elocute.render.stage import Stage

SIDE_RANGE = (16, 8192)
PIXELS_MAX = 7680 * 4320
REMEDY = "apt-get install libegl1 libgl1-mesa-dri"


class Renderer(Protocol):
    """Draws frames of one head; use as a context manager."""

    def frame(self, points: NDArray[np.float32]) -> NDArray[np.uint8]:
        """(height, width, 3) sRGB picture of vertices (vertex, 3) m."""
        ...

    def frames(self, faces: Iterable[NDArray[np.float32]]) -> Iterator[NDArray[np.uint8]]:
        """One `frame` for each, drawn side by side with what makes the faces."""
        ...

    def __enter__(self) -> Renderer: ...

    def __exit__(self, *_: object) -> None: ...


def open_renderer(
    head: HeadModel,
    size: tuple[int, int] = (800, 800),
    *,
    backend: str = "auto",
    camera: Camera | None = None,
    stage: Stage | None = None,
) -> Renderer:
    """A renderer for pictures of one head.

    Parameters
    ----------
    head : HeadModel
        What is drawn.
    size : (int, int)
        Width and height, pixels.
    backend : str
        "moderngl", "embreex", or "auto": moderngl where EGL works, embreex elsewhere.
    camera : Camera, optional
        Where to look from; `portrait` of the head without it.
    stage : Stage, optional
        Lights, ground and quality.

    Returns
    -------
    Renderer
        A context manager.

    Raises
    ------
    InputError
        For an unknown backend or an invalid size.
    MachineError
        Where the backend does not work on this machine.
    """
    if not isinstance(backend, str) or backend not in BACKENDS:
        raise InputError.about(
            f"backend {brief(backend)}", found="unknown", allowed=", ".join(BACKENDS)
        )
    size = picture_size(size)
    camera, stage = camera or portrait(head), stage or Stage()
    if backend in ("auto", "moderngl"):
        try:
            from elocute.render.gl import GlRenderer

            return GlRenderer(head, size, camera, stage)
        except Exception as error:  # the driver's own kinds of failure are many
            if backend == "moderngl":
                raise MachineError(f"renderer moderngl: {_line(error)}; {REMEDY}") from error
    try:
        from elocute.render.rays import RayRenderer

        return RayRenderer(head, size, camera, stage)
    except ImportError as error:
        raise MachineError(
            f"no renderer works here: {_line(error)}; pip install embreex, or {REMEDY}"
        ) from error


def picture_size(size: tuple[int, int]) -> tuple[int, int]:
    """Check the size of a picture.

    Parameters
    ----------
    size : (int, int)
        Width and height, pixels.

    Returns
    -------
    (int, int)
        The same as Python's integers.

    Raises
    ------
    InputError
        For anything but two whole numbers within the range.
    """
    try:
        sides = [whole_number(side) for side in itertools.islice(size, 3)]
    except TypeError:
        sides = []
    low, high = SIDE_RANGE
    whole = [side for side in sides if side is not None and low <= side <= high]
    if len(whole) != 2 or len(sides) != 2 or whole[0] * whole[1] > PIXELS_MAX:
        raise InputError.about(
            "size",
            found=brief(size),
            allowed=f"(width, height) of {low} to {high} pixels, {PIXELS_MAX} in all",
        )
    return whole[0], whole[1]


def available_backends() -> dict[str, str]:
    """Which renderers work on this machine.

    Returns
    -------
    dict of str to str
        Backend to `works (…)`, or to why it does not.
    """
    states = {}
    try:
        from elocute.render.gl import describe

        states["moderngl"] = f"works ({describe()})"
    except Exception as error:  # as above
        states["moderngl"] = f"does not work: {_line(error)}; {REMEDY}"
    try:
        import embreex  # noqa: F401

        states["embreex"] = "works (no system library needed)"
    except ImportError as error:
        states["embreex"] = f"does not work: {_line(error)}"
    return states


def _line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
