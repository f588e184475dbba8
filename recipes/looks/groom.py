"""Hair that is grown and combed: ribbons of strands from roots on the scalp, in layers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import reduce

import numpy as np
from scipy.interpolate import CubicSpline

from recipes.looks.cards import Cards
from recipes.looks.draping import Drape
from recipes.looks.ribbons import ribbons, together
from recipes.looks.scalp import DEEP_MM, Places, Roots, Scalp, shell
from recipes.looks.strand_lanes import (
    AIRY,
    DENSE,
    FULL,
    LANES,
    LATE_LONG_ROOT,
    LONG_V,
    LOOSE,
    SHORT_V,
    within,
)
from recipes.looks.surface import unit

SUBSTEPS = 3
"""Steps between two pairs of vertices of a ribbon."""
SUNK_M, SUNK = 0.0012, 0.03
"""Ribbons begin this far under the skin, or this share of their length: what is sunk is lost."""
ROOT_DARK_M, ROOT_DARK = 0.016, 0.35
"""Over this length, or this share of its own, a strand comes out of the shade of the others."""
SHORT_M, SHORT_STEPS = 0.024, 3
"""Ribbons shorter than this need few vertices, stand closer and are narrower."""
SHELL_LEAST_M, SHELL_HEIGHT = 0.0003, 0.08
"""The shell lies this far off the skin, and this share of the hair's volume further."""
SHELL_SHADE, SHORT_SHELL_SHADE, PARTING_SHADE = 0.50, 0.80, 0.80
"""Brightness of the shell between locks, between short ones, and where hair is parted."""
SHADED = (0.62, 0.88)
"""Brightness at the root of long strands, and of short ones."""
WAVE_TOGETHER = 0.035
"""How far waves of neighbours are apart, radians per mm."""
WAVE_FROM_M = 0.05
"""Hair lies flat near its root: waves begin here, and are whole at twice that length."""
UNEVEN_HEIGHT, AIRY_HEIGHT = (0.92, 1.08), (0.75, 1.30)
"""How high ribbons of one layer lie, by its height; single hairs differ more, else they are a
second outline."""
HELD = 0.5
"""Hair hangs on the scalp below it where that holds it more than this."""
ROOT_NARROW, ROOT_WIDTH, POINTED = 0.20, 0.40, 0.12
"""Share of its length over which a ribbon comes to its width, and the share of it that it begins
with; long ones begin in a point, else one sees where they are cut."""
PARTING_NARROW_M, PARTING_RISE = 0.009, 0.65
"""The same where hair is parted, in metres, and how much sooner it comes up there: it would be bald
for centimetres, or lie under the shell."""
ROLL = 0.22
"""How far ribbons roll about their middle line, radians."""
CLING = 0.5
"""How fast strands come down to the height that they should lie at."""
OFF_SKIN_M = 0.004
"""How far they stay off neck and ears."""
HEAVY_M = 0.10
"""Of hair that falls, shorter ribbons are drawn down less: they are the fine hair at its edge."""
UNBENT, UNBENT_TIMES, HUNG_MM = 0.5, 3, (55.0, 25.0)
"""How far kinks of falling hair are taken out at a time, how often, and the heights over the eyes
between which that begins."""
HAIRLINE_M, HAIRLINE_STEPS = 0.028, 3
"""Length of the fine hair that is laid over what grows at the hairline."""
OPEN_EDGE = 0.5
"""How light roots at the hairline are, by those of a parting."""
CLOSER = (0.6, 1.25)
"""How much closer roots of short hair stand, and how much further those of long hair."""
SLENDER, SLENDEREST_M, CLOSED_BY = 0.10, 0.0013, 1.3
"""Ribbons are no wider than this share of their length and so much more, else they are scales;
those of the lowest layer are so many times wider, and close it."""
LATE_M, BEGUN = 0.06, 0.75
"""Longer hair leaves out so much of the beginnings of its locks, but for the hairline: they would
thin it for centimetres."""
EDGE_LANES = ((6.0, AIRY), (11.0, LOOSE), (16.0, FULL))
"""Up to which depths behind the hairline, mm, locks are no closer than these."""
EDGE_UNEVEN_MM = 2.5
"""How far those depths differ from ribbon to ribbon: a hairline is no line."""
EDGE_MM, EDGE_WIDTH, EDGE_LENGTH, EDGE_KEPT = 10.0, (0.6, 0.75), 0.30, 0.75
"""How deep the hairline is; what short and long ribbons at it have of the width of others, and
short ones of the length; and how many of them there are."""
FADE_MM, FADE_BELOW_MM = 30.0, 30.0
"""How deep behind the hairline short hair comes to its length at the sides and the neck, and the
height over the eyes below which it does."""
TEMPLE_MM, TEMPLE_DEEP_MM = (-105.0, 52.0), 11.0
"""Temples: before the first, below the second height, and how deep behind the hairline."""
FOREHEAD_MM, FOREHEAD_DEEP_MM = (54.0, 34.0), (7.0, 40.0)
"""A fringe grows this far aside at most, this high over the eyes, and between these depths."""
HAIRLINE_DEEP_MM = 17.0
"""How deep fine hair is laid over the hairline."""
PATCH_MM, PATCHY = 10.0, 0.14
"""How large patches of lighter and darker hair are, and how much those differ in brightness."""
UNEVEN = 0.84
"""Least brightness of one ribbon beside another: those that differ more look like scales, or, long,
like stripes."""
OfPlaces = Callable[[Places], np.ndarray]


@dataclass(frozen=True)
class Layer:
    """Ribbons that lie equally deep.

    Parameters
    ----------
    apart_m : float
        Distance of the roots.
    width_m : float
        Of a ribbon.
    lanes : tuple of int
        Locks of the picture to choose from.
    height : float
        Share of the hair's volume that it lies above the skin.
    length : tuple of float
        Range of its length, by that of the style.
    stray : float
        How far its ribbons stray from the comb, radians.
    shade : float
        Brightness, 0..1.
    where : str
        "all", or where alone it grows: along the "parting", at the "hairline",
        at the "temples", over the "forehead".
    """

    apart_m: float
    width_m: float
    lanes: tuple[int, ...]
    height: float
    length: tuple[float, float]
    stray: float
    shade: float
    where: str = "all"


LAYERS = (
    Layer(0.0102, 0.0150, DENSE, 0.30, (0.75, 0.95), 0.10, 0.80),
    Layer(0.0094, 0.0120, FULL, 0.70, (0.80, 1.05), 0.16, 0.91),
    Layer(0.0116, 0.0095, LOOSE, 1.00, (0.80, 1.10), 0.22, 0.97),
    Layer(0.0200, 0.0090, AIRY, 1.08, (0.75, 1.15), 0.34, 0.94),
    Layer(0.0034, 0.0060, DENSE, 0.55, (0.85, 1.00), 0.10, 0.90, where="parting"),
    Layer(0.0026, 0.0036, FULL[1:] + LOOSE, 0.40, (0.50, 1.00), 0.22, 0.92, where="hairline"),
)


SHORT_LAYERS = (
    Layer(0.0074, 0.0074, DENSE, 0.30, (0.75, 0.95), 0.08, 0.90),
    Layer(0.0074, 0.0060, FULL, 0.65, (0.75, 1.05), 0.12, 0.94),
    Layer(0.0090, 0.0050, LOOSE, 0.95, (0.70, 1.10), 0.18, 0.97),
    Layer(0.0140, 0.0048, AIRY, 1.15, (0.70, 1.15), 0.30, 0.96),
    Layer(0.0019, 0.0028, LOOSE + AIRY, 0.40, (0.60, 1.10), 0.22, 0.90, where="hairline"),
)
"""Of short hair: narrow ribbons, many of them."""


@dataclass(frozen=True)
class Groom:
    """How a style grows.

    Parameters
    ----------
    comb : function of Places
        (n, 3) direction in which hair is combed there.
    length_m, volume_m : functions of Places
        (n,) length of what grows there, and how far its top lies above the skin.
    rise_m : float
        Over which length hair comes up to its height.
    upright : float
        How much it stands up from its root.
    weight : float
        How much it is drawn down rather than along the comb, at its tips.
    stiff : float
        How much it keeps its direction from one pair of vertices to the next, 0 to 1.
    wave_m, wave_length_m : float
        How far strands wave aside, and along which length.
    inset_mm : float
        How far behind the hairline the shell below begins.
    steps : int
        Pairs of vertices along a ribbon.
    pairs : int
        As many are drawn, on a smooth line through those, where that is to be more; for what falls.
    near : float
        How much closer pairs stand at the root: 1 for evenly, more for long hair, which bends
        round the head and then hangs straight.
    cut : float
        Share of a lock, from its root, that long hair shows: less for a blunt end.
    edge : float
        How much deeper than others its hairline is in which locks are open: more where hair is
        brushed to the front, and shows its roots.
    falls : bool
        Whether it hangs to the jaw and below, and covers the hairline beside the face.
    temple_mm : float
        The height over the eyes below which hair grows that frames the face.
    parting : function of Places
        (n,) 0..1 where hair is parted: roots stand closer there and lie open to the light.
    hangs : function of Places
        (n,) 0..1 where hair hangs free although it grows there, as at the nape below what falls.
    free : function of Places
        (n, 3) mm: places moved out of what hair may not go through beside the skin.
    drape : Drape or None
        What it lies on that falls to the shoulders.
    layers : tuple of Layer
    """

    comb: OfPlaces
    length_m: OfPlaces
    volume_m: OfPlaces
    rise_m: float = 0.009
    upright: float = 1.0
    weight: float = 0.2
    stiff: float = 0.45
    wave_m: float = 0.0
    wave_length_m: float = 0.05
    inset_mm: float = 17.0
    steps: int = 8
    pairs: int = 0
    near: float = 1.0
    cut: float = 1.0
    edge: float = 1.0
    falls: bool = False
    temple_mm: float = TEMPLE_MM[1]
    parting: OfPlaces = field(default=lambda places: np.zeros(len(places)))
    hangs: OfPlaces = field(default=lambda places: np.zeros(len(places)))
    free: OfPlaces = field(default=lambda places: places)
    drape: Drape | None = None
    layers: tuple[Layer, ...] = LAYERS


def grown(scalp: Scalp, groom: Groom) -> Cards:
    """All layers of a style, over a dark shell that closes the scalp."""

    def off_m(places: Places) -> np.ndarray:
        return SHELL_LEAST_M + SHELL_HEIGHT * groom.volume_m(places) * (1 - groom.parting(places))

    def shade(places: Places) -> np.ndarray:
        lengths = (0.8 * SHORT_M, 3.0 * SHORT_M)
        between = np.interp(groom.length_m(places), lengths, (SHORT_SHELL_SHADE, SHELL_SHADE))
        return between + (PARTING_SHADE - between) * groom.parting(places)

    below = shell(scalp, off_m, groom.inset_mm, shade)
    return together(below, ribbons_of(scalp, groom))


def ribbons_of(scalp: Scalp, groom: Groom) -> Cards:
    """All layers of a style."""
    rng = np.random.default_rng(17)
    parts = (part for layer in groom.layers for part in _layer(scalp, groom, layer, rng))
    return reduce(together, parts)


def _layer(scalp: Scalp, groom: Groom, layer: Layer, rng: np.random.Generator) -> list[Cards]:
    """Its short ribbons and its long ones."""

    def apart(places: Places) -> np.ndarray:
        return layer.apart_m * np.clip(groom.length_m(places) / SHORT_M, *CLOSER)

    roots = scalp.roots(apart, rng)
    roots = roots[rng.random(len(roots)) < EDGE_KEPT + (1 - EDGE_KEPT) * _within(roots.depth)]
    if layer.where == "parting":
        roots = roots[groom.parting(roots.places) > 0.15]
        if not len(roots):
            return []
    if layer.where == "hairline":
        roots = roots[roots.depth < HAIRLINE_DEEP_MM]
        if groom.falls:
            roots = roots[~_beside_the_face(roots.places)]
    if layer.where == "temples":
        below = roots.places[:, 1] < groom.temple_mm
        roots = roots[_beside_the_face(roots.places) & below & (roots.depth < TEMPLE_DEEP_MM)]
    if layer.where == "forehead":
        x, y, _ = roots.places.T
        deep = (roots.depth > FOREHEAD_DEEP_MM[0]) & (roots.depth < FOREHEAD_DEEP_MM[1])
        roots = roots[deep & (np.abs(x) < FOREHEAD_MM[0]) & (y > FOREHEAD_MM[1])]
    length = groom.length_m(roots.places)
    roots, length = roots[length > 0.003], length[length > 0.003]
    if layer.where == "hairline":
        return [_grown(scalp, groom, layer, roots, HAIRLINE_STEPS, rng)]
    short = length < SHORT_M
    groups = ((roots[short], SHORT_STEPS), (roots[~short], groom.steps))
    return [
        _grown(scalp, groom, layer, chosen, steps, rng) for chosen, steps in groups if len(chosen)
    ]


def _within(depth: np.ndarray) -> np.ndarray:
    """(n,) 0 at the hairline to 1 behind it."""
    return np.clip(depth / EDGE_MM, 0, 1)


def _beside_the_face(places: Places) -> np.ndarray:
    """(n,) where hair grows from the corner of the forehead down to the ear."""
    return (places[:, 2] > TEMPLE_MM[0]) & (places[:, 1] < TEMPLE_MM[1])


def _grown(
    scalp: Scalp,
    groom: Groom,
    layer: Layer,
    roots: Roots,
    steps: int,
    rng: np.random.Generator,
) -> Cards:
    places, thick, count = roots.places, roots.thick, len(roots)
    most = HAIRLINE_M if layer.where == "hairline" else np.inf
    length = np.minimum(groom.length_m(places), most) * rng.uniform(*layer.length, count)
    short = (length < SHORT_M) | (layer.where == "hairline")
    cut = np.clip(roots.depth / np.where(places[:, 1] < FADE_BELOW_MM, FADE_MM, EDGE_MM), 0, 1)
    length *= np.where(short, EDGE_LENGTH + (1 - EDGE_LENGTH) * cut, 0.7 + 0.3 * thick)
    height = groom.volume_m(places) * layer.height * (0.4 + 0.6 * thick)
    height *= rng.uniform(*(AIRY_HEIGHT if layer.lanes == AIRY else UNEVEN_HEIGHT), count)
    paths, normals = _combed(scalp, groom, roots.points, length, height, layer.stray, steps, rng)
    t = np.linspace(0, 1, steps) ** groom.near
    if groom.falls and steps == groom.steps:
        heights_mm = scalp.places(paths)[..., 1]
        paths = _unbent(paths, heights_mm)
        at = np.linspace(0, 1, groom.pairs) ** groom.near if groom.pairs else t
        paths, normals = (_along_them(each, t, at) for each in (paths, normals))
        t = at
    within_edge = _within(roots.depth)
    slender = SLENDER * (CLOSED_BY if layer.lanes == DENSE else 1)
    wide = np.minimum(layer.width_m, slender * length + SLENDEREST_M)
    wide = wide * rng.uniform(0.75, 1.25, count)
    parted = groom.parting(places)
    narrow = np.where(short, *EDGE_WIDTH)
    narrow = narrow + (1 - narrow) * within_edge
    narrow_m = PARTING_NARROW_M if layer.where == "parting" else np.inf
    begins = np.minimum(ROOT_NARROW, narrow_m / length)
    across = _across(paths, normals, wide * narrow, t, begins, rng)
    along = length[:, None] * t
    dark = np.minimum(ROOT_DARK_M, ROOT_DARK * length)[:, None]
    least = np.interp(length, (0.5 * SHORT_M, SHORT_M), SHADED[::-1])
    open_ = np.maximum(parted, OPEN_EDGE * (1 - within_edge))
    least = np.maximum(least, SHADED[1] * open_)[:, None]
    shade = np.maximum(layer.shade, least - 0.05) * (
        least + (1 - least) * np.clip(along / dark, 0, 1)
    )
    shade = shade * (_patches(places) * rng.uniform(UNEVEN, 1.0, count))[:, None]
    index, weights = _hung(scalp, roots.points, paths)
    skin = scalp.fitting.skin
    # Fine hair over the hairline stays open, or one sees where it ends.
    edge = max(groom.edge, 1.0) if layer.where == "hairline" else groom.edge
    uv = _lanes(layer, length, t, groom.cut, roots.depth, edge, rng)
    return ribbons(paths, across, index, weights, skin, uv, shade)


def _unbent(paths: np.ndarray, heights_mm: np.ndarray) -> np.ndarray:
    """Nearer to the middle of what is before and behind, where hair hangs: it does not kink."""
    share = UNBENT * np.interp(-heights_mm, [-HUNG_MM[0], -HUNG_MM[1]], (0, 1))[..., None]
    for _ in range(UNBENT_TIMES):
        middle = (paths[:, :-2] + paths[:, 2:]) / 2
        paths[:, 1:-1] += share[:, 1:-1] * (middle - paths[:, 1:-1])
    return paths


def _along_them(paths: np.ndarray, t: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(n, k, 3) paths, given at `t`, at places `at`, 0..1."""
    return CubicSpline(t, paths, axis=1)(at)


def _hung(scalp: Scalp, start: np.ndarray, paths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, pair, m) mixtures: of the scalp below each pair, so that hair lies on any skull; past the
    scalp, of where it was left."""
    count, pairs, _ = paths.shape
    held = scalp.hold(paths.reshape(-1, 3)).reshape(count, pairs) > HELD
    last = np.maximum.accumulate(np.where(held, np.arange(pairs), 0), axis=1)
    places = np.take_along_axis(
        np.concatenate([start[:, None], paths[:, 1:]], 1), last[..., None], 1
    )
    index, weights = scalp.fitting.nearest(places.reshape(-1, 3))
    return index.reshape(count, pairs, -1), weights.reshape(count, pairs, -1)


def _patches(places: Places) -> np.ndarray:
    """(n,) about 1: neighbours are alike in brightness, as locks of a head are."""
    rng = np.random.default_rng(11)
    waves = rng.normal(size=(3, 6)) / PATCH_MM
    mixed = np.sin(places @ waves + rng.uniform(0, 2 * np.pi, 6)).mean(1)
    return 1 + PATCHY * np.clip(2 * mixed, -1, 1)


def _lanes(
    layer: Layer,
    length: np.ndarray,
    t: np.ndarray,
    cut: float,
    depth: np.ndarray,
    edge: float,
    rng: np.random.Generator,
) -> np.ndarray:
    """(n, step, 2, 2) places in the picture; short hair has locks of its own; towards the hairline
    (depth in mm) one sees through them more and more."""
    lane = rng.choice(layer.lanes, len(length))
    short = (length < SHORT_M) | (layer.where == "hairline")
    uneven = depth + EDGE_UNEVEN_MM * rng.normal(size=len(depth))
    for up_to, lanes in EDGE_LANES:
        lane = np.where(uneven < edge * up_to, np.maximum(lane, rng.choice(lanes, len(lane))), lane)
    flipped = rng.random((len(length), 1)) < 0.5
    edges = (lane[:, None] + np.where(flipped, [0.98, 0.02], [0.02, 0.98])) / LANES
    begun = (
        BEGUN * LATE_LONG_ROOT * np.clip(1 - LATE_M / length, 0, 1) * np.clip(depth / DEEP_MM, 0, 1)
    )
    begun = begun[:, None]
    v = within(LONG_V, cut * (begun + (1 - begun) * t))
    v = np.where(short[:, None], within(SHORT_V, t), v)
    return np.stack(np.broadcast_arrays(edges[:, None], v[..., None]), -1).astype(float)


def _combed(
    scalp: Scalp,
    groom: Groom,
    start: np.ndarray,
    length: np.ndarray,
    height: np.ndarray,
    stray: float,
    pairs: int,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray]:
    """(n, pairs, 3) m of the ribbons' middle lines, and the skin's normals beside them."""
    count, steps = len(start), (pairs - 1) * SUBSTEPS
    _, normal = scalp.skin.nearest(start)
    aside = stray * rng.normal(size=(count, 1))
    # What grows side by side waves together.
    phase = WAVE_TOGETHER * scalp.places(start) @ [[1.0], [0.6], [0.8]]
    phase = phase + rng.normal(0, 0.5, (count, 1))
    point = start - np.minimum(SUNK_M, SUNK * length)[:, None] * normal
    flat = _along(groom.comb(scalp.places(start)), normal, 1.0)
    direction = unit(0.4 * flat + groom.upright * normal)
    ways = np.linspace(0, 1, steps + 1) ** groom.near
    rise = groom.rise_m * (1 - PARTING_RISE * groom.parting(scalp.places(start)))
    rise = np.minimum(rise, 0.3 * length)[:, None]
    heavy = np.minimum(length / HEAVY_M, 1)[:, None] if groom.falls else 1.0
    paths, normals = [point], [normal]
    for step in range(1, steps + 1):
        t, gone = ways[step], ways[step] * length[:, None]
        stride = (ways[step] - ways[step - 1]) * length[:, None]
        places = scalp.places(point)
        hold = scalp.hold(point) * (1 - groom.hangs(places)[:, None])
        comb = _along(groom.comb(places), normal, hold)
        sideways = np.cross(normal, comb)
        wave = groom.wave_m * 2 * np.pi / groom.wave_length_m
        wave = wave * np.clip((gone - WAVE_FROM_M) / WAVE_FROM_M, 0, 1)
        bent = aside + wave * np.cos(2 * np.pi * gone / groom.wave_length_m + phase)
        drawn = groom.weight * t * heavy * np.array([0, -1.0, 0])
        wanted = unit(comb + bent * sideways + drawn)
        direction = unit(groom.stiff * direction + (1 - groom.stiff) * wanted)
        lies, under = np.zeros((count, 1)), normal
        if groom.drape:
            direction, lies, under = groom.drape.led(places, direction)
        point = point + stride * direction
        foot, normal = scalp.skin.nearest(point)
        above = ((point - foot) * normal).sum(1, keepdims=True)
        # Hair lies on the scalp, and past it hangs free: neck and ears only keep it out.
        over = height[:, None] * hold + OFF_SKIN_M * (1 - hold)
        wanted_height = over * (1 - np.exp(-gone / rise))
        lifted = np.where(above < wanted_height, 1.0, CLING * hold)
        point = point + normal * (wanted_height - above) * lifted
        places = groom.free(scalp.places(point))
        if groom.drape:
            places = groom.drape.out_of(places, 1000 * height[:, None])
            normal = unit(normal + lies * (under - normal))
        point = (places - scalp.shift) / 1000
        if step % SUBSTEPS == 0:
            paths.append(point)
            normals.append(normal)
    return np.stack(paths, 1), np.stack(normals, 1)


def _along(directions: np.ndarray, normal: np.ndarray, hold: np.ndarray | float) -> np.ndarray:
    """Unit directions, in the plane of the skin as far as the skin holds them."""
    ahead = unit(directions)
    flat = ahead - hold * (ahead * normal).sum(1, keepdims=True) * normal
    return flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-9)


def _across(
    paths: np.ndarray,
    normals: np.ndarray,
    wide: np.ndarray,
    t: np.ndarray,
    begins: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """(n, steps, 3) m from the middle of a ribbon to its edge: flat, rolled a little; `begins` is
    the share of each over which it comes to its width."""
    tangent = unit(np.gradient(paths, axis=1))
    flat = unit(np.cross(tangent, normals))
    out = np.cross(flat, tangent)
    roll = ROLL * rng.normal(size=(len(paths), 1, 1))
    taper = np.clip(ROOT_WIDTH + t / begins[:, None] * (1 - ROOT_WIDTH), 0, 1)
    taper *= 1 - 0.35 * t**2
    if len(t) > SHORT_STEPS:
        taper[:, 0] = POINTED
    return (np.cos(roll) * flat + np.sin(roll) * out) * (wide[:, None] / 2 * taper)[..., None]
