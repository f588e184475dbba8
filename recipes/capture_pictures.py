"""The pictures of docs/capture: a scan beside the head registered to it, and shapes of a corpus.

    python -m recipes.build_corpus build/small --limit 2
    python -m recipes.capture_pictures build/small [--out docs/images]

The scan is simulated: a face of flesh that speaks, with the scanner's noise, holes and bumps, and
landmarks that are 0.7 mm off.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from elocute.audio.read import read_audio
from elocute.capture.blendshapes.blendshape_learning import (
    extreme_shapes,
    learn_blendshapes,
    sweep_shapes,
)
from elocute.capture.blendshapes.settings import BlendshapeConfig
from elocute.capture.settings import Scanner
from elocute.capture.simulation.scan_simulator import ScanSimulator
from elocute.corpus.corpus_store import open_corpus
from elocute.export.pictures import contact_sheet
from elocute.head.builtin import load_builtin_head
from elocute.head.looks import dress, face_look
from elocute.head.mesh import head_from_arrays
from elocute.registration.register import register_neutral
from elocute.registration.scan import Scan
from elocute.render import open_renderer, portrait
from recipes.head.sheets import EXAMPLE, QUALITY, still
from recipes.rich_faces.rich_face import take_from_sound

WHO, FPS, SECONDS, FRAME = "ada", 10.0, 3.0, 27
SCAN_SIDE, SHAPE_SIDE, SHAPES = 420, 160, 4
GREY = (176, 172, 168)


def scan_picture(path: Path) -> None:
    """The scan in its colours and without them, and the registered head."""
    take = take_from_sound(read_audio(EXAMPLE), fps=FPS, seconds=SECONDS, identity=WHO)
    seen = ScanSimulator(take, Scanner()).frame(FRAME)
    scan = Scan("scan", seen.points, seen.triangles, seen.colors)
    own, found = register_neutral(load_builtin_head(), scan, seen.landmarks)
    print(f"surface {found.surface.median:.2f} mm median, landmarks {found.landmark_mm:.2f} mm")
    face = replace(own.head, template=found.vertices.astype(np.float32))
    look = face_look(found.parameters.identity.astype(np.float32))
    shown = dress(face, replace(look, hair="none", clothes="none"))
    view = portrait(face, "three-quarter")
    bare = head_from_arrays("scan", seen.points, seen.triangles)
    heads = [replace(bare, vertex_color=seen.colors)]
    heads.append(replace(bare, vertex_color=np.full_like(seen.colors, GREY)))
    pictures = [still(head, (SCAN_SIDE, SCAN_SIDE), view) for head in (*heads, shown)]
    _save(Image.fromarray(np.hstack([np.asarray(picture) for picture in pictures])), path)


def shapes_picture(corpus: Path, path: Path) -> None:
    """The first speech blendshapes at plus and minus two deviations."""
    opened = open_corpus(corpus)
    names = [entry.name for entry in opened.entries]
    learned = learn_blendshapes(opened, names, BlendshapeConfig(components=SHAPES))
    motion = sweep_shapes(learned.head).dressed()
    size, view = (SHAPE_SIDE, SHAPE_SIDE), portrait(learned.head, "mouth")
    with open_renderer(motion.head, size, camera=view) as renderer:
        shapes = extreme_shapes(motion)
        pictures = [renderer.frame(single.vertices()[0]).copy() for _, single in shapes]
    _save(contact_sheet(pictures, [label for label, _ in shapes], len(shapes)), path)


def _save(picture: Image.Image, path: Path) -> None:
    picture.convert("RGB").save(path, quality=QUALITY, optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "docs" / "images")
    given = parser.parse_args()
    scan_picture(given.out / "capture.jpg")
    shapes_picture(given.corpus, given.out / "speech_shapes.jpg")


if __name__ == "__main__":
    main()
