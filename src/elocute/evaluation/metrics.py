"""How far a predicted motion is from a recorded one, clip by clip.

Published speech metrics disagree on vertices and squares, so each is written out here: lists of
vertices are named and hashed (`vertex_lists`), the lip error is given squared and rooted. All
work on blocks of frames: memory does not grow with a clip.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields

import numpy as np
from numpy.typing import NDArray

from elocute.corpus.corpus_statistics import moments
from elocute.errors import CorpusError
from elocute.evaluation.lip_closures import CLOSED_MM, ClosureCounts, count_closures, lip_opening
from elocute.evaluation.vertex_regions import VertexRegion
from elocute.motion.vertex_motion import VertexMotion

Doubles = NDArray[np.float64]
NAN = float("nan")


@dataclass(frozen=True)
class ClipMetrics:
    """One clip; NaN where the topology names no such vertices. Lower is better but for closures.

    lve_mm2, lve_mm      lip vertex error, squared and rooted
    mve_mm               mean vertex error
    fdd_mm, fdd_abs_mm   upper-face dynamics deviation as CodeTalker's paper defines it, signed
                         (true - predicted) and absolute
    fdd_code_mm2         the same as CodeTalker's code computes it, of squared distances, signed
    velocity_mm          error of the steps from frame to frame, mm a frame
    jerk, true_jerk      of the lips, mm/s³: as calm as the truth is best, not 0
    closures             met and counted, of the true lips and of the predicted
    """

    lve_mm2: float
    lve_mm: float
    mve_mm: float
    fdd_mm: float
    fdd_abs_mm: float
    fdd_code_mm2: float
    velocity_mm: float
    jerk: float
    true_jerk: float
    closures: ClosureCounts | None

    def record(self) -> dict[str, object]:
        """For JSON, which knows no NaN."""
        return {name: None if value != value else value for name, value in asdict(self).items()}


AVERAGED_METRICS = tuple(field.name for field in fields(ClipMetrics) if field.name != "closures")
"""Metrics that are averaged over clips."""


def clip_metrics(
    predicted: VertexMotion,
    true: VertexMotion,
    lips: VertexRegion | None = None,
    upper_face: VertexRegion | None = None,
    *,
    mouth: bool = False,
    closed_mm: float = CLOSED_MM,
) -> ClipMetrics:
    """Everything about one clip; with `mouth` also closures (built-in topology only).

    Raises CorpusError where the two differ in topology, length or frame rate.
    """
    check_alike(predicted, true)
    lve = lip_vertex_error(predicted, true, lips) if lips else (NAN, NAN)
    fdd = _dynamics(predicted, true, upper_face) if upper_face else (NAN, NAN, NAN)
    jerks = (mean_jerk(predicted, lips), mean_jerk(true, lips)) if lips else (NAN, NAN)
    met = None
    if mouth:
        met = count_closures(lip_opening(predicted), lip_opening(true), true.fps, closed_mm)
    return ClipMetrics(
        *lve, mean_vertex_error(predicted, true), *fdd, velocity_error(predicted, true), *jerks, met
    )


def check_alike(predicted: VertexMotion, true: VertexMotion) -> None:
    """Raise CorpusError where two motions cannot be compared frame by frame."""
    facts = {
        "vertices": (predicted.vertex_count, true.vertex_count),
        "frames": (predicted.frame_count, true.frame_count),
        "frames per second": (predicted.fps, true.fps),
    }
    for what, (found, allowed) in facts.items():
        if found != allowed:
            raise CorpusError.about(
                "prediction", found=f"{found:g} {what}", allowed=f"{allowed:g}, as the truth has"
            )


def lip_vertex_error(
    predicted: VertexMotion, true: VertexMotion, lips: VertexRegion
) -> tuple[float, float]:
    """(mm², mm): in each frame the lip vertex that is furthest off, its distance squared and as
    it is, each averaged over frames (Richard et al. 2021, MeshTalk, section 4)."""
    worst = [
        np.square(p - t).sum(axis=2).max(axis=1) for p, t in _pairs(predicted, true, lips.indices)
    ]
    squared = np.concatenate(worst)
    return float(squared.mean()), float(np.sqrt(squared).mean())


def mean_vertex_error(predicted: VertexMotion, true: VertexMotion) -> float:
    """mm: distance of vertices, averaged over all of them and over frames."""
    return _mean(np.linalg.norm(p - t, axis=2).mean(axis=1) for p, t in _pairs(predicted, true))


def dynamics_deviation(
    predicted: VertexMotion, true: VertexMotion, upper_face: VertexRegion
) -> tuple[float, float]:
    """(mm signed, mm absolute): how much livelier the true upper face is than the predicted.

    Per vertex the standard deviation over time of its distance from the neutral face; true minus
    predicted, averaged over vertices, with its sign and without (FDD of Xing et al. 2023,
    CodeTalker, section 4.2; their code squares the distance: `dynamics_deviation_of_squares`).
    """
    return _dynamics(predicted, true, upper_face)[:2]


def dynamics_deviation_of_squares(
    predicted: VertexMotion, true: VertexMotion, upper_face: VertexRegion
) -> float:
    """mm²: the same of squared distances, signed, as the code that published figures come from
    computes it (CodeTalker's, and those of later work that took it over)."""
    return _dynamics(predicted, true, upper_face)[2]


def _dynamics(
    predicted: VertexMotion, true: VertexMotion, upper_face: VertexRegion
) -> tuple[float, float, float]:
    """FDD of distances, signed and absolute, and of their squares, signed."""
    plain, squared = (
        a - b for a, b in zip(*(_liveliness(t, upper_face) for t in (true, predicted)), strict=True)
    )
    return float(plain.mean()), float(np.abs(plain).mean()), float(squared.mean())


def velocity_error(predicted: VertexMotion, true: VertexMotion) -> float:
    """mm a frame: how far the steps of vertices differ; 0 for a single frame."""
    return _mean(
        np.linalg.norm(np.diff(p - t, axis=0), axis=2).mean(axis=1)
        for p, t in _pairs(predicted, true, overlap=1)
    )


def mean_jerk(track: VertexMotion, lips: VertexRegion) -> float:
    """mm/s³: length of the third difference of lip vertices; 0 for fewer than four frames."""
    steps = (
        np.linalg.norm(np.diff(block, 3, axis=0), axis=2).mean(axis=1)
        for block in track.blocks(lips.indices, overlap=3)
        if len(block) > 3
    )
    return _mean(steps) * track.fps**3


def _liveliness(track: VertexMotion, places: VertexRegion) -> tuple[Doubles, Doubles]:
    """(vertex,) mm and mm²: deviations over time of distances from rest, and of their squares."""
    rest = np.asarray(track.template, np.float64)[places.indices] * 1000
    distances = (np.linalg.norm(b - rest, axis=2) for b in track.blocks(places.indices))
    both = moments(np.concatenate([d, d * d], axis=1) for d in distances)
    plain, squared = np.split(np.sqrt(both.variance), 2)
    return plain, squared


def _pairs(
    predicted: VertexMotion,
    true: VertexMotion,
    vertices: NDArray[np.integer] | None = None,
    overlap: int = 0,
) -> Iterator[tuple[Doubles, Doubles]]:
    both = (track.blocks(vertices, overlap) for track in (predicted, true))
    return zip(*both, strict=True)


def _mean(parts: Iterator[Doubles]) -> float:
    total, count = 0.0, 0
    for part in parts:
        total, count = total + float(part.sum()), count + len(part)
    return total / count if count else 0.0
