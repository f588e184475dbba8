"""Teeth and gums, made by formula on two arches. Millimetres inside, metres out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

UPPER_WIDTHS_MM = (8.5, 6.6, 7.6, 7.0, 6.8, 10.0, 9.4)
UPPER_HEIGHTS_MM = (10.2, 8.9, 9.8, 8.4, 7.8, 7.2, 6.8)
UPPER_DEPTHS_MM = (6.0, 5.6, 7.2, 8.6, 8.8, 10.4, 10.2)
LOWER_WIDTHS_MM = (5.4, 5.9, 6.8, 7.0, 7.1, 10.6, 10.2)
LOWER_HEIGHTS_MM = (8.6, 8.8, 9.8, 8.2, 7.8, 7.0, 6.6)
LOWER_DEPTHS_MM = (5.4, 5.6, 7.0, 7.6, 8.0, 9.8, 9.6)
"""Crowns from the middle outwards: two incisors, canine, two premolars, two molars
(rounded from dental anatomy tables)."""

AROUND = 12
"""Vertices around a crown."""


SQUARENESS = 2.12
"""Exponent of the arch's superellipse: 2 would be an ellipse, more is squarer."""
SHORT_MM = (0.0, 0.7, 0.3, 0.9, 1.0, 1.2, 1.4)
"""How far each crown stays short of the biting plane: the edges of a smile, no fangs."""


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


def crown(width: float, height: float, depth: float, place: int) -> tuple[np.ndarray, ...]:
    """Local vertices (along the arch, height, outwards), quads, shade and gap of one crown.

    place 0..6 from the middle: incisors taper to an edge, the canine to a point, premolars
    and molars end in a dented top.
    """
    front = place < 3
    levels = np.array([0.0, 0.4, 0.75, 0.93, 1.0])
    widths = np.interp(levels, [0, 0.35, 0.8, 0.93, 1], [0.78, 0.93, 1.0, 0.96, 0.86])
    if front:
        depths = np.interp(levels, [0, 0.3, 0.8, 0.93, 1], [1.0, 0.92, 0.42, 0.30, 0.20])
    else:
        depths = np.interp(levels, [0, 0.4, 0.8, 0.93, 1], [0.88, 1.0, 0.92, 0.82, 0.62])
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    exponent = 0.62
    ring_x = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** exponent
    ring_z = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** exponent
    vertices, shade = [], []
    for level, w, d in zip(levels, widths, depths, strict=True):
        x = ring_x * w * width / 2
        z = ring_z * d * depth / 2
        if front:
            # The front face stays on the arch, the back face slopes towards it.
            z = z + (1 - d) * depth / 2 * 0.85 - 0.12 * depth * (level - 0.5) ** 2
        y = np.full(AROUND, level * height)
        if level == 1.0 and place == 2:
            y = y + 0.045 * height * (1 - np.abs(ring_x) ** 1.2)
        if level == 1.0 and not front:
            y = y + 0.05 * height * np.abs(ring_x * ring_z) ** 0.5
        vertices.append(np.stack([x, y, z], 1))
        shade.append(np.full(AROUND, level))
    top = vertices[-1].mean(0)
    top[1] = height * (1.0 if front else 0.86)
    centre = len(levels) * AROUND
    quads = []
    for row in range(len(levels) - 1):
        for k in range(AROUND):
            a, b = row * AROUND + k, row * AROUND + (k + 1) % AROUND
            quads.append([a, b, b + AROUND, a + AROUND])
    last = centre - AROUND
    for k in range(0, AROUND, 2):
        quads.append([last + k, last + (k + 1) % AROUND, last + (k + 2) % AROUND, centre])
    gap = np.r_[np.tile(np.abs(ring_x) > 0.99, len(levels)), False]
    whole = np.vstack([*vertices, top[None]])
    return whole, np.array(quads), np.r_[np.concatenate(shade), 1.0], gap.astype(float)


def teeth(arch: Arch, widths, heights, depths) -> Part:
    """All fourteen crowns of one jaw."""
    length, _ = arch.samples()
    scale = min(1.0, length[-1] / (sum(widths) * 0.97))
    vertices, quads, mirror, shades, gaps, start = [], [], [], [], [], 0.0
    count = 0
    for place, (width, height, depth) in enumerate(zip(widths, heights, depths, strict=True)):
        width = width * scale
        local, faces, shade, gap = crown(width * 0.975, height, depth, place)
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
            count += n
    return Part(
        np.vstack(vertices) / 1000,
        np.vstack(quads),
        np.concatenate(mirror),
        np.concatenate(shades),
        np.concatenate(gaps),
    )


def gums(arch: Arch, heights, stations: int = 19) -> Part:
    """A swept gum: its lower edge scallops around the crowns' roots."""
    length, _ = arch.samples()
    along = np.linspace(0, length[-1] * 0.995, stations)
    root = float(np.mean(heights)) - 0.6
    section = np.array(  # (out, up from the root line)
        [
            [-0.2, -1.2],
            [0.3, 0.3],
            [0.0, 2.2],
            [-2.5, 3.6],
            [-7.0, 3.4],
            [-10.0, 2.0],
            [-9.6, -0.8],
            [-5.0, -1.4],
        ]
    )
    rows = []
    for s in along:
        point, _, outward = arch.frame(s)
        flat = point + section[:, [0]] * outward
        y = arch.biting_mm - arch.direction * (root + section[:, 1])
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
    return Part(whole.reshape(-1, 3) / 1000, np.array(quads), index[::-1].ravel(), plain + 1, plain)
