"""The head's atlas as a canvas: values of vertices painted over it, blurs, noise, pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.ndimage as ndimage
from PIL import Image
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

from elocute.head import HeadModel

COARSE = 256
"""Pixels of the grid on which values of vertices are spread before they are enlarged."""


class Canvas:
    """The skin's atlas of a head."""

    def __init__(self, head: HeadModel) -> None:
        self.head = head
        materials = [head.material_names.index(name) for name in ("skin", "lips")]
        bust = np.isin(head.quads, head.regions["bust"]).any(1)
        faces = np.isin(head.material, materials) & ~bust
        texcoords, first = np.unique(head.uv_quads[faces].ravel(), return_index=True)
        self.vertices = head.quads[faces].ravel()[first]
        self.places = head.uv[texcoords] * [1, -1] + [0, 1]
        self.millimetres = self._millimetres()

    def _millimetres(self) -> np.ndarray:
        """(vertex, 3): y from the eyes' height, z from the front of the face backwards (< 0)."""
        head = self.head
        points = head.template.astype(float) * 1000
        eyes = head.joint_positions[head.joint_names.index("eyeLeft"), 1] * 1000
        return points - [0, eyes, points[head.regions["skin"], 2].max()]

    def spread(self, values: np.ndarray, size: int) -> np.ndarray:
        """(size, size) of a value per vertex, linear between them, nearest outside."""
        at = (np.arange(COARSE) + 0.5) / COARSE
        x, y = np.meshgrid(at, at)
        own = values[self.vertices]
        grid = LinearNDInterpolator(self.places, own)(x, y)
        hole = np.isnan(grid)
        grid[hole] = NearestNDInterpolator(self.places, own)(x[hole], y[hole])
        return resized(grid, size)

    def chosen(self, chosen: np.ndarray, size: int, soft: float) -> np.ndarray:
        """(size, size) 0..1 of a set of vertices (mask), blurred by a share of the size."""
        return blurred(self.spread(chosen.astype(float), size), soft * size)


def resized(values: np.ndarray, size: int) -> np.ndarray:
    picture = Image.fromarray(values.astype(np.float32), mode="F")
    return np.asarray(picture.resize((size, size), Image.Resampling.BICUBIC), float)


def blurred(values: np.ndarray, sigma: float) -> np.ndarray:
    return ndimage.gaussian_filter(values, (sigma, sigma, 0)[: values.ndim])


def noise(seed: int, size: int, sigma: float | tuple[float, float]) -> np.ndarray:
    """(size, size) smooth noise of mean 0 and deviation 1."""
    drawn = ndimage.gaussian_filter(
        np.random.default_rng(seed).normal(size=(size, size)), sigma, mode="wrap"
    )
    return drawn / drawn.std()


def luma(colour: np.ndarray) -> np.ndarray:
    return colour @ [0.3, 0.6, 0.1]


def save(path: Path, values: np.ndarray, quality: int) -> int:
    """Write values 0..1 as WebP or JPEG by the suffix; its size in bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = Image.fromarray((values.clip(0, 1) * 255 + 0.5).astype(np.uint8))
    if path.suffix == ".webp":
        picture.save(path, quality=quality, method=6, alpha_quality=80)
    else:
        picture.save(path, quality=quality, subsampling=0)
    return path.stat().st_size
