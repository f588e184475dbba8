"""Finds and measures the mouth of any mesh by what opens it.

Where its lips meet, the front of a face tears: going down a vertical line over the surface that is
seen from ahead, what is above stays and what is below goes with the jaw. No names, numbering or
landmarks are needed, meshes may come in parts, and all lengths are relative to what moves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from elocute.array_types import Float64Array, IntArray

COLUMNS, ROWS, FINE = 81, 400, 240
CROSSED_MAX = 20_000  # triangles on a line; no face has so many
NEAR = 0.12  # how far from its neighbour's a line's seam may lie, of the width that moves
RECESS, DEEP = 0.05, 0.02
"""What is narrower and deeper than this is the inside of a mouth whose lips stand apart."""
STEEP, ALIKE = 8.0, 0.15
"""A lip goes on into the crease where it falls back no steeper and moves alike."""
TORN, CORNER = 0.3, 0.15
"""Shares of the widest opening at which there is a seam in the middle, and at its corners."""
SHARES = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
"""Of the way from corner to corner, where the gap is measured."""
CHIN_REACH = 1.3  # how far below the seam a chin may be, in widths of the mouth
_Place = tuple[IntArray, Float64Array]  # four vertices, and how much of each it is


@dataclass(frozen=True, eq=False)
class MeasuredMouth:
    """A mouth at rest, and what shapes do to it, in the mesh's unit.

    Attributes
    ----------
    gaps : (gap,) float64
        How far the lips stand apart at rest, from the face's right to its left.
    width : float
        From corner to corner.
    effects : (shape, measure) float64
        What each shape in full does to the gaps, the width, and the drop of the jaw.
    """

    gaps: Float64Array
    width: float
    effects: Float64Array


def find_mouth(
    points: Float64Array,
    triangles: IntArray,
    drop: Float64Array,
    moved: Callable[[IntArray], Float64Array],
) -> MeasuredMouth | None:
    """Find the mouth of a mesh, and measure it.

    Parameters
    ----------
    points : (vertex, 3)
        At rest, in any unit; x to the face's left, y up, z ahead.
    triangles : (triangle, 3)
        Corners.
    drop : (vertex,)
        How far each goes down where the mouth is opened.
    moved : callable
        Vertices, rising, to their displacements (shape, vertex, 3) by the shapes.

    Returns
    -------
    MeasuredMouth or None
        None where nothing tears.
    """
    most = float(drop.max(initial=0.0))
    if not most > 0:
        return None
    far, near = points[drop > most / 4], points[drop > most / 20]
    wide, middle = float(np.ptp(far[:, 0])), float(far[:, 0].max() + far[:, 0].min()) / 2
    low, high = near[:, 1].min() - 0.1 * wide, near[:, 1].max() + 0.3 * wide
    inside = (points[:, 1] > low) & (points[:, 1] < high)
    front = _Front(points, triangles[inside[triangles].any(axis=1)], drop / most, wide)
    first = front.torn(middle, np.linspace(high, low, ROWS))
    if first is None or first.jump < TORN:
        return None
    found = {}
    for way in (1, -1):
        last = first
        for step in range(COLUMNS // 2 + 1):
            x = middle + way * step * wide / (COLUMNS - 1)
            tear = front.torn(x, last.y + NEAR * wide * np.linspace(1, -1, FINE))
            if tear is None or tear.jump < CORNER * first.jump:
                break
            found[x] = last = tear
    if len(found) < len(SHARES):
        return None
    xs = np.array(sorted(found))
    lips = [found[xs[np.abs(xs - x).argmin()]] for x in xs[0] + np.ptp(xs) * np.array(SHARES)]
    width, seam = float(np.ptp(xs)), np.mean([each.y for each in lips])
    below = seam - width * np.linspace(0.2, CHIN_REACH, FINE)
    corners, mixes, depth = front.line(xs.mean(), below)
    chin = corners[best := (depth - below).argmax()], mixes[best]  # farthest ahead and down
    ends = [found[xs[-1]], found[xs[0]]]
    places = [each.upper for each in lips + ends] + [each.lower for each in lips + ends] + [chin]
    used, corners = np.unique([each for each, _ in places], return_inverse=True)
    mixes = np.array([mix for _, mix in places])
    at = np.einsum("pc,spca->spa", mixes, moved(used)[:, corners.reshape(mixes.shape)])
    upper, lower = np.split(at[:, :-1], 2, axis=1)
    gaps, across = (upper - lower)[:, : len(SHARES), 1], (upper + lower)[:, len(SHARES) :, 0] / 2
    effects = np.column_stack([gaps, across[:, 0] - across[:, 1], -at[:, -1, 1]])
    return MeasuredMouth(np.array([each.gap for each in lips]), width, effects)


class _Tear(NamedTuple):
    """Where a vertical line crosses the seam."""

    jump: float
    y: float
    gap: float
    upper: _Place
    lower: _Place


@dataclass(frozen=True, eq=False)
class _Front:
    """The surface that is seen from ahead, line by line; drop: at most one."""

    points: Float64Array
    triangles: IntArray
    drop: Float64Array
    wide: float

    def torn(self, x: float, ys: Float64Array) -> _Tear | None:
        """The place on the line at x where it tears most; ys: (row,) falling."""
        corners, mixes, depth = self.line(x, ys)
        step = ys[0] - ys[1]
        closed = _closed(depth, max(1, int(RECESS * self.wide / step)))
        seen = np.flatnonzero(np.isfinite(depth) & (depth >= closed - DEEP * self.wide))
        if len(seen) < 2:
            return None
        drop = (self.drop[corners] * mixes).sum(axis=1)
        best = int(np.diff(drop[seen]).argmax())
        ends, jump = [seen[best], seen[best + 1]], float(np.diff(drop[seen])[best])
        y = float(ys[ends].mean())
        for lip, way in ((0, 1), (1, -1)):  # on into the crease
            start, row = drop[ends[lip]], ends[lip]
            while row + way != ends[1 - lip] and abs(depth[row + way] - depth[row]) < STEEP * step:
                row += way
                if abs(drop[row] - start) > ALIKE * jump:
                    break
                ends[lip] = row
        upper, lower = ((corners[row], mixes[row]) for row in ends)
        return _Tear(jump, y, float(ys[ends[0]] - ys[ends[1]] - step), upper, lower)

    def line(self, x: float, ys: Float64Array) -> tuple[IntArray, Float64Array, Float64Array]:
        """Corners (row, 4), mixes (row, 4) and depth (row,), -inf where there is nothing."""
        side = self.points[self.triangles, 0] - x
        crossed = (side.min(axis=1) < 0) & (side.max(axis=1) >= 0)
        triangles, side = self.triangles[crossed], side[crossed]
        if not 0 < len(triangles) <= CROSSED_MAX:
            none = np.zeros((len(ys), 4))
            return none.astype(np.intp), none, np.full(len(ys), -np.inf)
        # Of each triangle the corner that is alone on its side, and so the two edges that cross.
        left = side >= 0
        alone = np.where(left.sum(axis=1) == 1, left.argmax(axis=1), (~left).argmax(axis=1))
        order = (alone[:, None] + [0, 1, 0, 2]) % 3
        corners, side = (np.take_along_axis(each, order, 1) for each in (triangles, side))
        way = (side[:, ::2] / (side[:, ::2] - side[:, 1::2]))[:, :, None]
        one, other = np.moveaxis(
            (1 - way) * self.points[corners[:, ::2]] + way * self.points[corners[:, 1::2]], 1, 0
        )
        rise = other[:, 1] - one[:, 1]
        share = (ys[:, None] - one[:, 1]) / np.where(rise == 0, 1, rise)
        depth = one[:, 2] + share * (other[:, 2] - one[:, 2])
        depth[(share < 0) | (share > 1) | (rise == 0)] = -np.inf
        best = depth.argmax(axis=1)
        along = np.clip(share[np.arange(len(ys)), best], 0, 1)
        parts = np.stack([1 - along, along], axis=1)[:, :, None]
        mixes = parts * np.concatenate([1 - way, way], axis=2)[best]
        return corners[best], mixes.reshape(-1, 4), depth.max(axis=1)


def _closed(depth: Float64Array, reach: int) -> Float64Array:
    """Depth (row,) with all recesses filled that are no wider than twice `reach` rows."""
    filled = np.pad(depth, reach, constant_values=-np.inf)
    filled = sliding_window_view(filled, 2 * reach + 1).max(axis=-1)
    filled = np.pad(filled, reach, constant_values=np.inf)
    return sliding_window_view(filled, 2 * reach + 1).min(axis=-1)
