"""Bake the looks of the built-in head from MakeHuman's CC0 assets.

    python -m recipes.build_looks [--data ../shared/data] [--only skins]

Writes src/elocute/head/looks/assets: pictures (WebP, JPEG) and what is worn (.npz). Takes two
minutes on one core. Run it after `recipes.build_head`, whose neutral face things are fitted to.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from elocute.files.array_writing import write_npz
from elocute.head.builtin import load_builtin_head
from recipes.head.face import NeutralFace
from recipes.head.makehuman import MakeHuman
from recipes.looks import folds, irises, skins, tongues, wear
from recipes.looks.canvas import Canvas, save

ROOT = Path(__file__).parents[1]
ASSETS = ROOT / "src" / "elocute" / "head" / "looks" / "assets"
PARTS = ("skins", "maps", "eyes", "wear")
SKIN_QUALITY, NORMAL_QUALITY, EYE_QUALITY, FOLD_QUALITY = 93, 82, 88, 88


def bake_skins(canvas: Canvas, looks: Path) -> None:
    masks = skins.Masks(canvas, skins.SIZE)
    for name in skins.SKINS:
        picture = skins.skin(looks / "skins", name, masks, skins.SIZE)
        size = save(ASSETS / "skins" / f"{name}.webp", picture, SKIN_QUALITY)
        print(f"{name}: {size / 1e3:.0f} kB")


def bake_maps(canvas: Canvas, looks: Path) -> None:
    fine = skins.Masks(canvas, skins.NORMAL_SIZE)
    for name, (source, depth) in skins.NORMALS.items():
        picture = skins.normals(looks / "skins", source, fine, skins.NORMAL_SIZE, depth)
        size = save(ASSETS / "skins" / f"normal_{name}.webp", picture, NORMAL_QUALITY)
        print(f"normal {name}: {size / 1e3:.0f} kB")
    coarse = skins.Masks(canvas, skins.MAP_SIZE)
    save(ASSETS / "skins" / "roughness.jpg", skins.roughness(coarse, skins.MAP_SIZE), 85)
    for name, values in skins.marks(canvas, skins.Masks(canvas, skins.SIZE)).items():
        size = save(ASSETS / "skins" / f"{name}.webp", values, 60)
        print(f"{name}: {size / 1e3:.0f} kB")
    size = save(ASSETS / "skins" / "folds.jpg", folds.picture(canvas), FOLD_QUALITY)
    write_npz(ASSETS / "skins" / "folds.npz", folds.zone_arrays(canvas), compressed=True)
    print(f"folds: {size / 1e3:.0f} kB")
    save(ASSETS / "skins" / "tongue.webp", tongues.relief(canvas.head), NORMAL_QUALITY)


def bake_eyes() -> None:
    for name in irises.IRISES:
        save(ASSETS / "eyes" / f"{name}.jpg", irises.eye(name), EYE_QUALITY)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--only", choices=PARTS, action="append")
    choice = parser.parse_args()
    parts, looks = choice.only or PARTS, choice.data / "makehuman_looks"
    canvas = Canvas(load_builtin_head())
    np.seterr(all="raise", under="ignore")
    if "skins" in parts:
        bake_skins(canvas, looks)
    if "maps" in parts:
        bake_maps(canvas, looks)
    if "eyes" in parts:
        bake_eyes()
    if "wear" in parts:
        wear.bake(NeutralFace(MakeHuman(choice.data / "makehuman")), canvas, ASSETS)
    sizes = [path.stat().st_size for path in ASSETS.rglob("*.*")]
    print(f"{ASSETS}: {len(sizes)} files, {sum(sizes) / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
