"""What became of a sequence."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SequenceResult:
    """What became of a sequence.

    failed   why there is no motion of it, or ""
    frames   of the motion
    flagged  numbers of scans that were not used, missing those that were never there; all of
             these frames are interpolated
    median_mm, p95_mm  distance from scan to surface, median over frames of each frame's own
    """

    name: str
    failed: str = ""
    frames: int = 0
    flagged: tuple[int, ...] = ()
    missing: tuple[int, ...] = ()
    median_mm: float | None = None
    p95_mm: float | None = None
    landmark_mm: float | None = None
    seconds_per_frame: float = 0.0
    in_corpus: bool = False
