"""The built-in head of the first version beside today's: people, shapes, visemes, talking.

    python -m recipes.head.then_and_now [--out docs/images]

Run it after `recipes.head.sheets`, in a clone with its history: the first version's sheets are read
out of it, and its code films the example, as today's does.
"""

from __future__ import annotations

import argparse
import io
import os
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

import av
import numpy as np
from PIL import Image, ImageDraw

from elocute.head.identity import identity_names
from elocute.head.viseme_shapes import VISEME_SHAPES
from recipes.head.sheets import EXAMPLE, QUALITY

ROOT = Path(__file__).parents[2]
FIRST = "5f66e4f"
"""The commit at which all sheets of the first version were drawn."""
SHOWN_SHAPES = {  # place in the sheet of shapes
    "eyeBlink": 0, "mouthPucker": 12, "mouthSmile": 14, "mouthFrown": 15, "mouthUpperUp": 24,
    "browDown": 25, "cheekPuff": 28, "noseSneer": 30,
}  # fmt: skip
SHOWN_VISEMES = ("PP", "FF", "TH", "CH", "SS", "aa", "E", "ou")
WHO, FROM_S, STEP_S, FRAME = "ada", 0.5, 0.45, 150
FILM = "import elocute, sys; elocute.animate({!r}, identity={!r}).write(sys.argv[1])"


def cell(sheet: Image.Image, item: int, view: int, grid: tuple[int, int], size) -> Image.Image:
    """One picture of a sheet of `grid` (items across, views of each)."""
    across, views = grid
    x, y = (item % across * views + view) * size[0], item // across * size[1]
    return sheet.crop((x, y, x + size[0], y + size[1]))


def strips(read) -> list[list[Image.Image]]:
    """People, shapes and visemes cut out of the sheets of one version."""
    people, shapes = read("head_identities.jpg"), read("head_shapes.jpg")
    visemes, names = read("visemes.jpg"), list(VISEME_SHAPES)
    named = range(1, len(identity_names()))
    return [
        [cell(people, item, 1, (4, 3), (150, 180)) for item in named],
        [cell(shapes, item, 0, (5, 2), (150, 190)) for item in SHOWN_SHAPES.values()],
        [cell(visemes, names.index(n), 1, (2, 4), (150, 170)) for n in SHOWN_VISEMES],
    ]


def frames(code: Path, folder: Path) -> list[Image.Image]:
    """Moments of a film of the example by the package in `code`."""
    film = folder / "talk.mp4"
    environment = os.environ | {"PYTHONPATH": str(code / "src")}
    run = [sys.executable, "-c", FILM.format(str(EXAMPLE), WHO), str(film)]
    subprocess.run(run, check=True, cwd=folder, env=environment)
    wanted = FROM_S + STEP_S * np.arange(len(SHOWN_VISEMES))
    found: list[Image.Image] = []
    with av.open(str(film)) as container:
        for frame in container.decode(video=0):
            if len(found) < len(wanted) and frame.time >= wanted[len(found)] - 1e-3:
                square = frame.to_image()
                found.append(square.resize((FRAME, FRAME), Image.Resampling.LANCZOS))
    return found


def of_first(place: str) -> bytes:
    git = ["git", "-C", str(ROOT), "show", f"{FIRST}:{place}"]
    return subprocess.run(git, check=True, capture_output=True).stdout


def first_strips(folder: Path) -> list[list[Image.Image]]:
    git = ["git", "-C", str(ROOT), "archive", FIRST]
    packed = subprocess.run(git, check=True, capture_output=True).stdout
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(folder / "first", filter="data")
    sheets = strips(lambda name: Image.open(io.BytesIO(of_first(f"docs/images/{name}"))))
    return [*sheets, frames(folder / "first", folder)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images")
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as folder:
        then = first_strips(Path(folder))
        now = [*strips(lambda name: Image.open(out / name)), frames(ROOT, Path(folder))]
    pairs = [row for both in zip(then, now, strict=True) for row in both]
    whole = Image.new("RGB", (FRAME * len(SHOWN_VISEMES), sum(row[0].height for row in pairs)))
    y = 0
    for number, row in enumerate(pairs):
        for place, picture in enumerate(row):
            whole.paste(picture, (place * FRAME, y))
        label = "now" if number % 2 else "then"
        low = y + row[0].height - 16
        ImageDraw.Draw(whole).text((6, low), label, fill=(255, 255, 255))
        y += row[0].height
    path = out / "then_and_now.jpg"
    whole.save(path, quality=QUALITY, optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
