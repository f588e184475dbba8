"""Lip opening of real talkers beside that of two models, with the phones heard, as a picture.

    python -m benchmarks.talker_curves DATA/talkers/dev edtalk_pose2 romajaku_Ba_Ba -o curves.png
    python -m benchmarks.talker_curves DATA/grid_s1/clips bbaf2n --from 0 --seconds 3 -o curves.png
    python -m benchmarks.talker_curves DATA/talkers/dev edtalk_pose2 --frames 36 -o frames.png

Black is the tracked mouth, its offset taken out; grey the rules; red the other model. Below each
are the phones as the encoder hears them, and dots where it hears p, b or m. With `--frames`, so
many pictures in even steps stand below: the tracked lips, the head by the rules and by the other
model. With `--blind SEED` the curves are left out, and the models are called A and B in an order
drawn for each clip, which is printed: for judges who are not told which is which.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from benchmarks.face_rows import (
    FACE,
    FACES_A_ROW,
    lip_faces,
    model_faces,
    phones_heard,
    read_tracked_lips,
    sheet_rows,
    shown_frames,
)
from elocute.animation import animate
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.phones_and_visemes import PHONES
from elocute.evaluation.tracked_mouths import (
    TrackedClip,
    TrackedMouth,
    find_tracked_mouths,
    read_tracked_mouth,
)
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import TRACKED_RESTING, measure_mouth

WIDTH, HEIGHT, FOOT, LEFT = FACES_A_ROW * FACE, 170, 30, 60
TOP_MM = 22.0
Place = Callable[[float, float], tuple[float, float]]
COLOURS = {"tracked": (0, 0, 0), "rules": (160, 160, 160), "model": (200, 30, 30)}


def panel(
    recorded: TrackedMouth, models: dict[str, str], first_s: float, seconds: float, fps: float
) -> tuple[Image.Image, dict[str, Motion]]:
    """One talker: three curves and the phones below; and the motions of the models."""
    image = Image.new("RGB", (WIDTH, HEIGHT + FOOT), "white")
    draw = ImageDraw.Draw(image)
    eyes_mm = 1000 * load_builtin_head().eye_distance_m
    times = recorded.times_s[recorded.valid] - recorded.offset_s
    opening = np.maximum(recorded.opening[recorded.valid] - TRACKED_RESTING, 0) * eyes_mm
    tracks = {"tracked": (times, opening)}
    motions = {}
    for name, chosen in models.items():
        motion = motions[name] = animate(recorded.sound, model=chosen, fps=fps, life=0).motion
        mm = measure_mouth(motion)["opening_mm"].astype(float)
        tracks[name] = (np.arange(len(mm)) / fps, mm)

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
    return image, motions


def face_rows(
    clip: TrackedClip,
    recorded: TrackedMouth,
    motions: dict[str, Motion],
    first_s: float,
    count: int,
) -> list[Image.Image]:
    """The tracked lips and the head by each model, frame after frame."""
    frames = [shown_frames(motion, first_s, count, 1) for motion in motions.values()]
    times = np.array(min(frames, key=len)) / next(iter(motions.values())).fps
    rows = [("person", lip_faces(read_tracked_lips(clip.path, recorded.offset_s), times))]
    for (name, motion), shown in zip(motions.items(), frames, strict=True):
        rows.append((name, model_faces(motion, shown)))
    return sheet_rows(rows, phones_heard(recorded.sound, times), times, WIDTH)


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
    parser.add_argument("--fps", type=float, default=60.0, choices=(30.0, 60.0))
    parser.add_argument("--blind", type=int, metavar="SEED", help="models without their names")
    parser.add_argument("-o", "--output", type=Path, required=True)
    given = parser.parse_args()
    panels = []
    for number, clip in enumerate(find_tracked_mouths(given.folder, given.names)):
        recorded = read_tracked_mouth(clip)
        seconds = given.seconds or float(recorded.times_s[-1])
        models = {"rules": "articulation", "model": given.model}
        curves, motions = panel(recorded, models, given.first_s, seconds, given.fps)
        if given.blind is not None:
            order = np.random.default_rng([given.blind, number]).permutation(2)
            hidden = [list(motions)[place] for place in order]
            print(f"{recorded.name}: A is {hidden[0]}, B is {hidden[1]}")
            motions = {label: motions[name] for label, name in zip("AB", hidden, strict=True)}
        else:
            panels.append(curves)
        if given.frames:
            panels += face_rows(clip, recorded, motions, given.first_s, given.frames)
    stacked(panels).save(given.output, optimize=True)


if __name__ == "__main__":
    main()
