"""Contact sheets of the built-in head, drawn by Elocute's own renderer.

python -m recipes.head.sheets [--out docs/images]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from elocute.animation import animate, identity_head
from elocute.export.options import PictureOptions
from elocute.export.pictures import open_pictures
from elocute.head import HeadModel
from elocute.head.identity import identity_names
from elocute.head.looks import PEOPLE, dress, identity_look
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.life import MOODS
from elocute.render import Camera, open_renderer
from elocute.render.lights import RIGS

QUALITY = 82
EXAMPLE = Path(__file__).parents[2] / "src/elocute/assets/example.flac"
FIELD_DEG = 18.0


def camera(head: HeadModel, height_m: float, yaw_deg: float, on_mouth: bool = False) -> Camera:
    """Looks at the face, or at the mouth, so that `height_m` fills the picture."""
    mouth = head.template[head.landmarks[48:68]].mean(0)
    eyes = head.template[head.landmarks[36:48]].mean(0)
    y = mouth[1] - 0.004 if on_mouth else eyes[1] - (0.042 if height_m > 0.25 else 0.030)
    yaw = np.radians(yaw_deg)
    depth = mouth[2] - 0.04 + 0.025 * np.sin(yaw) if on_mouth else 0.01
    target = np.array([0, y, depth])
    away = np.array([np.sin(yaw), 0.02, np.cos(yaw)])
    distance = height_m / 2 / np.tan(np.radians(FIELD_DEG) / 2)
    return Camera((target + away * distance).astype("f4"), target.astype("f4"), FIELD_DEG)


def worn(who: str) -> HeadModel:
    """A person in the look that `animate` would give them."""
    look = identity_look("auto", who)
    assert look is not None
    return dress(identity_head(who), look)


def drawn(
    head: HeadModel, faces: list[np.ndarray], size: tuple[int, int], view: Camera
) -> Iterator[Image.Image]:
    """One picture per face, twice as fine and scaled down."""
    with open_renderer(head, (size[0] * 2, size[1] * 2), camera=view) as renderer:
        for vertices in faces:
            picture = Image.fromarray(renderer.frame(vertices.astype(np.float32)))
            yield picture.resize(size, Image.Resampling.LANCZOS)


def still(head: HeadModel, size: tuple[int, int], view: Camera) -> Image.Image:
    """One head at rest."""
    return next(drawn(head, [head.template], size, view))


def sheet(rows: list[list[Image.Image]], labels: list[str], columns: int, path: Path) -> None:
    """`rows[view][item]`: the views of one item side by side, items in a grid."""
    width, height = rows[0][0].size
    views, items = len(rows), len(rows[0])
    down = -(-items // columns)
    whole = Image.new("RGB", (columns * views * width, down * height), (60, 64, 70))
    for item in range(items):
        x, y = item % columns * views * width, item // columns * height
        for view in range(views):
            whole.paste(rows[view][item], (x + view * width, y))
        ImageDraw.Draw(whole).text((x + 6, y + 4), labels[item], fill=(255, 255, 255))
    path.parent.mkdir(parents=True, exist_ok=True)
    whole.save(path, quality=QUALITY, optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


OPEN_JAW = {"mouthClose": 1.0, "tongueTipUp": 0.4, "tongueDental": 0.3}
"""How far the jaw is open for shapes that are made for that, or are not seen else."""


def shapes_sheet(head: HeadModel, path: Path) -> None:
    faces, labels = [], []
    for name, delta in zip(head.expression_names, head.expression_basis, strict=True):
        if name.endswith("Right"):
            continue
        partner = name[:-4] + "Right"
        both = name.endswith("Left") and partner in head.expression_names
        moved = head.template + delta
        open_ = OPEN_JAW.get(name, 0.0)
        moved = moved + open_ * head.expression_basis[head.expression_index("jawOpen")]
        sideways = name.startswith(("jaw", "mouthLeft", "eyeLook"))
        if both and not sideways:
            moved = moved + head.expression_basis[head.expression_index(partner)]
        faces.append(moved)
        label = name.removesuffix("Left") if both and not sideways else name
        labels.append(f"{label} + jawOpen" if open_ else label)
    rows = [list(drawn(head, faces, (150, 190), camera(head, 0.23, yaw))) for yaw in (0.0, 40.0)]
    sheet(rows, labels, 5, path)


def visemes_sheet(head: HeadModel, path: Path) -> None:
    faces = [
        head.template + np.tensordot(head.expression_vector(weights), head.expression_basis, 1)
        for weights in VISEME_SHAPES.values()
    ]
    views = [(0.23, 0.0, False), (0.11, 0.0, True), (0.11, 40.0, True), (0.11, 85.0, True)]
    rows = [
        list(drawn(head, faces, (150, 170), camera(head, height, yaw, on_mouth)))
        for height, yaw, on_mouth in views
    ]
    sheet(rows, list(VISEME_SHAPES), 2, path)


def identities_sheet(path: Path) -> None:
    labels = [*identity_names(), *(f"seed {seed}" for seed in range(1, 8))]
    people = [worn(label.split()[-1]) for label in labels]
    rows = []
    for yaw in (0.0, 35.0, 85.0):
        rows.append([still(one, (150, 180), camera(one, 0.36, yaw)) for one in people])
    sheet(rows, labels, 4, path)


def lights_sheet(path: Path) -> None:
    """Two people in each of the lights, before the ground that belongs to it."""
    rows: list[list[Image.Image]] = []
    for who in ("ada", "esi"):
        one = worn(who)
        row = []
        for light in RIGS:
            with open_pictures(one, (400, 400), PictureOptions(light=light)) as renderer:
                picture = Image.fromarray(renderer.frame(one.template.astype(np.float32)))
                row.append(picture.resize((200, 200), Image.Resampling.LANCZOS))
        rows.append(row)
    sheet(rows, list(RIGS), 3, path)


MOOD_MOMENTS_S = (0.5, 2.5, 5.0, 6.3)


def moods_sheet(path: Path) -> None:
    """Each mood at moments of the shipped example: at rest, in open and in closed mouths."""
    rows: list[list[Image.Image]] = [[] for _ in MOOD_MOMENTS_S]
    for mood in MOODS:
        motion = animate(EXAMPLE, fps=30, mood=mood).motion.dressed()
        frames = [round(moment * motion.fps) for moment in MOOD_MOMENTS_S]
        faces = [motion.vertices(frame, frame + 1)[0] for frame in frames]
        for row, picture in zip(
            rows, drawn(motion.head, faces, (150, 180), camera(motion.head, 0.27, 0.0)), strict=True
        ):
            row.append(picture)
    sheet(rows, list(MOODS), 2, path)


SIDES = ("Left", "Right")


def people_sheet(path: Path) -> None:
    people = {who: worn(who) for who in PEOPLE if who != "mean"}
    rows = [
        [
            next(drawn(one, [one.template], (230, 280), camera(one, 0.36, yaw)))
            for one in people.values()
        ]
        for yaw in (0.0, 38.0)
    ]
    sheet(rows, list(people), 4, path)


# Somebody talking, for pages that play no sound: who in which mood, which part of the example.
TALKERS = {"esi": "happy:0.7", "hana": "neutral", "otto": "angry:0.6"}
TALK_S, TALK_FPS, TALK_SIZE, TALK_QUALITY = (0.3, 4.3), 20, (250, 310), 60


def talking_pictures(path: Path) -> None:
    """An animated WebP: people side by side who say the same in different moods."""
    first, stop = (round(moment * TALK_FPS) for moment in TALK_S)
    strips = [
        Image.new("RGB", (len(TALKERS) * TALK_SIZE[0], TALK_SIZE[1])) for _ in range(first, stop)
    ]
    for place, (who, mood) in enumerate(TALKERS.items()):
        motion = animate(EXAMPLE, fps=TALK_FPS, identity=who, mood=mood).motion.dressed()
        view = camera(motion.head, 0.29, 0.0)
        faces = drawn(motion.head, list(motion.vertices(first, stop)), TALK_SIZE, view)
        for strip, face in zip(strips, faces, strict=True):
            strip.paste(face, (place * TALK_SIZE[0], 0))
    path.parent.mkdir(parents=True, exist_ok=True)
    shown_ms = round(1000 / TALK_FPS)
    strips[0].save(
        path,
        save_all=True,
        append_images=strips[1:],
        duration=shown_ms,
        loop=0,
        quality=TALK_QUALITY,
        method=6,
    )
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[2] / "docs" / "images")
    folder = parser.parse_args().out
    head = worn("mean")
    people_sheet(folder / "people.jpg")
    shapes_sheet(head, folder / "head_shapes.jpg")
    visemes_sheet(head, folder / "visemes.jpg")
    identities_sheet(folder / "head_identities.jpg")
    moods_sheet(folder / "moods.jpg")
    lights_sheet(folder / "lights.jpg")
    talking_pictures(folder / "talking.webp")


if __name__ == "__main__":
    main()
