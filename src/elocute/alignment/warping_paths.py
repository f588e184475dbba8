"""Warping paths from attention and from paths of pairs, and attention from a path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from elocute.alignment.alignment import WarpingPath
from elocute.alignment.dtw import dtw
from elocute.array_types import Float32Array

PROBABILITY_MIN = 1e-8


def attention_path(
    attention: NDArray[np.floating], band: float | None = None, open_source: bool = False
) -> WarpingPath:
    """The most probable monotone path (step, 2): the cheapest through -log attention."""
    return dtw(-np.log(np.maximum(attention, PROBABILITY_MIN)), band, open_source)[0]


def expected_path(
    expected: NDArray[np.floating], band: float | None = None, open_source: bool = False
) -> WarpingPath:
    """The monotone path nearest to where frames are expected, each seen from the other view.

    expected: (source, target) how often each cell is passed. The mean source of each target frame
    and the mean target of each source frame are two curves, free of steps that a single best path
    makes where frames are alike; the path that has the least squares from both is taken.
    """
    weights = np.maximum(np.asarray(expected, np.float64), PROBABILITY_MIN)
    sources, targets = (np.arange(size) for size in weights.shape)
    source_of = sources @ weights / weights.sum(axis=0)
    target_of = weights @ targets / weights.sum(axis=1)
    # With open ends most source frames belong to no target frame, and must weigh nothing.
    weight = np.minimum(expected.sum(axis=1), 1.0)
    off = (sources[:, None] - source_of) ** 2 + weight[:, None] * (
        targets - target_of[:, None]
    ) ** 2
    return dtw(off, band, open_source)[0]


def path_attention(path: WarpingPath, sources: int, targets: int) -> Float32Array:
    """(source frame, target frame): each target frame looks evenly at the sources it is with."""
    weights = np.zeros((sources, targets), np.float32)
    weights[path[:, 0], path[:, 1]] = 1
    return weights / np.maximum(weights.sum(axis=0), 1)


def diagonal_path(sources: int, targets: int) -> WarpingPath:
    """Frames matched in proportion, the baseline of every method."""
    count = max(sources, targets)
    return np.stack(
        [np.round(np.linspace(0, length - 1, count)) for length in (sources, targets)], axis=1
    ).astype(np.intp)


def merge_paths(paths: Sequence[WarpingPath], frames: int) -> WarpingPath:
    """Paths (step, 2) of several views against one reference of so many frames, as one.

    Columns are the views in their order, the reference last. While the reference stays at a frame,
    the other views advance together, shorter runs spread over the longest.
    """
    rows = []
    edges = [np.searchsorted(path[:, 1], np.arange(frames + 1)) for path in paths]
    for frame in range(frames):
        runs = [
            path[edge[frame] : edge[frame + 1], 0] for path, edge in zip(paths, edges, strict=True)
        ]
        count = max(map(len, runs))
        spread = [run[np.arange(count) * len(run) // count] for run in runs]
        rows.append(np.stack([*spread, np.full(count, frame)], axis=1))
    return np.concatenate(rows).astype(np.intp)
