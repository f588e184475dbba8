"""Moves teeth, tongue, lashes and brows with the skin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.carrying import Adoption
from elocute.adoption.shape_transfer import SIDES
from elocute.array_types import Float64Array
from elocute.head.model import HeadModel

NEAR_M, FAR_M = 0.004, 0.02
"""What lies so near the skin follows it whole; what lies further than the second, not at all."""
JAWS = (("teeth_lower", "gums_lower", "tongue"), ("teeth_upper", "gums_upper"))
INSIDE_M = 0.012
"""How near a part's vertices lie to the source's teeth and tongue, in the median, to be theirs."""
PART_MIN = 4


def with_attached_parts(adoption: Adoption) -> HeadModel:
    """The adopted head, whose other parts move as the skin or the source's mouth beside them.

    Parameters
    ----------
    adoption : Adoption
        A head whose skin and eyeballs move already.

    Returns
    -------
    HeadModel
        Teeth move as one with the source's teeth that are nearest, as does each part in the
        mouth; lashes, brows, beards and what else lies on the skin follow it.
    """
    head, transfer = adoption.head, adoption.transfer
    parts = transfer.target.graph.parts
    eyes = [head.regions[f"eye_{side}"] for side in SIDES if f"eye_{side}" in head.regions]
    done = np.zeros(head.vertex_count, bool)
    done[transfer.target.skin] = True
    for eye in eyes:
        done[eye] = True
    basis = head.expression_basis.copy()
    template = head.template.astype(np.float64)
    for part in np.unique(parts[~done]):
        members = np.flatnonzero((parts == part) & ~done)
        inside = _of_the_mouth(adoption, template[members]) if len(members) >= PART_MIN else None
        if inside is not None:
            basis[:, members] = _as_one(template[members], inside).astype(np.float32)
        else:
            basis[:, members] = _with_skin(head, transfer.target.skin, members)
    return replace(head, expression_basis=basis)


def _of_the_mouth(
    adoption: Adoption, points: Float64Array
) -> tuple[Float64Array, Float64Array] | None:
    """Places (near, 3) of the source's mouth nearest to a part, and their displacements."""
    from scipy.spatial import KDTree

    transfer = adoption.transfer
    source = transfer.source.head
    turned = transfer.similar.scale * transfer.similar.rotation
    found = []
    for names in JAWS:
        own = [source.regions[name] for name in names if name in source.regions]
        if not own:
            continue
        vertices = np.concatenate(own)
        places = transfer.similar(source.template[vertices].astype(np.float64))
        away, nearest = KDTree(places).query(points)
        moved = source.expression_basis[:, vertices[nearest]].astype(np.float64) @ turned.T
        found.append((float(np.median(away)), places[nearest], moved))
    # A part belongs to one jaw, whatever of the other is near some of it.
    away, places, moved = min(found, key=lambda jaw: jaw[0], default=(np.inf, points, points))
    return (places, moved) if away < INSIDE_M * transfer.similar.scale else None


def _as_one(points: Float64Array, inside: tuple[Float64Array, Float64Array]) -> Float64Array:
    """(shape, member, 3): the affine motion of all that is near, so that teeth stay teeth."""
    _, moved = inside
    around = np.column_stack([points - points.mean(axis=0), np.full(len(points), 0.01)])
    fit = np.linalg.lstsq(around, np.moveaxis(moved, 1, 0).reshape(len(points), -1), rcond=1e-2)[0]
    carried = (around @ fit).reshape(len(points), len(moved), 3)
    return np.moveaxis(carried, 1, 0).astype(np.float64)


def _with_skin(
    head: HeadModel, skin: NDArray[np.intp], members: NDArray[np.intp]
) -> NDArray[np.float32]:
    """(shape, member, 3): what the nearest skin does, fading with the distance."""
    from scipy.spatial import KDTree

    template = head.template.astype(np.float64)
    away, nearest = KDTree(template[skin]).query(template[members], 4)
    share = 1 / np.maximum(away, 1e-5)
    share *= np.clip((FAR_M - away[:, :1]) / (FAR_M - NEAR_M), 0, 1) / share.sum(axis=1)[:, None]
    moved = head.expression_basis[:, skin[nearest]]
    return np.einsum("smka,mk->sma", moved, share).astype(np.float32)
