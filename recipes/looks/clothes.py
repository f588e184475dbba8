"""Shirts: the body below the head's cut, a few millimetres further out.

The head's mesh ends at the base of the neck. MakeHuman's body goes on from there; its arms are
lowered, it is joined to the rim of the head, and a shell of cloth is laid over it. A band runs
round the neck, on the head's own skin, and its inner edge lies in that skin: knitted and narrow,
rolled down, or a collar with two points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage as ndimage
import scipy.sparse as sp
from scipy.interpolate import LinearNDInterpolator
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import spsolve
from scipy.spatial import KDTree

from elocute.numerics.smoothing import smoothstep
from recipes.head.face import NeutralFace
from recipes.head.makehuman import MakeHuman
from recipes.head.pose import axis_rotation
from recipes.head.topology import SmoothSpread, adjacency, limit_stencil
from recipes.looks.canvas import noise
from recipes.looks.cards import SKULL, Cards
from recipes.looks.surface import Skin, subdivided, unit

SHOULDER_DEG, ARM_DEG = 4.0, 27.0
"""How far MakeHuman's arms, which stand off, are lowered."""
HEM_M, ARM_M = 0.36, 0.30
"""The shirt ends this far below the eyes; what is further from the middle is hand and forearm."""
JOIN_M = 0.07
"""Within this of the rim the body gives way to the cut of the neck."""
CLOTH_M, LOOSEST_M = 0.005, 0.012
"""Cloth lies this far off the body, and further where it hangs."""
SMOOTHINGS = 12
LOCAL_M = 0.10
"""Further from the rim than this, cloth follows the rim as a whole."""
RIBS, SIZE = 150, 1024
SEAM_TURN, SEAM_ENDS = 0.24, 0.62
PLACKET_M, BUTTON_M, BUTTONS_M = 0.016, 0.0052, (0.022, 0.100, 0.178)
"""Half the width of the strip that buttons sit on, their radius, and how far below the band's
lower edge they are."""


@dataclass(frozen=True)
class Cut:
    """How a shirt goes round the neck.

    Parameters
    ----------
    edge_m : (3,) tuple of float
        Height of the band's upper edge over the plane of the head's cut: front, side, back.
    band : tuple of (float, float)
        Section of the band: how far down it lies, and how far off the skin, m.
    flap : (2,) tuple of int
        First and last ring of the section, counted from 0, which a collar's points draw out.
    starts_m : float
        Where the cloth of the body begins, down from the upper edge.
    band_share : float
        Of the picture's height; the body's cloth lies below it.
    knitted : bool
        Ribs on the band; otherwise woven, with a strip of buttons.
    """

    edge_m: tuple[float, float, float]
    band: tuple[tuple[float, float], ...]
    flap: tuple[int, int] = (0, 0)
    starts_m: float = 0.020
    band_share: float = 0.16
    knitted: bool = True


CUTS = {
    "crew": Cut(
        (0.001, 0.013, 0.010),
        (
            (0.0000, -0.0015),
            (0.0000, 0.0016),
            (0.0006, 0.0027),
            (0.0020, 0.0033),
            (0.0050, 0.0038),
            (0.0090, 0.0040),
            (0.0130, 0.0039),
            (0.0150, 0.0034),
            (0.0158, 0.0028),
            (0.0166, 0.0033),
        ),
    ),
    "roll": Cut(
        (0.034, 0.046, 0.046),
        (
            (0.0000, -0.0015),
            (0.0000, 0.0024),
            (0.0010, 0.0052),
            (0.0050, 0.0078),
            (0.0130, 0.0092),
            (0.0210, 0.0098),
            (0.0280, 0.0096),
            (0.0325, 0.0082),
            (0.0335, 0.0060),
            (0.0325, 0.0034),
            (0.0400, 0.0034),
            (0.0470, 0.0036),
        ),
        starts_m=0.052,
        band_share=0.32,
    ),
    "collar": Cut(
        (0.018, 0.034, 0.038),
        (
            (0.0020, -0.0015),
            (0.0004, 0.0012),
            (0.0000, 0.0026),
            (0.0006, 0.0042),
            (0.0060, 0.0062),
            (0.0150, 0.0090),
            (0.0250, 0.0120),
            (0.0330, 0.0150),
            (0.0334, 0.0138),
            (0.0250, 0.0100),
            (0.0160, 0.0052),
            (0.0200, 0.0038),
            (0.0320, 0.0038),
            (0.0420, 0.0038),
        ),
        flap=(4, 9),
        starts_m=0.046,
        band_share=0.30,
        knitted=False,
    ),
}
"""The shirts by their names."""
UPWARDS = 1.5
"""How much more up than inwards the way from the rim to the band's edge goes."""
POINT_DEG, POINT_FADES_DEG, POINT_DRAWS = 14.0, 50.0, 0.75
"""A collar is longest this far from the middle of the throat, as long as elsewhere from so far on,
and by this share longer."""


@dataclass(frozen=True, eq=False)
class Shirt:
    """Cards of a shirt, and what its pictures are painted from."""

    cut: Cut
    cards: Cards
    covers: np.ndarray  # skin vertices under it
    skull: np.ndarray  # (3, 2) as in `elocute.head.looks.cards.Cards`: here of the neck
    skull_m: np.ndarray  # (3,)


def lowered(mh: MakeHuman, body: np.ndarray) -> np.ndarray:
    """A body whose arms hang."""
    posed = body.copy()
    for side, sign in (("L", -1), ("R", 1)):
        for bone, degrees in (("shoulder01", SHOULDER_DEG), ("upperarm01", ARM_DEG)):
            pivot = mh.joint(f"{bone}.{side}____head", posed)
            weights = sum(
                weight
                for name, weight in mh.bone_weights.items()
                if f"{bone}.{side}" in mh.ancestors(name)
            )
            turn = axis_rotation("Z", sign * degrees)
            turned = (posed - pivot) @ turn.T + pivot
            posed += np.asarray(weights)[:, None] * (turned - posed)
    return posed


class Torso:
    """The head's skin round the cut, and the body that goes on from it."""

    def __init__(self, face: NeutralFace) -> None:
        anatomy, mh = face.anatomy, face.mh
        body = lowered(mh, face.body)
        self.eye = face.assembly.eye_centre * [0, 1, 1]
        base = mh.base
        faces = base.quads[base.groups == "body"]
        above = np.setdiff1d(anatomy.skin_of_base, anatomy.rim_of_base)
        is_head = np.isin(faces, above).any(1)
        low = body[faces][..., 1].max(1) > self.eye[1] - HEM_M
        near = np.abs(body[faces][..., 0]).min(1) < ARM_M
        rim = body[anatomy.rim_of_base]
        by_rim = KDTree(rim).query(body[faces].mean(1))[0] < 0.09
        kept = np.where(is_head, by_rim, low & near)
        used, local = np.unique(faces[kept], return_inverse=True)
        self.quads = local.reshape(-1, 4)
        self.is_head = np.asarray(is_head)[kept]
        points = limit_stencil(self.quads, len(used)) @ body[used]
        edge = np.isin(used, self._open_rim(self.quads, used))
        points[edge] = body[used[edge]]
        own = anatomy.local[used]
        is_skin = np.greater_equal(own, 0)
        rim_local = np.searchsorted(used, anatomy.rim_of_base)
        cut = np.zeros_like(points)
        cut[is_skin] = face.skin[own[is_skin]] - points[is_skin]
        away = KDTree(points[rim_local]).query(points)[0]
        free = np.flatnonzero((away < JOIN_M) & ~is_skin)
        spread = SmoothSpread(self.quads, len(used), rim_local, free, alpha=0.002)
        moved = spread(cut[rim_local])
        moved[is_skin] = cut[is_skin]
        self.points = points + moved
        self.rim = rim_local
        self.plane = face.bust
        self.skin = Skin(self.points, self.quads)

    @staticmethod
    def _open_rim(quads: np.ndarray, used: np.ndarray) -> np.ndarray:
        edges = np.sort(np.stack([quads, np.roll(quads, -1, 1)], -1).reshape(-1, 2), 1)
        pairs, count = np.unique(edges, axis=0, return_counts=True)
        return used[np.unique(pairs[count == 1])]

    def heights(self, points: np.ndarray) -> np.ndarray:
        """Over the plane of the cut, m."""
        return points @ self.plane.normal - self.plane.height


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
    points, quads, rim = _below(torso)
    edge, down = neckline(torso, points[rim], cut.edge_m)
    starts, _ = torso.skin.walk(edge, down, cut.starts_m)
    points = _from_the_band(points, quads, rim, starts, torso)
    points = _hung(points, quads, rim, torso)
    points, quads, rim = _hemmed(points, quads, rim, torso.eye[1] - HEM_M)
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
    uv, uv_quads = _texture(whole, whole_quads, cut, count, rim + own)
    return Shirt(
        cut,
        _bound(face, whole, whole_quads, uv, uv_quads),
        _covered(face, torso, edge, down),
        *_measures(face),
    )


def _below(torso: Torso) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The body below the rim, finer, and the vertices of its rim in order."""
    points, quads, edges = subdivided(torso.points, torso.quads)
    parent = np.repeat(torso.is_head, 4)
    order = []
    for a, b in zip(torso.rim, np.roll(torso.rim, -1), strict=True):
        order += [int(a), edges[min(a, b), max(a, b)]]
    used, local = np.unique(quads[~parent], return_inverse=True)
    return points[used], local.reshape(-1, 4), np.searchsorted(used, order)


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
    edge = np.isin(np.arange(len(points)), Torso._open_rim(quads, np.arange(len(points))))
    for _ in range(SMOOTHINGS):
        smooth = 0.5 * cloth + 0.5 * (walk @ cloth)
        smooth[edge] = cloth[edge]
        place, normal = torso.skin.nearest(smooth)
        off = ((smooth - place) * normal).sum(1, keepdims=True)
        cloth = place + normal * np.clip(off, CLOTH_M, LOOSEST_M)
    place, normal = torso.skin.nearest(points[rim])
    cloth[rim] = place + 0.0042 * normal
    return cloth


def _hemmed(points, quads, rim, height: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut along a horizontal plane: vertices below it come up along their edges."""
    low = points[:, 1] < height
    quads = quads[~low[quads].all(1)]
    cut = points.copy()
    lift = np.full(len(points), -np.inf)
    for a, b in np.stack([quads, np.roll(quads, -1, 1)], -1).reshape(-1, 2).tolist():
        for down, up in ((a, b), (b, a)):
            if low[down] and not low[up] and points[up, 1] > lift[down]:
                lift[down] = points[up, 1]
                share = (height - points[down, 1]) / (points[up, 1] - points[down, 1])
                cut[down] = points[down] + share * (points[up] - points[down])
    alone = low & ~np.isfinite(lift)
    cut[alone, 1] = height
    used, local = np.unique(quads, return_inverse=True)
    return cut[used], local.reshape(-1, 4), np.searchsorted(used, rim)


def _band(torso: Torso, edge, down, cut: Cut) -> list[np.ndarray]:
    """The rings of the band, each (column, 3), from the upper edge down."""
    ways, steps = [edge], 0.001
    furthest = max(along for along, _ in cut.band) * (1 + POINT_DRAWS)
    points, towards = edge, down
    while (len(ways) - 1) * steps < furthest:
        points, towards = torso.skin.walk(points, towards, steps)
        ways.append(points)
    way = np.array(ways)
    drawn = _points_of_a_collar(edge)
    rings = []
    for ring, (along, off) in enumerate(cut.band):
        length = np.full(len(edge), along)
        if cut.flap[0] <= ring < cut.flap[1]:
            length *= drawn
            off = off + 0.004 * (drawn - 1).clip(0)[:, None]
        place = length / steps
        low = np.minimum(place.astype(int), len(way) - 2)
        column, share = np.arange(len(edge)), (place - low)[:, None]
        points = (1 - share) * way[low, column] + share * way[low + 1, column]
        points, normal = torso.skin.nearest(points)
        rings.append(points + off * unit(_round(normal)))
    return rings


def _points_of_a_collar(edge: np.ndarray) -> np.ndarray:
    """(column,) how long a collar is round the neck: open at the throat, two points beside it."""
    out = edge - edge.mean(0)
    aside = np.degrees(np.abs(np.arctan2(out[:, 0], out[:, 2])))
    at = (0.0, POINT_DEG, POINT_FADES_DEG, 180.0)
    return np.interp(aside, at, (0.15, 1 + POINT_DRAWS, 1.0, 1.0))


def _strip(upper: np.ndarray, lower: np.ndarray) -> np.ndarray:
    return np.stack([upper, lower, np.roll(lower, -1), np.roll(upper, -1)], 1)


def _outwards(points: np.ndarray, band: np.ndarray) -> bool:
    middle = points[band].mean((0, 1))
    normal = np.cross(
        points[band[:, 1]] - points[band[:, 0]], points[band[:, 2]] - points[band[:, 0]]
    )
    return bool((normal * (points[band].mean(1) - middle) * [1, 0, 1]).sum() > 0)


def _texture(points, quads, cut: Cut, columns: int, rim) -> tuple[np.ndarray, np.ndarray]:
    """(texcoord, 2) and (face, 4): round the neck from the back, and down from the band's edge."""
    rings = len(cut.band)
    band_faces = rings * columns
    count = len(points)
    turn, down = np.zeros(count), np.zeros(count)
    start = int(points[:columns, 2].argmin())
    share = ((np.arange(columns) - start) % columns) / columns
    section = np.r_[0, np.cumsum(np.linalg.norm(np.diff(cut.band, axis=0), axis=1))]
    section = section / (section[-1] + 0.0035)
    for ring in range(rings):
        own = slice(ring * columns, (ring + 1) * columns)
        turn[own], down[own] = share, cut.band_share * section[ring]
    body = quads[band_faces:]
    angle = _carried_angle(points, body, rim, 2 * np.pi * share)
    below = np.arange(rings * columns, count)
    turn[below] = angle[below] / (2 * np.pi) % 1
    far = _distances(points, body, rim)
    down[below] = cut.band_share + (1 - cut.band_share) * np.sqrt(far[below] / far[below].max())
    turn[rim] = share
    corner = turn[quads]
    # Faces over the seam at the back count on beyond one.
    wraps = np.ptp(corner, axis=1) > 0.5
    corner = np.where(wraps[:, None] & (corner < 0.5), corner + 1, corner)
    texel = np.stack([0.02 + 0.94 * corner, 1 - (0.005 + 0.99 * down[quads])], -1)
    uv, uv_quads = np.unique(texel.reshape(-1, 2).round(6), axis=0, return_inverse=True)
    return np.clip(uv, 0, 1), uv_quads.reshape(-1, 4)


def _carried_angle(points, quads, rim, angle) -> np.ndarray:
    """The angle of the rim carried over the cloth (harmonic)."""
    count = len(points)
    links = adjacency(quads, count)
    degree = np.asarray(links.sum(1)).ravel()
    used = np.flatnonzero(degree > 0)
    free = np.setdiff1d(used, rim)
    laplace = (sp.diags(degree) - links).tocsr()
    given = np.stack([np.cos(angle), np.sin(angle)], 1)
    solved = np.asarray(spsolve(laplace[free][:, free].tocsc(), -(laplace[free][:, rim] @ given)))
    whole = np.zeros(count)
    whole[free] = np.arctan2(solved[:, 1], solved[:, 0])
    whole[rim] = angle
    return whole


def _distances(points, quads, rim) -> np.ndarray:
    pairs = np.stack([quads, np.roll(quads, -1, 1)], -1).reshape(-1, 2)
    diagonals = np.vstack([quads[:, [0, 2]], quads[:, [1, 3]]])
    pairs = np.vstack([pairs, diagonals])
    length = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    graph = sp.coo_matrix((length, tuple(pairs.T)), shape=(len(points),) * 2).tocsr()
    graph = graph.maximum(graph.T)
    far = np.asarray(dijkstra(graph, directed=False, indices=rim, min_only=True))
    return np.where(np.isfinite(far), far, 0)


CARDINALS = 4
COVERED_M = 0.002
"""Skin further below the band's upper edge than this is not seen."""


def _cardinals(face: NeutralFace) -> np.ndarray:
    """Rim vertices at the left, right, front and back."""
    rim = face.anatomy.rim
    points = face.skin[rim]
    left = int(rim[points[:, 0].argmax()])
    front = rim[np.argsort(np.abs(points[:, 0]) - 10 * points[:, 2])[0]]
    back = rim[np.argsort(np.abs(points[:, 0]) + 10 * points[:, 2])[0]]
    return np.array([left, face.anatomy.skin_mirror[left], front, back])


def _bound(face, points, quads, uv, uv_quads) -> Cards:
    """Near the neck on the skin beside it, further away on the rim as a whole."""
    skin = face.skin
    away, near = map(np.asarray, KDTree(skin).query(points, 3))
    local = 1 / np.maximum(away, 1e-4)
    local /= local.sum(1, keepdims=True)
    far = smoothstep(np.clip(away[:, 0] / LOCAL_M, 0, 1))[:, None]
    whole = _cardinals(face)
    index = np.hstack([near, np.tile(whole, (len(points), 1))])
    weights = np.hstack([local * (1 - far), np.tile(far / CARDINALS, (1, CARDINALS))])
    offset = points - np.einsum("vk,vkc->vc", weights, skin[index])
    return Cards(index, weights, offset, quads, uv, uv_quads, np.ones(len(points)), points)


def _measures(face: NeutralFace) -> tuple[np.ndarray, np.ndarray]:
    """What scales the shirt: the neck's width and depth, and the height of the skull."""
    left, right, front, back = _cardinals(face)
    pairs = np.array([[left, right], face.anatomy.local[list(SKULL[1])], [front, back]])
    between = [abs(face.skin[a, k] - face.skin[b, k]) for k, (a, b) in enumerate(pairs)]
    return pairs, np.array(between)


def _covered(face: NeutralFace, torso: Torso, edge, down) -> np.ndarray:
    """Skin vertices under cloth."""
    inner = torso.skin.walk(edge, down, COVERED_M)[0]
    low = np.flatnonzero(torso.heights(face.skin) < torso.heights(edge).max() + 0.03)
    nearest = KDTree(inner).query(face.skin[low])[1]
    under = ((face.skin[low] - inner[nearest]) * down[nearest]).sum(1) > 0
    return low[under]


def pictures(shirt: Shirt) -> tuple[np.ndarray, np.ndarray]:
    """(SIZE, SIZE, 3) grey brightness and normals of the cloth, both 0..1."""
    cut, height = shirt.cut, np.zeros((SIZE, SIZE))
    down = np.repeat(((np.arange(SIZE) + 0.5) / SIZE)[:, None], SIZE, 1)
    turn = np.repeat((((np.arange(SIZE) + 0.5) / SIZE - 0.02) / 0.94)[None], SIZE, 0)
    below = down - cut.band_share
    band = smoothstep(np.clip((-0.012 - below) / 0.008, 0, 1))
    ribs = np.cos(2 * np.pi * RIBS * turn) if cut.knitted else np.ones_like(turn)
    height += 0.10 * band * ribs * smoothstep(np.clip(down / 0.03, 0, 1))
    cloth = 1 - band
    height += cloth * _folds(below / (1 - cut.band_share))
    near = np.exp(-((below / 0.3) ** 2))
    height += (0.006 + 0.022 * near) * noise(11, SIZE, 1.0)
    seam = np.exp(-(((below - 0.004) / 0.005) ** 2)) * cut.knitted
    height -= 0.35 * seam
    shoulder = _shoulder_seam(turn, below)
    height -= 0.25 * shoulder
    grey = (
        0.93
        - 0.15 * shoulder
        - 0.33 * seam
        + 0.018 * noise(13, SIZE, 1.2)
        - 0.05 * band * (1 - ribs) / 2
    )
    if not cut.knitted:
        seams, buttons = _buttoned(shirt, below)
        height += 0.9 * buttons - 0.5 * seams
        grey = grey - 0.22 * seams + 0.10 * (buttons > 0.5)
    slope_x, slope_y = ndimage.sobel(height, 1), ndimage.sobel(height, 0)
    normal = np.stack([-slope_x, slope_y, np.ones_like(height)], -1)
    normal = unit(normal) * 0.5 + 0.5
    return np.repeat(grey.clip(0, 1)[..., None], 3, 2), normal


def _buttoned(shirt: Shirt, below: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(SIZE, SIZE) each: the seams of the strip down the front, and its buttons."""
    cards = shirt.cards
    corners, first = np.unique(cards.uv_quads.ravel(), return_index=True)
    points = cards.points[cards.quads.ravel()[first]]
    texel = cards.uv[corners] * [1, -1] + [0, 1]
    front = (points[:, 2] > np.median(points[:, 2])) & (np.abs(points[:, 0]) < 0.08)
    front &= texel[:, 1] > shirt.cut.band_share * 0.985
    at = (np.arange(SIZE) + 0.5) / SIZE
    x, y = np.meshgrid(at, at)
    place = LinearNDInterpolator(texel[front], points[front], fill_value=1.0)(x, y)
    aside = np.abs(place[..., 0])
    cloth = smoothstep(np.clip(below / 0.004, 0, 1))
    seams = np.exp(-(((aside - PLACKET_M) / 0.0007) ** 2)) * cloth
    top = points[front, 1].max()
    away = np.min([np.hypot(aside, place[..., 1] - (top - far)) for far in BUTTONS_M], axis=0)
    buttons = smoothstep(np.clip((BUTTON_M - away) / 0.0012, 0, 1))
    return seams, buttons * cloth


def _shoulder_seam(turn: np.ndarray, below: np.ndarray) -> np.ndarray:
    """A line over each shoulder, a little before its ridge."""
    seam = np.zeros_like(turn)
    for place in (0.5 - SEAM_TURN, 0.5 + SEAM_TURN):
        seam += np.exp(-(((turn - place) / 0.0022) ** 2))
    return seam * smoothstep(np.clip(below / 0.01, 0, 1)) * (below < SEAM_ENDS)


def _folds(far: np.ndarray) -> np.ndarray:
    """Soft folds that run down from the band and grow with the distance from it, 0 to 1."""
    slack = smoothstep(np.clip((far - 0.2) / 0.5, 0, 1))
    long = noise(14, SIZE, (110, 26)) + 0.6 * noise(15, SIZE, (60, 18))
    return 2.6 * slack * long
