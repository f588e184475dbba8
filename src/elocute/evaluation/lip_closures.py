"""Lips that must meet: closures of a recorded mouth, and whether a predicted one makes them.

A closure is a short stretch in which the inner lips touch, open before and after: p, b and m.
Where the mouth stays shut for longer it rests, and a rest counts nowhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.contacts_and_rest import REST_AFTER_S
from elocute.errors import CorpusError
from elocute.head.builtin import load_builtin_head
from elocute.motion.vertex_motion import VertexMotion

CLOSED_MM = 0.5  # inner-lip gap below which nobody sees an opening
TOLERANCE_S = 0.040  # a closure this early or late is still met
Doubles = NDArray[np.float64]
FrameRun = tuple[int, int]


@dataclass(frozen=True)
class ClosureCounts:
    """true closures, those that the prediction meets; predicted closures, those that are true."""

    wanted: int
    met: int
    made: int
    right: int


def lip_opening(track: VertexMotion) -> Doubles:
    """(frame,) mm between the inner lips, middle third, as `measure_mouth` gives it.

    Raises CorpusError for another topology than the built-in head's.
    """
    head = load_builtin_head()
    if track.vertex_count != head.vertex_count:
        raise CorpusError.about(
            "mouth opening",
            found=f"{track.vertex_count} vertices",
            allowed=f"the built-in head's {head.vertex_count}",
        )
    third = len(head.inner_lip_upper) // 3
    middle = slice(third, len(head.inner_lip_upper) - third)
    upper, lower = head.inner_lip_upper[middle], head.inner_lip_lower[middle]
    gaps = [
        block[:, : len(upper), 1] - block[:, len(upper) :, 1]
        for block in track.blocks(np.concatenate([upper, lower]))
    ]
    return np.maximum(np.concatenate(gaps), 0).mean(axis=1)


def count_closures(
    predicted_mm: NDArray[np.floating],
    true_mm: NDArray[np.floating],
    fps: float,
    closed_mm: float = CLOSED_MM,
) -> ClosureCounts:
    """Count closures of two openings (frame,) in mm.

    Met is a true closure during which the predicted lips touch, NEAR_S early or late at most;
    right is a predicted one during which the true lips do.
    """
    predicted, true = predicted_mm < closed_mm, true_mm < closed_mm
    wanted, made = short_runs(true, fps), short_runs(predicted, fps)
    near = round(TOLERANCE_S * fps)

    def touched(run: FrameRun, closed: NDArray[np.bool_]) -> bool:
        return bool(closed[max(0, run[0] - near) : run[1] + near].any())

    met = sum(touched(run, predicted) for run in wanted)
    right = sum(touched(run, true) for run in made)
    return ClosureCounts(len(wanted), met, len(made), right)


def short_runs(closed: NDArray[np.bool_], fps: float) -> list[FrameRun]:
    """Start and stop (exclusive) of every stretch of True between two of False, but rests."""
    edges = np.diff(closed.astype(np.int8))
    starts, stops = np.flatnonzero(edges == 1) + 1, np.flatnonzero(edges == -1) + 1
    if len(stops) and closed[0]:
        stops = stops[1:]  # shut from the first frame on: a rest
    pairs = zip(starts.tolist(), stops.tolist(), strict=False)
    return [(start, stop) for start, stop in pairs if (stop - start) / fps < REST_AFTER_S]
