"""Lip opening of real talkers beside that of two models, with the phones heard, as a picture.

    python -m benchmarks.talker_curves DATA/talkers/dev edtalk_pose2 romajaku_Ba_Ba -o curves.png
    python -m benchmarks.talker_curves DATA/grid_s1/clips bbaf2n --from 0 --seconds 3 -o curves.png
    python -m benchmarks.talker_curves DATA/talkers/dev edtalk_pose2 --frames 36 -o frames.png

Black is the tracked mouth, its offset taken out; grey the rules; red the other model. Below each
are the phones as the encoder hears them, and dots where it hears p, b or m. With `--frames`, so
many pictures of the face in even steps stand below: in each pair of rows first the rules, then the
other model. A step is a whole number of frames at 60 a second.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from elocute.animation import animate
from elocute.audio.phones_and_visemes import PHONES
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.evaluation.tracked_mouths import TrackedMouth, find_tracked_mouths, read_tracked_mouth
from elocute.export.render import open_renderer, portrait
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import TRACKED_RESTING, measure_mouth

WIDTH, HEIGHT, FOOT, LEFT = 1400, 170, 30, 60
TOP_MM = 22.0
FPS = 60.0
FACES_A_ROW = 18
Place = Callable[[float, float], tuple[float, float]]
COLOURS = {"tracked": (0, 0, 0), "rules": (160, 160, 160), "model": (200, 30, 30)}


def panel(
    recorded: TrackedMouth, model: str, first_s: float, seconds: float, frames: int = 0
) -> Image.Image:
    """One talker: three curves, the phones below, and below them `frames` pictures a model."""
    image = Image.new("RGB", (WIDTH, HEIGHT + FOOT), "white")
    draw = ImageDraw.Draw(image)
    eyes_mm = 1000 * load_builtin_head().eye_distance_m
    times = recorded.times_s[recorded.valid] - recorded.offset_s
    opening = np.maximum(recorded.opening[recorded.valid] - TRACKED_RESTING, 0) * eyes_mm
    tracks = {"tracked": (times, opening)}
    motions = {}
    for name, chosen in (("rules", "articulation"), ("model", model)):
        motion = motions[name] = animate(recorded.sound, model=chosen, fps=FPS, life=0).motion
        mm = measure_mouth(motion)["opening_mm"].astype(float)
        tracks[name] = (np.arange(len(mm)) / FPS, mm)

    def place(time_s: float, mm: float) -> tuple[float, float]:
        x = LEFT + (time_s - first_s) / seconds * (WIDTH - LEFT)
        return x, HEIGHT - mm / TOP_MM * HEIGHT

    for mm in (0, 10, 20):
        draw.line([place(first_s, mm), place(first_s + seconds, mm)], fill=(225, 225, 225))
        draw.text((30, place(0, mm)[1] - 12), f"{mm}", fill=(90, 90, 90))
    for name in ("rules", "tracked", "model"):
        when, mm = tracks[name]
        inside = (when >= first_s) & (when <= first_s + seconds)
        points = [place(t, v) for t, v in zip(when[inside], mm[inside], strict=True)]
        draw.line(points, fill=COLOURS[name], width=2)
    _phones(draw, recorded.sound, first_s, seconds, place)
    draw.text((LEFT + 4, 2), f"{recorded.name} ({recorded.language or 'en'}), mm", fill=(0, 0, 0))
    if not frames:
        return image
    return stacked([image, *face_rows(list(motions.values()), first_s, seconds, frames)])


def face_rows(
    motions: list[Motion], first_s: float, seconds: float, frames: int
) -> list[Image.Image]:
    """Pictures of the lower face: a row of each motion, then the next times."""
    step = max(1, round(seconds * FPS / frames))
    shown = [round(first_s * FPS) + step * k for k in range(frames)]
    shown = [frame for frame in shown if frame < min(m.frame_count for m in motions)]
    side = WIDTH // FACES_A_ROW
    head = motions[0].head
    with open_renderer(head, (2 * side, 2 * side), camera=portrait(head, "mouth")) as renderer:
        drawn = [
            [renderer.frame(motion.vertices(frame, frame + 1)[0]) for frame in shown]
            for motion in motions
        ]
    rows = []
    for start in range(0, len(shown), FACES_A_ROW):
        for name, pictures in zip(("rules", "model"), drawn, strict=True):
            row = Image.new("RGB", (WIDTH, side), "white")
            for k, picture in enumerate(pictures[start : start + FACES_A_ROW]):
                row.paste(Image.fromarray(picture).resize((side, side)), (k * side, 0))
            ImageDraw.Draw(row).rectangle([0, 0, 3, side], fill=COLOURS[name])
            times = [shown[start] / FPS, shown[min(start + FACES_A_ROW, len(shown)) - 1] / FPS]
            ImageDraw.Draw(row).text((8, 2), f"{times[0]:.2f} to {times[1]:.2f} s", fill="white")
            rows.append(row)
    return rows


def stacked(images: list[Image.Image]) -> Image.Image:
    """Pictures of one width, one below the other."""
    sheet = Image.new("RGB", (WIDTH, sum(image.height for image in images)), "white")
    top = 0
    for image in images:
        sheet.paste(image, (0, top))
        top += image.height
    return sheet


def _phones(
    draw: ImageDraw.ImageDraw, sound: Path, first_s: float, seconds: float, place: Place
) -> None:
    samples = read_audio(sound, sample_rate=SPEECH_RATE).samples
    heard = builtin_encoder().encode(samples).argmax(axis=1)
    edges = [0, *(np.flatnonzero(np.diff(heard)) + 1).tolist(), len(heard)]
    for start, stop in pairwise(edges):
        middle_s, phone = (start + stop) / 100, PHONES[heard[start]]
        if phone == "SIL" or stop - start < 2 or not first_s <= middle_s < first_s + seconds:
            continue
        x, _ = place(middle_s, 0)
        draw.text((x - 6, HEIGHT + 6), phone, fill=(60, 60, 60))
        if phone in ("P", "B", "M"):
            draw.ellipse([x - 3, HEIGHT - 4, x + 3, HEIGHT + 2], fill=(20, 80, 200))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--model", default="talkers")
    parser.add_argument("--from", dest="first_s", type=float, default=0.0)
    parser.add_argument("--seconds", type=float, default=0.0, help="of each; all of it by default")
    parser.add_argument("--frames", type=int, default=0, help="pictures of the face, each model")
    parser.add_argument("-o", "--output", type=Path, required=True)
    given = parser.parse_args()
    panels = []
    for clip in find_tracked_mouths(given.folder, given.names):
        recorded = read_tracked_mouth(clip)
        seconds = given.seconds or float(recorded.times_s[-1])
        panels.append(panel(recorded, given.model, given.first_s, seconds, given.frames))
    stacked(panels).save(given.output, optimize=True)


if __name__ == "__main__":
    main()
