"""Makes the picture of a skin: baked skins blended by tone, age and sex, and details over them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from elocute.array_types import Float32Array, FloatArray
from elocute.head.looks import baked
from elocute.head.looks.pictures import decoded, jpeg
from elocute.head.skin_tone import skin_albedo

AGES = {"young": 24.0, "middle": 45.0, "old": 68.0}
"""Ages in years that the baked skins look."""
TONES = {"light": 0.16, "dark": 0.84}
"""Tones of the baked skins on the scale of `elocute.head.skin_tone`."""
TONE_STRENGTH = 0.85
"""How far the blend is moved to the tone's own colour."""
FLUSH, FLUSH_MEAN = (1.03, 0.64, 0.62), 0.47
"""Factors of linear red, green and blue where blood shows through the skin, and the mean of the
picture that says where it does."""
FLUSH_OF_DARK = 0.4
"""Share of the flush that is seen in the darkest skin."""
FRECKLE = (0.72, 0.50, 0.40)
STUBBLE_STRENGTH = 0.55
ROOTS_STRENGTH, ROOT_OF_HAIR, SKIN_THROUGH = 0.98, 0.28, 0.02
LEAST_SHARE = 0.02
MEAN_PLACE = (slice(480, 700), slice(300, 724))
"""Rows and columns of the atlas (1024 px) whose mean says what colour a skin is: the cheeks."""

KEPT_SKIN, KEPT_POWER = (0.235, 0.129, 0.094), (0.22, 0.36, 0.42)
"""Linear skin that is the same in other programs, and how far that of others comes to it: under
whiter lights and steeper tone curves than ours pale skin would be chalk, dark skin red."""


@lru_cache(maxsize=8)
def skin_picture(
    age: float,
    sex: float,
    tone: float,
    freckles: float,
    stubble: float,
    hair: tuple[float, ...],
    rooted: bool = True,
) -> bytes:
    """A JPEG of the head's atlas, the settings being those of `Look`, with the tone a number.

    `hair` is the linear colour of the hair, which stubble and the roots have too; `rooted` says
    whether roots of hair shade the scalp.
    """
    colour = _flushed(_blend(age, sex, tone), tone)
    strand = np.array(hair, np.float32)
    through = np.float32(SKIN_THROUGH) * colour  # black on brown skin would be blue
    for place, strength, tint in (
        ("skins/freckles", 0.75 * freckles, colour * np.array(FRECKLE, np.float32)),
        ("skins/stubble", STUBBLE_STRENGTH * stubble, through + strand),
        ("hair/roots", ROOTS_STRENGTH * rooted, through + np.float32(ROOT_OF_HAIR) * strand),
    ):
        if strength > 0:
            share = np.float32(strength) * _grey(place)[..., None]
            colour = colour ** (1 - share) * tint**share
    return jpeg(np.round(255 * _srgb(colour)).astype(np.uint8))


@lru_cache(maxsize=8)
def picture_for_engines(skin: bytes) -> bytes:
    """One of `skin_picture` as other programs are to have it, to look as it does in ours."""
    pixels, linear = decoded(skin), np.exp(_LOGS)
    factor = (np.array(KEPT_SKIN) / linear[pixels[MEAN_PLACE]].mean((0, 1))) ** KEPT_POWER
    table = np.round(255 * _srgb(linear[:, None] * factor)).astype(np.uint8)
    return jpeg(np.stack([table[pixels[..., k], k] for k in range(3)], axis=-1))


@lru_cache(maxsize=1)
def normal_picture(age: float) -> bytes:
    """The relief of the age nearest to the one that is asked for."""
    nearest = min(AGES, key=lambda name: abs(AGES[name] - age))
    return baked.picture(f"skins/normal_{nearest}")


def shares(age: float, sex: float, tone: float) -> dict[str, float]:
    """How much of each baked skin there is in a blend; they sum to one."""
    names, years = list(AGES), list(AGES.values())
    place = float(np.interp(age, years, range(len(years))))
    of_age = {name: max(0.0, 1 - abs(place - k)) for k, name in enumerate(names)}
    dark = float(np.interp(tone, list(TONES.values()), (0, 1)))
    of_tone, of_sex = {"light": 1 - dark, "dark": dark}, {"female": 1 - sex, "male": sex}
    whole = {
        f"{t}_{a}_{s}": of_tone[t] * of_age[a] * of_sex[s]
        for t in of_tone
        for a in of_age
        for s in of_sex
    }
    kept = {name: share for name, share in whole.items() if share > LEAST_SHARE}
    return {name: share / sum(kept.values()) for name, share in kept.items()}


def _blend(age: float, sex: float, tone: float) -> Float32Array:
    """(row, column, 3) linear colour: the mean of logarithms, moved to the tone's own colour."""
    blended = [np.float32(share) * _log_skin(n) for n, share in shares(age, sex, tone).items()]
    logs = np.stack(blended).sum(axis=0, dtype=np.float32)
    mean_log = logs[MEAN_PLACE].mean((0, 1))
    move = TONE_STRENGTH * (np.log(skin_albedo(tone)) - mean_log)
    return np.exp(logs + move).astype(np.float32)


def _flushed(colour: Float32Array, tone: float) -> Float32Array:
    """Redder where blood shows through, paler elsewhere."""
    seen = 1 - (1 - FLUSH_OF_DARK) * tone
    share = np.float32(seen) * (_grey("skins/flush")[..., None] - np.float32(FLUSH_MEAN))
    return np.exp(np.log(np.array(FLUSH, np.float32)) * share) * colour


def _log_skin(name: str) -> Float32Array:
    return _LOGS[decoded(baked.picture(f"skins/{name}"))]


def _grey(place: str) -> Float32Array:
    return (decoded(baked.picture(place))[..., 0] / 255).astype(np.float32)


def _logs() -> Float32Array:
    srgb = np.maximum(np.arange(256) / 255, 1 / 255)
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return np.log(linear).astype(np.float32)


_LOGS = _logs()
"""Logarithm of linear light by byte."""


def _srgb(linear: FloatArray) -> Float32Array:
    linear = np.clip(linear, 0, 1)
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return srgb.astype(np.float32)
