"""Correspondences: which point of a scan belongs to which point of the template's surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.one_line_repr import one_line
from elocute.registration.scan import Scan
from elocute.registration.template import Template

ON_EDGE = 1e-6


@dataclass(frozen=True, eq=False)
class ScanSamples:
    """Points (sample, 3) m of a scan that take part in a fit, with unit normals.

    areas: (sample,) m² of the surface that each stands for.
    """

    points: Float64Array
    normals: Float64Array
    areas: Float64Array

    def subset(self, count: int, seed: int = 0) -> ScanSamples:
        """At most `count` of them, evenly spread by area."""
        if count >= len(self.points):
            return self
        share = self.areas / self.areas.sum()
        # Even steps through the summed areas, after a shuffle: no two draws fall together.
        order = np.random.default_rng(seed).permutation(len(share))
        steps = (np.arange(count) + 0.5) / count
        chosen = order[np.searchsorted(np.cumsum(share[order]), steps).clip(0, len(order) - 1)]
        chosen = np.unique(chosen)
        areas = np.full(len(chosen), self.areas.sum() / len(chosen))
        return ScanSamples(self.points[chosen], self.normals[chosen], areas)


def sample_scan(scan: Scan) -> ScanSamples:
    """All points of a scan except those on the rims of its holes, whose normals are unreliable."""
    kept = ~scan.boundary
    return ScanSamples(scan.points[kept], scan.normals[kept], scan.areas[kept])


@dataclass(frozen=True, eq=False)
class Correspondences:
    """Samples and where they lie on the template.

    sample, triangle: (match,) indices into the samples and the template's triangles. bary: (match,
    3) barycentric coordinates in that triangle. normals: (match, 3) of the template's triangles.
    gap: (match,) m, signed distance from surface to sample along the normal.
    """

    sample: NDArray[np.intp]
    triangle: NDArray[np.intp]
    bary: Float64Array
    normals: Float64Array
    gap: Float64Array

    __repr__ = one_line


def find_correspondences(
    template: Template,
    vertices: Float64Array,
    samples: ScanSamples,
    *,
    reach_m: float,
    facing: float,
    near: int = 2,
) -> Correspondences:
    """The closest point of a surface for each sample that has one.

    Refused are samples further away than reach_m, samples whose normal disagrees with the surface's
    (a cosine below `facing`), and those closest to the template's own rim (Amberg et al. 2007,
    4.3). vertices: (vertex, 3) m, the template's present shape, in the samples' frame. near:
    candidate triangles for each sample.
    """
    nearest = template.surface(vertices).closest(samples.points, reach_m, near)
    a, b, c = (vertices[template.triangles[nearest.triangle, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    kept = np.isfinite(nearest.squared) & (nearest.squared <= reach_m**2)
    kept &= np.einsum("ij,ij->i", normals, samples.normals) > facing
    on_edge = (nearest.bary < ON_EDGE) & template.rim[nearest.triangle]
    kept &= ~on_edge.any(axis=1)
    rows = np.flatnonzero(kept)
    gap = np.einsum("ij,ij->i", normals[rows], samples.points[rows] - nearest.points[rows])
    return Correspondences(rows, nearest.triangle[rows], nearest.bary[rows], normals[rows], gap)


def robust_weights(gap: Float64Array, smallest_m: float) -> Float64Array:
    """(match,) 0 to 1 by Geman and McClure's rule, its scale from the median of |gap|."""
    if not len(gap):
        return gap
    scale = max(2.5 * 1.4826 * float(np.median(np.abs(gap))), smallest_m)
    return 1 / (1 + (gap / scale) ** 2) ** 2
