"""How far in time the lips of a prediction are from the true ones: mean temporal misalignment.

Chae-Yeon et al. 2025, "Perceptually Accurate 3D Talking Head Generation", counted as their
`evaluation/evaluate_MTM.py` does at 488a1988: the distance between the middles of both lips is
smoothed, both courses are aligned by dynamic time warping of their derivatives, and openings are
compared with openings, closures with closures, where the alignment brings them together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.motion.vertex_motion import VertexMotion

SMOOTHED_FRAMES = 2.0  # standard deviation of the Gaussian, which ends at four of it


def lip_distance(motion: VertexMotion, middles: tuple[int, int]) -> Float64Array:
    """(frame,) distance between two vertices, the middles of upper and lower lip, mm."""
    blocks = motion.blocks(np.array(middles))
    return np.concatenate([np.linalg.norm(block[:, 0] - block[:, 1], axis=1) for block in blocks])


def temporal_misalignments(predicted: Float64Array, true: Float64Array) -> NDArray[np.intp]:
    """Frames between extrema that belong together, of two courses (frame,) of the lip distance.

    There may be none. Needs Numba.
    """
    from elocute.alignment.dtw import dtw

    true, predicted = _smoothed(true), _smoothed(predicted)
    steps = [np.diff(each, prepend=each[0]) for each in (true, predicted)]
    path, _ = dtw(np.abs(steps[0][:, None] - steps[1][None, :]))
    kinds, others = extrema(true), extrema(predicted)
    places = sorted(kinds)
    before = dict(zip(places, [0, *places], strict=False))
    after = dict(zip(places, [*places[1:], len(true) - 1], strict=False))
    return np.array(
        [
            abs(at - other)
            for at, other in path.tolist()
            if at in kinds and kinds[at] == others.get(other) and before[at] <= other <= after[at]
        ],
        np.intp,
    )


def extrema(values: Float64Array) -> dict[int, int]:
    """Frames of local maxima (1) and minima (-1); of a level stretch its middle, ends left out."""
    ends = np.flatnonzero(np.diff(values))
    starts, ends = np.array([0, *(ends + 1)]), np.array([*ends, len(values) - 1])
    rises = np.sign(np.diff(values[starts])).astype(int)
    turns = np.flatnonzero(rises[:-1] != rises[1:]) + 1
    return {int(starts[k] + ends[k]) // 2: int(rises[k - 1]) for k in turns}


def _smoothed(values: Float64Array) -> Float64Array:
    """As `scipy.ndimage.gaussian_filter1d` does: the course is mirrored at both ends."""
    reach = round(4 * SMOOTHED_FRAMES)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / SMOOTHED_FRAMES) ** 2)
    padded = np.pad(values, reach, "symmetric")
    return np.asarray(np.convolve(padded, kernel / kernel.sum(), "valid"), np.float64)
