"""Plots curves over time with Pillow: no plotting library for one picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from elocute.files.atomic import write_atomically
from elocute.motion.curves import Curves
from elocute.plots.overlay import INKS, SCALE, WIDTH

PANEL, MARGIN, GAP = 170, 90, 26
"""Height of a panel, and what lies beside and between panels, in pixels."""


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
    for second in np.arange(0, seconds + 1e-9, _step(seconds)):
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


def _step(seconds: float) -> float:
    """About ten marks, on round numbers."""
    raw = max(seconds, 1e-3) / 10
    power = 10.0 ** np.floor(np.log10(raw))
    return float(power * min(n for n in (1, 2, 5, 10) if n * power >= raw))
