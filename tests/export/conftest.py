"""A short take that every writer is given."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest

from elocute.animation import Animation, animate
from elocute.head.surface import Surface
from elocute.motion.motion import Motion


@pytest.fixture(scope="session")
def take(speech_wav) -> Animation:
    """The shipped example, animated at 30 fps, by the bare head."""
    return animate(speech_wav, fps=30, life=0, look="none")


@pytest.fixture(scope="session")
def motion(take):
    return take.motion


def picture(kind: str, seed: int, clear: bool = False, side: int = 32) -> bytes:
    """A small encoded picture of coloured noise; clear: with alpha from nothing to solid."""
    from PIL import Image

    rng = np.random.default_rng(seed)
    pixels = rng.integers(90, 166, (side, side, 4 if clear else 3), np.uint8)
    if clear:
        pixels[:, :, 3] = np.linspace(0, 255, side).astype(np.uint8)[:, None]
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, kind, **({"lossless": True} if kind == "WEBP" else {}))
    return file.getvalue()


@pytest.fixture(scope="session")
def dressed(motion) -> Motion:
    """The same motion of a head with images: each kind of file, each kind of opacity."""
    surfaces = {
        "skin": Surface(
            color=picture("WEBP", 1),
            normal=picture("PNG", 2),
            roughness=picture("JPEG", 3),
            tint=(0.9, 0.8, 0.7),
            roughness_factor=0.9,
            normal_scale=0.5,
        ),
        "lips": Surface(color=picture("WEBP", 1)),
        "teeth": Surface(color=picture("WEBP", 4, clear=True), opacity="cutout"),
        "hair": Surface(color=picture("WEBP", 5, clear=True), opacity="blend", both_sides=True),
    }
    return replace(motion, head=replace(motion.head, surfaces=surfaces))
