"""Scan: one raw triangle mesh of a head, as a scanner gives it, and what stands out of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.corpus.length_units import HEIGHT_RANGE_M, fitting_unit, is_head_sized, longest_side
from elocute.errors import CaptureError
from elocute.head.normals import vertex_normals
from elocute.one_line_repr import one_line

POINTS_RANGE = (500, 4_000_000)
WINDING_POINTS = 2_000
SOUP_SHARE = 0.5
"""A scan with fewer different places than this share of its points has them apart by triangle."""
STRAY_SHARE = 0.001
"""A separate part with a smaller share of the points than this is removed."""


@dataclass(frozen=True, eq=False)
class Scan:
    """A triangle mesh of unknown topology: holes, noise and stray parts are normal.

    Attributes
    ----------
    points
        (point, 3) float64 m, +Y roughly up where there are no landmarks.
    triangles
        (triangle, 3) int32.
    colors
        (point, 3) uint8 sRGB, or None for a scan without texture.
    """

    name: str
    points: Float64Array
    triangles: NDArray[np.int32]
    colors: NDArray[np.uint8] | None = None
    unit_m: float = 1.0
    """Metres in the unit that the file was taken to be in."""

    __repr__ = one_line

    @cached_property
    def normals(self) -> Float64Array:
        """(point, 3) unit normals, triangles weighted by area."""
        return vertex_normals(self.points, self.triangles).astype(np.float64)

    @cached_property
    def boundary(self) -> NDArray[np.bool_]:
        """(point,) whether it lies on the rim of a hole, where closest points mean little."""
        count = len(self.points)
        start = self.triangles.astype(np.int64).ravel()
        stop = np.roll(self.triangles, -1, axis=1).astype(np.int64).ravel()
        keys = np.sort(np.minimum(start, stop) * count + np.maximum(start, stop))
        first = np.concatenate([[True], keys[1:] != keys[:-1]])
        places = np.flatnonzero(first)
        single = keys[places[np.diff(np.append(places, len(keys))) == 1]]
        on_rim = np.zeros(count, bool)
        on_rim[single // count] = True
        on_rim[single % count] = True
        return on_rim

    @cached_property
    def areas(self) -> Float64Array:
        """(point,) m²: a third of the triangles around each point."""
        a, b, c = (self.points[self.triangles[:, corner]] for corner in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6
        return np.bincount(
            self.triangles.ravel(), np.repeat(area, 3), minlength=len(self.points)
        ).astype(np.float64)


def checked_scan(scan: Scan) -> tuple[Scan, tuple[str, ...]]:
    """A scan fit for registration, and notes on what was removed.

    Points that are not finite, triangles without area, points without triangle and small stray
    parts are removed; triangles that are wound inside out are turned. Raises CaptureError for a
    scan that holds no head: too few points, a single plane, or a size that is no head's in metres
    (the unit that fits is named).
    """
    notes = []
    points, triangles, colors = welded(scan.points, scan.triangles, scan.colors)
    if len(points) < SOUP_SHARE * len(
        scan.points
    ):  # of programs that write one triangle after the other
        notes.append("points of its triangles were apart, and were joined")
        scan = replace(scan, points=points, triangles=triangles, colors=colors)
    finite = np.asarray(np.isfinite(scan.points).all(axis=1), bool)
    if not finite.all():
        notes.append(f"{(~finite).sum()} points were not finite")
    kept = finite[scan.triangles].all(axis=1)
    a, b, c = scan.triangles.T
    kept &= (a != b) & (b != c) & (c != a)
    scan = _without_points(replace(scan, triangles=scan.triangles[kept]))
    _check_count(scan)
    part = _largest_parts(scan)
    if not part.all():
        notes.append(f"{(~part).sum()} points in stray parts")
        scan = _without_points(replace(scan, triangles=scan.triangles[part[scan.triangles[:, 0]]]))
        _check_count(scan)
    _check_size(scan)
    if _inside_out(scan):
        notes.append("its triangles were wound inside out")
        scan = replace(scan, triangles=scan.triangles[:, ::-1].copy())
    return scan, tuple(notes)


def _inside_out(scan: Scan) -> bool:
    """Whether what stands out goes against the normals: a head is hollow nowhere for long."""
    some = np.random.default_rng(0).permutation(len(scan.points))[:WINDING_POINTS]
    away = protrusions(scan.points[some])
    return bool(np.einsum("ij,ij->", away, scan.normals[some]) < 0)


def _without_points(scan: Scan) -> Scan:
    """The scan without points that no triangle uses."""
    used = np.zeros(len(scan.points), bool)
    used[scan.triangles] = True
    if used.all():
        return scan
    places = np.cumsum(used) - 1
    colors = None if scan.colors is None else scan.colors[used]
    triangles = places[scan.triangles].astype(np.int32)
    return Scan(scan.name, scan.points[used], triangles, colors, scan.unit_m)


def _largest_parts(scan: Scan) -> NDArray[np.bool_]:
    """(point,) whether it belongs to a connected part of some size."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    count = len(scan.points)
    a, b, c = scan.triangles.T
    ones = np.ones(2 * len(a), np.int8)
    links = coo_matrix((ones, (np.r_[a, b], np.r_[b, c])), (count, count))
    _, label = connected_components(links, directed=False)
    sizes = np.bincount(label)
    large = sizes >= min(STRAY_SHARE * count, int(sizes.max()))
    return np.asarray(large, bool)[label]


def _check_count(scan: Scan) -> None:
    low, high = POINTS_RANGE
    if not low <= len(scan.points) <= high:
        raise CaptureError.about(
            scan.name,
            found=f"{len(scan.points)} usable points",
            allowed=f"a mesh of {low} to {high} points with triangles",
        )


def _check_size(scan: Scan) -> None:
    size = longest_side(scan.points)
    if is_head_sized(size):
        if np.linalg.svd(scan.points[::101] - scan.points.mean(axis=0))[1][2] < 1e-6:
            raise CaptureError.about(scan.name, found="a flat plane", allowed="a scan of a head")
        return
    raw = size / scan.unit_m
    unit = "m" if is_head_sized(raw) else fitting_unit(raw)
    remedy = f"it looks like {unit}: say `unit` {unit}" if unit else ""
    low, high = HEIGHT_RANGE_M
    raise CaptureError.about(
        scan.name, found=f"a size of {size:.4g} m", allowed=f"{low} to {high} m", remedy=remedy
    )


def welded(
    points: NDArray[np.float64], faces: NDArray[np.integer], colors: NDArray[np.uint8] | None
) -> tuple[NDArray[np.float64], NDArray[np.integer], NDArray[np.uint8] | None]:
    """Points (point, 3), triangles and mean colours, where points at the same place are one."""
    first, place = _same_places(points)
    if colors is not None:
        count = np.bincount(place)
        total = [np.bincount(place, band) for band in colors.T.astype(np.float64)]
        colors = np.round(np.stack(total, axis=1) / count[:, None]).astype(np.uint8)
    return points[first], place[faces], colors


def _same_places(
    points: NDArray[np.floating],
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Points that a seam of the texture doubled, found again by their bytes."""
    raw = np.ascontiguousarray(points, np.float64).view(np.dtype((np.void, 24))).ravel()
    _, first, place = np.unique(raw, return_index=True, return_inverse=True)
    order = np.argsort(first)  # as they come in the file
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[place.ravel()]


NEIGHBOURHOOD_M = 0.025
"""About the size of a nose: what protrudes from so much is one."""


def protrusions(points: Float64Array, radius_m: float = NEIGHBOURHOOD_M) -> Float64Array:
    """(point, 3) m from the middle of each point's neighbourhood to the point itself."""
    from scipy.spatial import KDTree

    tree = KDTree(points)
    pairs = tree.query_pairs(radius_m, output_type="ndarray")
    total, number = points.copy(), np.ones(len(points))
    for here, there in (pairs.T, pairs.T[::-1]):
        number += np.bincount(here, minlength=len(points))
        for axis in range(3):
            total[:, axis] += np.bincount(here, points[there, axis], minlength=len(points))
    return points - total / number[:, None]
