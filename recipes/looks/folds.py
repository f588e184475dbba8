"""Folds that come with expressions: lines on the atlas, and the zones that bring them out.

Places are millimetres on the mean face, seen from the front: x to its left, y from the height of
the eyes. What is given for the left side is there on the right as well, with another hand.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.ndimage as ndimage
from scipy.interpolate import LinearNDInterpolator, PchipInterpolator
from scipy.spatial import KDTree

from elocute.head.folds import SETS, ZONES, ZONES_OF_SET
from recipes.looks.canvas import Canvas, noise

SIZE = 1024
FRONT_MM = -90.0
"""What lies further back than this is no part of the face."""
STEP_MM, NEAR_MM = 0.15, 9.0
"""Between the samples of a line; how far from it its relief reaches."""
SOFT_MM = 5.0
Place = tuple[float, float]
Pair = tuple[Place, Place]


@dataclass(frozen=True)
class Zone:
    """A place that folds.

    `together` come closer to each other where skin folds, `apart` part, with factors; folds begin
    and are whole at `reach`. The mask is a box: `across` and `up` are its sides.
    """

    name: str
    across: Place
    up: Place
    reach: Place
    together: tuple[Pair, ...]
    apart: tuple[Pair, ...] = ()
    parting: float = 1.0


def _both(name: str, *given: Any) -> tuple[Zone, Zone]:
    left = Zone(f"{name}Left", *given)
    (low, high), up, reach = left.across, left.up, left.reach
    together, apart = _mirrored(left.together), _mirrored(left.apart)
    return left, Zone(f"{name}Right", (-high, -low), up, reach, together, apart, left.parting)


def _mirrored(pairs: tuple[Pair, ...]) -> tuple[Pair, ...]:
    return tuple(((-ax, ay), (-bx, by)) for (ax, ay), (bx, by) in pairs)


SETS_OF_ZONES: tuple[tuple[Zone, ...], ...] = (
    (
        Zone(
            "foreheadMiddle", (-17, 17), (20, 62), (0.015, 0.13),
            tuple(((x, 20), (x, 50)) for x in (-12, -6, 0, 6, 12)),
        ),
        *_both(
            "forehead", (17, 62), (20, 62), (0.02, 0.18),
            (((26, 24), (26, 50)), ((34, 24), (34, 50)),
             ((42, 26), (42, 48)), ((48, 24), (48, 44))),
        ),
        *_both(
            "crow", (44, 75), (-30, 17), (0.02, 0.16),
            (((58, -2), (54, -28)), ((62, 0), (60, -28)),
             ((56, 4), (52, -20)), ((52, 2), (48, -20))),
            (((25, -7), (8, -18)), ((30, -7), (10, -24)), ((34, -6), (10, -24))),
            2.0,
        ),
        *_both(
            "nasolabial", (13, 58), (-84, -34), (0.03, 0.17),
            (
                ((18, -52), (38, -48)), ((24, -58), (44, -52)), ((27, -64), (46, -62)),
                ((12, -20), (14, -42)), ((16, -42), (20, -20)), ((10, -26), (14, -44)),
            ),
        ),
        Zone(
            "lips", (-13, 13), (-84, -46), (0.08, 0.26),
            (((-9, -54), (9, -54)), ((-14, -56), (14, -56)), ((-7, -50), (7, -50))),
        ),
    ),
    (
        Zone(
            "glabella", (-20, 20), (-1, 40), (0.038, 0.16),
            (((13, 19), (8, 2)), ((0, 22), (0, 3)), ((-13, 19), (-8, 2))),
        ),
        *_both(
            "bunny", (0, 15), (-32, -1), (0.028, 0.043),
            (((9, -4), (12, -38)), ((6, -2), (10, -30)),
             ((10, 0), (12, -24)), ((8, -2), (11, -34))),
        ),
        *_both(
            "underEye", (15, 48), (-32, -6), (0.04, 0.19),
            (((25, -7), (26, -20)), ((30, -7), (31, -20)), ((35, -6), (36, -20))),
        ),
        *_both(
            "marionette", (19, 42), (-104, -62), (0.03, 0.11),
            (((26, -66), (30, -92)), ((24, -66), (24, -92))),
        ),
        Zone(
            "chin", (-19, 19), (-112, -78), (0.03, 0.16),
            (((26, -66), (30, -92)), ((-26, -66), (-30, -92))),
            (
                ((0, -98), (0, -116)), ((8, -98), (8, -114)), ((-8, -98), (-8, -114)),
                ((0, -76), (0, -96)),
            ),
            2.0,
        ),
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Line:
    """A line that folds: points of its left half or side, width and depth (1: the deepest).

    `middle` lines are whole and not mirrored.
    """

    points: tuple[Place, ...]
    width: float
    depth: float
    middle: bool = False
    wave: float = 0.5


def _gull(height: float, start: float, end: float, lift: float = 0.4) -> tuple[Place, ...]:
    """A line across the forehead: lowest in the middle, highest over the brows."""
    x = np.linspace(start, end, 25)
    y = height + lift * (1 - np.cos(np.pi * np.minimum(np.abs(x), 30) / 30)) / 2
    y -= 0.006 * np.maximum(np.abs(x) - 30, 0) ** 2
    return tuple(zip(x, y, strict=True))


LINES: dict[str, tuple[Line, ...]] = {
    "first": (
        Line(_gull(28.0, -8, 52), 1.7, 0.75, middle=True, wave=0.9),
        Line(_gull(29.0, -50, -4), 1.7, 0.85, middle=True, wave=0.9),
        Line(_gull(35.5, -54, 52), 2.1, 1.0, middle=True, wave=1.1),
        Line(_gull(43.0, -50, 26), 2.0, 0.9, middle=True, wave=1.1),
        Line(_gull(43.8, 12, 52), 1.8, 0.8, middle=True, wave=1.1),
        Line(_gull(51.0, -28, 42), 1.7, 0.5, middle=True, wave=1.2),
        Line(((48, 5), (53, 8), (58, 12.5), (61, 17)), 1.0, 0.5),
        Line(((47.5, 2), (53, 3.5), (59, 6.5), (63, 9)), 1.1, 0.7),
        Line(((47, -1.5), (53, -2), (59, -1), (64, 0)), 1.1, 0.75),
        Line(((46, -5), (52, -7.5), (58, -8.5), (63, -9)), 1.1, 0.7),
        Line(((45, -9), (50, -13.5), (55, -17.5), (59, -20)), 1.0, 0.5),
        Line(((16, -38), (19.5, -44), (25, -51), (30.5, -58), (34, -65), (34.5, -72)), 3.4, 0.65),
        *(
            Line(((x, top), (1.05 * x, -52.5), (1.12 * x, -55.5)), 1.0, depth, wave=0.5)
            for x, top, depth in ((3.4, -50, 0.13), (6.1, -49, 0.17), (11.2, -50.5, 0.14))
        ),
        *(
            Line(((x, -77), (1.06 * x, -79.5), (1.1 * x, -81.5)), 1.0, 0.12, wave=0.4)
            for x in (4.4, 10.6)
        ),
    ),
    "second": (
        Line(((5.4, 7), (5.8, 13), (6.6, 19), (7.4, 27)), 1.7, 0.9, wave=0.6),
        Line(((10.8, 13), (12.2, 17.5), (13.6, 23)), 1.4, 0.45),
        Line(((-9, 3.5), (-4, 2.4), (0, 2.0), (4, 2.5), (9, 3.4)), 1.2, 0.6, middle=True),
        Line(((1.5, -3.2), (5.5, -5.5), (10, -9.5), (13.5, -14.5)), 1.7, 0.6),
        Line(((2.0, -8), (6, -10.5), (10.5, -15), (14, -20.5)), 2.0, 0.7),
        Line(((3.5, -14), (7.5, -16.5), (11.5, -21), (14, -26)), 1.8, 0.45),
        Line(((-6, -4.6), (0, -3.6), (6, -4.8)), 1.5, 0.35, middle=True),
        Line(((17, -11.5), (22, -15), (28, -16.5), (35, -15.5), (41, -12)), 1.1, 0.6),
        Line(((19, -16), (25, -20.5), (32, -22.5), (39, -21), (45, -16)), 1.5, 0.65),
        Line(((27.5, -66.5), (29, -71), (30, -77), (29.5, -85)), 3.0, 0.6),
        Line(((-15, -86), (-8, -83.4), (0, -82.6), (8, -83.4), (15, -86)), 1.8, 0.5, middle=True),
    ),
    "finer": (
        Line(_gull(24.6, -20, 16), 0.8, 0.3, middle=True, wave=1.0),
        Line(_gull(32.2, -40, 8), 0.9, 0.45, middle=True, wave=1.4),
        Line(_gull(31.6, 14, 46), 0.8, 0.35, middle=True, wave=1.3),
        Line(_gull(39.6, -16, 48), 1.0, 0.5, middle=True, wave=1.5),
        Line(_gull(38.6, -50, -26), 0.8, 0.35, middle=True, wave=1.3),
        Line(_gull(46.8, -36, 12), 0.9, 0.4, middle=True, wave=1.5),
        Line(_gull(47.8, 20, 46), 0.8, 0.35, middle=True, wave=1.3),
        Line(_gull(55.5, -22, 30), 0.9, 0.35, middle=True, wave=1.4),
        Line(((49, 3.4), (55, 6), (61, 10)), 0.7, 0.45),
        Line(((49, 0.2), (55, 0.8), (62, 3.6)), 0.7, 0.45),
        Line(((48, -3.4), (54, -4.8), (62, -4.8)), 0.7, 0.5),
        Line(((47, -7.4), (53, -11), (60, -13.6)), 0.7, 0.45),
        Line(((40, -42), (44.5, -50), (47, -58), (47, -67)), 1.3, 0.55),
        Line(((36, -46), (39.5, -53), (41, -61), (40.5, -70)), 1.1, 0.5),
        *(
            Line(((x, top), (1.06 * x, -53), (1.1 * x, -56)), 0.8, 0.13, wave=0.4)
            for x, top in ((8.2, -51.5), (13.6, -50))
        ),
    ),
}  # fmt: skip
HANDS = (0.7, 1.1)
"""No line is as deep as its mirror image; factors."""
CHIN_PITS, CHIN_MM = 0.55, 1.3
"""Depth of the dimples of a chin, and their size."""


class Face:
    """The front of the mean face as a height field, and as pixels of the atlas."""

    def __init__(self, canvas: Canvas, size: int) -> None:
        at = canvas.millimetres
        front = np.unique(canvas.vertices)
        front = front[(at[front, 2] > FRONT_MM) & (canvas.head.occlusion[front] > 0.2)]
        self.depth = LinearNDInterpolator(at[front, :2], at[front, 2])
        self.pixels = np.stack([canvas.spread(at[:, k], size) for k in range(3)], -1)
        self.size = size

    def heights(self, lines: tuple[Line, ...], seed: int) -> np.ndarray:
        """(size, size) -1..1: what lines leave of smooth skin, which is 0."""
        rng = np.random.default_rng(seed)
        out = np.zeros((self.size, self.size))
        for line in lines:
            points = np.array(line.points, float)
            for sign in (1,) if line.middle else (1, -1):
                self._draw(out, points * [sign, 1], line, rng)
        return out.clip(-1, 1)

    def _draw(self, out: np.ndarray, points: np.ndarray, line: Line, rng) -> None:
        path, share = _sampled(points, line.wave, rng)
        path = np.column_stack([path, self.depth(path)])
        known = ~np.isnan(path[:, 2])
        path, share = path[known], share[known]
        low, high = path.min(0) - NEAR_MM, path.max(0) + NEAR_MM
        rows, columns = np.nonzero(((self.pixels > low) & (self.pixels < high)).all(-1))
        away, nearest = KDTree(path).query(self.pixels[rows, columns])
        # A line grows finer towards its ends, and is deeper here and there.
        along = share[nearest]
        ends = np.clip(along / 0.22, 0, 1) * np.clip((1 - along) / 0.28, 0, 1)
        ends = ends * ends * (3 - 2 * ends)
        uneven = 1 + 0.35 * _wandering(len(share), 40, rng)[nearest]
        depth = line.depth * rng.uniform(*HANDS) * ends * uneven.clip(0.25, 1.5)
        wide = away / (line.width * (0.55 + 0.45 * ends))
        out[rows, columns] += depth * _profile(wide)


def _profile(wide: np.ndarray) -> np.ndarray:
    """A crease with soft shoulders and the skin that is pushed up beside it."""
    crease = -1 / (1 + (1.25 * wide) ** 2) ** 2
    beside = 0.30 * np.exp(-(((wide - 2.1) / 1.0) ** 2))
    return crease + beside


def _sampled(
    points: np.ndarray, wave: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """(sample, 2) of a smooth curve through points that wavers a little; share of its way."""
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
    count = max(8, int(length[-1] / STEP_MM))
    t = np.linspace(0, length[-1], count)
    path = PchipInterpolator(length, points)(t)
    across = np.gradient(path, axis=0)[:, ::-1] * [1, -1]
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    waver = 0.6 * _wandering(count, 45, rng) + 0.25 * _wandering(count, 14, rng)
    return path + wave * waver[:, None] * across, t / length[-1]


def _wandering(count: int, sigma: float, rng: np.random.Generator) -> np.ndarray:
    """(count,) smooth noise of deviation 1 over samples of a line."""
    drawn = ndimage.gaussian_filter1d(rng.normal(size=count + 400), sigma)
    return (drawn / drawn.std())[200 : 200 + count]


def picture(canvas: Canvas, size: int = SIZE) -> np.ndarray:
    """(size, size, 3) 0..1: heights of the two sets and of the finer lines of the first."""
    face = Face(canvas, size)
    layers = [face.heights(lines, seed) for seed, lines in enumerate(LINES.values(), 31)]
    layers[1] += _chin(canvas, size)
    return np.stack(layers, -1).clip(-1, 1) * 0.5 + 0.5


def _chin(canvas: Canvas, size: int) -> np.ndarray:
    x, y, z = canvas.millimetres.T
    pad = np.exp(-((x / 11) ** 2) - ((y + 94) / 9) ** 2) * (z > -60)
    pits = np.minimum(noise(5, size, CHIN_MM / 0.39), 0.35)
    return CHIN_PITS * canvas.spread(pad, size).clip(0, 1) * (pits - 0.1).clip(-1.2, 0.3)


def zone_arrays(canvas: Canvas) -> dict[str, np.ndarray]:
    """Zones as `elocute.head.folds.folds_of_arrays` reads them."""
    at = canvas.millimetres
    front = np.unique(canvas.vertices)
    front = front[(at[front, 2] > FRONT_MM) & (canvas.head.occlusion[front] > 0.2)]
    tree = KDTree(at[front, :2])
    pairs, zone, weight = [], [], []
    masks, reach = np.zeros((at.shape[0], ZONES)), np.tile([0.0, 1.0], (ZONES, 1))
    names = ["-"] * ZONES
    for number, each in _numbered():
        for chosen, factor in ((each.together, 1.0), (each.apart, -each.parting)):
            for pair in chosen:
                pairs.append(front[tree.query(np.array(pair))[1]])
                zone.append(number)
                weight.append(factor / len(chosen))
        names[number], reach[number] = each.name, each.reach
        masks[front, number] = _box(each)(at[front, 0], at[front, 1])
    masks = np.round(255 * _shared(masks)).astype(np.uint8)
    return {
        "names": np.array(" ".join(names)),
        "pairs": np.array(pairs, np.uint16),
        "zone": np.array(zone, np.uint8),
        "weight": np.array(weight, np.float32),
        "reach": reach.astype(np.float32),
        "masks": masks[: np.nonzero(masks.any(1))[0].max() + 1],
    }


def _numbered() -> list[tuple[int, Zone]]:
    return [
        (first * ZONES_OF_SET + number, zone)
        for first, zones_of_set in zip(range(SETS), SETS_OF_ZONES, strict=True)
        for number, zone in enumerate(zones_of_set)
    ]


def _box(zone: Zone) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    def share(value: np.ndarray, sides: Place) -> np.ndarray:
        within = np.minimum(value - sides[0], sides[1] - value)
        t = np.clip(within / (2 * SOFT_MM) + 0.5, 0, 1)
        return t * t * (3 - 2 * t)

    return lambda x, y: share(x, zone.across) * share(y, zone.up)


def _shared(masks: np.ndarray) -> np.ndarray:
    """Zones of one set that meet share what lies between them."""
    sets = masks.reshape(len(masks), SETS, ZONES_OF_SET)
    return (sets / np.maximum(sets.sum(-1, keepdims=True), 1)).reshape(masks.shape)
