"""Moves irises behind their corneas, for programs that do not refract the view at a cornea.

The face of the eye keeps the cornea's normals, so highlights lie on it; only its places go back, to
the depth at which the aqueous humour shows an iris. No program needs to know of it.
"""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array
from elocute.head.model import HeadModel
from elocute.render.shading import CORNEA_INDEX

EYES = ("eyeLeft", "eyeRight")
SEEN_ASLANT = np.pi / 4
"""Of views so far from the axis the iris is as deep as it would be seen: from ahead depth does not
show, and from the side the edge of the cornea would hide too much."""


def sunk(head: HeadModel, shapes: Float32Array) -> tuple[Float32Array, Float32Array]:
    """A head's vertices (vertex, 3) m and shapes (shape, vertex, 3) m, its irises behind the
    corneas.

    The eyes' surface says how deep they lie; of a head without one nothing is moved.
    """
    places = head.template.copy()
    share = _share(head)
    moved = np.flatnonzero(share < 1)
    if not len(moved):
        return places, shapes
    middles = np.array([head.joint_positions[head.joint_names.index(eye)] for eye in EYES])
    away = places[moved, None] - middles
    middle = middles[(away * away).sum(2).argmin(1)]
    kept = share[moved, None]
    places[moved] = middle + kept * (places[moved] - middle)
    shapes = shapes.copy()
    shapes[:, moved] *= kept  # eyes turn round their middles: nearer to them, ways are shorter
    return places, shapes


def _share(head: HeadModel) -> Float32Array:
    """(vertex,) of its way from the middle of its eye that a vertex keeps; 1 outside irises."""
    share = np.ones(head.vertex_count, np.float32)
    surface = head.surfaces.get("eyeball")
    if surface is None or surface.iris_depth <= 0 or not set(EYES) <= set(head.joint_names):
        return share
    faces = head.material == head.material_names.index("eyeball")
    at = head.uv[head.uv_quads[faces].ravel()]
    angle = np.linalg.norm((at - 0.5) * 2 * surface.eye_rad, axis=1)
    bent = np.arcsin(np.sin(SEEN_ASLANT) / CORNEA_INDEX)
    depth = surface.iris_depth * np.tan(bent) / np.tan(SEEN_ASLANT)
    below = depth * np.maximum(1 - (angle / surface.iris_rad) ** 2, 0)
    share[head.quads[faces].ravel()] = 1 - below
    return share
