"""Measures: models against clips and real talkers, alignments against truth, studies of noise,
styles, faces and languages.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.evaluation.benchmark import BenchmarkScore, benchmark_scores, score_predictions
    from elocute.evaluation.benchmark_files import (
        benchmark_named,
        find_predictions,
        frames_apart,
        open_benchmark_truth,
    )
    from elocute.evaluation.confidence_intervals import ConfidenceInterval, mean_interval
    from elocute.evaluation.corpus_scores import (
        MetricConfig,
        SubjectScore,
        best_style_scores,
        score_clips,
        subject_scores,
    )
    from elocute.evaluation.face_study import (
        FaceScore,
        face_scores,
        faces_of,
        heard_closures,
        own_closures,
        random_faces,
    )
    from elocute.evaluation.lip_penetration import LipContact, lip_contact
    from elocute.evaluation.model_predictions import clip_predictor, recorded_motion
    from elocute.evaluation.mouth_studies import NoiseScore, noise_scores, style_openings
    from elocute.evaluation.phone_mouth_scores import (
        ContactCount,
        PhoneMouthScore,
        SpokenTake,
        mouth_class,
        phone_mouth_score,
    )
    from elocute.evaluation.tracked_mouth_scores import (
        GroupScore,
        MouthScore,
        TrackedMouthReport,
        evaluate_tracked_mouths,
    )
    from elocute.evaluation.vertex_regions import (
        VertexRegion,
        builtin_region,
        published_region,
        read_vertex_region,
    )
    from elocute.evaluation.wild_experiments import WildStudy, select_sentences, study_wild

__all__ = [
    "BenchmarkScore",
    "ConfidenceInterval",
    "ContactCount",
    "FaceScore",
    "GroupScore",
    "LipContact",
    "MetricConfig",
    "MouthScore",
    "NoiseScore",
    "PhoneMouthScore",
    "SpokenTake",
    "SubjectScore",
    "TrackedMouthReport",
    "VertexRegion",
    "WildStudy",
    "benchmark_named",
    "benchmark_scores",
    "best_style_scores",
    "builtin_region",
    "clip_predictor",
    "evaluate_tracked_mouths",
    "face_scores",
    "faces_of",
    "find_predictions",
    "frames_apart",
    "heard_closures",
    "lip_contact",
    "mean_interval",
    "mouth_class",
    "noise_scores",
    "open_benchmark_truth",
    "own_closures",
    "phone_mouth_score",
    "published_region",
    "random_faces",
    "read_vertex_region",
    "recorded_motion",
    "score_clips",
    "score_predictions",
    "select_sentences",
    "study_wild",
    "style_openings",
    "subject_scores",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "benchmark": ("BenchmarkScore", "benchmark_scores", "score_predictions"),
        "benchmark_files": (
            "benchmark_named",
            "find_predictions",
            "frames_apart",
            "open_benchmark_truth",
        ),
        "confidence_intervals": ("ConfidenceInterval", "mean_interval"),
        "corpus_scores": (
            "MetricConfig",
            "SubjectScore",
            "best_style_scores",
            "subject_scores",
            "score_clips",
        ),
        "model_predictions": ("clip_predictor", "recorded_motion"),
        "face_study": (
            "FaceScore",
            "face_scores",
            "faces_of",
            "heard_closures",
            "own_closures",
            "random_faces",
        ),
        "lip_penetration": ("LipContact", "lip_contact"),
        "mouth_studies": ("NoiseScore", "noise_scores", "style_openings"),
        "phone_mouth_scores": (
            "ContactCount",
            "PhoneMouthScore",
            "SpokenTake",
            "mouth_class",
            "phone_mouth_score",
        ),
        "tracked_mouth_scores": (
            "GroupScore",
            "MouthScore",
            "TrackedMouthReport",
            "evaluate_tracked_mouths",
        ),
        "vertex_regions": (
            "VertexRegion",
            "builtin_region",
            "published_region",
            "read_vertex_region",
        ),
        "wild_experiments": ("WildStudy", "select_sentences", "study_wild"),
    },
)
