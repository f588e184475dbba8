"""A model against the recorded clips of a corpus: per subject and per style, with intervals.

The predictor is a plain callable, so any model can be measured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from elocute.corpus.corpus_store import Corpus
from elocute.evaluation.confidence_intervals import ConfidenceInterval, metric_intervals
from elocute.evaluation.lip_closures import CLOSED_MM
from elocute.evaluation.metrics import ClipMetrics, clip_metrics
from elocute.evaluation.model_predictions import recorded_motion
from elocute.evaluation.vertex_regions import VertexRegion
from elocute.motion.vertex_motion import VertexMotion

ClipPredictor = Callable[[str, str], VertexMotion]
"""(clip, style) to a motion of the clip's length."""
ALL_SUBJECTS = "all"


@dataclass(frozen=True, eq=False)
class MetricConfig:
    """What is looked at: lists of vertices where there are any, closures where `mouth`."""

    lips: VertexRegion | None
    upper_face: VertexRegion | None
    mouth: bool
    closed_mm: float = CLOSED_MM

    def record(self) -> dict[str, Any]:
        return {
            "lips": self.lips.record() if self.lips else None,
            "upper_face": self.upper_face.record() if self.upper_face else None,
            "closed_mm": self.closed_mm if self.mouth else None,
        }


@dataclass(frozen=True, eq=False)
class ClipScore:
    """One clip predicted in one style."""

    name: str
    subject: str
    style: str
    metrics: ClipMetrics


@dataclass(frozen=True, eq=False)
class SubjectScore:
    """Some clips of a subject (or EVERYBODY) predicted in a style."""

    subject: str
    style: str
    clips: int
    intervals: dict[str, ConfidenceInterval]

    def record(self) -> dict[str, Any]:
        metrics = {name: interval.record() for name, interval in self.intervals.items()}
        return {"subject": self.subject, "style": self.style, "clips": self.clips, **metrics}


def score_clips(
    corpus: Corpus,
    names: Sequence[str],
    styles: Sequence[str],
    predict: ClipPredictor,
    measure: MetricConfig,
    progress: Callable[[float], None] | None = None,
) -> list[ClipScore]:
    """Every clip in every style. Raises CorpusError where a prediction does not fit."""
    scores = []
    for done, name in enumerate(names, 1):
        true, subject = recorded_motion(corpus, name), corpus.entry(name).subject
        for style in styles:
            metrics = clip_metrics(
                predict(name, style),
                true,
                measure.lips,
                measure.upper_face,
                mouth=measure.mouth,
                closed_mm=measure.closed_mm,
            )
            scores.append(ClipScore(name, subject, style, metrics))
        if progress:
            progress(done / len(names))
    return scores


def subject_scores(scores: Sequence[ClipScore], seed: int = 0) -> list[SubjectScore]:
    """One row per subject and style, then EVERYBODY's per style."""
    subjects = list(dict.fromkeys(score.subject for score in scores))
    styles = list(dict.fromkeys(score.style for score in scores))
    table = []
    for subject in (*subjects, ALL_SUBJECTS):
        for style in styles:
            chosen = [
                s for s in scores if s.style == style and subject in (s.subject, ALL_SUBJECTS)
            ]
            if chosen:
                table.append(_subject_score(subject, style, chosen, seed))
    return table


def best_style_scores(scores: Sequence[ClipScore], seed: int = 0) -> list[SubjectScore]:
    """Each subject in the style that fits them best, then EVERYBODY in their own.

    The style is chosen by the truth it is measured against (lip error, or vertex error where
    there are no lips): this says what the styles could reach, not what a listener gets.
    """
    table, kept = [], []
    for subject in dict.fromkeys(score.subject for score in scores):
        mine = [score for score in scores if score.subject == subject]
        styles = list(dict.fromkeys(score.style for score in mine))
        best = min(styles, key=lambda s: _error([m for m in mine if m.style == s]))
        chosen = [score for score in mine if score.style == best]
        table.append(_subject_score(subject, best, chosen, seed))
        kept += chosen
    return [*table, _subject_score(ALL_SUBJECTS, "best", kept, seed)]


def _error(scores: Sequence[ClipScore]) -> float:
    lips = sum(score.metrics.lve_mm for score in scores)
    return lips if lips == lips else sum(score.metrics.mve_mm for score in scores)


def _subject_score(
    subject: str, style: str, scores: Sequence[ClipScore], seed: int
) -> SubjectScore:
    return SubjectScore(
        subject, style, len(scores), metric_intervals([s.metrics for s in scores], seed)
    )
