"""Skins on the head's atlas: twelve of them, by tone, age and sex; and the maps they share."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property
from pathlib import Path

import numpy as np
import scipy.ndimage as ndimage
from PIL import Image
from scipy.spatial import KDTree

from elocute.numerics.smoothing import smoothstep
from recipes.head.atlas import SOURCE_PX, socket_patch, source_pixels
from recipes.looks import lids
from recipes.looks.canvas import Canvas, blurred, luma, noise
from recipes.looks.scalp import grows

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
LIP_OF_SKIN = {
    "light_female": (0.84, 0.63, 0.65),
    "light_male": (0.80, 0.695, 0.705),
    "dark_female": (0.82, 0.64, 0.67),
    "dark_male": (0.80, 0.69, 0.71),
}
"""Lips as factors of the skin around them (sRGB): less red in men, duller in dark skin."""
LIP_CREASE, LIP_ROLL = (0.034, 0.060, 0.055), 0.035
"""How much darker lips are in their fine upright creases; how much paler the skin along them."""
LIP_CREASE_PX, LIP_CREASE_DEPTH = (18, 1.5), 0.018
"""Length and width of a crease on an atlas of 2048 px, and how deep it is."""
LIP_NATURAL = {"female": 0.85, "male": 0.95}
"""How far painted lips give way to natural ones."""
LIP_ENDS_MM, LIP_END = (0.5, 5.0), 0.8
"""Over which distance from the corners of the mouth lips take on their red, and their share of it
at the corners, where it comes to an end in skin, not in a point."""
CORNER_COLUMNS = np.r_[10:15, 24:29]
CORNER_RED = 0.8
"""Columns of the lips that end at the corners of the mouth, and the red of their border."""
MOUTH_END_MM, MOUTH_END, MOUTH_END_ROUGH = 3.4, 0.3, 0.3
"""How far round its corners a mouth lies in its own shade, how much of the light that keeps, and
how much rougher it is there: its tight folds would else each have a bright dot."""
CORNER_MM = 11.0
"""How far from the corners of the mouth skin is evened."""
NOSE_BASE, NOSE_WINGS = (0, -50, 18, 16), (16, -41, 7, 9)
"""Where it is evened under the nose and beside its wings: middle and half size, mm, from the middle
of the face and from the eyes' height."""
NOSTRIL_MM, NOSTRIL = ((9.3, -39.2, -10.6), 3.3), (0.46, 0.35, 0.33)
"""Middle and half size of a nostril, mm; what its inside, where light hardly comes, keeps of the
colour of skin."""
LID_OF_SKIN = {"light": (0.915, 0.845, 0.84), "dark": (0.77, 0.72, 0.70)}
NEAR_LID_OF_SKIN = (0.955, 0.905, 0.905)
"""Lids are thin and redder than the skin round them, which comes to their colour by and by."""
LID_GRAIN, STRETCHED_GRAIN = 0.2, 0.08
"""A lid's grain is drawn out as it shuts: less of it than elsewhere."""
LID_CREPE, LID_CREPE_PX = 0.02, (0.9, 5.0)
"""Depth of the fine lines across a lid; their height and length on an atlas of 2048 px."""
CREASE_DEPTH, CREASE_OF_SKIN, FOLD_OF_SKIN = 0.045, (0.84, 0.75, 0.73), (0.91, 0.86, 0.85)
VEIN_OF_SKIN = (0.92, 0.86, 0.90)
RIM_OF_SKIN, RIM_FLESH, RIM_IS_FLESH = (0.97, 0.79, 0.785), (0.84, 0.52, 0.49), 0.12
LASH_LINE_OF_SKIN = (0.58, 0.48, 0.46)
"""The edges of lids are wet, and flesh of the same red in everybody; roots of lashes are dark."""
CARUNCLE_MM, CARUNCLE_SHARE = ((17.9, -2.4, -29.0), 1.6), 0.75
CARUNCLE = {"light": (0.84, 0.47, 0.44), "dark": (0.50, 0.28, 0.25)}
"""The flesh in the inner corner of an eye: its middle and half size, mm; how far it covers the
skin there; its colour."""
FOREHEAD_OF_SKIN = (1.0, 0.995, 0.955)
JAW_OF_SKIN = {"light": (0.955, 0.97, 0.99), "dark": (0.96, 0.965, 0.98)}
"""There is little blood over the bone of a forehead; hair that is shaven off shimmers through."""
UNDER_EYE_OF_SKIN = {"light": (0.935, 0.925, 0.955), "dark": (0.96, 0.945, 0.935)}
ROUND_EYE = {"light": 1.0, "dark": 0.35}
"""How much of a lid's colour the skin round the eye takes: in dark skin it would be a bruise."""
EVENED_HUE, EVENED_ORBIT, EVENED_LIGHT = 0.85, 0.9, {"light": 0.60, "dark": 0.85}
"""How far patches of another hue or brightness come to the colour of the cheeks; round eyes."""
STAINS = {"light": 1.0, "dark": 0.35}
"""Share of painted strokes that stays: on dark skin they are stains."""
ORBIT_EVENED = 1.0
"""How far the shade between lid and brow, painted as if by a light, gives way to skin."""
ORANGE_EVENED = 0.85
"""How far what is yellower than the cheeks comes to them."""
GLINT_FROM, GLINT_EVENED = 1.04, 0.8
"""From which brightness, by that round it, a patch is painted light; how far that is evened."""
EAR_Y, EAR_Z, EAR_SIDE = (-17, 28), (-114, 19), 66
"""Middle and half length of the ears, mm: from the eyes' height, from the front of the face; and
how far off the middle they are."""
EAR_GRAIN, EAR_SHADE, EAR_RIM = 0.25, (0.62, 0.86, 0.90), (1.0, 0.98, 0.97)
"""Share of the painted detail that stays in an ear; powers of the shade that its folds take,
red least; what thin rims, through which light comes, are multiplied by."""
SOCKET = (0.60, 0.33, 0.30)
RAYS_MM, RAYED = 20.0, 0.85
"""How far from the corners of the mouth skin is plainer, and how much."""
SHAVEN_MM = -8.0
"""From where hair is taken off that is painted, behind our hairline: it begins before it in some.
"""


class Masks:
    """Places on the atlas, 0..1, at one size."""

    def __init__(self, canvas: Canvas, size: int) -> None:
        head, at = canvas.head, canvas.millimetres
        lip = np.zeros(head.vertex_count)
        for ring, share in enumerate((0.25, 0.95, *[1.0] * (len(head.lip_rings) - 2))):
            lip[head.lip_rings[ring]] = share
        # At the corners red reaches beyond the border: in a smile it is drawn out to a thread.
        lip[head.lip_rings[0, CORNER_COLUMNS]] = CORNER_RED
        self.lip = blurred(canvas.spread(lip, size), size / 700).clip(0, 1)
        ends = at[head.landmarks[[48, 54]]]
        away = np.linalg.norm(at[:, None] - ends[None], axis=2).min(axis=1)
        first, last = LIP_ENDS_MM
        along = np.clip((away - first) / (last - first), 0, 1)
        red = LIP_END + (1 - LIP_END) * smoothstep(along)
        self.red = blurred(canvas.spread(red, size), size / 400).clip(0, 1)
        beside = np.exp(-((away / CORNER_MM) ** 2))
        front = at[:, 2] > -75
        x, y = np.abs(at[:, 0]), at[:, 1]
        nose = [
            np.exp(-(((x - across) / wide) ** 4) - ((y - up) / high) ** 4) * front
            for across, up, wide, high in (NOSE_BASE, NOSE_WINGS)
        ]
        plain = np.maximum.reduce([beside, *nose])
        # Round lips draw what is painted beside their corners out to rays.
        rayed = np.exp(-((away / RAYS_MM) ** 2))
        self.rayed = RAYED * blurred(canvas.spread(rayed, size), size / 250) * (1 - self.lip)
        self.plain = blurred(canvas.spread(plain, size), size / 250) * (1 - self.lip)
        crown = np.clip((at[:, 1] - 55) / 14, 0, 1)
        behind = np.clip((-95 - at[:, 2]) / 14, 0, 1) * np.clip((at[:, 1] + 62) / 20, 0, 1)
        scalp = np.maximum(crown, behind)
        self.scalp = blurred(canvas.spread(scalp, size), size / 200)
        self.shaven = blurred(
            canvas.spread(np.maximum(scalp, grows(at, SHAVEN_MM)), size), size / 200
        )
        self.lid = lids.lids(canvas, size)
        self.near_lid = (1.6 * blurred(self.lid, size / 110)).clip(0, 1)
        orbit = (x > 12) & (x < 48) & (y > 1) & (y < 24)
        corner = (x > 42) & (x < 66) & (y > -11) & (y < 9)
        self.orbit = (1.4 * canvas.chosen(front & (orbit | corner), size, 1 / 60)).clip(0, 1)
        self.open = canvas.spread(head.occlusion.astype(float), size).clip(0, 1)
        middle = np.exp(-((at[:, 0] / 16) ** 2)) * (at[:, 1] > -48) * front
        pored = np.exp(-((at[:, 0] / 30) ** 2) - (np.abs(at[:, 1] + 24) / 30) ** 4)
        self.pored = canvas.spread(pored * front, size).clip(0, 1)
        ear = np.hypot((y - EAR_Y[0]) / EAR_Y[1], (at[:, 2] - EAR_Z[0]) / EAR_Z[1]) < 1
        self.ear = canvas.chosen(ear & (x > EAR_SIDE), size, 1 / 200).clip(0, 1)
        self.t_zone = canvas.chosen(middle, size, 1 / 128)
        self.front = canvas.chosen(front & (at[:, 1] < 60), size, 1 / 100)
        self.beard = beard(canvas, size) * (1 - self.lip)
        self.cheek = canvas.chosen(front & (at[:, 1] < 20) & (at[:, 1] > -80), size, 1 / 80)
        under = np.exp(-(((x - 27) / 13) ** 2) - ((y + 14 - 0.12 * (x - 27)) / 5.5) ** 2) * front
        self.under_eye = canvas.spread(under, size).clip(0, 1)
        beside = np.hypot((x - 49) / 9, y / 5.5), np.hypot(x - 15, y + 3) / 5
        within = np.minimum.reduce([*beside, np.hypot((x - 29) / 15, (y + 10) / 4.5)])
        self.round_eye = canvas.spread(np.exp(-(within**4)) * front, size).clip(0, 1)
        self.rim = lids.rims(canvas, size)
        self.crease, self.lid_fold, self.lash_line = lids.lines(canvas, size)
        forehead = np.exp(-((x / 55) ** 4) - ((y - 48) / 26) ** 4) * front
        self.forehead = canvas.spread(forehead, size).clip(0, 1)
        self.millimetres = np.stack([canvas.spread(at[:, k], size) for k in range(3)], -1)
        self.caruncle, self.nostril = self._pair(*CARUNCLE_MM), self._pair(*NOSTRIL_MM)
        self.mouth_end = self._pair(ends[ends[:, 0].argmax()], MOUTH_END_MM)

    def _pair(self, middle: Sequence[float] | np.ndarray, half: float) -> np.ndarray:
        """Soft discs round a place, mm, and round that on the other side."""
        x, y, z = np.moveaxis(self.millimetres, -1, 0)
        away = np.linalg.norm(np.stack([np.abs(x), y, z], -1) - middle, axis=-1)
        return np.exp(-((away / half) ** 4))

    @cached_property
    def relief(self) -> tuple[np.ndarray, np.ndarray]:
        """Pores, 0..1, and the furrows between fine fields of skin; both larger beside the nose."""
        fine, coarse = (np.array(_cells(self.millimetres, pitch)) for pitch in PITCH_MM)
        pores, furrows = fine + (coarse - fine) * self.pored
        return pores, furrows


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
    tone, _, sex = name.split("_")
    colour = _shaven(colour.clip(0, 1), masks)
    colour = _lit_orbits(colour, masks)
    colour = _plain_lids(colour, masks, tone)
    colour = _without_orange(colour, masks)
    colour = _without_glints(colour, masks)
    colour = _evened(colour, masks, tone)
    colour = _unstained(colour, masks, STAINS[tone])
    colour = _plain_mouth(colour, masks)
    colour = _plain_ears(colour, masks)
    colour = _natural_lips(colour, masks, f"{tone}_{sex}")
    colour = _eyes_bedded(colour, masks, tone)
    colour = _toned(colour, masks, tone, sex)
    colour = _mottled(colour, masks)
    colour[socket_patch(size)] = np.array(SOCKET) * np.clip(_skin_colour(colour, masks) * 1.3, 0, 1)
    return colour.clip(0, 1)


def _skin_colour(colour: np.ndarray, masks: Masks) -> np.ndarray:
    plain = (masks.cheek > 0.9) & (masks.lip < 0.02) & (masks.open > 0.8) & (masks.beard < 0.05)
    return np.median(colour[plain], axis=0)


def _shaven(colour: np.ndarray, masks: Masks) -> np.ndarray:
    """Where hair grows, the colour of the forehead; a little of its own grain is kept."""
    forehead = (masks.front > 0.9) & (masks.scalp < 0.15) & (masks.open > 0.8)
    bright = luma(colour)
    forehead &= bright > np.percentile(bright[forehead], 35)
    plain = np.median(colour[forehead], axis=0)
    grain = colour - blurred(colour, colour.shape[0] / 250)
    bare = plain * 0.97 + 0.15 * grain
    share = masks.shaven.clip(0, 1)[..., None]
    return colour * (1 - share) + bare * share


def _lit_orbits(colour: np.ndarray, masks: Masks) -> np.ndarray:
    wide = np.maximum(blurred(colour, colour.shape[0] / 90), 0.02)
    share = ORBIT_EVENED * masks.orbit[..., None]
    return colour * np.maximum(_skin_colour(colour, masks) / wide, 1) ** share


def _plain_lids(colour: np.ndarray, masks: Masks, tone: str) -> np.ndarray:
    """Lids, and what is next to them, in the colour of the skin round them: shade that is painted
    there is drawn out to streaks when they shut, and lashes lie where no lid ends."""
    lid = np.maximum.reduce([masks.lid, masks.round_eye, masks.rim])
    outside = (1 - lid)[..., None] ** 2 * (masks.open > 0.75)[..., None]
    wide = colour.shape[0] / 30
    around = blurred(colour * outside, wide) / np.maximum(blurred(outside, wide), 1e-4)
    cheek = _skin_colour(colour, masks)
    tinted = np.maximum.reduce([masks.lid, ROUND_EYE[tone] * masks.round_eye, masks.rim])[..., None]
    plain = (0.75 * around + 0.25 * cheek) * (1 - tinted * (1 - np.array(LID_OF_SKIN[tone])))
    grain = colour - blurred(colour, colour.shape[0] / 500)
    share = lid[..., None]
    stretched = np.maximum(masks.lid, masks.rim)[..., None]
    kept = LID_GRAIN + (STRETCHED_GRAIN - LID_GRAIN) * stretched
    return colour * (1 - share) + (plain + kept * grain) * share


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


def _without_glints(colour: np.ndarray, masks: Masks) -> np.ndarray:
    """Light that was painted on: what is brighter than the skin round it, less so."""
    size = colour.shape[0]
    bright = luma(colour)
    near, wide = blurred(bright, size / 250), blurred(bright, size / 28)
    over = np.maximum(near / np.maximum(wide * GLINT_FROM, 0.02), 1)
    share = GLINT_EVENED * (1 - masks.lip) * (1 - masks.scalp.clip(0, 1)) * (masks.front > 0.5)
    return colour / (over**share)[..., None]


def _evened(colour: np.ndarray, masks: Masks, tone: str) -> np.ndarray:
    """Large patches nearer to the colour of the cheeks: painted light, and hues that no blood
    gives. What blood does give is laid over a skin later."""
    size = colour.shape[0]
    wide = np.maximum(blurred(colour, size / 110), 0.02)
    plain = _skin_colour(colour, masks)
    light = (luma(plain) / luma(wide))[..., None]
    hue = plain / wide / light
    bare = (1 - masks.lip) * (1 - masks.scalp.clip(0, 1)) * (1 - masks.ear)
    bare *= np.maximum(((masks.open - 0.55) / 0.25).clip(0, 1), masks.orbit)
    bright = bare * np.maximum(EVENED_LIGHT[tone], EVENED_ORBIT * masks.orbit)
    return colour * light ** bright[..., None] * hue ** (EVENED_HUE * bare)[..., None]


def _unstained(colour: np.ndarray, masks: Masks, kept: float) -> np.ndarray:
    """Less of what is smaller than shade and larger than grain: painted strokes."""
    size = colour.shape[0]
    strokes = blurred(colour, size / 500) - blurred(colour, size / 60)
    share = (1 - kept) * masks.cheek * (1 - masks.lip)
    return colour - strokes * share[..., None]


def _eyes_bedded(colour: np.ndarray, masks: Masks, tone: str) -> np.ndarray:
    """Thin skin under the eyes, creases, veins and wet edges of the lids, dark roots of lashes."""
    for share, factor in (
        (masks.under_eye, UNDER_EYE_OF_SKIN[tone]),
        (masks.near_lid, NEAR_LID_OF_SKIN),
        (masks.lid * lids.veins(colour.shape[0]), VEIN_OF_SKIN),
        (masks.lid_fold, FOLD_OF_SKIN),
        (masks.crease, CREASE_OF_SKIN),
        (masks.rim, RIM_OF_SKIN),
        (masks.lash_line, LASH_LINE_OF_SKIN),
    ):
        colour = colour * (1 - share[..., None] * (1 - np.array(factor)))
    for share, flesh in (
        (RIM_IS_FLESH * masks.rim * (1 - masks.lash_line), RIM_FLESH),
        (CARUNCLE_SHARE * masks.caruncle, CARUNCLE[tone]),
    ):
        colour = colour * (1 - share[..., None]) + np.array(flesh) * share[..., None]
    return colour


def _toned(colour: np.ndarray, masks: Masks, tone: str, sex: str) -> np.ndarray:
    """Yellower foreheads, greyer jaws of men; the red of blood is laid over a skin later."""
    jaw = masks.beard * (sex == "male")
    for share, factor in ((masks.forehead, FOREHEAD_OF_SKIN), (jaw, JAW_OF_SKIN[tone])):
        colour = colour * (1 - share[..., None] * (1 - np.array(factor)))
    return colour


def _mottled(colour: np.ndarray, masks: Masks) -> np.ndarray:
    """Pores are darker than the skin round them, and no skin is of one red."""
    size = colour.shape[0]
    pores, _ = masks.relief
    bare = (1 - masks.lip) * (1 - masks.lid) * (1 - masks.scalp.clip(0, 1)) * (1 - masks.ear)
    bare *= 1 - masks.rayed
    dark = PORE_SHADE * pores * (0.35 + 0.65 * masks.pored) * bare
    red = MOTTLE * (0.6 * noise(21, size, size / 340) + 0.4 * noise(22, size, size / 110)) * bare
    return colour * (1 - dark[..., None]) * np.exp(red[..., None] * [0.25, -1.0, -0.8])


def _plain_mouth(colour: np.ndarray, masks: Masks) -> np.ndarray:
    """Skin round the mouth and under the nose without painted lines and shade: lips would draw them
    out to streaks, and noses of other shapes have their shade elsewhere."""
    size = colour.shape[0]
    bare = (1 - masks.lip)[..., None] ** 2 * (masks.open > 0.7)[..., None]
    bare *= 1 - 0.9 * masks.plain[..., None]
    around = blurred(colour * bare, size / 30) / np.maximum(blurred(bare, size / 30), 1e-4)
    grain = colour - blurred(colour, size / 500)
    share = np.maximum(masks.plain, masks.rayed)[..., None]
    colour = colour * (1 - share) + (around + LID_GRAIN * grain) * share
    return colour * (1 - masks.nostril[..., None] * (1 - np.array(NOSTRIL)))


def _plain_ears(colour: np.ndarray, masks: Masks) -> np.ndarray:
    """Ears in the colour of the skin beside them, with the shade of their own folds: what is
    painted there is that of another shape. Rims let light through and are redder."""
    size, outside = colour.shape[0], (1 - masks.ear)[..., None]
    wide = size / 30
    around = blurred(colour * outside, wide) / np.maximum(blurred(outside, wide), 1e-4)
    plain = 0.75 * around + 0.25 * _skin_colour(colour, masks)
    grain = colour - blurred(colour, size / 200)
    open_ = masks.open.clip(0.05, 1)[..., None]
    rim = np.clip((open_ - 0.75) / 0.2, 0, 1)
    tinted = plain * open_ ** np.array(EAR_SHADE) * np.array(EAR_RIM) ** rim
    share = masks.ear[..., None]
    return colour * (1 - share) + (tinted + EAR_GRAIN * grain) * share


def _natural_lips(colour: np.ndarray, masks: Masks, kind: str) -> np.ndarray:
    """Lips in a red of the skin's own, darker in fine creases, with a pale roll along them."""
    size, sex = colour.shape[0], kind.split("_")[-1]
    bright = luma(colour)[..., None]
    inside = masks.lip > 0.9
    red = masks.red[..., None]
    shade = (bright / bright[inside].mean()) ** red
    tint = 1 - red * (1 - np.array(LIP_OF_SKIN[kind]))
    natural = shade * _skin_colour(colour, masks) * tint
    share = (1 - (1 - LIP_NATURAL[sex]) * red) * masks.lip[..., None]
    colour = colour * (1 - share) + natural * share
    roll = LIP_ROLL * blurred(masks.lip, size / 160) * (1 - masks.lip)
    creased = (masks.lip * _lip_creases(size).clip(0, 2))[..., None] * np.array(LIP_CREASE)
    return colour * (1 - creased) * (1 + 2 * roll[..., None])


def _lip_creases(size: int) -> np.ndarray:
    """(size, size) of deviation 1: fine and upright, deeper where it is more."""
    long, wide = (px * size / 2048 for px in LIP_CREASE_PX)
    return 0.7 * noise(3, size, (long, wide)) + 0.5 * noise(8, size, (1.5 * long, 2.2 * wide))


def normals(folder: Path, name: str, masks: Masks, size: int, depth: float) -> np.ndarray:
    """(size, size, 3) 0..1: folds and pores from the skin's own detail, pits, creases of lips."""
    bright = luma(baked(folder, name, size))
    scale = size / 2048
    fine = blurred(bright, 0.9 * scale) - blurred(bright, 5 * scale)
    outside = 1 - masks.lip
    bare = (1 - masks.scalp.clip(0, 1)) * (1 - 0.95 * masks.lid) * (1 - masks.rim)
    bare *= 1 - 0.7 * masks.ear
    height = depth * fine * bare * outside * (1 - np.maximum(masks.plain, masks.round_eye))
    bare *= 1 - 0.6 * masks.plain
    pores, grain = masks.relief
    deep, furrowed = (few + (many - few) * masks.pored for few, many in (PORES, GRAIN))
    rough = deep * pores + furrowed * grain + 0.003 * noise(1, size, 0.9 * scale)
    height -= bare * outside * rough
    height -= LIP_CREASE_DEPTH * masks.lip * _lip_creases(size)
    height -= CREASE_DEPTH * masks.crease
    wide_px, high_px = LID_CREPE_PX
    height += LID_CREPE * masks.lid * noise(9, size, (wide_px * scale, high_px * scale))
    slope_x, slope_y = ndimage.sobel(height, 1), ndimage.sobel(height, 0)
    strength = 2.2
    normal = np.stack([-slope_x * strength, slope_y * strength, np.ones_like(height)], -1)
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True) * 0.5 + 0.5


def _cells(at: np.ndarray, pitch: float) -> tuple[np.ndarray, np.ndarray]:
    """(size, size) 0..1 pores, and 0..1 the furrows between the fields of skin round them: as far
    apart on the skin, at places `at` (size, size, 3) mm, however the atlas is stretched."""
    rng = np.random.default_rng(4)
    places = at.reshape(-1, 3)
    order = rng.permutation(len(places))
    # One place of each box that the skin passes through: at random, but nowhere crowded.
    _, first = np.unique(
        np.floor(places[order] / pitch).astype(np.int16), axis=0, return_index=True
    )
    middles = places[order[first]]
    away, nearest = map(np.asarray, KDTree(middles).query(places, 2, workers=2))
    strong = rng.uniform(0.1, 1.0, len(middles))[nearest[:, 0]]
    pores = strong * np.exp(-((away[:, 0] / (PORE_WIDTH * pitch)) ** 2))
    furrows = np.exp(-(((away[:, 1] - away[:, 0]) / (0.28 * pitch)) ** 2))
    size = len(at)
    return pores.reshape(size, size), furrows.reshape(size, size)


def roughness(masks: Masks, size: int) -> np.ndarray:
    """(size, size, 3): red occlusion, green roughness."""
    pits = np.minimum(noise(2, size, 1.0) + 0.6, 0)
    rough = 0.50 - 0.11 * masks.t_zone - 0.17 * masks.lip + 0.08 * masks.scalp - 0.06 * pits
    rough += 0.16 * masks.lid - 0.28 * np.maximum(masks.rim * (1 - masks.lip), masks.caruncle)
    rough += 0.3 * masks.nostril + MOUTH_END_ROUGH * masks.mouth_end
    shade = np.maximum(
        0.35 + 0.65 * masks.open, np.maximum(LID_OPEN * masks.lid, 0.92 * masks.orbit)
    )
    shade *= (1 - 0.7 * masks.nostril) * (1 - MOUTH_END * masks.mouth_end)
    return np.stack([shade, rough.clip(0.25, 0.85), 0 * rough], -1)


PORE_SHADE, MOTTLE = 0.10, 0.014
"""How much darker pores are; deviation of green, by which skin is redder here than there."""
PITCH_MM, PORE_WIDTH = (0.95, 1.6), 0.26
"""Between pores, on the whole and beside the nose; their width by that."""
PORES, GRAIN = (0.038, 0.070), (0.022, 0.030)
"""Depth of pores, and of the furrows between, on the whole and beside the nose."""
NORMALS = {
    "young": ("young_lightskinned_female2", 0.5),
    "middle": ("middleage_lightskinned_male", 0.65),
    "old": ("old_darkskinned_male", 1.3),
}
"""Source of the relief and its depth."""
STUBBLE_MM = 0.8
"""Between hairs of a beard."""
MAP_SIZE, LID_OPEN = 512, 0.76
"""Size of the map of roughness; how open to the light a shut lid is, under its brow."""


def marks(canvas: Canvas, masks: Masks) -> dict[str, np.ndarray]:
    """Grey pictures of what may be laid over a skin: how much of it there is, place by place."""
    rng = np.random.default_rng(7)
    size = SIZE
    dots, _ = _cells(masks.millimetres, STUBBLE_MM)
    dots = np.clip(1.4 * dots, 0, 1) * (1 - masks.rayed)
    stubble = masks.beard.clip(0, 1) * (0.30 + 0.70 * dots)
    spots = blurred((rng.random((size, size)) > 0.9985) * 1.0, 2.0)
    spots += 0.5 * blurred((rng.random((size, size)) > 0.9975) * 1.0, 1.2)
    spots = np.clip(spots / np.percentile(spots, 99.3), 0, 1)
    middle = canvas.millimetres
    where = np.exp(-(((middle[:, 1] + 28) / 26) ** 2)) * (middle[:, 2] > -80)
    freckles = spots * canvas.spread(where, size).clip(0, 1) * (1 - masks.lip)
    return {"stubble": stubble, "freckles": freckles, "flush": flush(canvas, masks)}


def flush(canvas: Canvas, masks: Masks) -> np.ndarray:
    """(SIZE, SIZE) 0..1, half of it on the whole: where blood shows through."""
    x, y, z = canvas.millimetres.T
    front = z > -80

    def spot(across: float, up: float, wide: float, high: float) -> np.ndarray:
        return np.exp(-(((np.abs(x) - across) / wide) ** 2) - ((y - up) / high) ** 2) * front

    tip = spot(0, -38, 15, 9) + 0.6 * spot(14, -42, 6, 8)
    warm = np.maximum.reduce([tip, 0.75 * spot(37, -32, 15, 13), 0.4 * spot(0, -94, 11, 8)])
    plain = np.maximum(0.55 * spot(0, 40, 30, 16), 0.7 * spot(27, -62, 9, 9))
    broad = blurred(canvas.spread(warm - 0.6 * plain, SIZE), SIZE / 200) + masks.ear
    blotches = 0.5 * noise(11, SIZE, 16) + 0.5 * noise(12, SIZE, 6) + 0.3 * noise(13, SIZE, 3)
    uneven = 0.09 * blotches * (1 - masks.lip) * (1 - masks.lid)
    return (0.42 + 0.50 * broad + uneven).clip(0, 1)
