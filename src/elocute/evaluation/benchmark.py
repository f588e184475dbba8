"""The published protocol of VOCASET and BIWI on predictions of any method, given as files.

Errors are counted as in the code behind published tables (CodeTalker's `main/cal_metric.py` at
e687bbe6, FaceDiffuser's `evaluation/compute_objective_metrics.py` at 8d480dfc), in the data's own
unit:

LVE
    Squared distance of the worst lip vertex of a frame, a mean over all frames of all sequences.
MVE
    Distance of a vertex, a mean over all vertices and frames.
FDD
    For each upper-face vertex the standard deviation over time of its squared distance from the
    neutral face; true minus predicted, a mean over vertices, then over sequences.
MTM
    Frames between openings or closures that belong together (`lip_timing`), a mean over a
    sequence, then over sequences that have any; where it is asked for.

Of truth and prediction the longer one is cut, as FaceDiffuser's code does (CodeTalker's cuts the
prediction alone, and fails where it is the shorter).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elocute.errors import CorpusError
from elocute.evaluation.benchmark_files import Prediction, Truth, read_prediction
from elocute.evaluation.confidence_intervals import (
    ConfidenceInterval,
    mean_interval,
    ratio_interval,
)
from elocute.evaluation.lip_timing import lip_distance, temporal_misalignments
from elocute.evaluation.metrics import (
    dynamics_deviation,
    lip_vertex_error,
    vertex_errors,
)
from elocute.evaluation.vertex_regions import VertexRegion
from elocute.motion.vertex_motion import MM, VertexMotion

SIZES_DIFFER = 1.5  # how much larger one face may be than another in the same unit
MEASURES = ("lve", "lve_distance", "mve", "fdd", "fdd_absolute", "fdd_paper", "mtm")


@dataclass(frozen=True, eq=False)
class SequenceScore:
    """One prediction against its clip.

    frames: how many were compared. longer_by: by how many frames the prediction is longer than the
    truth; below 0 where it is shorter. lve, lve_distance: squared and plain lip vertex error for
    each list of lips. mve: mean vertex error. fdd, fdd_paper: FDD of squared distances and, as
    CodeTalker's paper writes it, of distances. mtm: mean temporal misalignment in frames; None
    where it was not asked for, or nothing belongs together.
    """

    prediction: Prediction
    frames: int
    longer_by: int
    lve: tuple[float, ...]
    lve_distance: tuple[float, ...]
    mve: float
    fdd: float
    fdd_paper: float
    mtm: float | None = None


@dataclass(frozen=True, eq=False)
class BenchmarkScore:
    """A method over a list of lip vertices, in the data's unit.

    Attributes
    ----------
    method : str
        The folder's name.
    lips : VertexRegion
        The list.
    sequences, frames : int
        How many files and frames were compared.
    intervals : dict of str to ConfidenceInterval
        Of each of `MEASURES` that was counted, over sequences.
    """

    method: str
    lips: VertexRegion
    sequences: int
    frames: int
    intervals: dict[str, ConfidenceInterval]

    def record(self) -> dict[str, object]:
        """Numbers by name, for JSON."""
        numbers = {name: interval.record() for name, interval in self.intervals.items()}
        return {
            "method": self.method,
            "lips": self.lips.record(),
            "sequences": self.sequences,
            "frames": self.frames,
            **numbers,
        }


def score_predictions(
    truth: Truth,
    predictions: Sequence[Prediction],
    lips: Sequence[VertexRegion],
    upper_face: VertexRegion,
    every: int = 1,
    progress: Callable[[float], None] | None = None,
    timing: tuple[int, int] | None = None,
) -> list[SequenceScore]:
    """Compare every prediction with its clip.

    Parameters
    ----------
    truth : Truth
        The clips.
    predictions : sequence of Prediction
        What `find_predictions` found.
    lips : sequence of VertexRegion
        Lists of lip vertices; the lip vertex error is counted over each.
    upper_face : VertexRegion
        Vertices of FDD.
    every : int
        Every Nth frame of the truth is compared.
    progress : callable, optional
        Called with the share that is done, 0 to 1.
    timing : (int, int), optional
        Middles of upper and lower lip, between which MTM is counted; needs the extra `wild`.

    Returns
    -------
    list of SequenceScore
        One for each prediction.

    Raises
    ------
    CorpusError
        For a file of another topology, NaN or infinity in it, and another unit.
    """
    scores = []
    for done, prediction in enumerate(predictions, 1):
        true = truth.clips[prediction.clip]()
        true = replace(true, values=np.asarray(true.values[::every]))
        predicted = read_prediction(prediction.path, np.asarray(true.template, np.float32))
        predicted = replace(predicted, template=true.template, fps=true.fps)
        _check_size(prediction.path, predicted, true)
        frames = min(predicted.frame_count, true.frame_count)
        scores.append(
            _sequence_score(
                prediction,
                predicted.cut(frames),
                true.cut(frames),
                predicted.frame_count - true.frame_count,
                lips,
                upper_face,
                timing,
            )
        )
        if progress:
            progress(done / len(predictions))
    return scores


def _sequence_score(
    prediction: Prediction,
    predicted: VertexMotion,
    true: VertexMotion,
    longer_by: int,
    lips: Sequence[VertexRegion],
    upper_face: VertexRegion,
    timing: tuple[int, int] | None,
) -> SequenceScore:
    """Measures in the data's unit; those of `metrics` are in thousandths of it."""
    errors = [lip_vertex_error(predicted, true, each) for each in lips]
    fdd, _, fdd_of_squares = dynamics_deviation(predicted, true, upper_face)
    apart = (
        temporal_misalignments(*(lip_distance(each, timing) for each in (predicted, true)))
        if timing
        else []
    )
    return SequenceScore(
        prediction,
        true.frame_count,
        longer_by,
        tuple(squared / MM**2 for squared, _ in errors),
        tuple(plain / MM for _, plain in errors),
        vertex_errors(predicted, true)[0] / MM,
        fdd_of_squares / MM**2,
        fdd / MM,
        float(np.mean(apart)) if len(apart) else None,
    )


def _check_size(path: Path, predicted: VertexMotion, true: VertexMotion) -> None:
    """Raise CorpusError for a face of quite another size, which means another unit."""
    sizes = [
        float(np.ptp(np.asarray(motion.values[0], np.float64).reshape(-1, 3), axis=0).max())
        for motion in (predicted, replace(true, values=true.template[None], basis=None))
    ]
    ratio = sizes[0] / max(sizes[1], 1e-12)
    if not 1 / SIZES_DIFFER < ratio < SIZES_DIFFER:
        raise CorpusError.about(
            path,
            found=f"a face {ratio:.3g} times as large as the true one",
            allowed="vertices in the unit of the truth, not displacements",
        )


def benchmark_scores(
    method: str, scores: Sequence[SequenceScore], lips: Sequence[VertexRegion], seed: int = 0
) -> list[BenchmarkScore]:
    """Published figures of a method, with 95 % confidence intervals over sequences.

    Errors of vertices are means over frames, FDD over sequences, as in the published code.

    Parameters
    ----------
    method : str
        Its name.
    scores : sequence of SequenceScore
        What `score_predictions` gave.
    lips : sequence of VertexRegion
        The same lists.
    seed : int
        Seed of the bootstrap.

    Returns
    -------
    list of BenchmarkScore
        One for each list of lip vertices.
    """
    frames = [float(score.frames) for score in scores]

    def over_frames(values: Sequence[float]) -> ConfidenceInterval:
        return ratio_interval([v * f for v, f in zip(values, frames, strict=True)], frames, seed)

    table = []
    for place, region in enumerate(lips):
        intervals = {
            "lve": over_frames([score.lve[place] for score in scores]),
            "lve_distance": over_frames([score.lve_distance[place] for score in scores]),
            "mve": over_frames([score.mve for score in scores]),
            "fdd": mean_interval([score.fdd for score in scores], seed),
            "fdd_absolute": mean_interval([abs(score.fdd) for score in scores], seed),
            "fdd_paper": mean_interval([score.fdd_paper for score in scores], seed),
        }
        if timed := [score.mtm for score in scores if score.mtm is not None]:
            intervals["mtm"] = mean_interval(timed, seed)
        table.append(BenchmarkScore(method, region, len(scores), int(sum(frames)), intervals))
    return table
