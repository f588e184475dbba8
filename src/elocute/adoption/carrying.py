"""Carries the shapes and named places of a source head over to another face.

Then all that is not its skin moves along: eyes, teeth, tongue, lashes and brows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.face import Face
from elocute.adoption.registration import lay_over
from elocute.adoption.shape_transfer import SIDES, Transfer
from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.head.model import HeadModel

NEAR_M, FAR_M = 0.004, 0.02
"""What lies so near the skin follows it whole; what lies further than the second, not at all."""
JAWS = (("teeth_lower", "gums_lower", "tongue"), ("teeth_upper", "gums_upper"))
INSIDE_M = 0.012
"""How near a part's vertices lie to the source's teeth and tongue, in the median, to be theirs."""
PART_MIN = 4
SEALED_M = 2e-4
"""How far the upper lip lies below the lower one where both touch, as on the built-in head."""
REST_GAP_MAX_M = 0.006
EYE_NEAR_M = 0.03
"""A ball's middle lies no further from the middle of the lids."""
ROUND = 0.15
"""How unequal the radii of an eyeball may be, as a share."""
MOUTH_PLACES = 13
JawShape = Callable[[Float64Array], Float64Array]


@dataclass(frozen=True, eq=False)
class Adoption:
    """A head that has taken over another's shapes.

    Attributes
    ----------
    head
        Ready to be animated by every model.
    transfer
        How the shapes came over.
    rest_gap_mm
        How far the lips stood apart at rest, at most, before they were closed.
    """

    head: HeadModel
    transfer: Transfer
    rest_gap_mm: float


def adopt(source: HeadModel, target: HeadModel, *, jaw: JawShape | None = None) -> Adoption:
    """Carry all shapes of a head over to another face.

    Parameters
    ----------
    source : HeadModel
        With lips, lids and landmarks, such as the built-in head.
    target : HeadModel
        With landmarks; its lips are open in the mesh, touching or nearly so. It stays as it is but
        for its shapes: lips that stand apart at rest are closed, and its identities keep them so.
    jaw : callable, optional
        Where the target has a jaw of its own: it is given what the source's `jawOpen` does to the
        vertices (vertex, 3) m, and returns what its own jaw does to them when it opens as far.

    Returns
    -------
    Adoption

    Raises
    ------
    HeadError
        Where the landmarks are not those of a face, or the mouth stands open.
    """
    one, other = Face(source), Face(target)
    laid, similar = lay_over(one, other)
    transfer = Transfer(one, other, laid, similar)
    closing, gap_m = _closing(transfer)
    shapes = _shapes(transfer, jaw)
    eyes = _eyeballs(other)
    _turn_eyes(transfer, eyes, shapes)
    template = target.template.astype(np.float64)
    template[other.skin] += closing
    head = replace(
        _with_places(transfer, eyes),
        template=template.astype(np.float32),
        identity_basis=_sealed_identities(transfer),
        expression_names=source.expression_names,
        expression_basis=shapes.astype(np.float32),
    )
    return Adoption(head, transfer, 1000 * gap_m)


def _upward(transfer: Transfer) -> Float64Array:
    """(3,) the target's own up: from the chin to the brows."""
    return transfer.similar.rotation @ np.array([0.0, 1.0, 0.0])


def _closing(transfer: Transfer) -> tuple[Float64Array, float]:
    """(free, 3) m that closes lips which stand apart at rest, and how far they do, m."""
    face, ties, up = transfer.target, transfer.lips, _upward(transfer)
    gaps = ties.apart(face.points) @ up
    widest = float(gaps.max(initial=0.0))
    if widest > REST_GAP_MAX_M * transfer.similar.scale:
        raise HeadError.about(
            f"head {face.head.name!r}",
            found=f"lips {1000 * widest:.1f} mm apart",
            allowed="a face with closed lips",
        )
    apart = np.zeros((1, len(transfer.all_ties.shares), 3))
    fading = np.clip(np.minimum(ties.shares, 1 - ties.shares) / 0.05, 0, 1)
    apart[0, : len(gaps)] = -(np.maximum(gaps + SEALED_M, 0) * fading)[:, None] * up
    return transfer.spread(apart)[0], max(widest, 0.0)


def _sealed_identities(transfer: Transfer) -> NDArray[np.float32]:
    """The target's identities, changed at the lips so that none of them parts the two."""
    face, up = transfer.target, _upward(transfer)
    basis = face.head.identity_basis
    if not len(basis):
        return basis
    apart = np.zeros((len(basis), len(transfer.all_ties.shares), 3))
    gaps = transfer.lips.apart(basis.astype(np.float64)) @ up
    apart[:, : gaps.shape[1]] = -gaps[:, :, None] * up
    sealed = basis.copy()
    sealed[:, face.skin] += transfer.spread(apart).astype(np.float32)
    return sealed


def _shapes(transfer: Transfer, jaw: JawShape | None) -> Float64Array:
    """(shape, vertex, 3) m on the target."""
    source, target = transfer.source.head, transfer.target.head
    basis = source.expression_basis.astype(np.float64)
    wanted = transfer.at_places(basis)
    apart = transfer.apart_as_on_source(basis)
    lips = len(transfer.lips.shares)
    start = lips
    for side in SIDES:
        count = len(transfer.lids[side].shares)
        name = f"eyeBlink{side.capitalize()}"
        if name in source.expression_names:
            row = source.expression_index(name)
            apart[row, start : start + count] = transfer.shut_lids(side, basis[row])
        start += count
    carried = transfer.smoothed(wanted, apart)
    shapes = np.zeros((len(basis), target.vertex_count, 3))
    shapes[:, transfer.target.skin] = carried
    if jaw is not None:
        _give_jaw(transfer, jaw, shapes)
    return shapes


def _give_jaw(transfer: Transfer, jaw: JawShape, shapes: Float64Array) -> None:
    """The target's own jaw for `jawOpen`; `mouthClose` then closes what that opens."""
    names = transfer.source.head.expression_names
    opening, closing = (names.index(name) for name in ("jawOpen", "mouthClose"))
    skin = transfer.target.skin
    carried = shapes[opening].copy()
    shapes[opening] = jaw(carried)
    # Around the lips the two together stay what they were; the chin is the jaw's alone.
    together = (carried + shapes[closing])[skin]
    share = lip_share(transfer)[:, None]
    wanted = shapes[closing][skin] + share * (carried - shapes[opening])[skin]
    apart = transfer.all_ties.apart(_on_all(transfer, together - shapes[opening][skin])[None])
    shapes[closing][skin] = transfer.smoothed(wanted[None], apart)[0]


def lip_share(transfer: Transfer) -> Float64Array:
    """(free,) 1 on the lips, fading over the skin around: how much a vertex is a lip's."""
    closing = transfer.source.head.expression_index("mouthClose")
    moved = np.linalg.norm(transfer.source.head.expression_basis[closing], axis=1)
    share = np.clip(1.25 * moved / max(float(moved.max()), 1e-9), 0, 1).astype(np.float64)
    return transfer.places.read(share)


def _on_all(transfer: Transfer, values: Float64Array) -> Float64Array:
    """(vertex, 3) of values (free, 3) on the skin; zero elsewhere."""
    result = np.zeros((transfer.target.head.vertex_count, 3))
    result[transfer.target.skin] = values
    return result


def _eyeballs(face: Face) -> dict[str, NDArray[np.intp]]:
    """Vertices of the ball behind each pair of lids: separate round parts."""
    parts, eyeballs = face.graph.parts, {}
    skin_part = parts[face.skin[0]]
    for side in SIDES:
        lids = np.concatenate(
            [face.lines[f"lid_{lid}_{side}"].corners for lid in ("upper", "lower")]
        )
        middle = lids.mean(axis=0)
        balls = []
        for part in np.unique(parts):
            members = np.flatnonzero(parts == part)
            if part == skin_part or len(members) < 12:
                continue
            points = face.points[members]
            centre = (points.min(axis=0) + points.max(axis=0)) / 2
            radii = np.linalg.norm(points - centre, axis=1)
            if np.ptp(radii) < 2 * ROUND * radii.mean():
                balls.append((float(np.linalg.norm(centre - middle)), members))
        if balls:
            distance, members = min(balls, key=lambda ball: ball[0])
            if distance < EYE_NEAR_M:
                eyeballs[side] = members
    return eyeballs


def _turn_eyes(transfer: Transfer, eyes: dict[str, NDArray[np.intp]], shapes: Float64Array) -> None:
    """Eyeballs turn as the source's do, about their own middles."""
    source = transfer.source.head
    frame = transfer.similar.rotation
    for side, members in eyes.items():
        ball = source.regions.get(f"eye_{side}", np.zeros(0, np.int32))
        if not len(ball):
            continue
        rest = source.template[ball].astype(np.float64)
        around = rest - rest.mean(axis=0)
        points = transfer.target.points[members]
        own = points - (points.min(axis=0) + points.max(axis=0)) / 2
        for row in range(len(shapes)):
            moved = source.expression_basis[row, ball].astype(np.float64)
            if not np.abs(moved).max(initial=0) > 1e-5:
                continue
            # Linear in the place: what the source's ball does, a chord of its turn.
            linear = np.linalg.lstsq(around, moved - moved.mean(axis=0), rcond=None)[0].T
            shapes[row, members] = own @ (frame @ linear @ frame.T).T


def _with_places(transfer: Transfer, eyes: dict[str, NDArray[np.intp]]) -> HeadModel:
    """The target with lips, lids and eyes named as on the source."""
    face = transfer.target
    steps = np.arange(1, MOUTH_PLACES + 1) / (MOUTH_PLACES + 1)
    named = {}
    for name in ("outer_upper", "outer_lower", "inner_upper", "inner_lower"):
        which, side = name.split("_")
        line = face.lines[name]
        inside = (line.shares > 0) & (line.shares < 1)
        nearest = np.abs(line.shares[inside][:, None] - steps).argmin(axis=0)
        named[f"{which}_lip_{side}"] = line.vertices[inside][nearest].astype(np.int32)
    regions = dict(face.head.regions)
    for side in SIDES:
        for lid in ("upper", "lower"):
            line = face.lines[f"lid_{lid}_{side}"]
            inside = (line.shares > 0) & (line.shares < 1)
            regions[f"lid_{lid}_{side}"] = line.vertices[inside].astype(np.int32)
        if side in eyes:
            regions[f"eye_{side}"] = eyes[side].astype(np.int32)
    for name in ("face", "lips", "skin", "eye_area_left", "eye_area_right"):
        if name in transfer.source.head.regions:
            regions[name] = _carried_region(transfer, name)
    landmarks = face.head.landmarks
    return replace(
        face.head,
        **named,
        vertex_color=_colors(transfer),
        lip_rings=_lip_rings(face),
        outer_corners=landmarks[[48, 54]],
        inner_corners=landmarks[[60, 64]],
        regions=regions,
    )


def _lip_rings(face: Face) -> NDArray[np.int32]:
    """(2, column): once around the vermilion border and the contact line, lower lip first."""
    steps = np.linspace(0, 1, MOUTH_PLACES + 2)
    rings = []
    for which in ("outer", "inner"):
        lower, upper = (
            line.vertices[np.abs(line.shares[:, None] - steps).argmin(axis=0)]
            for line in (face.lines[f"{which}_lower"], face.lines[f"{which}_upper"])
        )
        rings.append(np.concatenate([lower, upper[-2:0:-1]]))
    return np.array(rings, np.int32)


def _colors(transfer: Transfer) -> NDArray[np.uint8]:
    """(vertex, 3) sRGB: skin of one colour takes the source's, so that lips are seen."""
    skin, colors = transfer.target.skin, transfer.target.head.vertex_color
    if len(np.unique(colors[skin], axis=0)) > 1:
        return colors
    carried = transfer.places.read(transfer.source.head.vertex_color.astype(np.float64))
    face = transfer.source.head.regions.get("face", np.zeros(0, np.int32))
    plain = np.median(transfer.source.head.vertex_color[face], axis=0) if len(face) else carried
    share = transfer.places.confidence[:, None]
    result = colors.copy()
    result[skin] = np.round(share * carried + (1 - share) * plain).astype(np.uint8)
    return result


def _carried_region(transfer: Transfer, name: str) -> NDArray[np.int32]:
    inside = np.zeros(transfer.source.head.vertex_count)
    inside[transfer.source.head.regions[name]] = 1
    share = transfer.places.read(inside) * (transfer.places.confidence > 0.1)
    return transfer.target.skin[share > 0.5].astype(np.int32)


def with_attached_parts(adoption: Adoption) -> HeadModel:
    """The adopted head, whose skin and eyeballs move already, with all other parts moving.

    Teeth move as one with the source's teeth that are nearest, as does each part in the mouth;
    lashes, brows, beards and what else lies on the skin follow it.
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
    jaws = []
    for names in JAWS:
        own = [source.regions[name] for name in names if name in source.regions]
        if not own:
            continue
        vertices = np.concatenate(own)
        places = transfer.similar(source.template[vertices].astype(np.float64))
        away, nearest = KDTree(places).query(points)
        moved = source.expression_basis[:, vertices[nearest]].astype(np.float64) @ turned.T
        jaws.append((float(np.median(away)), places[nearest], moved))
    # A part belongs to one jaw, whatever of the other is near some of it.
    away, places, moved = min(jaws, key=lambda jaw: jaw[0], default=(np.inf, points, points))
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
