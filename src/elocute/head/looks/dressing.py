"""Dresses a head in its look: more vertices, more materials, and a Surface for each of them."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from elocute.errors import HeadError
from elocute.head.looks import baked
from elocute.head.looks.cards import Cards, read_cards
from elocute.head.looks.eyes import EDGE_RAD, IRIS_DEPTH, IRIS_RAD, eye_picture
from elocute.head.looks.folds import PLACE, fold_depth, fold_lines
from elocute.head.looks.hair_fitting import hair_off_cheeks, hair_on_clothes
from elocute.head.looks.look import CLOTHES, CLOTHES_COLOURS, HAIR_COLOURS, Look
from elocute.head.looks.skin import normal_picture, skin_picture
from elocute.head.looks.subdivision import made_finer
from elocute.head.model import HeadModel
from elocute.head.surface import Surface

DEFAULT_TONE = 0.2
DULL_WHITE = 0.22
"""How much darker the whites of the eyes are in the darkest skin: pure white seems to glow, as the
camera is set for the skin."""
INSIDE = {
    "teeth": (0.36, 0.985, 0.95),
    "gums": (0.45, 0.96, 0.98),
    "tongue": (0.42, 0.97, 0.97),
    "mouth": (0.35, 1.0, 1.0),
}
"""How much darker each part of the mouth is in the darkest skin, and the shares of its green and
blue that are left."""
HAIR_PICTURES = {"curls": "curls", "coils": "curls", "afro": "curls", "buzz": "buzz"}
"""Pictures of hair styles that do not consist of straight strands."""
LASHES, SPARSE_LASHES = "lashes/lashes", "lashes/sparse"
SHORTEST_LASH, SPARSE_BELOW = 0.35, 0.6
"""The shortest lashes as a share of the longest; and the lashes of a look below which they are also
fewer and finer, as most men's are."""
LASH_COLOUR, LASH_OF_HAIR = (0.006, 0.005, 0.004), 0.05
"""Darkest linear colour of lashes, and the share of the hair's colour that is added to it."""
BROW_WARMTH = (1.0, 0.93, 0.84)
"""Factors of linear red, green and blue: without them brows over warm skin would look blue."""
CORNER_M, CORNER_SKIN, CORNER_FLESH = 0.010, 0.9, (215, 140, 122)
"""How far from the corners of the mouth the edge of its lining is skin's too, how much there, and
its colour: that of skin there is multiplied by it, that of the lining is it.
"""
MODELLED = ("brows", "lashes")
"""Parts of the bare head that a look puts cards in place of."""
TEXTURED = ("skin", "lips", "eyeball")
"""Materials whose colour is all in their pictures."""

OPEN_SHADE, DEEPEST_SHADE = 128, np.uint8(80)
"""Hair darker than the first, of 255, lies under other hair, which keeps light and lustre from it;
none is darker than the second: it would be a hole."""
FAIR, THROUGH_FAIR = 0.5, 0.5
"""The brightest channel of fair hair, and how much less of a shade there is in it."""


def dress(head: HeadModel, look: Look, *, finer: bool = True) -> HeadModel:
    """A head as its look shows it.

    Parameters
    ----------
    head : HeadModel
        The built-in head or one of its mesh: with an identity, with other expression bases.
    look : Look
        What it looks like.
    finer : bool
        Whether its face gets more vertices; without, a head that wears nothing keeps to its own.

    Returns
    -------
    HeadModel
        The same vertices first, then those of a finer face and of what is worn; the same
        expressions and joints, so that every motion of `head` is one of this. Lips are of the
        material of the skin.

    Raises
    ------
    HeadError
        For a head of another mesh.
    """
    if not wearable(head):
        raise HeadError.about(
            f"head {head.name!r}", found="another mesh", allowed="the built-in head's, for a look"
        )
    hair = HAIR_COLOURS[look.hair_colour]
    brow = tuple(0.55 * c * warm for c, warm in zip(hair, BROW_WARMTH, strict=True))
    place = f"clothes/{CLOTHES[look.clothes]}" if look.clothes != "none" else ""
    clothes = read_cards(place).scaled_to(head) if place else None
    locks = read_cards(f"hair/{look.hair}").scaled_to(head) if look.hair != "none" else None
    dressed = _uncovered(_bare(head, look, hair), locks, clothes)
    dressed = made_finer(dressed) if finer else dressed
    if look.lashes > 0:
        cards = read_cards(LASHES).scaled_to(head)
        cards = cards.scaled(SHORTEST_LASH + (1 - SHORTEST_LASH) * look.lashes)
        lash = tuple(least + LASH_OF_HAIR * c for least, c in zip(LASH_COLOUR, hair, strict=True))
        picture = SPARSE_LASHES if look.lashes < SPARSE_BELOW else LASHES
        dressed = _wearing(dressed, head, "lashes", cards, _strands(picture, lash, "sheer"))
    if look.brows != "none":
        picture = f"brows/{look.brows}"
        cards = read_cards(picture).scaled_to(head)
        dressed = _wearing(dressed, head, "brows", cards, _strands(picture, brow, "sheer"))
    if locks:
        locks = hair_on_clothes(locks, clothes, head) if clothes else locks
        picture = f"hair/{HAIR_PICTURES.get(look.hair, 'strands')}"
        locks = replace(locks, shade=_let_through(np.maximum(locks.shade, DEEPEST_SHADE), hair))
        light = np.minimum(locks.shade / np.float32(OPEN_SHADE), 1) ** 2
        first = dressed.vertex_count
        dressed = _wearing(dressed, head, "hair", locks, _strands(picture, hair), light)
        dressed = hair_off_cheeks(dressed, slice(first, dressed.vertex_count), head)
    if clothes:
        cloth = _cloth(place, CLOTHES_COLOURS[look.clothes_colour])
        dressed = _wearing(dressed, head, "clothes", clothes, cloth)
    return dressed


@lru_cache(maxsize=2)
def dressed(head: HeadModel) -> HeadModel:
    """A head as it is drawn: with its look, or as it is where it has none.

    Kept for the next file of the same head: a page, a film and a scene of one take dress it once.
    """
    look = head.look
    return dress(head, look) if look is not None and wearable(head) else head


def wearable(head: HeadModel) -> bool:
    """Whether looks fit a head: whether it is the built-in mesh, undressed."""
    names = ("skin", "lips", "mouth", "teeth", "gums", "tongue", "eyeball", "hair")
    parts = ("brows", "lashes", "bust", "scalp")
    if head.surfaces or head.material_names != names:
        return False
    return all(part in head.regions for part in parts)


def _let_through(shade: np.ndarray, hair: tuple[float, ...]) -> np.ndarray:
    """Shade of locks, 0 to 255: fair hair lets light through to what lies below."""
    fair = min(max(hair) / FAIR, 1.0)
    lifted = (shade / np.float32(255)) ** np.float32(1 - THROUGH_FAIR * fair)
    return np.round(255 * lifted).astype(np.uint8)


def _strands(place: str, colour: tuple[float, ...], opacity: str = "blend") -> Surface:
    return Surface(
        color=baked.picture(place),
        tint=(colour[0], colour[1], colour[2]),
        roughness_factor=0.5,
        opacity=opacity,
        both_sides=True,
    )


def _cloth(place: str, colour: tuple[float, float, float]) -> Surface:
    return Surface(
        color=baked.picture(place),
        normal=baked.picture(f"{place}_normal"),
        tint=colour,
        roughness_factor=0.85,
        both_sides=True,
    )


def _without(head: HeadModel, vertices: np.ndarray) -> HeadModel:
    """A head without the faces between some vertices, which stay."""
    kept = ~np.isin(head.quads, vertices).all(1)
    return replace(
        head, quads=head.quads[kept], uv_quads=head.uv_quads[kept], material=head.material[kept]
    )


def _uncovered(bare: HeadModel, hair: Cards | None, clothes: Cards | None) -> HeadModel:
    """A head without what lies under its hair and clothes, and in the shade of these."""
    if hair:
        bare = _without(bare, hair.covers)
    if not clothes:
        return bare
    bare = _without(bare, np.union1d(clothes.covers, bare.regions["bust"]))
    occlusion = bare.occlusion.copy()
    occlusion[clothes.near] *= clothes.near_light / np.float32(255)
    return replace(bare, occlusion=occlusion)


def _bare(head: HeadModel, look: Look, hair: tuple[float, ...]) -> HeadModel:
    """The head's own parts with their pictures; modelled brows and lashes left out."""
    materials = head.material_names
    modelled = np.concatenate([head.regions[name] for name in MODELLED])
    kept = ~np.isin(head.quads, modelled).any(1)
    material = head.material.copy()
    material[material == materials.index("lips")] = materials.index("skin")
    color = head.vertex_color.copy()
    for name in TEXTURED:
        faces = head.material == materials.index(name)
        color[np.unique(head.quads[faces & kept])] = 255
    # Where the lining begins, the skin's white would else run into it.
    lining = np.unique(head.quads[head.material == materials.index("mouth")])
    color[lining] = _lightened(head, color, lining)
    tone = DEFAULT_TONE if look.tone is None else look.tone
    skin = Surface(
        color=skin_picture(
            look.age, look.sex, tone, look.freckles, look.stubble, hair, look.hair != "none"
        ),
        normal=normal_picture(look.age),
        roughness=baked.picture("skins/roughness"),
        roughness_factor=1.0,
        folds=baked.picture(PLACE),
        fold_depth=fold_depth(look.age),
        fold_lines=fold_lines(look.age),
    )
    white = 1 - DULL_WHITE * tone
    eye = Surface(
        color=eye_picture(look.eyes, look.pupils),
        tint=(white, 0.98 * white, 0.95 * white),
        roughness_factor=0.08,
        eye_rad=EDGE_RAD,
        iris_rad=IRIS_RAD,
        iris_depth=IRIS_DEPTH,
    )
    wet = {"teeth": 0.22, "gums": 0.3, "tongue": 0.56, "mouth": 0.6}
    surfaces = {"skin": skin, "eyeball": eye}
    surfaces |= {name: Surface(roughness_factor=rough) for name, rough in wet.items()}
    surfaces["tongue"] = replace(surfaces["tongue"], normal=baked.picture("skins/tongue"))
    for name, (dark, green, blue) in INSIDE.items():
        left = 1 - dark * tone
        surfaces[name] = replace(surfaces[name], tint=(left, green * left, blue * left))
    return replace(
        head,
        quads=head.quads[kept],
        uv_quads=head.uv_quads[kept],
        material=material[kept],
        vertex_color=color,
        surfaces=surfaces,
        look=None,
    )


def _lightened(head: HeadModel, color: np.ndarray, lining: np.ndarray) -> np.ndarray:
    """(vertex, 3) colours of the lining; lighter where skin begins at the corners of the mouth:
    dark on either side, the line between the lips would else run on in black beyond their red."""
    own = head.vertex_color[lining].astype(np.float32)
    ends = head.template[head.inner_corners]
    away = np.linalg.norm(head.template[lining][:, None] - ends, axis=2).min(axis=1)
    share = CORNER_SKIN * (color[lining] == 255).all(axis=1) * np.exp(-((away / CORNER_M) ** 2))
    return np.round(own + (np.array(CORNER_FLESH) - own) * share[:, None]).astype(np.uint8)


def _wearing(
    dressed: HeadModel,
    head: HeadModel,
    name: str,
    cards: Cards,
    surface: Surface,
    light: np.ndarray | None = None,
) -> HeadModel:
    """A head with one more thing worn; `head` is the bare one that its skin belongs to, `light`
    how open each vertex of the thing is, (vertex,) 0 to 1."""
    light = np.ones(len(cards), np.float32) if light is None else light
    first, texcoords = dressed.vertex_count, len(dressed.uv)
    names = dressed.material_names
    if name not in names:
        names = (*names, name)
    number = np.full(len(cards.quads), names.index(name), np.uint8)
    own = np.arange(first, first + len(cards), dtype=np.int32)
    white = np.repeat(cards.shade[:, None], 3, 1)
    return replace(
        dressed,
        template=np.vstack([dressed.template, cards.points(head.template)]),
        quads=np.vstack([dressed.quads, cards.quads + np.int32(first)]),
        uv=np.vstack([dressed.uv, cards.uv]),
        uv_quads=np.vstack([dressed.uv_quads, cards.uv_quads + np.int32(texcoords)]),
        identity_basis=_joined(dressed.identity_basis, cards.carried(head.identity_basis)),
        expression_basis=_joined(
            dressed.expression_basis, cards.moved(head.template, head.expression_basis)
        ),
        skin_weights=np.vstack([dressed.skin_weights, cards.carried(head.skin_weights)]),
        material=np.concatenate([dressed.material, number]),
        material_names=names,
        vertex_color=np.vstack([dressed.vertex_color, white]),
        occlusion=np.concatenate([dressed.occlusion, light]),
        mirror=np.concatenate([dressed.mirror, own]) if len(dressed.mirror) else dressed.mirror,
        surfaces={**dressed.surfaces, name: surface},
    )


def _joined(basis: np.ndarray, more: np.ndarray) -> np.ndarray:
    return np.concatenate([basis, more.astype(np.float32)], axis=1)
