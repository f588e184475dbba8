"""Where hair grows: the hairline, roots on the scalp, a shell over it."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from elocute.head.normals import vertex_normals
from recipes.looks.cards import Cards, Fitting
from recipes.looks.strand_lanes import LANES
from recipes.looks.surface import Skin, subdivided, triangles

Places = np.ndarray
"""(n, 3) mm: y from the eyes' height, z from the front of the face backwards (`Canvas`)."""
DEEP_MM, DEPTH_STEP_MM, LOWER = 24.0, 2.0, 0.4
"""How far behind the hairline depths are told apart, how finely, and the share of them that counts
at its lower edge."""
DIVE_M = 0.003
"""How deep the edge of a shell lies under the skin."""
SOWN, LEAST_THICK = 40000, 0.2
"""Of how many places at random roots are chosen, and how thick hair is there at least."""
REACH_M = 0.05
"""The scalp holds hair that is nearer than this."""
LOWEST_MM = ((-205, -54), (-165, -52), (-150, -42), (-141, -22), (-133, 0), (-124, 11), (-100, 13))
LOWEST_MM += ((-95, 2), (-91, -8), (-84, -12))
"""How far behind the tip of the nose, and the height over the eyes where hair ends there: at the
nape, behind the ear, over it, in the sideburn."""
SOFT_MM = 5.0
SHELL_TIPS_V, SHELL_FADE_MM = 0.66, (2.0, 5.0, 8.0, 11.0)
"""Where in a lock there are but tips, and over which distances from its edge a shell closes."""
SHELL_V, SHELL_TURNS = (0.25, 0.17), 12
"""The shell takes the closed part of a lock: the middle of its height there, and half of it; how
often it goes forth and back across it, round the head."""
SIDEBURN_MM, SIDEBURN_SOFT_MM = (24.0, -116.0), (14.0, 8.0)
"""Below this height over the eyes, and before this, hair is a sideburn; how softly it begins."""


@dataclass(frozen=True)
class Hairline:
    """Where hair begins on the forehead, and at the temples.

    Parameters
    ----------
    front_mm : tuple of (float, float)
        How far aside, and the height over the eyes there.
    temple_mm : tuple of (float, float)
        Heights over the eyes, and how far behind the tip of the nose there.
    """

    front_mm: tuple[tuple[float, float], ...]
    temple_mm: tuple[tuple[float, float], ...]


OVAL = Hairline(
    ((0, 55), (12, 55), (26, 55), (36, 52), (45, 46), (53, 38), (62, 29)),
    ((-20, -84), (0, -80), (15, -73), (30, -65), (44, -56), (53, -46)),
)
WIDE = Hairline(
    ((0, 54), (14, 53), (30, 56), (42, 54), (52, 46), (62, 38)),
    ((-20, -84), (0, -80), (15, -74), (30, -68), (44, -60), (53, -46)),
)
"""Of a face that is framed by what falls beside it: hair of its corners would hang into it."""


def ramp(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """0 below the first, 1 above the second, smooth between; the other way round if they are."""
    t = np.clip((values - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def grows(
    millimetres: Places, inset_mm: float = 0.0, lower: float = 1.0, line: Hairline = OVAL
) -> np.ndarray:
    """(place,) 0 where no hair grows to 1 where it is thick, by `Canvas.millimetres`; `inset_mm`
    draws the hairline back, round the ears and at the nape by its share `lower`."""
    x, y, z = millimetres.T
    # Nobody's hairline is a line.
    y = y + 1.6 * np.sin(0.33 * x + 1) + 1.1 * np.sin(0.77 * x + 2) + 0.8 * np.sin(0.51 * z)
    z = z + 1.4 * np.sin(0.31 * y) + 1.0 * np.sin(0.73 * y + 1)

    def above(values: np.ndarray, limit: float | np.ndarray, share: float = 1.0) -> np.ndarray:
        return np.clip((values - limit - share * inset_mm) / SOFT_MM + 0.5, 0, 1)

    start = np.interp(y, *np.array(line.temple_mm).T)
    side = above(-z, -start) * above(y, np.interp(z, *np.array(LOWEST_MM).T), lower)
    front = np.interp(np.abs(x), *np.array(line.front_mm).T)
    return np.maximum(above(y, front), side)


def depth_mm(millimetres: Places, line: Hairline = OVAL) -> np.ndarray:
    """(place,) how far behind the hairline, about, from 0 to DEEP_MM: it is closer round the ears
    and at the nape than it is on the forehead, and depths count for more there."""
    insets = np.arange(0, DEEP_MM, DEPTH_STEP_MM)
    return DEPTH_STEP_MM * np.sum(
        [grows(millimetres, inset, LOWER, line) for inset in insets], axis=0
    )


@dataclass(frozen=True, eq=False)
class Roots:
    """Where ribbons begin: (n, 3) m, (n, 3) mm, how thick hair is there, how deep it lies in mm."""

    points: np.ndarray
    places: Places
    thick: np.ndarray
    depth: np.ndarray

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, chosen: np.ndarray) -> Roots:
        return Roots(
            self.points[chosen], self.places[chosen], self.thick[chosen], self.depth[chosen]
        )


class Scalp:
    """The skin that hair grows on and lies on."""

    def __init__(self, fitting: Fitting, millimetres: np.ndarray, line: Hairline = OVAL) -> None:
        self.fitting, self.line = fitting, line
        self.skin = Skin(fitting.skin, fitting.face.anatomy.skin_quads)
        self.shift = millimetres[0] - 1000 * fitting.skin[0]
        self.thick = self.grows(self.places(self.skin.points))

    def places(self, points: np.ndarray) -> Places:
        return 1000 * points + self.shift

    def lined(self, line: Hairline) -> Scalp:
        """The same scalp with another hairline."""
        other = copy(self)
        other.line = line
        other.thick = other.grows(self.places(self.skin.points))
        return other

    def grows(self, places: Places, inset_mm: float = 0.0) -> np.ndarray:
        """As the function, by its own hairline."""
        return grows(places, inset_mm, line=self.line)

    def hold(self, points: np.ndarray) -> np.ndarray:
        """(n, 1) 0..1 how much hair grows at the nearest places of the skin."""
        away, index = map(np.asarray, self.skin.tree.query(points))
        return (self.thick[index] * np.clip(1 - away / REACH_M, 0, 1))[:, None]

    def roots(self, apart_m: Callable[[Places], np.ndarray], rng: np.random.Generator) -> Roots:
        """Places on the skin that stand apart, by a function of places; closer at the hairline."""
        points = self.skin.scattered(SOWN, self.thick > 0, rng)
        places = self.places(points)
        thick = self.grows(places)
        apart = apart_m(places) * (0.6 + 0.4 * thick)
        tree, free = KDTree(points), thick > LEAST_THICK
        chosen = []
        for k in range(SOWN):
            if free[k]:
                chosen.append(k)
                free[tree.query_ball_point(points[k], apart[k])] = False
        kept = np.array(chosen)
        return Roots(points[kept], places[kept], thick[kept], depth_mm(places[kept], self.line))


def shell(
    scalp: Scalp,
    off_m: float | Callable[[Places], np.ndarray],
    inset_mm: float,
    shade: float | Callable[[Places], np.ndarray],
    *,
    sideburns: bool = False,
) -> Cards:
    """The scalp once more, further out by a distance or by a function of places;
    its edge, which stays `inset_mm` behind the hairline, dives under the skin. Without sideburns it
    ends above the ears: under the few hairs there it would show as a patch."""
    points, quads, _ = subdivided(scalp.fitting.skin, scalp.fitting.face.anatomy.skin_quads)
    thick = scalp.grows(scalp.places(points), inset_mm)
    if not sideburns:
        _, y, z = scalp.places(points).T
        below = np.clip((SIDEBURN_MM[0] - y) / SIDEBURN_SOFT_MM[0], 0, 1)
        before = np.clip((z - SIDEBURN_MM[1]) / SIDEBURN_SOFT_MM[1], 0, 1)
        thick = thick * (1 - below * before)
    normals = vertex_normals(points, triangles(quads))
    quads = quads[(thick[quads] > 0).any(1)]
    used, own = np.unique(quads, return_inverse=True)
    own = own.reshape(-1, 4)
    places = scalp.places(points[used])
    away = off_m(places) if callable(off_m) else off_m
    away = np.minimum(away, np.maximum(away * (2.4 * thick[used] ** 2 - 1.4), -DIVE_M))
    index, weights = scalp.fitting.nearest(points[used])
    points = points[used] + normals[used] * away[:, None]
    # Strands run down, back and forth within one lock of the picture: shading needs their way.
    x, y, z = (points - points.mean(0)).T
    turn = np.arcsin(np.sin(SHELL_TURNS * np.arctan2(x, z))) / (np.pi / 2)
    down = SHELL_V[0] + SHELL_V[1] * y / np.abs(y).max()
    # Towards its edge come the tips of the lock: there it is no more than strands.
    closed = np.mean([scalp.grows(places, inset_mm + more) for more in SHELL_FADE_MM], axis=0)
    uv = np.stack([(0.5 + 0.3 * turn) / LANES, SHELL_TIPS_V + (down - SHELL_TIPS_V) * closed], 1)
    offset = points - np.einsum("vk,vkc->vc", weights, scalp.fitting.skin[index])
    dark = shade(places) if callable(shade) else np.full(len(used), shade)
    return Cards(index, weights, offset, own, uv, own, dark, points)
