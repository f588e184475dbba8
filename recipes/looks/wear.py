"""Hair, brows, lashes: fitted cards with their pictures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from elocute.files.array_writing import write_npz
from recipes.head.face import NeutralFace
from recipes.looks import brows, clothes, locks
from recipes.looks.canvas import Canvas, save
from recipes.looks.cards import Cards, Fitting
from recipes.looks.finer import finer
from recipes.looks.roots import covered, roots
from recipes.looks.strands import long_strands, strands

HAIR = ("short01", "short02", "short04", "long01", "ponytail01", "afro01")
"""Styles that leave both eyes free."""
FALLING = ("long01",)
"""Of these, whose hair falls straight down its picture."""
TIED = {"ponytail01": "bun"}
"""Of these, whose tail is wound to a knot as well, and that style's file."""
HAIR_PX, LASH_PX = 1024, 512
LASHES = ("eyelashes01",)
ROOT_M, ROOT_SHADE = 0.012, 0.45
"""Hair nearer to the skin than this lies in its own shadow."""
NEIGHBOURS = 10
UPPER_LASH, LOWER_LASH = 0.9, 0.42
"""Length of lashes by that of MakeHuman's, which look painted."""


def bake(face: NeutralFace, canvas: Canvas, looks: Path, assets: Path) -> None:
    fitting = Fitting(face)
    for name in HAIR:
        bake_hair(fitting, canvas, looks / "hair" / name, assets)
    for name, curl in locks.CURLS.items():
        bake_curls(fitting, canvas, assets / "hair" / name, curl)
    bake_buzz(fitting, canvas, assets / "hair" / "buzz")
    bake_brows(fitting, assets)
    for name in LASHES:
        bake_lashes(fitting, looks / "eyelashes", name, assets)
    bake_clothes(fitting, assets)


def bake_hair(fitting: Fitting, canvas: Canvas, folder: Path, assets: Path) -> None:
    """A style of MakeHuman's, made finer, with single hairs that leave it."""
    name, painted = folder.name, next(folder.glob("*.png"))
    cards = finer(fitting.cards(folder, name), fitting.skin)
    away, _ = fitting.tree.query(cards.points)
    cards = replace(cards, shade=ROOT_SHADE + (1 - ROOT_SHADE) * np.clip(away / ROOT_M, 0, 1))
    if name in FALLING:
        picture = long_strands(painted, HAIR_PX)
    else:
        picture = strands(painted, HAIR_PX, even=HAIR_PX / 14)
    shade = roots(canvas, covered(canvas, cards, picture[..., 3]))
    write_hair(assets / "hair" / name, fitting, cards, picture, shade)
    if name in TIED:
        write_hair(assets / "hair" / TIED[name], fitting, locks.bun(cards, fitting), picture, shade)


def bake_curls(fitting: Fitting, canvas: Canvas, path: Path, curl: locks.Curl) -> None:
    """Curls of our own, on MakeHuman's scalp."""
    cards = locks.curls(fitting, canvas.millimetres[: len(fitting.skin)], curl)
    shade = roots(canvas, locks.grows(canvas.millimetres))
    write_hair(path, fitting, cards, locks.curl_picture(), shade)


def bake_buzz(fitting: Fitting, canvas: Canvas, path: Path) -> None:
    """Hair cut close, where the curls grow."""
    cards = locks.buzz(fitting, canvas.millimetres[: len(fitting.skin)])
    shade = roots(canvas, locks.grows(canvas.millimetres))
    write_hair(path, fitting, cards, locks.buzz_picture(), shade)


def write_hair(
    path: Path, fitting: Fitting, cards: Cards, picture: np.ndarray, shade: np.ndarray
) -> None:
    write(path.with_suffix(".npz"), fitting, cards)
    size = save(path.with_suffix(".webp"), picture, 78)
    size += save(path.with_name(f"{path.name}_roots.webp"), shade, 60)
    print(f"{path.name}: {len(cards.points)} vertices, {size / 1e3:.0f} kB")


def bake_brows(fitting: Fitting, assets: Path) -> None:
    for name, brow in brows.STYLES.items():
        write(assets / "brows" / f"{name}.npz", fitting, brows.cards(fitting.face, brow))
        size = save(assets / "brows" / f"{name}.webp", brows.picture(brow), 80)
        print(f"brows {name}: {size / 1e3:.0f} kB")


def bake_clothes(fitting: Fitting, assets: Path) -> None:
    for name, cut in clothes.CUTS.items():
        shirt = clothes.shirt(fitting.face, cut)
        places = {"skull": shirt.skull, "covers": shirt.covers}
        path = assets / "clothes" / f"{name}.npz"
        write(path, fitting, shirt.cards, skull_m=shirt.skull_m, **places)
        colour, normal = clothes.pictures(shirt)
        sizes = [path.stat().st_size]
        sizes.append(save(path.with_suffix(".webp"), colour, 75))
        sizes.append(save(path.with_name(f"{name}_normal.webp"), normal, 80))
        print(f"{name}: {len(shirt.cards.points)} vertices, {sum(sizes) / 1e3:.0f} kB")


def bake_lashes(fitting: Fitting, folder: Path, name: str, assets: Path) -> None:
    """Each lash hangs on one vertex of its lid's edge and turns with the skin of that lid."""
    cards, anatomy = fitting.cards(folder, name), fitting.face.anatomy
    edge = np.array(anatomy.lid_front)
    roots = np.unique(np.r_[edge, anatomy.skin_mirror[edge]])
    skin = fitting.skin
    away = np.linalg.norm(cards.points[:, None] - skin[roots][None], axis=2)
    root = roots[away.argmin(1)]
    middle = skin[roots, 1].mean()
    shorter = np.where(skin[root, 1] > middle, UPPER_LASH, LOWER_LASH)[:, None]
    cards = Cards(
        np.repeat(root[:, None], 3, 1),
        np.tile([1.0, 0, 0], (len(root), 1)),
        (cards.points - skin[root]) * shorter,
        cards.quads,
        cards.uv,
        cards.uv_quads,
        cards.shade,
        cards.points,
    )
    around = np.stack([_same_lid(skin, vertex, middle) for vertex in root])
    write(assets / "lashes" / f"{name}.npz", fitting, cards, around=around)
    save(assets / "lashes" / f"{name}.webp", strands(folder / f"{name}.png", LASH_PX), 80)


def _same_lid(skin: np.ndarray, root: int, middle: float) -> np.ndarray:
    """(NEIGHBOURS,) skin round a root; the other lid, which moves against it, left out."""
    away = np.linalg.norm(skin - skin[root], axis=1)
    side = 1 if skin[root, 1] > middle else -1
    other = (skin[:, 1] - skin[root, 1]) * side < -0.0006
    behind = skin[:, 2] < skin[root, 2] - 0.004
    return np.argsort(away + 1.0 * (other | behind))[:NEIGHBOURS]


def write(path: Path, fitting: Fitting, cards: Cards, skull_m=None, **more: np.ndarray) -> None:
    """Places in `more` are whole numbers; a skull there takes the place of the head's own."""
    path.parent.mkdir(parents=True, exist_ok=True)
    pairs, between = fitting.skull()
    between = between if skull_m is None else skull_m
    arrays = {
        "index": cards.index.astype(np.uint16),
        "weights": cards.weights.astype(np.float32),
        "offset": cards.offset.astype(np.float32),
        "quads": cards.quads.astype(np.uint16),
        "uv": cards.uv.astype(np.float32),
        "uv_quads": cards.uv_quads.astype(np.uint16),
        "shade": np.round(255 * np.clip(cards.shade, 0, 1)).astype(np.uint8),
        "skull": pairs.astype(np.uint16),
        "skull_m": between.astype(np.float32),
    }
    arrays |= {name: values.astype(np.uint16) for name, values in more.items()}
    write_npz(path, arrays, compressed=True)
