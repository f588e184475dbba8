"""Shirts: the body below the head's cut, a few millimetres further out.

The head's mesh ends at the base of the neck. MakeHuman's body goes on from there; its arms are
lowered, it is joined to the rim of the head, and a shell of cloth is laid over it. A band runs
round the neck, on the head's own skin, and its inner edge lies in that skin: knitted and narrow,
rolled down, or under a collar with two points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage as ndimage
import scipy.sparse as sp
from scipy.spatial import KDTree

from elocute.head.normals import vertex_normals
from recipes.head.face import NeutralFace
from recipes.head.shade import occlusion
from recipes.head.topology import SmoothSpread, adjacency
from recipes.looks import collars
from recipes.looks.cards import Cards
from recipes.looks.cloth_binding import bound, measures
from recipes.looks.cloth_map import texture
from recipes.looks.cuts import Cut
from recipes.looks.surface import Skin, triangles, unit
from recipes.looks.torso import HEM_M, JOIN_M, Torso, hemmed

CLOTH_M, LOOSEST_M = 0.005, 0.012
"""Cloth lies this far off the body, and further where it hangs."""
SMOOTHINGS = 12
UPWARDS = 1.5
"""How much more up than inwards the way from the rim to the band's edge goes."""
LIP_WAVES_M = 0.0022
"""How far a rolled band's lower edge wavers."""
DARKEST, CONTACT, SHADED_M = 0.16, 0.05, 0.040
"""Light in the deepest fold of the cloth, and on skin under it; how far cloth shades skin."""
COVERED_M = 0.002
"""Skin further below the band's upper edge than this is not seen."""


@dataclass(frozen=True, eq=False)
class Shirt:
    """Cards of a shirt, and what its pictures are painted from."""

    cut: Cut
    cards: Cards
    covers: np.ndarray  # skin vertices under it
    skull: np.ndarray  # (3, 2) as in `elocute.head.looks.cards.Cards`: here of the neck
    skull_m: np.ndarray  # (3,)
    near: np.ndarray  # skin vertices that it shades
    near_light: np.ndarray  # (near,) 0..1 the light that it leaves them
    eye_m: np.ndarray  # (3,) m between the eyes
    columns: int  # vertices of a ring
    button_faces: int  # at the end


def neckline(
    torso: Torso, rim: np.ndarray, edge_m: tuple[float, float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """(column, 3) the upper edge of the band above each vertex of the rim (column, 3), and the
    direction from it down the body."""
    centre = rim.mean(0)
    out = unit((rim - centre) * [1, 0, 1])
    ahead, side, behind = edge_m
    front = out[:, 2]
    level = side + np.where(front > 0, ahead - side, behind - side) * front**2
    fall = out - np.array([0, UPWARDS, 0])
    points, towards = rim.copy(), -fall
    step = 0.0005
    found = points.copy()
    open_ = np.ones(len(rim), bool)
    for _ in range(240):
        points, towards = torso.skin.walk(points, towards, step)
        found[open_] = points[open_]
        open_ &= torso.heights(points) < level
        if not open_.any():
            break
    found = _round(found)
    found, normal = torso.skin.nearest(found)
    return found, unit(fall - (fall * normal).sum(1, keepdims=True) * normal)


def _round(ring: np.ndarray) -> np.ndarray:
    return ndimage.gaussian_filter1d(ring, 1.5, axis=0, mode="wrap")


def shirt(face: NeutralFace, cut: Cut) -> Shirt:
    """A shirt on the neutral face."""
    torso = Torso(face)
    points, quads, rim = torso.below()
    edge, down = neckline(torso, points[rim], cut.edge_m)
    starts, _ = torso.skin.walk(edge, down, cut.starts_m)
    points = _from_the_band(points, quads, rim, starts, torso)
    points = _hung(points, quads, rim, torso)
    points, quads, rim = hemmed(points, quads, rim, torso.eye[1] - HEM_M)
    rings = _band(torso, edge, down, cut)
    count = len(rim)
    own = count * len(rings)
    whole = np.vstack([*rings, points])
    band = np.vstack(
        [
            _strip(k * count + np.arange(count), (k + 1) * count + np.arange(count))
            for k in range(len(rings) - 1)
        ]
        + [_strip((len(rings) - 1) * count + np.arange(count), rim + own)]
    )
    if not _outwards(whole, band):
        band = band[:, ::-1]
    whole_quads = np.vstack([band, quads + own])
    uv, uv_quads = texture(whole, whole_quads, cut, rings, rim + own)
    sewn = collars.buttons(Skin(points, quads), points[rim]) if not cut.knitted else []
    for button, faces in sewn:
        whole_quads = np.vstack([whole_quads, faces + len(whole)])
        uv_quads = np.vstack([uv_quads, np.full_like(faces, len(uv))])
        whole = np.vstack([whole, button])
    uv = np.vstack([uv, [collars.BUTTON_UV]])
    covers = _covered(face, torso, edge, down)
    light, near, near_light = _shades(face, whole, whole_quads, covers)
    return Shirt(
        cut,
        bound(face, whole, whole_quads, uv, uv_quads, light),
        covers,
        *measures(face),
        near,
        near_light,
        torso.eye,
        count,
        sum(len(faces) for _, faces in sewn),
    )


def _shades(
    face: NeutralFace, points: np.ndarray, quads: np.ndarray, covers: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(vertex,) brightness of the cloth; the skin beside it and (near,) the light left there."""
    skin, skin_quads = face.skin, face.anatomy.skin_quads
    seen = skin_quads[~np.isin(skin_quads, covers).all(1)]
    cloth, head = triangles(quads), triangles(seen) + len(points)
    whole, both = np.vstack([points, skin]), np.vstack([cloth, head])
    normals = vertex_normals(whole, both).astype(float)
    cloth_normals = normals[: len(points)]
    free = occlusion(whole, both, normals)[: len(points)]
    light = (DARKEST + (1 - DARKEST) * np.clip(free * 1.3, 0, 1)) ** (1 / 2.2)
    low = np.flatnonzero(skin[:, 1] < points[:, 1].max() + SHADED_M)
    probes = np.vstack([points, skin[low]])
    outwards = np.vstack([cloth_normals, vertex_normals(skin, triangles(skin_quads))[low]])
    left = occlusion(probes, cloth, outwards.astype(float), SHADED_M)[len(points) :]
    left = CONTACT + (1 - CONTACT) * left**2
    shaded = left < 0.98
    return light, low[shaded], left[shaded]


def _from_the_band(points, quads, rim, starts, torso: Torso) -> np.ndarray:
    away = KDTree(points[rim]).query(points)[0]
    free = np.flatnonzero(away < JOIN_M)
    spread = SmoothSpread(quads, len(points), rim, free, alpha=0.002)
    moved = points + spread(starts - points[rim])
    near = away < JOIN_M
    moved[near] = torso.skin.nearest(moved[near])[0]
    return moved


def _hung(points, quads, rim, torso: Torso) -> np.ndarray:
    """Cloth over a body: off the skin, smooth, tight at the band."""
    _, normal = torso.skin.nearest(points)
    cloth = points + CLOTH_M * normal
    links = adjacency(quads, len(points))
    walk = sp.diags(1 / np.maximum(np.asarray(links.sum(1)).ravel(), 1)) @ links
    edge = np.isin(np.arange(len(points)), Torso.open_rim(quads, np.arange(len(points))))
    for _ in range(SMOOTHINGS):
        smooth = 0.5 * cloth + 0.5 * (walk @ cloth)
        smooth[edge] = cloth[edge]
        place, normal = torso.skin.nearest(smooth)
        off = ((smooth - place) * normal).sum(1, keepdims=True)
        cloth = place + normal * np.clip(off, CLOTH_M, LOOSEST_M)
    place, normal = torso.skin.nearest(points[rim])
    cloth[rim] = place + 0.0042 * normal
    return cloth


def _band(torso: Torso, edge, down, cut: Cut) -> list[np.ndarray]:
    """The rings of the band, each (column, 3), from the upper edge down."""
    ways, steps = [edge], 0.001
    furthest = max(max(along for along, _ in cut.band) + LIP_WAVES_M * 3, collars.LONGEST_M)
    points, towards = edge, down
    while (len(ways) - 1) * steps < furthest:
        points, towards = torso.skin.walk(points, towards, steps)
        ways.append(points)
    way = ndimage.gaussian_filter1d(np.array(ways), 1.5, axis=1, mode="wrap")
    waver = _waver(len(edge))
    rings = []
    for ring, (along, off) in enumerate(cut.band):
        length = np.full(len(edge), along)
        if cut.lip[0] <= ring < cut.lip[1]:
            length += LIP_WAVES_M * waver * (ring - cut.lip[0] + 1) / np.ptp(cut.lip)
        points, normal = torso.skin.nearest(collars.along(way, length / steps))
        rings.append(_evened(points + off * unit(_round(normal))))
    if not cut.knitted:
        rings[4:4] = collars.leaf(torso.skin, way, steps, rings[3])
    return rings


def _evened(ring: np.ndarray) -> np.ndarray:
    return ndimage.gaussian_filter1d(ring, 1.4, axis=0, mode="wrap")


def _waver(count: int) -> np.ndarray:
    """(column,) about -1..1: how a knitted edge hangs round a neck."""
    drawn = np.random.default_rng(4).normal(size=count)
    drawn = ndimage.gaussian_filter1d(drawn, 4.0, mode="wrap")
    return drawn / np.abs(drawn).max()


def _strip(upper: np.ndarray, lower: np.ndarray) -> np.ndarray:
    return np.stack([upper, lower, np.roll(lower, -1), np.roll(upper, -1)], 1)


def _outwards(points: np.ndarray, band: np.ndarray) -> bool:
    middle = points[band].mean((0, 1))
    normal = np.cross(
        points[band[:, 1]] - points[band[:, 0]], points[band[:, 2]] - points[band[:, 0]]
    )
    return bool((normal * (points[band].mean(1) - middle) * [1, 0, 1]).sum() > 0)


def _covered(face: NeutralFace, torso: Torso, edge, down) -> np.ndarray:
    """Skin vertices under cloth."""
    inner = torso.skin.walk(edge, down, COVERED_M)[0]
    low = np.flatnonzero(torso.heights(face.skin) < torso.heights(edge).max() + 0.03)
    nearest = KDTree(inner).query(face.skin[low])[1]
    under = ((face.skin[low] - inner[nearest]) * down[nearest]).sum(1) > 0
    return low[under]
