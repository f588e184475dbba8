"""Measures: models against clips and real talkers, alignments against truth, studies of noise,
styles and faces.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.evaluation.confidence_intervals import Interval, mean_interval
    from elocute.evaluation.corpus_scores import Measure, Row, best_rows, rows, score_clips
    from elocute.evaluation.model_predictions import clip_predictor, true_track
    from elocute.evaluation.mouth_studies import face_scores, noise_scores, style_openings
    from elocute.evaluation.real_talker import evaluate_real
    from elocute.evaluation.vertex_lists import (
        VertexList,
        builtin_list,
        published_list,
        read_vertex_list,
    )
    from elocute.evaluation.wild_experiments import WildStudy, chosen_sentences, study_wild

__all__ = [
    "Interval",
    "Measure",
    "Row",
    "VertexList",
    "WildStudy",
    "best_rows",
    "builtin_list",
    "chosen_sentences",
    "clip_predictor",
    "evaluate_real",
    "face_scores",
    "mean_interval",
    "noise_scores",
    "published_list",
    "read_vertex_list",
    "rows",
    "score_clips",
    "study_wild",
    "style_openings",
    "true_track",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "confidence_intervals": ("Interval", "mean_interval"),
        "corpus_scores": ("Measure", "Row", "best_rows", "rows", "score_clips"),
        "model_predictions": ("clip_predictor", "true_track"),
        "mouth_studies": ("face_scores", "noise_scores", "style_openings"),
        "real_talker": ("evaluate_real",),
        "vertex_lists": ("VertexList", "builtin_list", "published_list", "read_vertex_list"),
        "wild_experiments": ("WildStudy", "chosen_sentences", "study_wild"),
    },
)
