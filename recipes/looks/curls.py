"""Curls as ribbons that grow on the scalp, and hair cut close: MakeHuman's hair has neither."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from PIL import Image, ImageDraw
from scipy.interpolate import griddata
from scipy.spatial import KDTree

from recipes.looks.canvas import blurred, noise
from recipes.looks.cards import Cards
from recipes.looks.groom import ribbons_of
from recipes.looks.grooms import stubble
from recipes.looks.ribbons import ribbons, together
from recipes.looks.scalp import Places, Scalp, depth_mm, grows, shell
from recipes.looks.surface import subdivided, unit

CURL_PX, LANES = 512, 8
"""Size of the picture of curls, and how many locks stand in it side by side."""
CURL_FINER, CURL_POINTS, CURL_CLUMPS = 3, 40, 4
CURL_STRANDS = (26, 24, 20, 18, 16, 13, 10, 7)
"""Strands of each lock: the last are single hairs."""
CURL_TONE, CURL_CLUMP_TONE = 0.72, 0.10
BAND = 1.15
"""Width of a curl's ribbon by the radius."""
SHELL_SHADE = 0.65
"""The shell under curls is dark."""
RINGS, RING_PX, RING_BEND = 6000, (2.1, 5.2), (150, 330)
"""How many coils its picture shows, their radius, and how far round they go, degrees."""
RING_DEEP, RING_TONE, RING_UNEVEN = 0.34, 0.95, 0.30
"""Brightness between them, of the lightest on average, and how much they differ."""


@dataclass(frozen=True)
class Curl:
    """How hair curls.

    Parameters
    ----------
    apart_m, edge_apart_m : float
        Distance of the roots: on top, and at the hairline, where curls are smaller.
    radius_m, edge_radius_m : float
        Radius of curls, likewise.
    rise_m : float
        How far a turn of a curl takes it on.
    turns : float
        Of a whole curl.
    steps : int
        Pairs of vertices along a ribbon.
    shell_m : float
        Under the curls lies a shell this far off the skin.
    volume_m : float
        How much further shell and curls lie off the skin in the middle of the head.
    within : float
        From how much nearer the crown its shell takes its picture: what stands steep at the
        hairline is closed there.
    """

    apart_m: float
    edge_apart_m: float
    radius_m: float
    edge_radius_m: float
    rise_m: float
    turns: float
    steps: int
    shell_m: float
    volume_m: float = 0.0
    within: float = 1.0


CURLS = {
    "curls": Curl(0.0076, 0.0038, 0.0056, 0.0028, 0.0105, 2.2, 15, 0.0035),
    "coils": Curl(0.0051, 0.0025, 0.0034, 0.0019, 0.0050, 1.4, 9, 0.0022),
    "afro": Curl(0.0061, 0.0034, 0.0048, 0.0026, 0.0072, 1.6, 7, 0.0030, 0.034, 0.87),
}
"""Styles by the names of their files."""
BUZZ_M = 0.0014
"""Hair cut to a few millimetres is a shell of stubs this far off the skin."""


def curl_picture(scalp: Scalp) -> np.ndarray:
    """(CURL_PX, 2 CURL_PX, 4): coils of the shell, and beside them locks."""
    return np.hstack([_thinned(coil_picture(), scalp, CURLED_THIN), lock_picture()])


def lock_picture() -> np.ndarray:
    """(CURL_PX, CURL_PX, 4): locks side by side of strands that part, cross and end one by one."""
    rng = np.random.default_rng(23)
    size = CURL_PX * CURL_FINER
    tone, alpha = Image.new("L", (size, size), 110), Image.new("L", (size, size), 0)
    drawings = ImageDraw.Draw(tone), ImageDraw.Draw(alpha)
    t = np.linspace(0, 1, CURL_POINTS)
    for lane, count in enumerate(CURL_STRANDS):
        middles = rng.uniform(0.2, 0.8, CURL_CLUMPS)
        lights = rng.normal(0, CURL_CLUMP_TONE, CURL_CLUMPS)
        for _ in range(count):
            clump = rng.integers(CURL_CLUMPS)
            wander = np.sin(2 * np.pi * (rng.uniform(0.5, 1.6) * t + rng.uniform()))
            x = middles[clump] + rng.normal(0, 0.12) + rng.uniform(0.02, 0.12) * wander
            x = np.clip(0.5 + (x - 0.5) * (1 - 0.5 * t**3), 0.06, 0.94)
            rows = size * (1 - rng.uniform(0.72, 0.98) * t)
            places = list(zip(size * (lane + x) / LANES, rows, strict=True))
            light = np.clip(CURL_TONE + lights[clump] + rng.normal(0, 0.13), 0.32, 1.0)
            broad = int(rng.integers(3, 7))
            cut = int(0.75 * CURL_POINTS)
            for drawing, fill in zip(drawings, (round(255 * light), 255), strict=True):
                drawing.line(places[: cut + 1], fill=fill, width=broad, joint="curve")
                drawing.line(places[cut:], fill=fill, width=max(2, broad - 2))
    grey, cover = (
        np.asarray(each.resize((CURL_PX, CURL_PX), Image.Resampling.BOX), float) / 255
        for each in (tone, alpha)
    )
    near = blurred(grey * cover, 2.0) / np.maximum(blurred(cover, 2.0), 1e-4)
    grey = np.where(cover > 0.02, grey * cover + near * (1 - cover), np.maximum(near, 0.3))
    return np.dstack([grey, grey, grey, np.clip(1.2 * cover, 0, 1)])


def coil_picture() -> np.ndarray:
    """(CURL_PX, CURL_PX, 4): coils that lie over each other, as one sees them between locks."""
    rng = np.random.default_rng(31)
    size = CURL_PX * CURL_FINER
    tone = Image.new("L", (size, size), round(255 * RING_DEEP))
    drawing = ImageDraw.Draw(tone)
    for k in range(RINGS):
        x, y = rng.uniform(0, size, 2)
        wide, high = CURL_FINER * rng.uniform(*RING_PX, 2)
        start = rng.uniform(0, 360)
        # The later, the further out and the lighter.
        light = RING_DEEP + (RING_TONE - RING_DEEP) * np.sqrt(k / RINGS)
        fill = round(255 * np.clip(light + rng.normal(0, RING_UNEVEN / 2), 0.1, 1))
        box = (x - wide, y - high, x + wide, y + high)
        drawing.arc(box, start, start + rng.uniform(*RING_BEND), fill, int(rng.integers(2, 5)))
    small = tone.resize((CURL_PX, CURL_PX), Image.Resampling.BOX)
    grey = np.asarray(small, float) / 255
    return np.dstack([grey, grey, grey, np.ones_like(grey)])


SHELL_HEIGHT = 0.92
"""Where the shell lies, of the volume."""
FULL_MM = (4.0, 10.0, 17.0, 25.0, 34.0)
"""Distances from the hairline between which hair comes to its volume."""
THIN_MM = (-1.0, 0.0, 1.0, 2.0, 3.0, 4.5, 6.0)
"""Distances from the hairline over which a shell closes: its edge is hairs, no line."""
CURLED_THIN, STUBS_THIN, THIN_SOFT = 0.85, 0.75, 0.16
"""How much of that way goes by before the gaps between coils close, or between stubs, and how soft
their edges are."""
EDGE_TONE = 0.4
"""Brightness at its edge: what lies open there in full light would be chips of grey."""
MAP_RAD = 1.8
"""How far down from the crown a shell's picture reaches."""
CURLED_EDGE_MM, CURLED_LEAST, CURLED_BELOW_MM = 9.0, (0.4, 0.22), (-20.0, 20.0)
"""How deep the hairline of curls is, and how thick hair is there at least: below the ears, where
single curls would hang from a lobe, and above them, between these heights over the eyes."""


def full(millimetres: np.ndarray) -> np.ndarray:
    """(place,) 0 at the hairline to 1 where hair has all its volume, as round as a ball."""
    share = np.mean([grows(millimetres, inset) for inset in FULL_MM], axis=0)
    return np.sqrt(1 - (1 - share) ** 2)


def curls(scalp: Scalp, curl: Curl) -> Cards:
    """Curls all over the scalp, on a dark shell."""
    rng = np.random.default_rng(8)
    fitting, dense = scalp.fitting, scalp.skin
    roots = _apart(scalp, rng, curl)
    place = dense.points[roots]
    share = _behind(scalp.places(place))
    normal = dense.normals[roots]
    count = len(roots)
    fall = np.stack([0.15 * rng.normal(size=count), np.full(count, -0.35), np.full(count, -0.1)], 1)
    axis = unit(normal + fall + 0.38 * rng.normal(size=(count, 3)))
    side = unit(np.cross(axis, rng.normal(size=(count, 3))))
    other = np.cross(axis, side)
    radius = curl.edge_radius_m + (curl.radius_m - curl.edge_radius_m) * share
    radius *= rng.uniform(0.75, 1.25, count)
    turns = curl.turns * rng.uniform(0.7, 1.2, count) * (0.55 + 0.45 * share)
    t = np.linspace(0, 1, curl.steps)
    angle = 2 * np.pi * turns[:, None] * t + rng.uniform(0, 2 * np.pi, (count, 1))
    hand = rng.choice([-1.0, 1.0], (count, 1))
    wide = radius[:, None] * np.clip(t / 0.12, 0.1, 1) * (1 - 0.35 * t)
    stands = curl.volume_m * full(scalp.places(place)) * rng.uniform(0.85, 1.05, count)
    place = place + normal * stands[:, None]
    rise = curl.rise_m * turns[:, None] * (radius / curl.radius_m)[:, None] * t
    paths = (
        place[:, None]
        + axis[:, None] * rise[..., None]
        + side[:, None] * (wide * np.cos(angle))[..., None]
        + other[:, None] * (wide * np.sin(angle) * hand)[..., None]
    )
    foot, out = dense.nearest(paths.reshape(-1, 3))
    above = ((paths.reshape(-1, 3) - foot) * out).sum(1, keepdims=True)
    paths = paths + (out * np.maximum(-above, 0)).reshape(paths.shape)
    half = BAND / 2 * radius[:, None] * np.clip(t / 0.1, 0.3, 1) * np.clip((1 - t) / 0.3, 0.15, 1)
    across = axis[:, None] * half[..., None] * np.ones((1, curl.steps, 1))
    lane = rng.integers(0, LANES, count)
    edges = (lane[:, None] + np.array([0.06, 0.94])) / LANES
    uv = np.stack(
        [
            np.broadcast_to(edges[:, None], (count, curl.steps, 2)),
            np.broadcast_to((0.04 + 0.92 * t)[None, :, None], (count, curl.steps, 2)),
        ],
        -1,
    )
    deep = np.clip(rise / (curl.rise_m * 1.4), 0, 1)
    shade = (0.60 + 0.40 * deep) * rng.uniform(0.75, 1.0, (count, 1))
    index, weights = fitting.nearest(dense.points[roots])
    below = shell(
        scalp,
        lambda places: curl.shell_m + SHELL_HEIGHT * curl.volume_m * full(places),
        0.0,
        SHELL_SHADE,
        sideburns=True,
    )
    locks = ribbons(paths, across, index, weights, fitting.skin, uv, shade)
    return _side_by_side(_mapped(scalp, below, curl.within), locks)


def _mapped(scalp: Scalp, below: Cards, within: float = 1.0) -> Cards:
    """A shell with places in a picture round the crown, by the skin that it lies on."""
    foot = np.einsum("vk,vkc->vc", below.weights, scalp.fitting.skin[below.index])
    return replace(below, uv=0.5 + within * (_round_the_crown(scalp.fitting.skin, foot) - 0.5))


def _round_the_crown(skin: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(n, 2) 0..1: places in a picture round the crown, the distance from it kept: nothing is
    drawn out."""
    x, y, z = (points - skin[skin[:, 1] > 0].mean(0)).T
    down, round_ = np.arctan2(np.hypot(x, z), y), np.arctan2(x, z)
    away = 0.48 * np.minimum(down / MAP_RAD, 1)[:, None]
    return 0.5 + away * np.stack([np.sin(round_), np.cos(round_)], 1)


def _thinned(picture: np.ndarray, scalp: Scalp, thin: float) -> np.ndarray:
    """A shell's picture (CURL_PX, CURL_PX, 4) with the hairline in its alpha: where hair is thin
    there are but the lightest hairs, the uppermost, further back what lies between them too."""
    skin = scalp.fitting.skin
    points, _, _ = subdivided(skin, scalp.fitting.face.anatomy.skin_quads)
    places = scalp.places(points)
    near = grows(places, 2 * THIN_MM[0]) > 0
    behind = np.mean([grows(places[near], inset) for inset in THIN_MM], axis=0)
    texels = (np.arange(CURL_PX) + 0.5) / CURL_PX
    u, v = np.meshgrid(texels, texels[::-1])
    known = _round_the_crown(skin, points[near])
    share = griddata(known, behind, (u, v), fill_value=0.0)
    tone = picture[..., 0]
    rank = (np.argsort(np.argsort(tone.ravel())) / tone.size).reshape(tone.shape)
    cover = (share - thin * (1 - rank)) / THIN_SOFT
    dark = EDGE_TONE + (1 - EDGE_TONE) * share.clip(0, 1)
    return np.dstack([picture[..., :3] * dark[..., None], cover.clip(0, 1)])


def _side_by_side(below: Cards, locks: Cards) -> Cards:
    """A shell in the left half of a picture, locks in the right."""
    left = replace(below, uv=below.uv * [0.5, 1.0])
    return together(left, replace(locks, uv=locks.uv * [0.5, 1.0] + [0.5, 0]))


def buzz(scalp: Scalp) -> Cards:
    """The stubs of hair cut close, a shell, and single hairs at its edge."""
    stubs = shell(scalp, BUZZ_M, 0.0, 1.0, sideburns=True)
    return _side_by_side(_mapped(scalp, stubs), ribbons_of(scalp, stubble()))


def buzz_picture(scalp: Scalp, lanes: np.ndarray) -> np.ndarray:
    """(CURL_PX, 2 CURL_PX, 4): stubs, and beside them a picture of locks made smaller."""
    tone = (0.50 + 0.09 * noise(17, CURL_PX, 0.7) + 0.03 * noise(19, CURL_PX, 2.7)).clip(0.2, 1.0)
    stubs = _thinned(np.dstack([tone, tone, tone, np.ones_like(tone)]), scalp, STUBS_THIN)
    step = len(lanes) // CURL_PX
    small = lanes.reshape(CURL_PX, step, CURL_PX, step, 4).mean((1, 3))
    return np.hstack([stubs, small])


def _behind(places: Places) -> np.ndarray:
    """(n,) 0 at the hairline to 1 where curls have their size."""
    return np.clip(depth_mm(places) / CURLED_EDGE_MM, 0, 1)


def _apart(scalp: Scalp, rng: np.random.Generator, curl: Curl) -> np.ndarray:
    """Which points are roots: as many as fit at their distance from each other, where they stand
    off the skin: along the steep front of a ball they stand as close as on its top."""
    points, places = scalp.skin.points, scalp.places(scalp.skin.points)
    share = _behind(places)
    points = points + scalp.skin.normals * (curl.volume_m * full(places))[:, None]
    tree = KDTree(points)
    free = scalp.thick > np.interp(places[:, 1], CURLED_BELOW_MM, CURLED_LEAST)
    chosen = []
    for k in rng.permutation(np.flatnonzero(free)):
        if free[k]:
            chosen.append(k)
            apart = curl.edge_apart_m + (curl.apart_m - curl.edge_apart_m) * share[k]
            free[tree.query_ball_point(points[k], apart)] = False
    return np.array(chosen)
