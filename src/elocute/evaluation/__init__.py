"""Measures: models against clips and real talkers, alignments against truth, studies of noise,
styles and faces.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.evaluation.confidence_intervals import ConfidenceInterval, mean_interval
    from elocute.evaluation.corpus_scores import (
        MetricConfig,
        SubjectScore,
        best_style_scores,
        score_clips,
        subject_scores,
    )
    from elocute.evaluation.model_predictions import clip_predictor, recorded_motion
    from elocute.evaluation.mouth_studies import face_scores, noise_scores, style_openings
    from elocute.evaluation.tracked_mouth_scores import evaluate_tracked_mouths
    from elocute.evaluation.vertex_regions import (
        VertexRegion,
        builtin_region,
        published_region,
        read_vertex_region,
    )
    from elocute.evaluation.wild_experiments import WildStudy, select_sentences, study_wild

__all__ = [
    "ConfidenceInterval",
    "MetricConfig",
    "SubjectScore",
    "VertexRegion",
    "WildStudy",
    "best_style_scores",
    "builtin_region",
    "clip_predictor",
    "evaluate_tracked_mouths",
    "face_scores",
    "mean_interval",
    "noise_scores",
    "published_region",
    "read_vertex_region",
    "recorded_motion",
    "score_clips",
    "select_sentences",
    "study_wild",
    "style_openings",
    "subject_scores",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "confidence_intervals": ("ConfidenceInterval", "mean_interval"),
        "corpus_scores": (
            "MetricConfig",
            "SubjectScore",
            "best_style_scores",
            "subject_scores",
            "score_clips",
        ),
        "model_predictions": ("clip_predictor", "recorded_motion"),
        "mouth_studies": ("face_scores", "noise_scores", "style_openings"),
        "tracked_mouth_scores": ("evaluate_tracked_mouths",),
        "vertex_regions": (
            "VertexRegion",
            "builtin_region",
            "published_region",
            "read_vertex_region",
        ),
        "wild_experiments": ("WildStudy", "select_sentences", "study_wild"),
    },
)
