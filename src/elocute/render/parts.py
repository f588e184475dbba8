"""Splits a head for drawing: vertices split at seams of images, a part per material."""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, FloatArray
from elocute.errors import HeadError, InputError
from elocute.head.folds import SETS, ZONES_OF_SET
from elocute.head.looks.folds import folds_of
from elocute.head.model import HeadModel
from elocute.head.mouth_opening import mouth_opening, openness
from elocute.head.normals import vertex_normals
from elocute.head.surface import IMAGES, Surface
from elocute.meshes.mesh_file import PICTURE_FORMATS, check_picture
from elocute.numerics.image_sampling import bilinear
from elocute.render.lights import Rig
from elocute.render.shading import FINISHES, FOLD_STEP, Finish, finish_of, to_linear

Pixels = NDArray[np.uint8]
_LINEAR = to_linear(np.arange(256, dtype=np.float32) / 255)


@dataclass(frozen=True)
class Image:
    """A decoded image."""

    pixels: NDArray[np.uint8]  # (height, width, 4) uint8: as stored, the top row first
    srgb: bool  # whether red, green and blue are sRGB, not linear

    @cached_property
    def levels(self) -> list[Float32Array]:
        """(height, width, 4) linear 0…1, bottom row first; each level half as large."""
        scale = np.full((4, 256), np.arange(256) / 255, np.float32)
        if self.srgb:
            scale[:3] = _LINEAR
        level = np.stack([scale[c][self.pixels[::-1, :, c]] for c in range(4)], axis=2)
        levels = [level]
        while min(level.shape[:2]) > 1:
            high, wide = (side // 2 * 2 for side in level.shape[:2])
            even = level[:high, :wide].reshape(high // 2, 2, wide // 2, 2, 4)
            levels.append(level := even.mean(axis=(1, 3)))
        return levels

    def texels(self, at: FloatArray, level: int = 0) -> Float32Array:
        """(point, 4) linear values at texture coordinates (point, 2), between four texels."""
        image = self.levels[min(max(level, 0), len(self.levels) - 1)]
        return bilinear(image, at)

    def at_density(self, at: FloatArray, density: FloatArray) -> Float32Array:
        """As `texels`, from levels at which a texel is about a pixel.

        density (point,) is how far texture coordinates go in a pixel.
        """
        side = max(self.pixels.shape[:2])
        levels = np.log2(np.maximum(density * side, 1)).round().astype(np.int32)
        levels = np.minimum(levels, len(self.levels) - 1)
        out = np.empty((len(at), 4), np.float32)
        for level in np.unique(levels):
            chosen = levels == level
            out[chosen] = self.texels(at[chosen], level)
        return out


def open_pixels(data: bytes, what: str | Path, side_max: int, error: type[InputError]) -> Pixels:
    """Pixels of a PNG, JPEG or WebP file; its size is checked before memory is taken.

    what: what messages call it; side_max: a larger image is reduced to this many pixels on its
    longer side. Raises an `error` for what is no image or too large a one.

    Returns
    -------
    (height, width, 4) uint8
    """
    from PIL import Image as Pillow

    wide, high = check_picture(data, what, error)
    try:
        with Pillow.open(io.BytesIO(data), formats=PICTURE_FORMATS) as image:
            bands = image.convert("RGBA").split()
    except Exception as problem:  # Pillow's parsers raise of every kind
        raise error.about(what, found="a broken picture", allowed="a whole one") from problem
    largest = max(wide, high)
    if largest > side_max:
        # Each band by itself: Pillow would turn what is clear black, and fringes with it.
        size = (max(1, wide * side_max // largest), max(1, high * side_max // largest))
        bands = [band.resize(size, Pillow.Resampling.BOX) for band in bands]
    return np.stack([np.asarray(band) for band in bands], axis=2)


TWO_SIDED = ("eyeball", "teeth", "hair")  # without a surface that says it
ENCLOSED = 0.5  # share of the surrounding light that comes to what is in the mouth, at most
CORES = {"opaque": 0.0, "cutout": 0.5, "blend": 0.8, "sheer": 2.0}
"""By its opacity: the alpha from which a surface hides what lies behind it."""
EXPOSED_AS = 0.36  # mean linear colour of skin that the lights are set for
EXPOSURE_POWER = 0.38  # how far a photographer follows the tone of the skin
EXPOSURE_RANGE = (0.9, 1.75)


@dataclass(frozen=True)
class Part:
    """The faces of one material."""

    name: str
    triangles: NDArray[np.int32]  # (triangle, 3) indices into the split vertices
    finish: Finish  # how light meets it
    surface: Surface  # its settings; the images are decoded below
    color: Image | None  # decoded; None where the surface has none
    normal: Image | None
    roughness: Image | None
    folds: Image | None

    @property
    def solid(self) -> bool:
        return self.surface.opacity == "opaque"

    @property
    def fades(self) -> bool:
        """Whether what is seen edge-on fades: cards of our own heads, not shells of others."""
        return not (self.solid or self.surface.finish)

    @property
    def repeats(self) -> bool:
        """Whether its images go on beyond their edges: roots of strands would show behind tips."""
        return bool(self.surface.finish) or not self.surface.fringed

    @property
    def rough(self) -> float:
        """Factor of the roughness: under a clear coat, that of what lies below it."""
        return self.finish.roughness if self.finish.coat else self.surface.roughness_factor

    @property
    def rounded(self) -> bool:
        """Whether it is hair in cards, whose normals are taken half from a ball."""
        return self.name.startswith("hair") and not self.solid

    @property
    def turns(self) -> bool:
        """Whether its normals turn towards the eye."""
        return self.surface.both_sides and not self.rounded

    @property
    def casts(self) -> bool:
        """Whether it casts shadows: not what is inside the head, nor brows and lashes."""
        if self.solid or self.surface.finish:
            return self.finish.ambient > ENCLOSED and self.surface.opacity != "sheer"
        return self.rounded

    @property
    def inside(self) -> bool:
        """Whether it is in the mouth, where lips keep light from it."""
        return self.solid and self.finish.ambient <= ENCLOSED

    @property
    def core(self) -> float:
        """The alpha from which it hides what lies behind: 0 for all of it, 2 for none."""
        return CORES[self.surface.opacity]

    @property
    def fringe_gain(self) -> float:
        """Factor of a fringe's alpha: it is full where the core begins, or that would show."""
        return 1 / min(self.core, 1.0) if self.surface.fringed else 1.0

    def fold_heights(
        self, strong: Float32Array, at: Float32Array, density: Float32Array
    ) -> Float32Array:
        """(point, 3) heights of folds: here, `FOLD_STEP` to the right, and as much above.

        strong (point, set); at (point, 2) and density (point,) as `Image.at_density` takes them.
        """
        assert self.folds is not None
        folded = np.flatnonzero(strong.sum(axis=1) > 0)
        heights = np.zeros((len(at), 3), np.float32)
        finer = strong[folded, :1] * np.float32(self.surface.fold_lines)
        deep = np.concatenate([strong[folded], finer], axis=1)
        for column, way in enumerate(((0, 0), (1, 0), (0, 1))):
            beside = at[folded] + np.float32(FOLD_STEP) * np.array(way, np.float32)
            texel = self.folds.at_density(beside, density[folded])[:, :3]
            heights[folded, column] = ((texel * 2 - 1) * deep).sum(axis=1)
        return heights


class Parts:
    """All that stays the same while a head moves; images of at most `side_max` pixels a side."""

    def __init__(self, head: HeadModel, side_max: int = 1024) -> None:
        self._head = head
        pairs = np.stack([head.triangles.ravel(), head.uv_triangles.ravel()], axis=1)
        unique, corners = np.unique(pairs, axis=0, return_inverse=True)
        self.source: NDArray[np.intp] = unique[:, 0].astype(np.intp)
        """(split,) the vertex of the head that each split vertex is."""
        self.at: Float32Array = np.ascontiguousarray(head.uv[unique[:, 1]], np.float32)
        """(split, 2) texture coordinates."""
        self.color: Float32Array = to_linear(head.vertex_color[self.source] / np.float32(255))
        """(split, 3) linear vertex colours."""
        self.occlusion: Float32Array = head.occlusion[self.source].astype(np.float32)
        """(split,) 1 = open to the light."""
        triangles = corners.reshape(-1, 3).astype(np.int32)
        self.parts: list[Part] = []
        """One for each material that has faces, in their order."""
        for index, name in enumerate(head.material_names):
            chosen = triangles[head.triangle_material == index]
            if len(chosen):
                self.parts.append(_part(head, name, chosen, side_max))
        self._folds = folds_of(head)
        self.fold_masks: NDArray[np.uint8] | None = None
        """(split, zone) of `elocute.head.folds`; None for a head that has none."""
        if self._folds is not None:
            self.fold_masks = self._folds.masks_at(self.source)
        self._hair = self._rounded_vertices()
        self.strand: Float32Array = strands(head)[self.source]
        """(split, 3) unit directions of hair, at rest; zero elsewhere."""

    def _rounded_vertices(self) -> NDArray[np.intp]:
        """Vertices of the head whose normals are rounded."""
        chosen = [part for part in self.parts if part.rounded]
        if not chosen:
            return np.zeros(0, np.intp)
        return np.unique(self.source[np.concatenate([p.triangles for p in chosen])])

    def moved(self, points: FloatArray) -> Float32Array:
        """(split, 6) places and unit normals of vertices (vertex, 3) m."""
        normals = vertex_normals(points, self._head.triangles)
        if len(self._hair):
            places, own = (np.take(each, self._hair, axis=0) for each in (points, normals))
            normals[self._hair] = rounded_normals(places, own)
        moved = np.concatenate([points, normals], axis=1).astype(np.float32, copy=False)
        return np.take(moved, self.source, axis=0)

    def fold_strengths(self, points: FloatArray) -> Float32Array:
        """(zone,) how strong the folds are on vertices (vertex, 3) m."""
        assert self._folds is not None
        depth = max(part.surface.fold_depth for part in self.parts if part.folds is not None)
        return self._folds.strengths(self._head.template, points) * np.float32(depth)

    def folded(self, points: FloatArray) -> Float32Array:
        """(split, set) how strong the folds of each set are at split vertices."""
        assert self.fold_masks is not None
        zones = self.fold_masks.astype(np.float32) / 255 * self.fold_strengths(points)
        return zones.reshape(-1, SETS, ZONES_OF_SET).sum(axis=2)

    def opening(self, points: FloatArray) -> Float32Array:
        """(3, 4) the opening of the lips on vertices (vertex, 3) m, as `mouth_opening` has it."""
        return mouth_opening(self._head, points)

    def openness(self, points: FloatArray) -> Float32Array:
        """(split, 1) how open split vertices in the mouth are to the room, 1 for all others."""
        open_ = np.ones((len(self.source), 1), np.float32)
        inner = [part.triangles.ravel() for part in self.parts if part.inside]
        if inner:
            chosen = np.unique(np.concatenate(inner))
            open_[chosen] = openness(self.opening(points), points[self.source[chosen]])
        return open_

    @cached_property
    def skin_color(self) -> float:
        """Mean linear colour (green) of the face, images counted."""
        for part in self.parts:
            if part.finish is FINISHES["skin"]:
                corners = part.triangles.ravel()
                return mean_skin(self.color[corners], self.at[corners], part.surface, part.color)
        return EXPOSED_AS

    def exposure(self, rig: Rig) -> float:
        """The factor of light before the tone curve: darker skin is exposed for longer."""
        return rig.exposure * exposure_of(self.skin_color)


def mean_skin(colors: FloatArray, at: FloatArray, surface: Surface, image: Image | None) -> float:
    """Mean linear colour (green) of skin with vertex colours (corner, 3) at places (corner, 2)."""
    green = colors[:, 1] if image is None else colors[:, 1] * image.texels(at)[:, 1]
    return float(green.mean()) * surface.tint[1]


def exposure_of(skin_color: float) -> float:
    """How long skin of a mean linear colour (green) is exposed, by what lights are set for."""
    factor = (EXPOSED_AS / max(skin_color, 1e-3)) ** EXPOSURE_POWER
    return float(np.clip(factor, *EXPOSURE_RANGE))


def strands(head: HeadModel) -> Float32Array:
    """Unit directions (vertex, 3) of hair at rest; zero elsewhere.

    Where the second texture coordinate grows, the mean of the triangles round a vertex.
    """
    sums = np.zeros((len(head.template), 3))
    for index, name in enumerate(head.material_names):
        if not finish_of(name).strand:
            continue
        chosen = head.triangle_material == index
        triangles = head.triangles[chosen]
        a, b, c = head.template[triangles.T]
        at, one, two = head.uv[head.uv_triangles[chosen].T]
        edge, other, one, two = b - a, c - a, one - at, two - at
        turned = np.sign(one[:, :1] * two[:, 1:] - two[:, :1] * one[:, 1:])
        along = (other * one[:, :1] - edge * two[:, :1]) * turned
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
        np.add.at(sums, triangles, along[:, None])
    sums /= np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-12)
    return sums.astype(np.float32)


def rounded_normals(places: FloatArray, normals: FloatArray) -> FloatArray:
    """Unit normals (n, 3) of cards of hair at places (n, 3), half of them a ball's: by their own
    cards look crumpled."""
    away = places - np.full(len(places), 1 / len(places), places.dtype) @ places
    away *= 0.6 / np.maximum(np.sqrt(_dots(away, away)), 1e-9)[:, None]
    both = away + normals * np.where(_dots(normals, away) < 0, -0.4, 0.4)[:, None]
    return both / np.sqrt(_dots(both, both))[:, None]


def _dots(one: FloatArray, other: FloatArray) -> FloatArray:
    """(n,) products of rows (n, 3)."""
    return np.einsum("nc,nc->n", one, other)


def _part(head: HeadModel, name: str, triangles: NDArray[np.int32], side_max: int) -> Part:
    surface = head.surfaces.get(name)
    own = surface is not None and surface.finish
    finish = FINISHES[own] if own else finish_of(name)
    if surface is None:
        surface = Surface(
            roughness_factor=finish.roughness, both_sides=name in TWO_SIDED, normal_scale=0.0
        )
    images = {
        kind: Image(open_pixels(data, f"{kind} of {name}", side_max, HeadError), kind == "color")
        for kind in IMAGES
        if (data := getattr(surface, kind))
    }
    return Part(
        name,
        np.ascontiguousarray(triangles),
        finish,
        surface,
        images.get("color"),
        images.get("normal"),
        images.get("roughness"),
        images.get("folds"),
    )
