"""Scores of a model against a corpus's clips: per subject and style, with confidence intervals.

The predictor is a plain callable, so any model can be measured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elocute.array_types import Float64Array
from elocute.corpus.corpus_store import Corpus
from elocute.evaluation.confidence_intervals import (
    DRAWS,
    NO_INTERVAL,
    ConfidenceInterval,
    bootstrap_interval,
    metric_intervals,
)
from elocute.evaluation.lip_closures import CLOSED_MM
from elocute.evaluation.metrics import ClipMetrics, clip_metrics, silent_frames
from elocute.evaluation.model_predictions import recorded_motion
from elocute.evaluation.vertex_regions import VertexRegion
from elocute.motion.vertex_motion import VertexMotion

ClipPredictor = Callable[[str, str], VertexMotion]
"""(clip, style) to a motion of the clip's length."""
ALL_SUBJECTS = "all"


@dataclass(frozen=True, eq=False)
class MetricConfig:
    """Which metrics are computed, and over which vertices.

    Parameters
    ----------
    lips : VertexRegion or None
        Vertices of the lip error and the jerk; None leaves both out.
    upper_face : VertexRegion or None
        Vertices of the upper-face dynamics deviation; None leaves it out.
    mouth : bool
        Whether lip closures are counted; the topology must be the built-in head's.
    closed_mm : float
        Opening of the mouth below which it counts as closed, mm.
    """

    lips: VertexRegion | None
    upper_face: VertexRegion | None
    mouth: bool
    closed_mm: float = CLOSED_MM

    def record(self) -> dict[str, Any]:
        """Regions and threshold, for reports."""
        return {
            "lips": self.lips.record() if self.lips else None,
            "upper_face": self.upper_face.record() if self.upper_face else None,
            "closed_mm": self.closed_mm if self.mouth else None,
        }


@dataclass(frozen=True, eq=False)
class ClipScore:
    """Metrics of one clip predicted in one style; loudness is the RMS of its sound, 0 to 1."""

    name: str
    subject: str
    style: str
    metrics: ClipMetrics
    loudness: float = 0.0


@dataclass(frozen=True, eq=False)
class SubjectScore:
    """Metrics over the clips of a subject, or of `ALL_SUBJECTS`, predicted in one style.

    Attributes
    ----------
    subject, style : str
        Their names.
    clips : int
        Number of clips.
    intervals : dict of str to ConfidenceInterval
        As from `metric_intervals`; `slcc` and `true_slcc` as from `intensity_correlation`.
    """

    subject: str
    style: str
    clips: int
    intervals: dict[str, ConfidenceInterval]

    def record(self) -> dict[str, Any]:
        """Numbers by name, for JSON."""
        metrics = {name: interval.record() for name, interval in self.intervals.items()}
        return {"subject": self.subject, "style": self.style, "clips": self.clips, **metrics}


def score_clips(
    corpus: Corpus,
    names: Sequence[str],
    styles: Sequence[str],
    predict: ClipPredictor,
    config: MetricConfig,
    progress: Callable[[float], None] | None = None,
) -> list[ClipScore]:
    """Compare every clip, predicted in every style, with its recording.

    Parameters
    ----------
    corpus : Corpus
        The recordings.
    names : sequence of str
        Its clips to score.
    styles : sequence of str
        Styles of the model.
    predict : callable
        Gives the motion of a clip in a style, as `clip_predictor` makes it.
    config : MetricConfig
        What is measured.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Returns
    -------
    list of ClipScore
        One for each clip and style.

    Raises
    ------
    CorpusError
        For an unknown clip, or a prediction of another topology, length or frame rate.
    """
    scores = []
    for done, name in enumerate(names, 1):
        true, subject = recorded_motion(corpus, name), corpus.entry(name).subject
        sound = corpus.sound(name)
        silent = silent_frames(sound, true.frame_count, true.fps)
        loudness = float(np.sqrt(np.square(sound.samples, dtype=np.float64).mean()))
        for style in styles:
            metrics = clip_metrics(
                predict(name, style),
                true,
                config.lips,
                config.upper_face,
                mouth=config.mouth,
                closed_mm=config.closed_mm,
                silent=silent,
            )
            scores.append(ClipScore(name, subject, style, metrics, loudness))
        if progress:
            progress(done / len(names))
    return scores


def subject_scores(scores: Sequence[ClipScore], seed: int = 0) -> list[SubjectScore]:
    """Means over the clips of each subject, and over all clips, for each style.

    Parameters
    ----------
    scores : sequence of ClipScore
        Scores of clips.
    seed : int
        Seed of the bootstrap.

    Returns
    -------
    list of SubjectScore
        For each subject and style, then for `ALL_SUBJECTS` and each style.
    """
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
    """Means over the clips of each subject in the style that fits the subject best.

    The style is chosen by the truth that it is measured against (lip error, or vertex error without
    lips): the result is what the styles could reach, not what a listener gets.

    Parameters
    ----------
    scores : sequence of ClipScore
        Scores of clips in several styles.
    seed : int
        Seed of the bootstrap.

    Returns
    -------
    list of SubjectScore
        For each subject, then for `ALL_SUBJECTS`, each in their own best style, called `best`.
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
    """Sum of lip errors, or of vertex errors where there are no lips, mm."""
    lips = sum(score.metrics.lve_mm for score in scores)
    return lips if lips == lips else sum(score.metrics.mve_mm for score in scores)


def _subject_score(
    subject: str, style: str, scores: Sequence[ClipScore], seed: int
) -> SubjectScore:
    """The score of some clips of a subject in a style."""
    intervals = metric_intervals([s.metrics for s in scores], seed)
    people, loudness = [s.subject for s in scores], [s.loudness for s in scores]
    for name in ("lip_intensity", "true_lip_intensity"):
        intensity = [getattr(s.metrics, name) for s in scores]
        correlation = intensity_correlation(loudness, intensity, people, seed)
        intervals[name.replace("lip_intensity", "slcc")] = correlation
    return SubjectScore(subject, style, len(scores), intervals)


def intensity_correlation(
    loudness: Sequence[float], intensity: Sequence[float], people: Sequence[str], seed: int = 0
) -> ConfidenceInterval:
    """Whether lips move more where the speech is louder: the correlation over clips.

    Both are first standardised within each person, as the speech-lip intensity correlation
    coefficient (SLCC) of Chae-Yeon et al. 2025 is counted; clips of whom there is one, or of whom
    all are alike, are left out. `NO_INTERVAL` where fewer than three are left.
    """
    table = np.array([loudness, intensity], np.float64)
    kept = []
    for person in dict.fromkeys(people):
        own = table[:, [each == person for each in people]]
        spread = own.std(axis=1, ddof=1, keepdims=True) if own.shape[1] > 1 else np.zeros((2, 1))
        if np.isfinite(spread).all() and (spread > 0).all():
            kept.append((own - own.mean(axis=1, keepdims=True)) / spread)
    pairs = np.concatenate(kept, axis=1) if kept else np.zeros((2, 0))
    if pairs.shape[1] < 3:
        return NO_INTERVAL
    rows = np.random.default_rng(seed).integers(0, pairs.shape[1], (DRAWS, pairs.shape[1]))
    with np.errstate(invalid="ignore"):  # draws of one clip alone have no correlation
        draws = _correlation(pairs[:, rows])
    return bootstrap_interval(float(_correlation(pairs)), draws[np.isfinite(draws)])


def _correlation(pairs: Float64Array) -> Float64Array:
    """Of pairs (2, …, clip), over the last axis."""
    x, y = pairs - pairs.mean(axis=-1, keepdims=True)
    covariance = (x * y).sum(-1)
    return np.asarray(covariance / np.sqrt((x * x).sum(-1) * (y * y).sum(-1)), np.float64)
