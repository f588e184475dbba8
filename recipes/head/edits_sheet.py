"""The example's take without and with the edits of examples/take.json: curves, and faces.

python -m recipes.head.edits_sheet [--out docs/images/edits.jpg]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from elocute.animation import animate
from elocute.motion import Motion, measure_mouth
from elocute.numerics.quaternions import to_axis_angle
from recipes.head.sheets import EXAMPLE, camera, drawn

EDITS = Path(__file__).parents[2] / "examples/take.json"
MOMENTS_S = (0.6, 2.72, 3.68, 5.8, 7.3, 9.33)
FACE = (190, 220)
WIDTH, LEFT, TOP, HEIGHT = 1140, 6, 26, 60
BEFORE, AFTER, RULE, INK = (150, 154, 160), (200, 40, 40), (228, 230, 233), (40, 44, 50)
QUALITY = 80


def curves_of(motion: Motion) -> dict[str, tuple[np.ndarray, float, float]]:
    """What is plotted: values by frame, and what is at the foot and the top of the plot."""

    def shape(name: str) -> np.ndarray:
        return motion.weights[:, motion.names.index(name)]

    assert motion.rotations is not None
    turns = np.degrees(to_axis_angle(motion.rotations))
    return {
        "opening of the lips, mm": (measure_mouth(motion)["opening_mm"], 0.0, 24.0),
        "mouthSmileLeft": (shape("mouthSmileLeft"), 0.0, 0.8),
        "browInnerUp": (shape("browInnerUp"), 0.0, 0.8),
        "eyeBlinkLeft": (shape("eyeBlinkLeft"), 0.0, 1.0),
        "head to its left, degrees": (turns[:, 0, 1] + turns[:, 1, 1], -10.0, 34.0),
    }


def plots(before: Motion, after: Motion) -> Image.Image:
    """Curves over time, one plot below the other."""
    both = [curves_of(motion) for motion in (before, after)]
    picture = Image.new("RGB", (WIDTH, len(both[0]) * (TOP + HEIGHT) + 20), "white")
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(13)

    def across(time_s: float) -> float:
        return LEFT + time_s / before.duration_s * (WIDTH - 2 * LEFT)

    for row, name in enumerate(both[0]):
        foot = (row + 1) * (TOP + HEIGHT)
        for moment in MOMENTS_S:
            draw.line([(across(moment), foot - HEIGHT), (across(moment), foot)], fill=RULE, width=2)
        draw.line([(LEFT, foot), (WIDTH - LEFT, foot)], fill=RULE)
        for curves, motion, colour in zip(both, (before, after), (BEFORE, AFTER), strict=True):
            values, low, high = curves[name]
            up = foot - np.clip((values - low) / (high - low), 0, 1) * HEIGHT
            places = [(across(t), y) for t, y in zip(motion.times_s, up, strict=True)]
            draw.line(places, fill=colour, width=2, joint="curve")
        draw.text((LEFT, foot - HEIGHT - TOP + 3), name, fill=INK, font=font)
    for second in range(int(before.duration_s) + 1):
        draw.text((across(second), picture.height - 18), f"{second} s", fill=INK, font=font)
    return picture


def faces(motion: Motion) -> Image.Image:
    """The face at the moments."""
    shown = motion.dressed()
    frames = [round(moment * motion.fps) for moment in MOMENTS_S]
    vertices = [shown.vertices(frame, frame + 1)[0] for frame in frames]
    strip = Image.new("RGB", (WIDTH, FACE[1]))
    view = camera(shown.head, 0.29, 0.0)
    for place, face in enumerate(drawn(shown.head, vertices, FACE, view)):
        strip.paste(face, (place * FACE[0], 0))
    return strip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--out", type=Path, default=Path(__file__).parents[2] / "docs/images/edits.jpg"
    )
    path = parser.parse_args().out
    before = animate(EXAMPLE, identity="hana").motion
    after = animate(EXAMPLE, identity="hana", edits=EDITS).motion
    font = ImageFont.load_default(15)
    parts = [plots(before, after), faces(before), faces(after)]
    for part, told in zip(parts[1:], ("as it was made", "edited"), strict=True):
        draw = ImageDraw.Draw(part)
        for place, moment in enumerate(MOMENTS_S):
            label = f"{moment:g} s" + (f", {told}" if place == 0 else "")
            draw.text((place * FACE[0] + 6, 4), label, fill="white", font=font)
    whole = Image.new("RGB", (WIDTH, sum(part.height for part in parts)), "white")
    top = 0
    for part in parts:
        whole.paste(part, (0, top))
        top += part.height
    whole.save(path, quality=QUALITY, optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
