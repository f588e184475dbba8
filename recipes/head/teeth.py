"""Teeth and gums, made by formula on two arches. Millimetres inside, metres out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

UPPER_WIDTHS_MM = (8.6, 6.5, 7.5, 7.0, 6.8, 10.0, 9.4)
UPPER_HEIGHTS_MM = (10.6, 9.2, 10.2, 9.0, 8.4, 7.8, 7.2)
UPPER_DEPTHS_MM = (6.0, 5.6, 7.2, 8.6, 8.8, 10.4, 10.2)
LOWER_WIDTHS_MM = (5.4, 5.9, 6.8, 7.0, 7.1, 10.6, 10.2)
LOWER_HEIGHTS_MM = (8.6, 8.8, 9.8, 8.2, 7.8, 7.0, 6.6)
LOWER_DEPTHS_MM = (5.4, 5.6, 7.0, 7.6, 8.0, 9.8, 9.6)
"""Crowns from the middle outwards: two incisors, canine, two premolars, two molars
(rounded from dental anatomy tables)."""

UPPER_ACROSS = np.array([1, 0.92, 0.7, 0.36, 0, -0.36, -0.7, -0.92, -1, -0.75, 0, 0.75])
LOWER_ACROSS = np.array([1, 0.86, 0.45, 0, -0.45, -0.86, -1, -0.86, -0.45, 0, 0.45, 0.86])
"""Where the vertices around a crown lie between its sides (1 is the one away from the middle of
the arch): most along the face that is seen first, of the lower jaw as many along the back."""
AROUND, UPPER_SEEN, LOWER_SEEN = len(UPPER_ACROSS), 9, 7
LEVELS = np.array([0.0, 0.35, 0.68, 0.9, 1.0])
"""Heights of the rings, as shares of the crown's."""
SIDE_OF_FRONT = 0.33
"""Where the faces of two neighbours meet between their backs (-1) and fronts (1)."""
ROUNDNESS = 2.6
"""Exponent of how the face of a crown turns away towards its sides: 2 is a circle's."""
CORNERS_MM = ((0.55, 1.50), (0.85, 1.55), (1.30, 1.80), (1.20, 1.30), (0.90, 0.95))
"""How much lower than its middle the edge of a crown is at either side, towards the middle of the
arch and away from it: two incisors, canine, two premolars."""
LOWER_FALL = 0.45
"""Of that fall, what the teeth of the lower jaw have."""
SHARPNESS = (3.2, 2.6, 1.35, 1.4, 1.5)
"""Exponent of that fall: 1 is a point, more an edge with round corners."""
WIDENING = ((0.78, 0.92, 0.99, 1.0, 0.94), (0.80, 0.93, 0.99, 1.0, 0.95))
"""Widths at those levels, as shares of the widest: of front teeth and of the others. They touch
near their edges and leave room for the gum above."""
TIPPED_MM, ROUNDED_MM, VALLEY_MM = 0.6, 0.3, 0.30
"""How far edges lean and turn inwards, and the valley between a molar's cusps."""
PIT = 0.94
"""How high the middle of a chewing face is, as a share of the crown."""
PAPILLA_MM = (3.5, 2.0)
"""How far the gum reaches down between two crowns: incisors, and premolars and molars."""
FOLLOWING = np.array([1.0, 1.0, 0.4, 0.2, 0.2, 0.2, 0.2, 0.6])
"""How far the points of a gum's section follow its scalloped edge."""
COVERED_MM = 0.9
"""How much of a crown the gum covers in its middle: a wide smile shows its edge."""
SEEN_GAP = 0.45
"""Of the dark between two crowns, what reaches the faces beside it."""
SQUARENESS = 2.2
"""Exponent of the arch's superellipse: 2 would be an ellipse, more is squarer."""
TONES = (
    (1.00, 1.00, 1.00),
    (0.985, 0.98, 0.965),
    (0.975, 0.955, 0.92),
    (0.98, 0.965, 0.935),
    (0.96, 0.945, 0.915),
    (0.97, 0.95, 0.92),
    (0.96, 0.94, 0.90),
)
"""What is left of red, green and blue: canines are yellowest, and no two neighbours are alike."""
SHORT_MM = (0.0, 0.9, 0.25, 0.8, 1.1, 1.4, 1.6)
"""How far each crown stays short of the biting plane: the edges of a smile, no fangs."""
SLIM = 0.992
"""Share of its place in the arch that a crown fills: the rest is the dark between two."""
UPPER_SET = ((-1.5, 0.0), (7.0, -0.45), (-4.0, 0.0), (0.0, 0.0))
LOWER_SET = ((3.0, -0.12), (-4.0, 0.15), (2.0, 0.2))
"""No row is a drawn line: degrees by which a crown's far side turns outwards, and mm that it
stands out of the arch."""


@dataclass(frozen=True)
class Arch:
    """Half a superellipse in the xz plane through the outer faces of the teeth."""

    half_width_mm: float
    front_mm: float  # z of the front
    back_mm: float  # z of the widest place
    biting_mm: float  # y of the incisal edge
    direction: float  # +1: crowns point up (lower jaw), -1: down (upper jaw)

    def samples(self) -> tuple[np.ndarray, np.ndarray]:
        """Arc length (n,) and points (n, 2) of the left half, from the middle backwards."""
        angle = np.linspace(0, np.pi / 2, 400)
        depth = self.front_mm - self.back_mm
        power = 2 / SQUARENESS
        points = np.stack(
            [
                self.half_width_mm * np.sin(angle) ** power,
                self.back_mm + depth * np.abs(np.cos(angle)) ** power,
            ],
            1,
        )
        length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
        return length, points

    def frame(self, along: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Point, tangent (backwards) and outward normal at an arc length."""
        length, points = self.samples()

        def at(s: float) -> np.ndarray:
            return np.array([np.interp(s, length, points[:, k]) for k in range(2)])

        tangent = at(along + 0.5) - at(max(along - 0.5, 0))
        tangent /= np.linalg.norm(tangent)
        return at(along), tangent, np.array([-tangent[1], tangent[0]])


@dataclass(frozen=True, eq=False)
class Part:
    vertices: np.ndarray  # (vertex, 3) m
    quads: np.ndarray  # (face, 4)
    mirror: np.ndarray  # (vertex,)
    shade: np.ndarray  # (vertex,) 0 at the root, 1 at the biting edge
    gap: np.ndarray  # (vertex,) 1 between two crowns, 0 elsewhere
    tone: np.ndarray  # (vertex, 3) factors of a crown's colour


def crown(
    width: float, height: float, depth: float, place: int, upper: bool
) -> tuple[np.ndarray, ...]:
    """Local vertices (along the arch, height, outwards), quads, shade and gap of one crown.

    place 0..6 from the middle: incisors taper to an edge, the canine to a point, premolars
    and molars end in a dented top.
    """
    front = place < 3
    widths = np.interp(LEVELS, [0, 0.35, 0.68, 0.9, 1], WIDENING[0 if front else 1])
    if front:
        depths = np.interp(LEVELS, [0, 0.3, 0.8, 0.92, 1], [1.0, 0.92, 0.46, 0.31, 0.17])
    else:
        depths = np.interp(LEVELS, [0, 0.4, 0.8, 0.92, 1], [0.88, 1.0, 0.94, 0.84, 0.66])
    across = UPPER_ACROSS if upper else LOWER_ACROSS
    seen = np.arange(AROUND) < (UPPER_SEEN if upper else LOWER_SEEN)
    bulge = np.abs(across) ** ROUNDNESS
    round_it = np.where(seen, 1 - (1 - SIDE_OF_FRONT) * bulge, -1 + 0.5 * bulge)
    fall = _edge_fall_mm(across, place) * (1.0 if upper else LOWER_FALL)
    vertices, shade = [], []
    for level, wide, deep in zip(LEVELS, widths, depths, strict=True):
        # The front face stays on the arch and leans in, the back face slopes towards it.
        z = 1 - (1 - round_it) * deep if front else round_it * deep
        z = z * depth / 2 - TIPPED_MM * level**2.5
        if level == 1.0:
            z = z - ROUNDED_MM * seen
        y = level * height - fall * level**4
        vertices.append(np.stack([across * wide * width / 2, y, z], 1))
        shade.append(np.full(AROUND, level))
    top = vertices[-1].mean(0)
    top[1] = vertices[-1][:, 1].max() if front else PIT * height
    centre = len(LEVELS) * AROUND
    quads = []
    for row in range(len(LEVELS) - 1):
        for k in range(AROUND):
            a, b = row * AROUND + k, row * AROUND + (k + 1) % AROUND
            quads.append([a, b, b + AROUND, a + AROUND])
    last = centre - AROUND
    for k in range(0, AROUND, 2):
        quads.append([last + k, last + (k + 1) % AROUND, last + (k + 2) % AROUND, centre])
    side = np.abs(across)
    dark = np.where(side == 1, 1.0, np.where(side > 0.8, SEEN_GAP, 0.0) * seen)
    gap = np.r_[np.tile(dark, len(LEVELS)), 0.0]
    whole = np.vstack([*vertices, top[None]])
    return whole, np.array(quads), np.r_[np.concatenate(shade), 1.0], gap


def _edge_fall_mm(across: np.ndarray, place: int) -> np.ndarray:
    """(AROUND,) mm by which a crown's edge stays below its highest point."""
    if place >= len(CORNERS_MM):  # molars: two cusps
        return VALLEY_MM * (0.5 + 0.5 * np.cos(2 * np.pi * across)) + 0.4 * np.abs(across) ** 4
    near, far = CORNERS_MM[place]
    return np.where(across < 0, near, far) * np.abs(across) ** SHARPNESS[place]


def teeth(arch: Arch, widths, heights, depths) -> Part:
    """All fourteen crowns of one jaw."""
    scale = _fitting(arch, widths)
    vertices, quads, mirror, shades, gaps, tones, start = [], [], [], [], [], [], 0.0
    count = 0
    for place, (width, height, depth) in enumerate(zip(widths, heights, depths, strict=True)):
        width = width * scale
        local, faces, shade, gap = crown(width * SLIM, height, depth, place, arch.direction < 0)
        local = _set(local, depth, place, arch.direction < 0)
        point, tangent, outward = arch.frame(start + width / 2)
        start += width
        centre = point - outward * depth / 2
        flat = centre + local[:, [0]] * tangent + local[:, [2]] * outward
        y = arch.biting_mm - arch.direction * (height + SHORT_MM[place] - local[:, 1])
        left = np.stack([flat[:, 0], y, flat[:, 1]], 1)
        n = len(left)
        # Mirroring turns faces inside out: the lower jaw's crowns and each right side need it.
        first = faces[:, ::-1] if arch.direction > 0 else faces
        for side, side_faces in ((1, first), (-1, first[:, ::-1])):
            vertices.append(left * [side, 1, 1])
            quads.append(side_faces + count)
            partner = count + n if side > 0 else count - n
            mirror.append(np.arange(n) + partner)
            shades.append(shade)
            gaps.append(gap)
            tones.append(np.tile(TONES[place], (n, 1)))
            count += n
    return Part(
        np.vstack(vertices) / 1000,
        np.vstack(quads),
        np.concatenate(mirror),
        np.concatenate(shades),
        np.concatenate(gaps),
        np.concatenate(tones),
    )


def _set(local: np.ndarray, depth: float, place: int, upper: bool) -> np.ndarray:
    """A crown turned and moved as it stands in its row, about the middle of its face."""
    row = UPPER_SET if upper else LOWER_SET
    turn_deg, out_mm = row[place] if place < len(row) else (0.0, 0.0)
    turn = np.radians(turn_deg)
    along, outwards = local[:, 0], local[:, 2] - depth / 2
    placed = local.copy()
    placed[:, 0] = along * np.cos(turn) - outwards * np.sin(turn)
    placed[:, 2] = along * np.sin(turn) + outwards * np.cos(turn) + depth / 2 + out_mm
    return placed


def _fitting(arch: Arch, widths) -> float:
    """Share of their widths that crowns have so that an arch holds all."""
    length, _ = arch.samples()
    return min(1.0, length[-1] / (sum(widths) * 0.97))


def gums(arch: Arch, widths, heights) -> Part:
    """A swept gum: its edge scallops around the crowns' roots, with a papilla between two."""
    length, _ = arch.samples()
    edges = np.r_[0, np.cumsum(widths)] * _fitting(arch, widths)
    centres = (edges[:-1] + edges[1:]) / 2
    between = np.r_[edges[:2] + centres[:2], centres[:2] + edges[1:3]] / 2
    along = np.r_[edges, centres, between]
    papilla = np.r_[np.ones(len(edges)), np.zeros(len(centres)), np.full(len(between), 0.14)]
    order = along.argsort()
    along, papilla = np.minimum(along[order], length[-1] * 0.995), papilla[order]
    filled = np.interp(along, (edges[2], edges[5]), PAPILLA_MM)
    roots = np.interp(along, centres, np.add(heights, SHORT_MM)) - COVERED_MM - filled * papilla
    level = np.mean(roots)
    section = np.array(  # (out, up from the root line)
        [
            [-0.2, -1.2],
            [0.45, 0.3],
            [0.55, 2.2],
            [-2.5, 3.6],
            [-7.0, 3.4],
            [-10.0, 2.0],
            [-9.6, -0.8],
            [-5.0, -1.4],
        ]
    )
    rows = []
    for s, root in zip(along, roots, strict=True):
        point, _, outward = arch.frame(s)
        flat = point + section[:, [0]] * outward
        base = level + FOLLOWING * (root - level)
        y = arch.biting_mm - arch.direction * (base + section[:, 1])
        rows.append(np.stack([flat[:, 0], y, flat[:, 1]], 1))
    left = np.array(rows)
    left[0, :, 0] = 0
    whole = np.concatenate([left[:0:-1] * [-1, 1, 1], left])
    n, k = whole.shape[:2]
    quads = []
    for i in range(n - 1):
        for j in range(k):
            a, b = i * k + j, i * k + (j + 1) % k
            quad = [a, b, b + k, a + k]
            quads.append(quad if arch.direction > 0 else quad[::-1])
    index = np.arange(n * k).reshape(n, k)
    plain = np.zeros(n * k)
    return Part(
        whole.reshape(-1, 3) / 1000,
        np.array(quads),
        index[::-1].ravel(),
        plain + 1,
        plain,
        np.ones((n * k, 3)),
    )
