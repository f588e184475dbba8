"""The picture of straight hair: locks side by side, drawn strand by strand."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from recipes.looks.canvas import blurred

PX, FINER, LANES = 1024, 4, 8
STRANDS = (170, 150, 104, 90, 52, 42, 16, 11)
"""Strands of each lock."""
DENSE, FULL, LOOSE, AIRY = (0, 1), (2, 3), (4, 5), (6, 7)
"""Locks by how much shows through."""
SOLID = (0.80, 0.72, 0.5, 0.4, 0.0, 0.0, 0.0, 0.0)
"""How far from the root a lock is closed."""
LONG_V, SHORT_V = (0.005, 0.70), (0.725, 0.995)
"""Heights of the picture that hold long locks, and below those of short hair, whose strands begin
as fine and as uneven as they end: such hair shows its roots."""
SHORT_STRANDS = (46, 40, 30, 26, 17, 14, 9, 6)
CLUMPS, GATHERED, SHORT_GATHERED = (4, 8), (0.25, 0.75), (0.6, 1.1)
"""Into how many clumps the strands of a lock fall, and how far from their middle they end there."""
TONE, CLUMP_TONE, STRAND_TONE, TONES = 0.80, 0.06, 0.08, (0.50, 1.0)
"""Mean tone of strands, how far that of clumps and of strands in a clump differs, and its ends."""
DEEP_TONE = 0.58
"""What one sees between strands of a closed lock lies in their shade."""
FEW = 25
"""Fewer strands than this stand as chance has it."""
SHORTEST, EARLY, ROUNDED = 0.62, 2.0, 0.07
"""The shortest strand of a lock, how few end early (a power: 1 as many as late; few that are left
alone at the tips would be wires), and how much sooner those at its sides end."""
SIDES = (0.02, 0.98)
"""Between these places across its lock a strand stays."""
LATE_ROOT, LATE_LONG_ROOT = 0.22, 0.07
"""Strands of short hair, and of long, begin within this share of their lock."""
POINTS = 24
WIDTHS, SHORT_WIDTHS = (5, 6, 7, 9), (10, 12, 16, 20)
BROADER = (0, 0, 0, 0, 1, 1, 3, 3)
"""Pixels of the drawing, as are the former: how much broader strands of an open lock are, whose
narrow ribbons show it."""
Drawings = tuple[ImageDraw.ImageDraw, ImageDraw.ImageDraw]
"""Of the tone, and of what is covered."""


def picture() -> np.ndarray:
    """(PX, PX, 4) 0..1: roots below, tips above; grey, to be tinted."""
    rng = np.random.default_rng(3)
    size = PX * FINER
    tone, alpha = Image.new("L", (size, size), 120), Image.new("L", (size, size), 0)
    drawings = ImageDraw.Draw(tone), ImageDraw.Draw(alpha)
    for lane in range(LANES):
        if SOLID[lane]:
            _body(drawings, lane)
        _lock(drawings, lane, STRANDS[lane], rng)
        _short_lock(drawings, lane, SHORT_STRANDS[lane], rng)
    small = [
        np.asarray(each.resize((PX, PX), Image.Resampling.BOX), float) / 255
        for each in (tone, alpha)
    ]
    grey, cover = small
    # Clear texels take the tone of the strands beside them, or fringes would be pale.
    share = blurred(cover, 3.0)
    near = blurred(grey * cover, 3.0) / np.maximum(share, 1e-4)
    grey = np.where(
        cover > 0.02, (grey * cover + near * (1 - cover)), np.where(share > 1e-3, near, 0.6)
    )
    return np.dstack([grey, grey, grey, np.clip(cover * 1.15, 0, 1)])


def _body(drawings: Drawings, lane: int) -> None:
    """What closes a lock behind its strands."""
    tone, alpha = drawings
    x = (lane + np.array([0.5, 0.7, 0.84, 0.80, 0.5, 0.2, 0.16, 0.3])) / LANES
    top = SOLID[lane]
    heights = np.array([0.05, 0.08, 0.14, top - 0.2, top, top - 0.2, 0.14, 0.08])
    outline = _pixels(x, heights, LONG_V)
    alpha.polygon(outline, fill=255)
    tone.polygon(outline, fill=round(255 * DEEP_TONE))


def _lock(drawings: Drawings, lane: int, count: int, rng: np.random.Generator) -> None:
    t = np.linspace(0, 1, POINTS)
    at, centre, light = _clumped(count, rng)
    for k in rng.permutation(count):
        end = centre[k] + (at[k] - centre[k]) * rng.uniform(*GATHERED) + 0.03 * rng.normal()
        end = 0.5 + (end - 0.5) * 0.85
        bow = 0.05 * rng.normal() * np.sin(np.pi * t) + 0.02 * rng.normal() * np.sin(2 * np.pi * t)
        x = _inside(at[k] + (end - at[k]) * t**1.6 + bow)
        length = 1 - (1 - SHORTEST) * rng.uniform() ** EARLY
        length *= 1 - ROUNDED * abs(2 * at[k] - 1) ** 2
        broad = BROADER[lane] + int(rng.choice(WIDTHS, p=[0.3, 0.4, 0.2, 0.1]))
        start = LATE_LONG_ROOT * (0.4 * rng.uniform() + 0.6 * (2 * at[k] - 1) ** 2)
        places = _pixels((lane + x) / LANES, start + (length - start) * t, LONG_V)
        cut = int(POINTS * 0.72)
        for drawing, fill in zip(drawings, (light[k], 255), strict=True):
            drawing.line(places[: cut + 1], fill=fill, width=broad, joint="curve")
            drawing.line(places[cut:], fill=fill, width=max(2, broad - 4))


def _short_lock(drawings: Drawings, lane: int, count: int, rng: np.random.Generator) -> None:
    """Strands that are fine at both ends; those outside begin later, so that no edge is seen."""
    at, centre, light = _clumped(count, rng)
    for k in rng.permutation(count):
        aside = abs(2 * at[k] - 1)
        start = LATE_ROOT * (0.5 * rng.uniform() + 0.5 * aside**2)
        stop = start + (1 - start) * rng.uniform(SHORTEST, 1.0) * (1 - 0.25 * aside**2)
        t = np.linspace(0, 1, POINTS)
        end = centre[k] + (at[k] - centre[k]) * rng.uniform(*SHORT_GATHERED)
        end = end + 0.08 * rng.normal()
        bow = 0.05 * rng.normal() * np.sin(np.pi * t)
        x = _inside(at[k] + (end - at[k]) * t**1.4 + bow)
        places = _pixels((lane + x) / LANES, start + (stop - start) * t, SHORT_V)
        broad = int(rng.choice(SHORT_WIDTHS))
        in_, out, far = POINTS // 6, int(POINTS * 0.58), int(POINTS * 0.8)
        for drawing, fill in zip(drawings, (light[k], 255), strict=True):
            drawing.line(places[: in_ + 1], fill=fill, width=round(0.7 * broad))
            drawing.line(places[in_ : out + 1], fill=fill, width=broad, joint="curve")
            drawing.line(places[out : far + 1], fill=fill, width=round(0.7 * broad))
            drawing.line(places[far:], fill=fill, width=round(0.4 * broad))


def _inside(x: np.ndarray) -> np.ndarray:
    """Places across a lock, turned back at its sides: held there, they would be an edge."""
    low, high = SIDES
    return high - np.abs(high - low - np.abs(x - low))


def _clumped(count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Where strands begin across their lock, the middle of each one's clump, its tone 0..255."""
    at = 0.06 + 0.88 * (np.arange(count) + rng.uniform(size=count)) / count
    if count < FEW:  # else a comb's teeth
        at = 0.06 + 0.88 * rng.uniform(size=count)
    clumps = int(rng.integers(*CLUMPS, endpoint=True))
    middles = 0.1 + 0.8 * (np.arange(clumps) + rng.uniform(0.2, 0.8, clumps)) / clumps
    own = np.abs(at[:, None] - middles).argmin(1)
    tone = TONE + CLUMP_TONE * rng.normal(size=clumps)[own] + STRAND_TONE * rng.normal(size=count)
    return at, middles[own], [round(255 * value) for value in np.clip(tone, *TONES)]


def within(span: tuple[float, float], share: np.ndarray | float) -> np.ndarray:
    """Heights of the picture at these shares of a span of it."""
    return np.asarray(span[0] + (span[1] - span[0]) * share)


def _pixels(u: np.ndarray, t: np.ndarray, span: tuple[float, float]) -> list[tuple[float, float]]:
    """Pixels of places u across the picture and t along a lock within these heights."""
    size = PX * FINER
    rows = size * (1 - within(span, t))
    return list(zip(size * u, rows, strict=True))
