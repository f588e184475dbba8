"""Lips that seal, flatten against each other, bulge by what they lose, and stay off the teeth.

The rig says when lips are closed: where its contact lines touch, a person's lips are brought to
touch as well, upper and lower each giving way by its share. Lips that would go into each other end
at a common surface instead, and what is pressed away there comes out on the red of the lips.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array, IntArray
from elocute.head.model import HeadModel
from elocute.head.normals import vertex_normals
from elocute.numerics.smoothing import smoothstep
from recipes.rich_faces.face_places import screened_spread
from recipes.rich_faces.teeth import ToothWall, tooth_wall

AROUND_M = 0.022  # skin so near the lips gives way with them
REACH_M = 0.006
SEALED_M, OPEN_M = 0.0001, 0.0010  # gaps of the rig that count as closed, and as open
TOUCH_M = 0.00002  # lips overlap by so much where they touch: no light between them
TOOTH_GAP_M = 0.00015
CONTACT_RING = 7
# Rings from the vermilion border inwards: how much of what is pressed away comes out there.
BULGE = np.array([0.15, 0.4, 0.7, 0.9, 1.0, 0.8, 0.35, 0.0, 0.0, 0.0])
UPPER_COLUMNS = (*range(29, 38), *range(10))
LOWER_COLUMNS = tuple(range(11, 28))
FLATTENED = slice(4, 10)  # rings that may meet the other lip


@dataclass(frozen=True, eq=False)
class LipContact:
    """Where the lips of one person may be.

    Attributes
    ----------
    vertices
        (local,) of the mesh: lips, mouth and the skin around.
    upper, lower
        (13,) the contact lines, by increasing x, and so all below that are called contact.
    felt
        (local, 26): how far vertices follow the upper and the lower contact line.
    columns
        (local, 13) where a vertex stands along the contact lines; rows sum to one.
    over, under
        Local vertices of the upper and the lower lip that may meet.
    seam_over, seam_under
        Those of the contact lines themselves.
    bulge
        (local, 3) direction and share of what is pressed away.
    smooth
        (local, local) means of neighbours.
    lips
        Local vertices that must stay off the teeth.
    share
        Of a gap that the upper lip closes.
    upper_teeth, lower_teeth
        Walls, in rest.
    """

    vertices: NDArray[np.intp]
    upper: IntArray
    lower: IntArray
    felt: Float64Array
    columns: Float64Array
    over: NDArray[np.intp]
    under: NDArray[np.intp]
    seam_over: NDArray[np.intp]
    seam_under: NDArray[np.intp]
    bulge: Float64Array
    smooth: Float64Array
    lips: NDArray[np.intp]
    share: float
    upper_teeth: ToothWall
    lower_teeth: ToothWall

    def settled(
        self,
        points: Float64Array,
        rig_gap: Float64Array,
        on_teeth: Float64Array,
        jaw: tuple[Float64Array, Float64Array],
    ) -> Float64Array:
        """Lips after contact.

        Parameters
        ----------
        points
            (frame, local, 3) m, before.
        rig_gap
            (frame, 13) m between the contact lines of the rig, below 0 where they overlap.
        on_teeth
            (frame,) 0 to 1, how far the lower lip meets the upper teeth instead.
        jaw
            Rotations (frame, 3, 3) and shifts (frame, 3) m of the lower teeth from their rest.

        Returns
        -------
        (frame, local, 3) m.
        """
        points = points.copy()
        away = np.clip((rig_gap - SEALED_M) / (OPEN_M - SEALED_M), 0, 1)
        seal = (1 - smoothstep(away)) * (1 - on_teeth[:, None])
        top, bottom = points[:, self.upper, 1], points[:, self.lower, 1]
        gap = top - bottom
        wanted = (1 - seal) * gap + seal * np.minimum(gap, -TOUCH_M)
        final = np.maximum(wanted, -TOUCH_M)
        pressed = np.maximum(-TOUCH_M - wanted, 0)
        closing = final - gap
        moves = np.concatenate([self.share * closing, (self.share - 1) * closing], axis=1)
        points[..., 1] += moves @ self.felt.T
        points += (pressed @ self.columns.T)[..., None] * self.bulge
        points = self._off_the_teeth(points, jaw)
        return self._met(points, seal)

    def _met(self, points: Float64Array, seal: Float64Array) -> Float64Array:
        """Neither lip crosses the surface between the contact lines; sealed lines lie on it."""
        top, bottom = points[:, self.upper, 1], points[:, self.lower, 1]
        middle = (top + bottom) / 2 @ self.columns.T
        shut = seal @ self.columns.T
        half = TOUCH_M / 2
        over, under = self.over, self.under
        points[:, over, 1] = np.maximum(points[:, over, 1], middle[:, over] - half)
        points[:, under, 1] = np.minimum(points[:, under, 1], middle[:, under] + half)
        for seam, sign in ((self.seam_over, -1), (self.seam_under, 1)):
            at = points[:, seam, 1]
            points[:, seam, 1] = at + shut[:, seam] * (middle[:, seam] + sign * half - at)
        return points

    def _off_the_teeth(
        self, points: Float64Array, jaw: tuple[Float64Array, Float64Array]
    ) -> Float64Array:
        lips = points[:, self.lips]
        out = self.upper_teeth.away(lips, TOOTH_GAP_M)
        turns, shifts = jaw
        in_jaw = np.einsum("fba,fpb->fpa", turns, lips - shifts[:, None])
        back = self.lower_teeth.away(in_jaw, TOOTH_GAP_M)
        out += np.einsum("fab,fpb->fpa", turns, back)
        if not out.any():
            return points
        push = np.zeros_like(points)
        push[:, self.lips] = out
        # What a tooth pushes takes its neighbours along, falling off.
        spread = push
        for share in (0.7, 0.5):
            spread = share * np.einsum("vw,fwa->fva", self.smooth, spread, optimize=True)
            push = np.where(np.abs(push) >= np.abs(spread), push, spread)
        return points + push


def lip_contact(head: HeadModel, template: Float64Array, share: float, bulge: float) -> LipContact:
    """The contact of a person's lips.

    Parameters
    ----------
    head
        With lip rings, inner mouth and teeth.
    template
        (vertex, 3) m, the person's neutral face.
    share
        Of a gap that the upper lip closes.
    bulge
        How much comes out of what is pressed away; 1 keeps the volume, roughly.
    """
    rings = head.lip_rings
    lips = np.unique(rings)
    chosen = np.zeros(head.vertex_count, bool)
    chosen[lips] = chosen[head.regions["inner_mouth"]] = True
    skin = head.regions["face"]
    far = ((template[skin][:, None] - template[lips]) ** 2).sum(axis=2).min(axis=1)
    chosen[skin[far < AROUND_M**2]] = True
    vertices = np.flatnonzero(chosen)
    local = np.full(head.vertex_count, -1)
    local[vertices] = np.arange(len(vertices))
    points = template[vertices]
    edges = _edges(local[head.quads])
    upper, lower = local[head.inner_lip_upper], local[head.inner_lip_lower]
    felt = screened_spread(points, edges, np.concatenate([upper, lower]), REACH_M)
    columns = _along(points[:, 0], points[upper, 0])
    normals = vertex_normals(template, head.triangles)[vertices]
    out = np.zeros((len(vertices), 1))
    out[local[rings]] = BULGE[:, None, None]
    over, under = (
        local[rings[FLATTENED][:, list(side)]].ravel() for side in (UPPER_COLUMNS, LOWER_COLUMNS)
    )
    smooth = np.zeros((len(vertices), len(vertices)))
    smooth[edges[:, 0], edges[:, 1]] = smooth[edges[:, 1], edges[:, 0]] = 1
    smooth /= np.maximum(smooth.sum(axis=1, keepdims=True), 1)
    walls = []
    for jaw, up in (("teeth_upper", 1), ("teeth_lower", -1)):
        inside = np.isin(head.quads, head.regions[jaw]).all(axis=1)
        walls.append(tooth_wall(template, head.quads[inside], up))
    return LipContact(
        vertices,
        upper,
        lower,
        felt,
        columns,
        over,
        under,
        local[rings[CONTACT_RING, list(UPPER_COLUMNS)]],
        local[rings[CONTACT_RING, list(LOWER_COLUMNS)]],
        0.5 * bulge * out * normals,
        smooth,
        local[np.unique(rings[:9])],
        share,
        walls[0],
        walls[1],
    )


def rig_gaps(head: HeadModel, template: Float64Array, weights: Float64Array) -> Float64Array:
    """(frame, 13) m between the contact lines of the rig with weights (frame, expression)."""
    basis = head.expression_basis[:, :, 1]
    rest = template[head.inner_lip_upper, 1] - template[head.inner_lip_lower, 1]
    return rest + weights @ (basis[:, head.inner_lip_upper] - basis[:, head.inner_lip_lower])


def _edges(quads: IntArray) -> NDArray[np.intp]:
    """(edge, 2) of quads whose corners are all there (not -1), each once."""
    kept = quads[(quads >= 0).all(axis=1)]
    pairs = np.concatenate([kept[:, [i, (i + 1) % 4]] for i in range(4)])
    pairs = np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1)
    return np.unique(pairs, axis=0).astype(np.intp)


def _along(x: Float64Array, knots: Float64Array) -> Float64Array:
    """(point, knot) shares of linear interpolation; the end knots beyond both ends."""
    return np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))], axis=1)
