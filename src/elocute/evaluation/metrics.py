"""How far a predicted motion is from a recorded one, clip by clip.

Published metrics of speech animation differ in their vertices and in whether they square, so each
is written out here: regions of vertices have names and hashes (`vertex_regions`), and the lip error
is given squared and not. All metrics work on blocks of frames, so that memory does not grow with a
clip.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_statistics import moments
from elocute.errors import CorpusError
from elocute.evaluation.lip_closures import CLOSED_MM, ClosureCounts, count_closures, lip_opening
from elocute.evaluation.vertex_regions import VertexRegion
from elocute.motion.vertex_motion import VertexMotion

NAN = float("nan")
SILENT_DB = -40.0
MOVING_MM_S = 5.0
"""Slower lips rest: breath and noise of tracking move them too."""


@dataclass(frozen=True)
class SilentMotion:
    """Steps between two frames in which nothing is heard, and those in which lips move.

    silent: how many. moving, true_moving: in how many of them predicted and true lips move.
    """

    silent: int
    moving: int
    true_moving: int


@dataclass(frozen=True)
class ClipMetrics:
    """Metrics of one clip; NaN where the topology names no such vertices.

    Lower is better, but for the jerk, which should be as in the recording, and for closures.

    Attributes
    ----------
    lve_mm2, lve_mm : float
        Lip vertex error, of squared distances and of distances.
    mve_mm : float
        Mean vertex error.
    fdd_mm, fdd_abs_mm, fdd_code_mm2 : float
        Upper-face dynamics deviation: as CodeTalker's paper defines it, signed (true − predicted)
        and absolute, and as its code computes it, of squared distances, signed.
    velocity_mm : float
        Error of the steps from frame to frame, mm per frame.
    jerk, true_jerk : float
        Of the predicted and the true lips, mm/s³.
    lip_intensity, true_lip_intensity : float
        Root mean square over steps from frame to frame of how far lip vertices move, mm: the lip
        intensity of Chae-Yeon et al. 2025.
    closures : ClosureCounts or None
        Of the predicted and the true lips.
    silence : SilentMotion or None
        Whether lips move where nothing is heard; None where the sound was not given.
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
    lip_intensity: float
    true_lip_intensity: float
    closures: ClosureCounts | None
    silence: SilentMotion | None = None

    def record(self) -> dict[str, object]:
        """Numbers by name, for JSON; None in place of NaN."""
        return {name: None if value != value else value for name, value in asdict(self).items()}


AVERAGED_METRICS = tuple(
    field.name for field in fields(ClipMetrics) if field.name not in ("closures", "silence")
)
"""Metrics that are averaged over clips."""
TITLES = {
    "lve_mm": "LVE mm",
    "lve_mm2": "LVE mm²",
    "mve_mm": "MVE mm",
    "fdd_mm": "FDD mm (paper)",
    "fdd_code_mm2": "FDD mm² (code)",
    "velocity_mm": "velocity mm/frame",
    "jerk": "jerk mm/s³",
    "true_jerk": "true jerk",
    "closure_recall": "closure recall",
    "closure_precision": "closure precision",
    "lip_intensity": "lip intensity mm/frame",
    "true_lip_intensity": "true intensity",
    "slcc": "SLCC",
    "true_slcc": "true SLCC",
    "lip_leak": "moving in silence",
    "true_lip_leak": "true moving",
}
"""Metrics that tables show, in their order, with the titles of their columns."""


def clip_metrics(
    predicted: VertexMotion,
    true: VertexMotion,
    lips: VertexRegion | None = None,
    upper_face: VertexRegion | None = None,
    *,
    mouth: bool = False,
    closed_mm: float = CLOSED_MM,
    silent: NDArray[np.bool_] | None = None,
) -> ClipMetrics:
    """Compute all metrics of one clip. Raises CorpusError as `check_alike` does.

    lips: vertices of the lip error and the jerk; upper_face: of the dynamics deviation; NaN
    without. mouth: whether closures (below `closed_mm`) are counted; in the built-in topology only.
    silent: (frame,) whether nothing is heard, for `silence`.
    """
    check_alike(predicted, true)
    lve = lip_vertex_error(predicted, true, lips) if lips else (NAN, NAN)
    fdd = dynamics_deviation(predicted, true, upper_face) if upper_face else (NAN, NAN, NAN)
    jerks = (mean_jerk(predicted, lips), mean_jerk(true, lips)) if lips else (NAN, NAN)
    met = None
    if mouth:
        met = count_closures(lip_opening(predicted), lip_opening(true), true.fps, closed_mm)
    intensity, true_intensity, silence = NAN, NAN, None
    if lips:
        steps, true_steps = lip_steps(predicted, lips), lip_steps(true, lips)
        intensity, true_intensity = _root_mean_square(steps), _root_mean_square(true_steps)
        if silent is not None:
            silence = silent_motion(steps, true_steps, silent, true.fps)
    distance, step = vertex_errors(predicted, true)
    return ClipMetrics(*lve, distance, *fdd, step, *jerks, intensity, true_intensity, met, silence)


def check_alike(predicted: VertexMotion, true: VertexMotion) -> None:
    """Raise CorpusError where two motions differ in topology, length or frame rate."""
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
    """Error of the worst lip vertex of each frame, averaged over frames.

    Of squared distances, mm², and of distances, mm, as in Richard et al. 2021 (MeshTalk), section
    4.
    """
    worst = [
        np.square(p - t).sum(axis=2).max(axis=1) for p, t in _pairs(predicted, true, lips.indices)
    ]
    squared = np.concatenate(worst)
    return float(squared.mean()), float(np.sqrt(squared).mean())


def dynamics_deviation(
    predicted: VertexMotion, true: VertexMotion, upper_face: VertexRegion
) -> tuple[float, float, float]:
    """How much livelier the true upper face is than the predicted one.

    For each vertex the standard deviation over time of its distance from the neutral face; true
    minus predicted, averaged over vertices with the sign and without, mm. This is FDD of Xing et
    al. 2023 (CodeTalker), section 4.2. The third number, signed, mm², is that of squared distances,
    as their code and that of later work has it.
    """
    plain, squared = (
        a - b for a, b in zip(*(_deviations(t, upper_face) for t in (true, predicted)), strict=True)
    )
    return float(plain.mean()), float(np.abs(plain).mean()), float(squared.mean())


def vertex_errors(predicted: VertexMotion, true: VertexMotion) -> tuple[float, float]:
    """Mean error of all vertices, mm, and of their steps, mm per frame: expanded once for both."""
    distances, steps = [], []
    for number, (p, t) in enumerate(_pairs(predicted, true, overlap=1)):
        apart = p - t
        distances.append(_lengths(apart[bool(number) :]).mean(axis=1))
        steps.append(_lengths(np.diff(apart, axis=0)).mean(axis=1))
    return _mean(iter(distances)), _mean(iter(steps))


def _lengths(vectors: Float64Array) -> Float64Array:
    """(frame, vertex) of (frame, vertex, 3); three times as fast as NumPy's norm of short rows."""
    return np.sqrt(np.einsum("fvc,fvc->fv", vectors, vectors))


def mean_jerk(motion: VertexMotion, lips: VertexRegion) -> float:
    """Mean length of the third derivative of lip vertices, mm/s³; 0 for fewer than four frames."""
    steps = (
        _lengths(np.diff(block, 3, axis=0)).mean(axis=1)
        for block in motion.blocks(lips.indices, overlap=3)
        if len(block) > 3
    )
    return _mean(steps) * motion.fps**3


def lip_steps(motion: VertexMotion, lips: VertexRegion) -> Float64Array:
    """(frame - 1,) how far lip vertices move from frame to frame in the mean, mm; 0 for one."""
    steps = [
        _lengths(np.diff(block, axis=0)).mean(axis=1)
        for block in motion.blocks(lips.indices, overlap=1)
    ]
    moved = np.concatenate(steps)
    return moved if len(moved) else np.zeros(1)


def silent_motion(
    predicted: Float64Array, true: Float64Array, silent: NDArray[np.bool_], fps: float
) -> SilentMotion:
    """Steps of the lips (frame - 1,) in mm between frames (frame,) that are both silent."""
    still = silent[1:] & silent[:-1]
    moving, true_moving = (
        int((steps[: len(still)][still] * fps > MOVING_MM_S).sum()) for steps in (predicted, true)
    )
    return SilentMotion(int(still.sum()), moving, true_moving)


def silent_frames(sound: Waveform, frames: int, fps: float) -> NDArray[np.bool_]:
    """(frame,) whether the sound of a frame is `SILENT_DB` below that of the loudest or more."""
    edges = np.round(np.arange(frames + 1) * sound.sample_rate / fps).astype(int)
    power = np.array(
        [np.square(sound.samples[a:b], dtype=np.float64).sum() for a, b in pairwise(edges)]
    )
    return power <= power.max() * 10 ** (SILENT_DB / 10)


def _deviations(motion: VertexMotion, region: VertexRegion) -> tuple[Float64Array, Float64Array]:
    """(vertex,) mm and mm²: deviations over time of distances from rest, and of their squares."""
    rest = np.asarray(motion.template, np.float64)[region.indices] * 1000
    distances = (_lengths(b - rest) for b in motion.blocks(region.indices))
    both = moments(np.concatenate([d, d * d], axis=1) for d in distances)
    plain, squared = np.split(np.sqrt(both.variance), 2)
    return plain, squared


def _pairs(
    predicted: VertexMotion,
    true: VertexMotion,
    vertices: NDArray[np.integer] | None = None,
    overlap: int = 0,
) -> Iterator[tuple[Float64Array, Float64Array]]:
    """Blocks of both motions, (frame, vertex, 3) mm."""
    both = (motion.blocks(vertices, overlap) for motion in (predicted, true))
    return zip(*both, strict=True)


def _root_mean_square(values: Float64Array) -> float:
    return float(np.sqrt(np.square(values).mean()))


def _mean(parts: Iterator[Float64Array]) -> float:
    """Mean over all numbers of some arrays; 0 for none."""
    total, count = 0.0, 0
    for part in parts:
        total, count = total + float(part.sum()), count + len(part)
    return total / count if count else 0.0
