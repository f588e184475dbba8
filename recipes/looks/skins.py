"""Skins on the head's atlas: twelve of them, by tone, age and sex; and the maps they share."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import scipy.ndimage as ndimage
from PIL import Image

from recipes.head.atlas import SOURCE_PX, socket_patch, source_pixels
from recipes.looks.canvas import Canvas, blurred, luma, noise

SIZE, NORMAL_SIZE = 1024, 1536
SKINS = {
    "light_young_female": ("young_lightskinned_female2", "", 1.0),
    "light_young_male": ("young_lightskinned_male", "", 1.0),
    "light_middle_female": ("middleage_lightskinned_female2", "", 1.0),
    "light_middle_male": ("middleage_lightskinned_male", "", 1.0),
    "light_old_female": ("middleage_lightskinned_female2", "old_lightskinned_female_512", 1.3),
    "light_old_male": ("middleage_lightskinned_male2", "old_lightskinned_male_512", 1.3),
    "dark_young_female": ("young_darkskinned_male", "young_darkskinned_female_512", 0.7),
    "dark_young_male": ("young_darkskinned_male", "", 1.0),
    "dark_middle_female": ("middleage_darkskinned_male", "middleage_darkskinned_female_512", 0.7),
    "dark_middle_male": ("middleage_darkskinned_male", "", 1.0),
    "dark_old_female": ("old_darkskinned_male", "old_darkskinned_female_512", 0.8),
    "dark_old_male": ("old_darkskinned_male", "", 1.0),
}
"""The source of its detail, that of its broad colours where another is, strength of the detail."""
LIP_OF_SKIN = {"female": (0.86, 0.66, 0.655), "male": (0.87, 0.75, 0.72)}
"""Lips as factors of the skin around them (sRGB)."""
LIP_NATURAL = {"female": 0.8, "male": 0.85}
"""How far painted lips give way to natural ones."""
SIDES = ("Left", "Right")
LID_MOVES_M = (0.0008, 0.0035)
"""Skin that a blink moves by less is no lid; by more, all lid."""
LID_OF_SKIN, LID_GRAIN = (1.0, 0.965, 0.955), 0.2
ORBIT_EVENED = 0.9
"""How far the shade between lid and brow, painted as if by a light, gives way to skin."""
ORANGE_EVENED = 0.85
"""How far what is yellower than the cheeks comes to them."""
SOCKET = (0.60, 0.33, 0.30)


class Masks:
    """Places on the atlas, 0..1, at one size."""

    def __init__(self, canvas: Canvas, size: int) -> None:
        head, at = canvas.head, canvas.millimetres
        lip = np.zeros(head.vertex_count)
        for ring, share in enumerate((0.25, 0.95, *[1.0] * (len(head.lip_rings) - 2))):
            lip[head.lip_rings[ring]] = share
        self.lip = blurred(canvas.spread(lip, size), size / 700).clip(0, 1)
        front = at[:, 2] > -75
        crown = np.clip((at[:, 1] - 55) / 14, 0, 1)
        behind = np.clip((-95 - at[:, 2]) / 14, 0, 1) * np.clip((at[:, 1] + 62) / 20, 0, 1)
        self.scalp = blurred(canvas.spread(np.maximum(crown, behind), size), size / 200)
        self.lid = lids(canvas, size)
        x, y = np.abs(at[:, 0]), at[:, 1]
        self.orbit = canvas.chosen(front & (x > 12) & (x < 48) & (y > 1) & (y < 24), size, 1 / 60)
        self.open = canvas.spread(head.occlusion.astype(float), size).clip(0, 1)
        middle = np.exp(-((at[:, 0] / 16) ** 2)) * (at[:, 1] > -48) * front
        self.t_zone = canvas.chosen(middle, size, 1 / 128)
        self.front = canvas.chosen(front & (at[:, 1] < 60), size, 1 / 100)
        self.beard = beard(canvas, size) * (1 - self.lip)
        self.cheek = canvas.chosen(front & (at[:, 1] < 20) & (at[:, 1] > -80), size, 1 / 80)


def lids(canvas: Canvas, size: int) -> np.ndarray:
    """What a blink unfolds."""
    head = canvas.head
    blinks = [head.expression_basis[head.expression_index(f"eyeBlink{side}")] for side in SIDES]
    moved = np.linalg.norm(sum(blinks), axis=1)
    share = np.clip((moved - LID_MOVES_M[0]) / np.ptp(LID_MOVES_M), 0, 1)
    return blurred(canvas.spread(share, size), size / 250).clip(0, 1)


def beard(canvas: Canvas, size: int) -> np.ndarray:
    """Where a man's beard grows: chin, jaw, upper lip, sideburns."""
    x, y, z = canvas.millimetres.T
    x = np.abs(x)
    jaw = (z > -110) & (y < -62 + 0.55 * np.clip(x - 20, 0, 60)) & (y > -128) & (x < 75)
    lip = (z > -45) & (y < -54) & (y > -80) & (x < 30)
    burns = (x > 55) & (z < -62) & (z > -98) & (y < -5) & (y > -80)
    return canvas.chosen(jaw | lip | burns, size, 1 / 90)


@cache
def source(folder: Path, name: str) -> np.ndarray:
    picture = Image.open(folder / f"{name}.jpg").convert("RGB")
    if picture.width < SOURCE_PX:
        picture = picture.resize((SOURCE_PX, SOURCE_PX), Image.Resampling.LANCZOS)
    return np.asarray(picture, np.float32) / 255


def baked(folder: Path, name: str, size: int) -> np.ndarray:
    """(size, size, 3) sRGB of one of MakeHuman's skins on the atlas."""
    rows, columns = source_pixels(size)
    full = source(folder, name)
    channels = [
        ndimage.map_coordinates(full[..., k], [rows, columns], order=3, mode="nearest")
        for k in range(3)
    ]
    return np.stack(channels, -1).clip(0, 1).astype(float)


def skin(folder: Path, name: str, masks: Masks, size: int) -> np.ndarray:
    """(size, size, 3) sRGB of one of SKINS: natural lips, a scalp without hair."""
    detail, broad, strength = SKINS[name]
    colour = baked(folder, detail, size)
    if broad:
        wide = size / 400
        coarse = baked(folder, broad, size)
        colour = blurred(coarse, wide) + strength * (colour - blurred(colour, wide))
    sex = name.split("_")[-1]
    colour = _shaven(colour.clip(0, 1), masks)
    colour = _lit_orbits(colour, masks)
    colour = _plain_lids(colour, masks)
    colour = _without_orange(colour, masks)
    colour = _natural_lips(colour, masks, sex)
    colour[socket_patch(size)] = np.array(SOCKET) * np.clip(_skin_colour(colour, masks) * 1.3, 0, 1)
    return colour.clip(0, 1)


def _skin_colour(colour: np.ndarray, masks: Masks) -> np.ndarray:
    plain = (masks.cheek > 0.9) & (masks.lip < 0.02) & (masks.open > 0.8) & (masks.beard < 0.05)
    return np.median(colour[plain], axis=0)


def _shaven(colour: np.ndarray, masks: Masks) -> np.ndarray:
    """The scalp in the colour of the forehead, a little of its own grain kept."""
    forehead = (masks.front > 0.9) & (masks.scalp < 0.15) & (masks.open > 0.8)
    bright = luma(colour)
    forehead &= bright > np.percentile(bright[forehead], 35)
    plain = np.median(colour[forehead], axis=0)
    grain = colour - blurred(colour, colour.shape[0] / 250)
    bare = plain * 0.97 + 0.15 * grain
    share = masks.scalp.clip(0, 1)[..., None]
    return colour * (1 - share) + bare * share


def _lit_orbits(colour: np.ndarray, masks: Masks) -> np.ndarray:
    wide = np.maximum(blurred(colour, colour.shape[0] / 90), 0.02)
    share = ORBIT_EVENED * masks.orbit[..., None]
    return colour * np.maximum(_skin_colour(colour, masks) / wide, 1) ** share


def _plain_lids(colour: np.ndarray, masks: Masks) -> np.ndarray:
    """Lids in the colour of the skin round them: what is painted there is shade, and is drawn
    out to streaks when they shut."""
    outside = (1 - masks.lid)[..., None] ** 2 * (masks.open > 0.75)[..., None]
    wide = colour.shape[0] / 30
    around = blurred(colour * outside, wide) / np.maximum(blurred(outside, wide), 1e-4)
    cheek = _skin_colour(colour, masks)
    plain = (0.75 * around + 0.25 * cheek) * LID_OF_SKIN
    grain = colour - blurred(colour, colour.shape[0] / 500)
    share = masks.lid[..., None]
    return colour * (1 - share) + (plain + LID_GRAIN * grain) * share


def _without_orange(colour: np.ndarray, masks: Masks) -> np.ndarray:
    """Patches that are yellower than the cheeks, as painted round old eyes, less so."""
    wide = np.maximum(blurred(colour, colour.shape[0] / 80), 0.02)
    plain = _skin_colour(colour, masks)
    blue = (plain[2] / luma(plain)) / (wide[..., 2] / luma(wide))
    red = (plain[0] / luma(plain)) / (wide[..., 0] / luma(wide))
    evened = colour.copy()
    evened[..., 2] *= np.maximum(blue, 1) ** ORANGE_EVENED
    evened[..., 0] *= np.minimum(red, 1) ** (ORANGE_EVENED / 2)
    return evened


def _natural_lips(colour: np.ndarray, masks: Masks, sex: str) -> np.ndarray:
    bright = luma(colour)[..., None]
    inside = masks.lip > 0.9
    natural = bright / bright[inside].mean() * _skin_colour(colour, masks) * LIP_OF_SKIN[sex]
    share = LIP_NATURAL[sex] * masks.lip[..., None]
    return colour * (1 - share) + natural * share


def normals(folder: Path, name: str, masks: Masks, size: int, depth: float) -> np.ndarray:
    """(size, size, 3) 0..1: folds and pores from the skin's own detail, pits, creases of lips."""
    bright = luma(baked(folder, name, size))
    scale = size / 2048
    fine = blurred(bright, 0.9 * scale) - blurred(bright, 8 * scale)
    outside = 1 - masks.lip
    bare = (1 - masks.scalp.clip(0, 1)) * (1 - 0.8 * masks.lid)
    height = depth * fine * bare * outside
    pits = np.minimum(noise(2, size, 1.5 * scale) + 0.6, 0)
    height += bare * outside * (0.011 * pits + 0.003 * noise(1, size, 0.9 * scale))
    height += 0.014 * masks.lip * noise(3, size, (12 * scale, 1.6 * scale))
    slope_x, slope_y = ndimage.sobel(height, 1), ndimage.sobel(height, 0)
    strength = 2.2
    normal = np.stack([-slope_x * strength, slope_y * strength, np.ones_like(height)], -1)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True) * 0.5 + 0.5


def roughness(masks: Masks, size: int) -> np.ndarray:
    """(size, size, 3): red occlusion, green roughness."""
    pits = np.minimum(noise(2, size, 1.0) + 0.6, 0)
    rough = 0.52 - 0.10 * masks.t_zone - 0.19 * masks.lip + 0.08 * masks.scalp - 0.06 * pits
    shade = np.maximum(0.35 + 0.65 * masks.open, masks.lid)
    return np.stack([shade, rough.clip(0.25, 0.85), 0 * rough], -1)


NORMALS = {
    "young": ("young_lightskinned_female2", 1.3),
    "middle": ("middleage_lightskinned_male", 1.7),
    "old": ("old_darkskinned_male", 2.3),
}
"""Source of the relief and its depth."""
MAP_SIZE = 512


def marks(canvas: Canvas, masks: Masks) -> dict[str, np.ndarray]:
    """Grey pictures of what may be laid over a skin: how much of it there is, place by place."""
    rng = np.random.default_rng(7)
    size = SIZE
    dots = blurred((rng.random((size, size)) > 0.975) * 1.0, 0.7)
    stubble = masks.beard.clip(0, 1) * (0.30 + 0.70 * np.clip(dots / np.percentile(dots, 98), 0, 1))
    spots = blurred((rng.random((size, size)) > 0.9985) * 1.0, 2.0)
    spots += 0.5 * blurred((rng.random((size, size)) > 0.9975) * 1.0, 1.2)
    spots = np.clip(spots / np.percentile(spots, 99.3), 0, 1)
    middle = canvas.millimetres
    where = np.exp(-(((middle[:, 1] + 28) / 26) ** 2)) * (middle[:, 2] > -80)
    freckles = spots * canvas.spread(where, size).clip(0, 1) * (1 - masks.lip)
    return {"stubble": stubble, "freckles": freckles}
