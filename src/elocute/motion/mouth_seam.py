"""The mouth of any mesh, found by what opens it.

Where its lips meet, the front of a face tears: going down a vertical line over the surface that is
seen from ahead, what is above stays and what is below goes with the jaw. No names, numbering or
landmarks are needed, meshes may come in parts, and all lengths are relative to what moves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from elocute.array_types import Float64Array, IntArray

COLUMNS, ROWS, FINE = 81, 400, 240
CROSSED_MAX = 20_000
"""Triangles on a line; no face has so many."""
NEAR = 0.12
"""How far from the middle of the mouth its seam may lie above or below, of the width that moves."""
RECESS, DEEP = 0.05, 0.02
"""What is narrower and deeper than this is the inside of a mouth whose lips stand apart."""
STEEP, ALIKE = 8.0, 0.15
"""A lip goes on into the crease where it falls back no steeper and moves alike."""
TORN, CORNER = 0.3, 0.15
"""Shares of the widest opening at which there is a seam in the middle, and at its corners."""
SHARES = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
"""Of the way from corner to corner, where the gap is measured."""
CHIN_REACH = 1.3
"""How far below the seam a chin may be, in widths of the mouth."""


@dataclass(frozen=True, eq=False)
class MouthSeam:
    """Places on a mesh at which a mouth is measured, each a mix of four vertices.

    Attributes
    ----------
    corners : (place, 4) int
        Vertices: of the upper lip, the lower lip, two for each corner, the chin.
    mixes : (place, 4) float64
        Their shares.
    gaps : (gap,) float64
        How far the lips stand apart at rest.
    width : float
        Of the mouth at rest.
    """

    corners: IntArray
    mixes: Float64Array
    gaps: Float64Array
    width: float

    def measures(self, moved: Float64Array) -> Float64Array:
        """What displacements do to the gaps of the lips, the width of the mouth and the jaw's drop.

        Parameters
        ----------
        moved : (place, 4, 3)
            Of `corners`; x to the face's left, y up.

        Returns
        -------
        (measure,) float64
        """
        at = np.einsum("pc,pca->pa", self.mixes, moved)
        count = len(SHARES)
        upper, lower, ends = at[:count, 1], at[count : 2 * count, 1], at[2 * count : -1, 0]
        return np.r_[upper - lower, ends[2:].mean() - ends[:2].mean(), -at[-1, 1]]


def find_seam(points: Float64Array, triangles: IntArray, drop: Float64Array) -> MouthSeam | None:
    """Find the mouth of a mesh.

    Parameters
    ----------
    points : (vertex, 3)
        At rest, in any unit; x to the face's left, y up, z ahead.
    triangles : (triangle, 3)
        Corners.
    drop : (vertex,)
        How far each goes down where the mouth is opened.

    Returns
    -------
    MouthSeam or None
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
        for step in range(0 if way > 0 else 1, COLUMNS // 2 + 1):
            x = middle + way * step * wide / (COLUMNS - 1)
            tear = front.torn(x, last.y + NEAR * wide * np.linspace(1, -1, FINE))
            if tear is None or tear.jump < CORNER * first.jump:
                break
            found[x] = last = tear
    if len(found) < len(SHARES):
        return None
    xs = np.array(sorted(found))
    ends = (xs[0], xs[-1])
    at = [found[xs[np.abs(xs - np.interp(s, (0, 1), ends)).argmin()]] for s in SHARES]
    width = float(ends[1] - ends[0])
    seam = np.mean([each.y for each in at])
    chin = front.chin(float(xs.mean()), seam - width * np.linspace(0.2, CHIN_REACH, FINE))
    if chin is None:
        return None
    places = [each.upper for each in at] + [each.lower for each in at]
    places += [place for end in ends for place in (found[end].upper, found[end].lower)] + [chin]
    return MouthSeam(
        np.stack([corners for corners, _ in places]),
        np.stack([mixes for _, mixes in places]),
        np.array([each.gap for each in at]),
        width,
    )


_Place = tuple[IntArray, Float64Array]


@dataclass(frozen=True, eq=False)
class _Tear:
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
        line = self._line(x, ys)
        if line is None:
            return None
        corners, mixes, depth = line
        step = ys[0] - ys[1]
        closed = _closed(depth, max(1, int(RECESS * self.wide / step)))
        seen = np.flatnonzero(np.isfinite(depth) & (depth >= closed - DEEP * self.wide))
        if len(seen) < 2:
            return None
        drop = (self.drop[corners] * mixes).sum(axis=1)
        best = int(np.diff(drop[seen]).argmax())
        above, below = seen[best], seen[best + 1]
        jump = float(drop[below] - drop[above])
        upper = self._inwards(above, below, 1, drop, jump, depth, step)
        lower = self._inwards(below, upper, -1, drop, jump, depth, step)
        return _Tear(
            jump,
            float(ys[above] + ys[below]) / 2,
            float(ys[upper] - ys[lower] - step),
            (corners[upper], mixes[upper]),
            (corners[lower], mixes[lower]),
        )

    @staticmethod
    def _inwards(
        row: int, end: int, way: int, drop: Float64Array, jump: float, z: Float64Array, step: float
    ) -> int:
        """How far a lip goes on into the crease, from a row towards another."""
        first = drop[row]
        while row + way != end and abs(z[row + way] - z[row]) < STEEP * step:
            if abs(drop[row + way] - first) > ALIKE * jump:
                break
            row += way
        return int(row)

    def chin(self, x: float, ys: Float64Array) -> _Place | None:
        """The place on the line at x that is farthest ahead and down."""
        line = self._line(x, ys)
        if line is None or not np.isfinite(line[2]).any():
            return None
        best = int((line[2] - ys).argmax())
        return line[0][best], line[1][best]

    def _line(
        self, x: float, ys: Float64Array
    ) -> tuple[IntArray, Float64Array, Float64Array] | None:
        """Corners (row, 4), mixes (row, 4) and depth (row,), -inf where there is nothing."""
        side = self.points[self.triangles, 0] - x
        crossed = (side.min(axis=1) < 0) & (side.max(axis=1) >= 0)
        triangles, side = self.triangles[crossed], side[crossed]
        if not 0 < len(triangles) <= CROSSED_MAX:
            return None
        left = side >= 0
        row = np.arange(len(triangles))
        alone = np.where(left.sum(axis=1) == 1, left.argmax(axis=1), (~left).argmax(axis=1))
        pairs = [(alone, (alone + step) % 3) for step in (1, 2)]
        way = [side[row, a] / (side[row, a] - side[row, b]) for a, b in pairs]
        vertices = np.stack([triangles[row, each] for pair in pairs for each in pair], axis=1)
        one, other = (
            (1 - way[end])[:, None] * self.points[vertices[:, 2 * end]]
            + way[end][:, None] * self.points[vertices[:, 2 * end + 1]]
            for end in (0, 1)
        )
        rise = other[:, 1] - one[:, 1]
        share = (ys[:, None] - one[:, 1]) / np.where(rise == 0, 1, rise)
        depth = one[:, 2] + share * (other[:, 2] - one[:, 2])
        depth[(share < 0) | (share > 1) | (rise == 0)] = -np.inf
        best = depth.argmax(axis=1)
        share = np.clip(share[np.arange(len(ys)), best], 0, 1)
        ends = [((1 - w) * (1 - t), (1 - w) * t) for w, t in ((share, way[0][best]),)]
        ends += [(share * (1 - way[1][best]), share * way[1][best])]
        mixes = np.stack([each for pair in ends for each in pair], axis=1)
        return vertices[best], mixes, depth.max(axis=1)


def _closed(depth: Float64Array, reach: int) -> Float64Array:
    """Depth (row,) with all recesses filled that are no wider than twice `reach` rows."""
    filled = np.pad(depth, reach, constant_values=-np.inf)
    filled = sliding_window_view(filled, 2 * reach + 1).max(axis=-1)
    filled = np.pad(filled, reach, constant_values=np.inf)
    return sliding_window_view(filled, 2 * reach + 1).min(axis=-1)
