"""PolygonMesh: what an .obj, .ply or .stl says, before its materials and pictures are found."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError

DENT = 0.1
"""Sine of the turn inwards from which on a polygon is not cut from its first corner: faces of a
moving head bend by less, and keep the triangles of its other frames."""
CUTS_MAX = 100_000
"""Of trials, of which a polygon takes the square of its corners."""
UNIT_TOP, BYTE_TOP, WORD_TOP = 2.0, 255.5, 65535.0
"""Colours up to the first are shares of 1, which some programs overshoot; then bytes, words."""
BRIGHT_SHARE = 0.99
"""Of the values, which tell what a colour counts to: a single one may be wrong."""


@dataclass(frozen=True, eq=False)
class PolygonMesh:
    """Polygons in the order of a file."""

    vertices: NDArray[np.float64]  # (vertex, 3) in the file's unit
    colors: NDArray[np.uint8] | None  # (vertex, 3) sRGB
    # (corner,) vertices of the polygons, one polygon after the other; all of them are there
    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]  # (face,) corners of each polygon
    uv: NDArray[np.float64]  # (place, 2) places in a picture, v upwards
    places: NDArray[np.int64]  # (corner,) rows of `uv`; -1 for a corner without one
    materials: NDArray[np.int64]  # (face,) rows of `material_names`; -1 for a face without one
    # names in material files; of a .ply, the names of pictures
    material_names: tuple[str, ...] = ()
    libraries: tuple[str, ...] = ()  # what the file names as its material files

    @property
    def triangles(self) -> NDArray[np.int64]:
        """(triangle, 3) vertices."""
        return self.corners[self.fan()[0]]

    def fan(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Triangles as rows of `corners` (triangle, 3), and the face of each (triangle,).

        A polygon is cut from its first corner, one that has a corner turned inwards so that its
        triangles cover it; one of two corners or fewer has no triangle.
        """
        counts = np.maximum(self.sizes - 2, 0)
        starts, ends = np.cumsum(self.sizes) - self.sizes, np.cumsum(counts)
        face = np.repeat(np.arange(len(counts)), counts)
        step = np.arange(len(face)) - np.repeat(ends - counts, counts)
        offsets = np.stack([np.zeros_like(step), step + 1, step + 2], axis=1)
        for one in self._dented():
            places = self.vertices[self.corners[starts[one] : starts[one] + self.sizes[one]]]
            offsets[ends[one] - counts[one] : ends[one]] = _ears(places)
        return np.repeat(starts, counts)[:, None] + offsets, face

    def _dented(self) -> NDArray[np.int64]:
        """Faces of which a corner is turned inwards, as many as are cut in a few seconds."""
        faces = np.flatnonzero(self.sizes > 3)
        sizes = self.sizes[faces]
        ends = np.cumsum(sizes)
        face = np.repeat(np.arange(len(faces)), sizes)
        within = np.arange(len(face)) - (ends - sizes)[face]
        starts = (np.cumsum(self.sizes) - self.sizes)[faces][face]
        before, here, after = (
            self.vertices[self.corners[starts + (within + step) % sizes[face]]]
            for step in (-1, 0, 1)
        )
        turn = np.cross(here - before, after - here)
        first = self.vertices[self.corners[starts]]
        areas = np.cross(here - first, after - first)
        normal = np.stack([np.bincount(face, areas[:, n], len(faces)) for n in range(3)], axis=1)
        inwards = (turn * normal[face]).sum(axis=1)
        least = np.linalg.norm(here - before, axis=1) * np.linalg.norm(after - here, axis=1)
        dents = inwards < -DENT * least * np.linalg.norm(normal[face], axis=1)
        dented = faces[np.unique(face[dents])]
        return dented[np.cumsum(self.sizes[dented] ** 2) <= CUTS_MAX]

    def quads(self) -> NDArray[np.int64]:
        """(face, 4) vertices of polygons; triangles repeat their last. Where there are larger
        ones, all are triangles."""
        if (self.sizes > 4).any():
            return self.triangles[:, [0, 1, 2, 2]]
        starts = np.cumsum(self.sizes) - self.sizes
        whole = self.sizes > 2
        last = np.minimum(np.arange(4), self.sizes[whole, None] - 1)
        return self.corners[starts[whole, None] + last]


def _ears(places: NDArray[np.float64]) -> list[tuple[int, int, int]]:
    """Triangles of one polygon (corner, 3): one after the other those of three corners in a row
    that turn outwards and have no other corner between them."""
    normal = np.cross(places - places[0], np.roll(places, -1, axis=0) - places[0]).sum(axis=0)
    left, triangles = list(range(len(places))), list[tuple[int, int, int]]()

    def turn(a: Any, b: Any, c: Any) -> Any:
        return np.cross(places[b] - places[a], places[c] - places[b]) @ normal

    def is_ear(at: int) -> bool:
        ear = left[at - 1], left[at], left[(at + 1) % len(left)]
        apart = (places[left][:, None] != places[list(ear)]).any(axis=2).all(axis=1)
        others = np.array(left)[apart]
        sides = [turn(a, b, others) >= 0 for a, b in pairwise((*ear, ear[0]))]
        return bool(turn(*ear) > 0 and not np.all(sides, axis=0).any())

    while len(left) > 3:
        at = next(filter(is_ear, range(len(left))), None)
        if at is None:
            break
        triangles.append((left[at - 1], left[at], left[(at + 1) % len(left)]))
        del left[at]
    return triangles + [(left[0], b, c) for b, c in pairwise(left[1:])]


def checked_mesh(
    mesh: PolygonMesh, path: Path, error: type[InputError], cloud: bool = False
) -> PolygonMesh:
    """The mesh, once it has triangles, all of whose corners are there; `places` that are not become
    -1.

    Raises an `error` for a cloud of points, unless it may be one, and for corners past the
    vertices.
    """
    count, corners = len(mesh.vertices), mesh.corners
    if not count or not (cloud or (mesh.sizes > 2).any()):
        found = f"{count} points without triangles" if count else "no vertices"
        remedy = "make a surface of them first (MeshLab: screened Poisson)" if count else ""
        raise error.about(path, found=found, allowed="a mesh of triangles", remedy=remedy)
    if corners.size and not 0 <= corners.min() <= corners.max() < count:
        raise error.about(
            path, found=f"faces that point past {count} vertices", allowed="a whole mesh"
        )
    mesh.places[(mesh.places >= len(mesh.uv)) | (mesh.places < 0)] = -1
    return mesh


def color_bytes(values: NDArray[Any], kind: str) -> NDArray[np.uint8]:
    """Colours (row, 3) as bytes, from numbers that count to 1, 255 or 65,535; black where not
    finite.

    kind: NumPy's letter and size of the numbers as declared: "u1" counts to 255, "f4" mostly to 1.
    """
    shares = np.nan_to_num(np.asarray(values, np.float64), posinf=0, neginf=0)
    if kind in ("u1", "i1"):  # where a signed byte is declared, an unsigned one is meant
        return np.where(shares < 0, shares + 256, shares).clip(0, 255).astype(np.uint8)
    bright = float(np.quantile(shares, BRIGHT_SHARE)) if shares.size else 0.0
    if kind[0] == "f" and bright <= UNIT_TOP:
        top = 1.0
    else:
        top = 255.0 if bright <= BYTE_TOP else max(WORD_TOP, float(bright))
    return np.round(255 / top * np.clip(shares, 0, top)).astype(np.uint8)
