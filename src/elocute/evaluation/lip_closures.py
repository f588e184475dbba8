"""Lip closures of a recorded mouth, and whether a predicted mouth makes them.

A closure is a short stretch in which the inner lips touch, open before and after, as on p, b and
m. Where the mouth stays shut for longer it rests, and rests are not counted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.articulation.contacts_and_rest import REST_AFTER_S
from elocute.errors import CorpusError
from elocute.head.builtin import load_builtin_head
from elocute.motion.vertex_motion import VertexMotion

CLOSED_MM = 0.5  # inner-lip gap below which nobody sees an opening
TOLERANCE_S = 0.040  # a closure this early or late is still met
FrameRun = tuple[int, int]


@dataclass(frozen=True)
class ClosureCounts:
    """Closures of one clip or more.

    wanted: of the true mouth. met: those during which the predicted lips touch. made: of the
    predicted mouth. right: those during which the true lips touch.
    """

    wanted: int
    met: int
    made: int
    right: int


def lip_opening(motion: VertexMotion) -> Float64Array:
    """Mean gap between the inner lips over the middle third of the mouth, as in `measure_mouth`.

    Returns
    -------
    (frame,) float64
        Millimetres, 0 or more.

    Raises
    ------
    CorpusError
        For a motion in another topology than the built-in head's.
    """
    head = load_builtin_head()
    if motion.vertex_count != head.vertex_count:
        raise CorpusError.about(
            "mouth opening",
            found=f"{motion.vertex_count} vertices",
            allowed=f"the built-in head's {head.vertex_count}",
        )
    third = len(head.inner_lip_upper) // 3
    middle = slice(third, len(head.inner_lip_upper) - third)
    upper, lower = head.inner_lip_upper[middle], head.inner_lip_lower[middle]
    gaps = [
        block[:, : len(upper), 1] - block[:, len(upper) :, 1]
        for block in motion.blocks(np.concatenate([upper, lower]))
    ]
    return np.maximum(np.concatenate(gaps), 0).mean(axis=1)


def count_closures(
    predicted_mm: NDArray[np.floating],
    true_mm: NDArray[np.floating],
    fps: float,
    closed_mm: float = CLOSED_MM,
) -> ClosureCounts:
    """Count the closures of two mouths, and which of them the other mouth makes too.

    Both are openings (frame,) in mm, closed below `closed_mm`. A closure is made too where the
    other lips touch during it, or up to `TOLERANCE_S` before or after.
    """
    predicted, true = predicted_mm < closed_mm, true_mm < closed_mm
    wanted, closures = short_runs(true, fps), short_runs(predicted, fps)
    near = round(TOLERANCE_S * fps)

    def touched(run: FrameRun, closed: NDArray[np.bool_]) -> bool:
        return bool(closed[max(0, run[0] - near) : run[1] + near].any())

    met = sum(touched(run, predicted) for run in wanted)
    right = sum(touched(run, true) for run in closures)
    return ClosureCounts(len(wanted), met, len(closures), right)


def short_runs(closed: NDArray[np.bool_], fps: float) -> list[FrameRun]:
    """First frame and the one behind the last of True stretches shorter than `REST_AFTER_S`.

    Of closed (frame,), whether the lips touch; only stretches between two of False.
    """
    edges = np.diff(closed.astype(np.int8))
    starts, stops = np.flatnonzero(edges == 1) + 1, np.flatnonzero(edges == -1) + 1
    if len(stops) and closed[0]:
        stops = stops[1:]  # shut from the first frame on: a rest
    pairs = zip(starts.tolist(), stops.tolist(), strict=False)
    return [(start, stop) for start, stop in pairs if (stop - start) / fps < REST_AFTER_S]
