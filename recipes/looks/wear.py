"""Hair, brows, lashes: fitted cards with their pictures."""

from __future__ import annotations

from functools import reduce
from pathlib import Path

import numpy as np

from elocute.files.array_writing import write_npz
from recipes.head.face import NeutralFace
from recipes.looks import brows, clothes, curls, fabric, groom, grooms, lashes, strand_lanes
from recipes.looks.beside_face import beside_face
from recipes.looks.canvas import Canvas, save
from recipes.looks.cards import Cards, Fitting
from recipes.looks.cuts import CUTS
from recipes.looks.draping import Drape
from recipes.looks.fewer_pairs import fewer_pairs
from recipes.looks.over_ears import over_ears, without_ears
from recipes.looks.ribbons import together
from recipes.looks.roots import roots
from recipes.looks.scalp import WIDE, Scalp
from recipes.looks.seen import without_hidden
from recipes.looks.surface import Skin
from recipes.looks.tied import knot, tail
from recipes.looks.underneath import dark_underneath
from recipes.looks.waving import waved

DEEP = (*grooms.FALLING, "ponytail", "bun")
"""Styles whose locks lie on many others."""


def bake(face: NeutralFace, canvas: Canvas, assets: Path) -> None:
    fitting = Fitting(face)
    bake_hair(fitting, canvas, assets / "hair")
    bake_brows(fitting, assets)
    bake_lashes(fitting, assets / "lashes")
    bake_clothes(fitting, assets)


def bake_hair(fitting: Fitting, canvas: Canvas, folder: Path) -> None:
    """All styles, three pictures for them, and the shade of their roots on the skin."""
    scalp = Scalp(fitting, canvas.millimetres[: len(fitting.skin)])
    lanes = strand_lanes.picture()
    for name, cards in styles(scalp, canvas.head.expression_basis).items():
        cards = finished(scalp, name, cards, lanes)
        write_hair(folder, fitting, name, cards)
        print(f"{name}: {len(cards.points)} vertices")
    save(folder / "strands.webp", lanes, 78)
    save(folder / "curls.webp", curls.curl_picture(scalp), 78)
    save(folder / "buzz.webp", curls.buzz_picture(scalp, lanes), 78)
    save(folder / "roots.webp", roots(canvas), 60)


def finished(scalp: Scalp, name: str, cards: Cards, lanes: np.ndarray) -> Cards:
    """A style without what nobody sees, and in its own shade."""
    if name in DEEP:
        cards = without_hidden(cards, lanes, scalp.skin)
    if name in grooms.HANGING:
        cards = dark_underneath(scalp, cards)
    return cards if name in curls.CURLS else fewer_pairs(scalp, cards)


def styles(scalp: Scalp, shapes: np.ndarray) -> dict[str, Cards]:
    """Every style's cards, by its name; `shapes` as for `beside_face`."""
    face = scalp.fitting.face
    worn = reduce(together, (clothes.shirt(face, cut).cards for cut in CUTS.values()))
    drape = Drape(Skin(worn.points, worn.quads), scalp.shift)
    earless = without_ears(scalp.lined(WIDE))
    tied = groom.grown(scalp, grooms.tied())
    made = {name: groom.grown(scalp, style()) for name, style in grooms.GROOMS.items()}
    for name, style in grooms.FALLING.items():
        whole = style(drape)
        fringed = name in grooms.FRINGED
        before = grooms.framing(whole, fringed)
        before = groom.ribbons_of(earless, before)
        if fringed:
            before = together(before, groom.ribbons_of(scalp, grooms.fringe()))
        hung = over_ears(face, together(groom.grown(earless, whole), before))
        made[name] = beside_face(earless, hung, shapes)
        if name in grooms.WAVED:
            made[name] = waved(scalp, made[name])
    made |= {name: curls.curls(scalp, curl) for name, curl in curls.CURLS.items()}
    made |= {"ponytail": together(tied, tail(scalp)), "bun": together(tied, knot(scalp))}
    return made | {"buzz": curls.buzz(scalp)}


def write_hair(folder: Path, fitting: Fitting, name: str, cards: Cards) -> None:
    """A style; one that falls over the ears says which skin it covers."""
    covers = np.zeros(0, int)
    if name in grooms.FALLING:
        covers = np.flatnonzero(fitting.face.ears.auricle > 0)
    write(folder / f"{name}.npz", fitting, cards, covers=covers)


def bake_brows(fitting: Fitting, assets: Path) -> None:
    for seed, (name, brow) in enumerate(brows.STYLES.items()):
        write(assets / "brows" / f"{name}.npz", fitting, brows.cards(fitting.face, brow))
        size = save(assets / "brows" / f"{name}.webp", brows.picture(brow, seed), 80)
        print(f"brows {name}: {size / 1e3:.0f} kB")


def bake_clothes(fitting: Fitting, assets: Path) -> None:
    for name, cut in CUTS.items():
        shirt = clothes.shirt(fitting.face, cut)
        places = {"skull": shirt.skull, "covers": shirt.covers, "near": shirt.near}
        places["near_light"] = np.round(255 * shirt.near_light)
        path = assets / "clothes" / f"{name}.npz"
        write(path, fitting, shirt.cards, skull_m=shirt.skull_m, **places)
        colour, normal = fabric.pictures(shirt)
        sizes = [path.stat().st_size]
        sizes.append(save(path.with_suffix(".webp"), colour, 75))
        sizes.append(save(path.with_name(f"{name}_normal.webp"), normal, 80))
        print(f"{name}: {len(shirt.cards.points)} vertices, {sum(sizes) / 1e3:.0f} kB")


def bake_lashes(fitting: Fitting, folder: Path) -> None:
    """Lashes, which turn with the skin of their lid."""
    cards, around = lashes.cards(fitting.face)
    write(folder / "lashes.npz", fitting, cards, around=around)
    for name, lids in lashes.PICTURES.items():
        size = save(folder / f"{name}.webp", lashes.picture(lids), 80)
        print(f"{name}: {len(cards.points)} vertices, {size / 1e3:.0f} kB")


def write(path: Path, fitting: Fitting, cards: Cards, skull_m=None, **more: np.ndarray) -> None:
    """Places in `more` are whole numbers; a skull there takes the place of the head's own."""
    if len(cards.points) > np.iinfo(np.uint16).max:
        raise ValueError(f"{path.name}: {len(cards.points)} vertices")
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
