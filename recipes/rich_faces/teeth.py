"""Where the teeth are, as a lip feels them: a wall around the dental arch, with an edge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array

ARCH_BEHIND_M = 0.035  # the middle of the arch lies so far behind its front
ANGLE_MAX, ANGLES = np.radians(75.0), 151
HEIGHT_STEP_M = 0.0004
SAMPLES = 10  # along each side of a quad
DEEPEST_M = 0.0035  # what lies further inside is behind the teeth, not in them


@dataclass(frozen=True, eq=False)
class ToothWall:
    """The outer faces of the teeth of one jaw, in its own rest position.

    Attributes
    ----------
    middle
        (3,) m, within the arch.
    low
        m, height of the first row of the grid.
    radius
        (height, angle) m from the vertical through `middle`; 0 where there is no tooth.
    edge
        (angle,) m, height of the biting edge.
    up
        1 where the wall stands upwards from its edge, as the upper teeth do; else -1.
    """

    middle: Float64Array
    low: float
    radius: Float64Array
    edge: Float64Array
    up: int

    def away(self, points: Float64Array, margin_m: float) -> Float64Array:
        """(..., 3) m: the shortest way out for points (..., 3) that are in a tooth, else 0.

        Points within the margin of a wall or an edge count as in it.
        """
        across = points[..., [0, 2]] - self.middle[[0, 2]]
        far = np.linalg.norm(across, axis=-1)
        angle = np.arctan2(across[..., 0], across[..., 1])
        place = (angle + ANGLE_MAX) / (2 * ANGLE_MAX) * (ANGLES - 1)
        column = np.clip(place, 0, ANGLES - 1.001)
        row = (points[..., 1] - self.low) / HEIGHT_STEP_M
        inside = (row >= 0) & (row <= len(self.radius) - 1) & (np.abs(angle) < ANGLE_MAX)
        wall = _read(self.radius, np.clip(row, 0, len(self.radius) - 1.001), column)
        sideways = wall + margin_m - far
        near = column.round().astype(int)
        upright = self.up * (points[..., 1] - self.edge[near]) + margin_m
        hit = inside & (wall > 0) & (sideways > 0) & (sideways < DEEPEST_M) & (upright > 0)
        out = np.zeros_like(points)
        flat = hit & (sideways <= upright)
        out[flat, 0] = (sideways * across[..., 0] / far)[flat]
        out[flat, 2] = (sideways * across[..., 1] / far)[flat]
        out[..., 1] = np.where(hit & ~flat, -self.up * upright, 0)
        return out


def tooth_wall(points: Float64Array, quads: NDArray[np.integer], up: int) -> ToothWall:
    """The wall of one jaw's teeth.

    points (vertex, 3) m; quads (quad, 4) those of its teeth; up as in `ToothWall`.
    """
    share = (np.arange(SAMPLES) + 0.5) / SAMPLES
    u, v = (each.ravel() for each in np.meshgrid(share, share))
    blend = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1)
    surface = np.einsum("sc,qca->qsa", blend, points[quads]).reshape(-1, 3)
    middle = np.array([0.0, 0.0, surface[:, 2].max() - ARCH_BEHIND_M])
    across = surface[:, [0, 2]] - middle[[0, 2]]
    angle = np.arctan2(across[:, 0], across[:, 1])
    column = np.round((angle + ANGLE_MAX) / (2 * ANGLE_MAX) * (ANGLES - 1)).astype(int)
    low = surface[:, 1].min()
    row = np.round((surface[:, 1] - low) / HEIGHT_STEP_M).astype(int)
    seen = np.abs(angle) < ANGLE_MAX
    radius = np.zeros((row.max() + 2, ANGLES))
    np.maximum.at(radius, (row[seen], column[seen]), np.linalg.norm(across[seen], axis=1))
    edge = np.full(ANGLES, np.inf)
    np.minimum.at(edge, column[seen], up * surface[seen, 1])
    return ToothWall(middle, float(low), radius, up * edge, up)


def rigid_motion(rest: Float64Array, moved: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Rotations (frame, 3, 3) and shifts (frame, 3) that lead rest (point, 3) to moved
    (frame, point, 3), best in the least squares."""
    middle, middles = rest.mean(axis=0), moved.mean(axis=1)
    covariance = np.einsum("pa,fpb->fba", rest - middle, moved - middles[:, None])
    u, _, vt = np.linalg.svd(covariance)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    turns = u @ vt
    return turns, middles - turns @ middle


def _read(grid: Float64Array, row: Float64Array, column: Float64Array) -> Float64Array:
    """Bilinear; 0 where any corner is."""
    r, c = row.astype(int), column.astype(int)
    a, b = row - r, column - c
    corners = grid[r, c], grid[r, c + 1], grid[r + 1, c], grid[r + 1, c + 1]
    mixed = (1 - a) * ((1 - b) * corners[0] + b * corners[1]) + a * (
        (1 - b) * corners[2] + b * corners[3]
    )
    return np.where(np.minimum.reduce(corners) > 0, mixed, np.maximum.reduce(corners))
