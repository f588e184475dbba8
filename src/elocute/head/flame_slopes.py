"""FLAME on a subset of its vertices: positions in a frame and their derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.head.skinning import blended, chained
from elocute.numerics.rotation_vectors import to_matrices


@dataclass(frozen=True, eq=False)
class FrameState:
    """One frame's unknowns."""

    expression: Float64Array
    pose: Float64Array
    translation: Float64Array


@dataclass(frozen=True, eq=False)
class PosedPart:
    """FLAME on some of its vertices, its joints still from all of them."""

    base: Float64Array  # (vertex, 3) m, with the shape
    centres: Float64Array  # (joint, 3) m, with the shape
    expression: Float64Array  # (expression, vertex, 3)
    expression_centres: Float64Array  # (expression, joint, 3)
    pose: Float64Array  # (vertex, 3, 9 · (joint - 1))
    weights: Float64Array  # (vertex, joint)
    parents: tuple[int, ...]
    chosen: NDArray[np.intp]

    def points(self, state: FrameState) -> Float64Array:
        """(vertex, 3) m."""
        return self.posed(*self.shaped(state), state.pose) + state.translation

    def shaped(self, state: FrameState) -> tuple[Float64Array, Float64Array]:
        """Vertices (vertex, 3) and joints (joint, 3) m before anything turns."""
        return (
            self.base + np.tensordot(state.expression, self.expression, 1),
            self.centres + np.tensordot(state.expression, self.expression_centres, 1),
        )

    def posed(
        self, shaped: Float64Array, centres: Float64Array, pose: Float64Array
    ) -> Float64Array:
        """(vertex, 3) m of `shaped` in a pose (3 · joint,), correctives included."""
        local = to_matrices(pose.reshape(-1, 3))
        bent = shaped + self.pose @ (local[1:] - np.eye(3)).ravel()
        turned = blended(bent, *chained(local, centres, self.parents), self.weights)
        return np.asarray(turned, np.float64)

    def along(self, state: FrameState, basis: Float64Array, centres: Float64Array) -> Float64Array:
        """(component, vertex, 3): exact slopes of components of shape or expression."""
        if not len(basis):
            return basis
        local = to_matrices(state.pose.reshape(-1, 3))
        turns = np.broadcast_to(local, (len(basis), *local.shape))
        # All components turn alike; only the joints that they move differ.
        world, shifts = chained(turns, centres, self.parents)
        mixed = np.tensordot(self.weights, world[0], 1)
        moved = self.weights @ shifts
        for a in range(3):
            for b in range(3):
                moved[..., a] += mixed[:, a, b] * basis[..., b]
        return np.asarray(moved, np.float64)


def scale_of(part: PosedPart) -> float:
    """Metres to mm over the root of the vertex count, so that sums of squares are means."""
    return 1000 / float(np.sqrt(len(part.base)))
