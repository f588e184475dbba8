"""Scales shapes that are made for the mean face to another face."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

ROUND_LIPS = ("mouthFunnel", "mouthPucker")
"""Shapes that draw the corners of the mouth in."""


class LidsAndCorners(Protocol):
    """What of a HeadModel is measured here."""

    @property
    def template(self) -> NDArray[np.floating]: ...
    @property
    def regions(self) -> Mapping[str, NDArray[Any]]: ...
    @property
    def expression_names(self) -> tuple[str, ...]: ...
    @property
    def inner_corners(self) -> NDArray[Any]: ...


def shape_reach(
    head: LidsAndCorners, template: NDArray[np.floating]
) -> dict[str, NDArray[np.float32]]:
    """Factors of the shapes that depend on the face: a blink shuts an eye that is wider open, round
    lips are as round from the corners of a wider mouth.

    They are (3,) float32, for x, y and z of the displacements, by the name of a shape. Shapes that
    stay are left out, and those of a head that does not name its lids or corners, or has them in
    one place.

    Parameters
    ----------
    head : LidsAndCorners
        With the face that its shapes fit.
    template : (vertex, 3)
        Another neutral face, m.
    """
    reach = {}
    for side in ("left", "right"):
        name = f"eyeBlink{side.capitalize()}"
        if name not in head.expression_names or not has_lids(head, side):
            continue
        if own := lid_gap(head, head.template, side):
            reach[name] = np.full(3, lid_gap(head, template, side) / own, np.float32)
    if len(head.inner_corners) and (own := _mouth_width(head, head.template)):
        scale = _mouth_width(head, template) / own
        factors = np.array([scale, 1, 1], np.float32)
        reach |= {name: factors for name in ROUND_LIPS if name in head.expression_names}
    return reach


def has_lids(head: LidsAndCorners, side: str) -> bool:
    """Whether a head names both lids of the eye `left` or `right`."""
    return all(len(head.regions.get(f"lid_{lid}_{side}", ())) for lid in ("upper", "lower"))


def lid_gap(head: LidsAndCorners, vertices: NDArray[np.floating], side: str) -> float:
    """Mean height of the upper lid over the lower one, m; linear in the vertices (vertex, 3)."""
    upper, lower = (vertices[head.regions[f"lid_{lid}_{side}"], 1] for lid in ("upper", "lower"))
    return float(upper.mean(dtype=np.float64) - lower.mean(dtype=np.float64))


def _mouth_width(head: LidsAndCorners, vertices: NDArray[np.floating]) -> float:
    """Between the inner corners of the lips, m."""
    one, other = vertices[head.inner_corners]
    return float(np.linalg.norm(one - other))
