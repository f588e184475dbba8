"""Plots two recordings and their alignment: spectrograms beside matrices with the path on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.audio.spectral import log_mel
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.files.atomic import write_atomically
from elocute.plots.curves import SCALE, round_step

SIDE, STRIP, GAP, MARGIN, TOP = 720, 170, 12, 64, 56
BETWEEN = 48  # matrices
PATH_INK, GRID_INK, TEXT_INK = "#e4572e", "#c8c8c8", "#333333"
DEPTH = 9.0  # of spectrograms, in natural logarithms below the loudest
DARK, LIGHT = np.array([16, 38, 77.0]), np.array([250, 251, 253.0])


def plot_alignment(
    sounds: Sequence[Waveform],
    matrices: Mapping[str, NDArray[np.floating]],
    path: NDArray[np.intp],
    output: str | Path,
    title: str = "",
) -> None:
    """Draw a warping path over matrices, with both spectrograms beside them, as .png.

    sounds: source and target. matrices: (source frame, target frame) by the names above them, side
    by side: attention, or costs with their sign turned; more is darker. path: (step, 2) frames of
    source and target, drawn over each matrix. Raises OutputError for a place that cannot be
    written.
    """
    from PIL import Image, ImageDraw, ImageFont

    lefts = [MARGIN + STRIP + GAP + place * (SIDE + BETWEEN) for place in range(len(matrices))]
    width, height = lefts[-1] + SIDE + 24, TOP + SIDE + GAP + STRIP + MARGIN
    image = Image.new("RGB", (width * SCALE, height * SCALE), "white")
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(14 * SCALE)
    tall, wide = (_shaded(_spectrum(sound)) for sound in sounds)
    # Time of the source runs upwards, low frequencies lie to the right of its strip and below.
    _paste(image, tall[::-1, ::-1], (MARGIN, TOP, MARGIN + STRIP, TOP + SIDE))
    _source_axis(draw, font, sounds[0].duration_s)
    for left, (name, matrix) in zip(lefts, matrices.items(), strict=True):
        _paste(image, _shaded(_spread(matrix)[::-1]), (left, TOP, left + SIDE, TOP + SIDE))
        under = (left, TOP + SIDE + GAP, left + SIDE, TOP + SIDE + GAP + STRIP)
        _paste(image, wide.swapaxes(0, 1)[::-1], under)
        _draw_path(draw, path, matrix.shape, left)
        _target_axis(draw, font, sounds[1].duration_s, left)
        at = ((left + SIDE // 2) * SCALE, (TOP - 8) * SCALE)
        draw.text(at, name, fill=TEXT_INK, font=font, anchor="ms")
    draw.text((MARGIN * SCALE, 8 * SCALE), title, fill=TEXT_INK, font=font)
    with write_atomically(output) as draft:
        image.resize((width, height), Image.Resampling.LANCZOS).save(draft)


def _draw_path(draw: Any, path: NDArray[np.intp], shape: tuple[int, ...], left: int) -> None:
    places = (path + 0.5) / np.array(shape)
    line = [((left + x * SIDE) * SCALE, (TOP + (1 - y) * SIDE) * SCALE) for y, x in places.tolist()]
    if len(line) > 1:
        draw.line(line, fill=PATH_INK, width=3 * SCALE, joint="curve")
    else:
        x, y = line[0]
        draw.ellipse([x - 8, y - 8, x + 8, y + 8], fill=PATH_INK)


def _source_axis(draw: Any, font: Any, seconds: float) -> None:
    bottom = TOP + SIDE
    for second in _marks(seconds):
        y = (bottom - SIDE * second / seconds) * SCALE
        draw.text(((MARGIN - 8) * SCALE, y), f"{second:g}", fill=TEXT_INK, font=font, anchor="rm")
        draw.line([MARGIN * SCALE, y, (MARGIN + 6) * SCALE, y], fill=GRID_INK, width=SCALE)
    at = ((MARGIN + STRIP // 2) * SCALE, (bottom + 14) * SCALE)
    draw.text(at, "source, s", fill=TEXT_INK, font=font, anchor="ma")


def _target_axis(draw: Any, font: Any, seconds: float, left: int) -> None:
    under = TOP + SIDE + GAP + STRIP
    for second in _marks(seconds):
        x = (left + SIDE * second / seconds) * SCALE
        draw.text((x, (under + 6) * SCALE), f"{second:g}", fill=TEXT_INK, font=font, anchor="ma")
    at = ((left + SIDE // 2) * SCALE, (under + 30) * SCALE)
    draw.text(at, "target, s", fill=TEXT_INK, font=font, anchor="ma")


def _marks(seconds: float) -> list[float]:
    """About six marks on round numbers."""
    step = round_step(max(seconds, 1e-3), 6)
    return np.round(np.arange(0, seconds + 1e-9, step), 6).tolist()


def _spectrum(sound: Waveform) -> NDArray[np.float64]:
    """(frame, band), 0 to 1."""
    values = log_mel(sound.resample(SPEECH_RATE).samples, SPEECH_RATE, bands=80, fft=1024)
    return np.clip((values - values.max()) / DEPTH + 1, 0, 1)


def _spread(matrix: NDArray[np.floating]) -> NDArray[np.floating]:
    """0 to 1, brightened so that faint attention is seen."""
    low, high = float(matrix.min()), float(np.quantile(matrix, 0.998))
    return np.clip((matrix - low) / max(high - low, 1e-12), 0, 1) ** 0.6


def _shaded(values: NDArray[np.floating]) -> NDArray[np.uint8]:
    return (LIGHT + values[..., None] * (DARK - LIGHT)).astype(np.uint8)


def _paste(image: Any, pixels: NDArray[np.uint8], box: tuple[int, int, int, int]) -> None:
    from PIL import Image

    size = ((box[2] - box[0]) * SCALE, (box[3] - box[1]) * SCALE)
    small = Image.fromarray(np.ascontiguousarray(pixels))
    how = Image.Resampling.NEAREST if small.width < 400 else Image.Resampling.BILINEAR
    image.paste(small.resize(size, how), (box[0] * SCALE, box[1] * SCALE))
