"""What hangs on a tie: a tail, a knot."""

from __future__ import annotations

import numpy as np

from recipes.looks.cards import Cards
from recipes.looks.grooms import TIE_MM
from recipes.looks.ribbons import ribbons, together
from recipes.looks.scalp import Scalp
from recipes.looks.strand_lanes import AIRY, DENSE, FULL, LANES, LONG_V, LOOSE, within
from recipes.looks.surface import unit

TAIL_M, TAIL_STEPS = 0.20, 14
TAIL_LAYERS = (
    (34, 0.004, DENSE, 0.015, 0.74),
    (44, 0.009, FULL, 0.013, 0.9),
    (30, 0.012, LOOSE, 0.010, 1.0),
    (14, 0.014, AIRY, 0.010, 1.0),
)
"""Ribbons, their distance from the middle (m), locks, width (m) and brightness, layer by layer."""
RISING_LAYERS = ((20, -0.0012, DENSE, 0.72), (26, 0.0, FULL, 0.9), (18, 0.0008, LOOSE, 1.0))
"""Ribbons, their height over the middle one (m), locks and brightness of what rises to the tie."""
RISING_M, RISING_STEPS, RISING_POWER, RISING_WIDE = (0.042, 0.0075), 7, 2.2, 1.9
"""From which ring round the tie to which, and how they rise: late, as what is pulled tight; how
much wider they are than the part of the ring that each has."""
LYING_M, TIED_M = 0.0035, 0.0155
"""Off the skin, where hair lies, and in the tie."""
BAND_M, BAND_TURNS = 0.0105, 12
KNOT_M, KNOT_DEEP_M = 0.031, 0.024
"""Half its width, and how far it stands out."""
KNOT_AT_MM = np.array([0.0, 2.0, -9.0])
KNOT_LAYERS = ((56, -0.0020, DENSE, 0.76), (60, 0.0, FULL, 0.92), (36, 0.0012, LOOSE, 1.0))
"""Ribbons, how far over the knot (m), locks and brightness."""
KNOT_STEPS, KNOT_WIDTH_M = 10, 0.0115
STRANDS_OF_KNOT, RIDGE = 3, 0.10
CORE = (18, 30)


def tail(scalp: Scalp) -> Cards:
    """Hair that rises to the tie and falls from it, and a lock wound round it."""
    rng = np.random.default_rng(5)
    parts = [_falling(scalp, *layer, rng) for layer in TAIL_LAYERS]
    parts += [_rising(scalp, *layer, rng) for layer in RISING_LAYERS]
    whole = _band(scalp, rng)
    for part in parts:
        whole = together(whole, part)
    return whole


def _falling(
    scalp: Scalp,
    count: int,
    away_m: float,
    lanes: tuple[int, ...],
    width_m: float,
    shade: float,
    rng: np.random.Generator,
) -> Cards:
    around = rng.uniform(0, 2 * np.pi, count)
    ring = np.stack([np.cos(around), np.sin(around), 0 * around], 1)
    t = np.linspace(0, 1, TAIL_STEPS)[None]
    length = TAIL_M * rng.uniform(0.82, 1.05, (count, 1))
    # Out and over the tie, then down; thickest in its upper third, thinner towards the tips.
    full = (
        away_m
        * (0.45 + 2.0 * t**0.6 * (1 - t) ** 0.8 + 0.35 * t)
        * rng.uniform(0.7, 1.15, (count, 1))
    )
    back = 0.030 * (1 - np.exp(-6 * t)) - 0.016 * t**2
    down = length * t**1.35 - 0.010 * np.sin(np.pi * np.minimum(t * 3, 1))
    sway = 0.004 * np.sin(2 * np.pi * (1.3 * t + rng.uniform(0, 1, (count, 1)))) * t
    paths = np.stack([0 * t + sway, -down, -back + 0 * sway], -1)
    # The ring stands across the way at the tie, and lies level where hair falls.
    level = np.stack([ring[:, 0], 0 * around, ring[:, 1]], 1)
    turn = np.clip(t * 4, 0, 1)[..., None]
    out = unit(ring[:, None] * (1 - turn) + level[:, None] * turn + 1e-9)
    paths = _metres(scalp, TIE_MM) + paths + out * full[..., None]
    across = unit(np.cross(np.gradient(paths, axis=1), out))
    wide = width_m / 2 * (0.5 + 0.5 * np.clip(t / 0.15, 0, 1)) * (1 - 0.35 * t)
    return _hung(
        scalp, paths, across * wide[..., None], _lanes(lanes, count, t[0], rng), shade, rng
    )


def _rising(
    scalp: Scalp,
    count: int,
    over_m: float,
    lanes: tuple[int, ...],
    shade: float,
    rng: np.random.Generator,
) -> Cards:
    """From the hair that lies round the tie up into it, all round."""
    around = (np.arange(count) + rng.uniform(-0.3, 0.3, count)) * (2 * np.pi / count)
    ring = np.stack([np.cos(around), np.sin(around), 0 * around], 1)[:, None]
    t = np.linspace(0, 1, RISING_STEPS)[None, :, None]
    off = RISING_M[0] + (RISING_M[1] - RISING_M[0]) * t
    foot, normal = scalp.skin.nearest((_metres(scalp, TIE_MM) + ring * off).reshape(-1, 3))
    foot, normal = foot.reshape(count, -1, 3), normal.reshape(count, -1, 3)
    high = LYING_M + over_m + (TIED_M - LYING_M) * t**RISING_POWER
    paths = foot + normal * high
    across = unit(np.cross(np.gradient(paths, axis=1), normal))
    wide = RISING_WIDE * np.pi * off / count * np.ones((count, 1, 1))
    index, weights = scalp.fitting.nearest(foot.reshape(-1, 3))
    dark = shade * rng.uniform(0.85, 1.0, (count, 1)) * np.linspace(1, 0.75, RISING_STEPS)
    return ribbons(
        paths,
        across * wide,
        index.reshape(count, RISING_STEPS, -1),
        weights.reshape(count, RISING_STEPS, -1),
        scalp.fitting.skin,
        _lanes(lanes, count, np.linspace(0.1, 0.6, RISING_STEPS), rng),
        dark,
    )


def _band(scalp: Scalp, rng: np.random.Generator) -> Cards:
    """A lock round the tie."""
    around = np.linspace(0, 2 * np.pi, BAND_TURNS)
    ring = np.stack([np.cos(around), np.sin(around), 0 * around], 1)
    paths = (_metres(scalp, TIE_MM) + [0, 0.001, -0.006] + ring * BAND_M)[None]
    across = np.broadcast_to([0.0, 0.0, 0.0065], paths.shape)
    t = np.linspace(0, 0.5, BAND_TURNS)
    return _hung(scalp, paths, across, _lanes(DENSE, 1, t, rng), 0.8, rng)


def knot(scalp: Scalp) -> Cards:
    """Hair wound to a knot over the tie, strand over strand."""
    rng = np.random.default_rng(6)
    whole = _core(scalp)
    for count, over_m, lanes, shade in KNOT_LAYERS:
        polar = np.arccos(rng.uniform(-0.35, 0.97, count))[:, None]
        t = np.linspace(0, 1, KNOT_STEPS)[None]
        around = rng.uniform(0, 2 * np.pi, (count, 1)) + np.radians(170) * t
        drift = polar + rng.normal(0, 0.10, (count, 1)) * (t - 0.5) + 0.18 * (t - 0.5)
        paths, normals = _on_the_knot(scalp, drift, around, over_m)
        across = unit(np.cross(np.gradient(paths, axis=1), normals))
        wide = KNOT_WIDTH_M / 2 * (0.35 + 0.65 * np.sin(np.pi * np.clip(t, 0.05, 0.95)))
        wide = wide * np.clip(np.sin(polar) * 1.6, 0.3, 1)
        uv = _lanes(lanes, count, t[0] * 0.9, rng)
        whole = together(whole, _hung(scalp, paths, across * wide[..., None], uv, shade, rng))
    return whole


def _on_the_knot(
    scalp: Scalp, polar: np.ndarray, around: np.ndarray, over_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Places and outward directions; its strands bulge and lie round each other."""
    bulge = np.abs(np.cos(STRANDS_OF_KNOT / 2 * (around + 1.9 * polar)))
    size = 1 + RIDGE * (bulge - 0.6)
    ball = np.stack(
        [
            np.sin(polar) * np.cos(around),
            np.sin(polar) * np.sin(around),
            -np.cos(polar) + 0 * around,
        ],
        -1,
    )
    half = np.array([KNOT_M, KNOT_M, KNOT_DEEP_M])
    normals = unit(ball / half)
    middle = _metres(scalp, TIE_MM + KNOT_AT_MM)
    return middle + ball * half * size[..., None] + normals * over_m, normals


def _core(scalp: Scalp) -> Cards:
    """What closes the knot below its ribbons."""
    polar, around = np.meshgrid(
        np.linspace(0.02, 2.1, CORE[0]), np.linspace(0, 2 * np.pi, CORE[1]), indexing="ij"
    )
    points, _ = _on_the_knot(scalp, polar, around, -0.0035)
    first = np.arange(CORE[0] * CORE[1]).reshape(CORE)
    quads = np.stack([first[:-1, :-1], first[1:, :-1], first[1:, 1:], first[:-1, 1:]], -1)
    quads = quads.reshape(-1, 4)
    wave = 0.5 + 0.4 * np.cos(STRANDS_OF_KNOT * (around + 1.9 * polar))
    uv = np.stack([(0.25 + 0.5 * wave) / LANES, 0.07 + 0.25 * (0.5 + 0.5 * np.cos(around))], -1)
    points, uv = points.reshape(-1, 3), uv.reshape(-1, 2)
    index, weights, offset = _bound(scalp, points)
    return Cards(index, weights, offset, quads, uv, quads, np.full(len(points), 0.5), points)


def _lanes(
    lanes: tuple[int, ...], count: int, v: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """(n, step, 2, 2) places in the picture."""
    lane = rng.choice(lanes, count)[:, None]
    edges = (lane + np.array([0.02, 0.98])) / LANES
    return np.stack(np.broadcast_arrays(edges[:, None], within(LONG_V, v)[None, :, None]), -1)


def _hung(
    scalp: Scalp,
    paths: np.ndarray,
    across: np.ndarray,
    uv: np.ndarray,
    shade: float,
    rng: np.random.Generator,
) -> Cards:
    tie = np.broadcast_to(_metres(scalp, TIE_MM), (len(paths), 3))
    index, weights = scalp.fitting.nearest(tie)
    dark = shade * rng.uniform(0.82, 1.0, (len(paths), 1)) * np.ones((1, paths.shape[1]))
    return ribbons(paths, across, index, weights, scalp.fitting.skin, uv, dark)


def _bound(scalp: Scalp, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All on the skin under the tie, so that it stays one piece."""
    tie = np.broadcast_to(_metres(scalp, TIE_MM), points.shape)
    index, weights = scalp.fitting.nearest(tie)
    return index, weights, points - np.einsum("vk,vkc->vc", weights, scalp.fitting.skin[index])


def _metres(scalp: Scalp, place: np.ndarray) -> np.ndarray:
    return (place - scalp.shift) / 1000
