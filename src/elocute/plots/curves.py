"""Plots curves over time with Pillow: a panel for each, or many over each other.

With the range between these shaded, as in VOCA 2019, fig. 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.files.atomic import write_atomically
from elocute.motion.curves import Curves

WIDTH, HEIGHT = 1400, 560
LEFT, RIGHT, TOP, BOTTOM = 80, 190, 50, 50  # margins; the names stand on the right
SCALE = 2  # drawn larger, then reduced: smooth lines
INKS = (
    *("#1f5fa8", "#b4482b", "#3a7d44", "#7a4b9a", "#8a6d1f", "#2b7a86"),
    *("#c2417c", "#555555", "#6a9a1f", "#0f3d6b", "#d98a3d", "#4b4bd0"),
)
SHADE = "#e3e8ef"
MARKS = (1, 2, 5, 10)
PANEL, MARGIN, GAP = 170, 90, 26  # of a panel for each curve


def plot_curves(curves: Curves, path: str | Path, title: str = "") -> None:
    """Draw curves over a common time axis, a panel for each, as .png.

    Raises OutputError for a place that cannot be written.
    """
    from PIL import Image, ImageDraw, ImageFont

    font = ImageFont.load_default(13 * SCALE)
    height = MARGIN + len(curves.names) * (PANEL + GAP)
    image = Image.new("RGB", (WIDTH * SCALE, height * SCALE), "white")
    draw = ImageDraw.Draw(image)
    draw.text((MARGIN * SCALE, 14 * SCALE), title, fill="#222222", font=font)
    seconds = len(curves.values) / curves.fps
    left, right = MARGIN, WIDTH - 30
    for index, name in enumerate(curves.names):
        top = 44 + index * (PANEL + GAP)
        values = curves.values[:, index]
        low, high = _nice_range(values)
        box = [left * SCALE, top * SCALE, right * SCALE, (top + PANEL) * SCALE]
        draw.rectangle(box, outline="#bbbbbb", width=SCALE)
        for value in (low, (low + high) / 2, high):
            y = (top + PANEL * (1 - (value - low) / (high - low))) * SCALE
            draw.line([left * SCALE, y, right * SCALE, y], fill="#e4e4e4", width=SCALE)
            draw.text((left * SCALE - 8, y), f"{value:g}", fill="#555555", font=font, anchor="rm")
        draw.text((left * SCALE + 10, top * SCALE + 6), name, fill=INKS[index % 6], font=font)
        x = left + (right - left) * np.arange(len(values)) / max(len(values) - 1, 1)
        y = top + PANEL * (1 - (values - low) / (high - low))
        points = np.stack([x, y], axis=1) * SCALE
        if len(points) > 1:
            draw.line([tuple(point) for point in points], fill=INKS[index % 6], width=2 * SCALE)
    bottom = 44 + len(curves.names) * (PANEL + GAP) - GAP
    for second in np.arange(0, seconds + 1e-9, round_step(max(seconds, 1e-3), 10)):
        x = (left + (right - left) * second / seconds) * SCALE
        label = f"{second:g} s"
        draw.text((x, (bottom + 8) * SCALE), label, fill="#555555", font=font, anchor="ma")
    with write_atomically(path) as draft:
        image.resize((WIDTH, height), Image.Resampling.LANCZOS).save(draft)


def _nice_range(values: np.ndarray) -> tuple[float, float]:
    low, high = float(min(values.min(), 0)), float(values.max())
    if values.min() > 0.5 * values.max() > 0:  # a width, say: look at its change
        low = float(values.min())
    low, high = np.floor(low), np.ceil(high)
    return float(low), float(high if high > low else low + 1)


def plot_overlay(
    curves: Curves,
    path: str | Path,
    *,
    title: str = "",
    unit: str = "",
    shade: bool = True,
    reach: Curves | None = None,
) -> None:
    """Draw curves over each other in one panel, as .png.

    unit: of the values. shade: fill the region between the least and the greatest curve, or that of
    `reach`, which has as many frames. Raises OutputError for a place that cannot be written.
    """
    with write_atomically(path) as draft:
        _panel(curves, title, unit, shade, reach).save(draft)


def plot_panels(
    panels: Sequence[tuple[str, Curves]], path: str | Path, *, unit: str = "", shade: bool = True
) -> None:
    """Draw panels of curves, each with a heading, below each other, as `plot_overlay` draws one."""
    from PIL import Image

    whole = Image.new("RGB", (WIDTH, HEIGHT * len(panels)), "white")
    for place, (title, curves) in enumerate(panels):
        whole.paste(_panel(curves, title, unit, shade), (0, HEIGHT * place))
    with write_atomically(path) as draft:
        whole.save(draft)


def _panel(curves: Curves, title: str, unit: str, shade: bool, reach: Curves | None = None) -> Any:
    """A picture of one panel."""
    from PIL import Image, ImageDraw, ImageFont

    image = Image.new("RGB", (WIDTH * SCALE, HEIGHT * SCALE), "white")
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(13 * SCALE)
    highest = max(float(each.values.max()) for each in (curves, reach or curves))
    high = round_step(max(highest, 1e-3), 5) * 5
    seconds = max(len(curves.values) / curves.fps, 1e-3)
    _axes(draw, font, title, unit, high, seconds)
    x = _across(np.arange(len(curves.values)) / curves.fps / seconds)
    if shade and len(x) > 1:
        filled = (reach or curves).values
        low, top = (_down(f(filled, axis=1) / high) for f in (np.min, np.max))
        draw.polygon([*_points(x, top), *reversed(_points(x, low))], fill=SHADE)
    for index, name in enumerate(curves.names):
        ink = INKS[index % len(INKS)]
        if len(x) > 1:
            line = _points(x, _down(curves.values[:, index] / high))
            draw.line(line, fill=ink, width=2 * SCALE, joint="curve")
        place = ((WIDTH - RIGHT + 16) * SCALE, (TOP + 22 * index) * SCALE)
        draw.text(place, name, fill=ink, font=font)
    return image.resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)


def _axes(draw: Any, font: Any, title: str, unit: str, high: float, seconds: float) -> None:
    left, right = _across(np.array([0.0, 1.0]))
    draw.text((left, 12 * SCALE), title, fill="#222222", font=font)
    for value in np.arange(0, high * 1.001, high / 5):
        y = float(_down(np.array([value / high]))[0])
        draw.line([left, y, right, y], fill="#d4d4d4", width=SCALE)
        draw.text((left - 8, y), f"{value:.3g} {unit}", fill="#555555", font=font, anchor="rm")
    step = round_step(seconds, 10)
    for second in np.arange(0, seconds + 1e-9, step):
        x = float(_across(np.array([second / seconds]))[0])
        place = (x, (HEIGHT - BOTTOM + 10) * SCALE)
        draw.text(place, f"{second:g} s", fill="#555555", font=font, anchor="ma")


def round_step(span: float, count: int) -> float:
    """A round number of which about `count` cover the span."""
    raw = span / count
    power = 10.0 ** np.floor(np.log10(raw))
    return float(power * min(n for n in MARKS if n * power >= raw * (1 - 1e-9)))


def _across(share: NDArray[np.floating]) -> NDArray[np.floating]:
    return (LEFT + (WIDTH - LEFT - RIGHT) * share) * SCALE


def _down(share: NDArray[np.floating]) -> NDArray[np.floating]:
    return (TOP + (HEIGHT - TOP - BOTTOM) * (1 - share)) * SCALE


def _points(x: NDArray[np.floating], y: NDArray[np.floating]) -> list[tuple[float, float]]:
    return [(float(a), float(b)) for a, b in zip(x, y, strict=True)]
