"""Measures: models against clips and real talkers, alignments against truth, studies of noise,
styles, faces and languages.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.evaluation.benchmark import (
        BenchmarkScore as BenchmarkScore,
        benchmark_scores as benchmark_scores,
        score_predictions as score_predictions,
    )
    from elocute.evaluation.benchmark_files import (
        benchmark_named as benchmark_named,
        find_predictions as find_predictions,
        frames_apart as frames_apart,
        open_benchmark_truth as open_benchmark_truth,
    )
    from elocute.evaluation.confidence_intervals import (
        ConfidenceInterval as ConfidenceInterval,
        mean_interval as mean_interval,
    )
    from elocute.evaluation.corpus_scores import (
        MetricConfig as MetricConfig,
        SubjectScore as SubjectScore,
        best_style_scores as best_style_scores,
        score_clips as score_clips,
        subject_scores as subject_scores,
    )
    from elocute.evaluation.face_study import (
        FaceScore as FaceScore,
        face_scores as face_scores,
        faces_of as faces_of,
        heard_closures as heard_closures,
        own_closures as own_closures,
        random_faces as random_faces,
    )
    from elocute.evaluation.lip_penetration import (
        LipContact as LipContact,
        lip_contact as lip_contact,
    )
    from elocute.evaluation.model_predictions import (
        clip_predictor as clip_predictor,
        recorded_motion as recorded_motion,
    )
    from elocute.evaluation.mouth_studies import (
        NoiseScore as NoiseScore,
        noise_scores as noise_scores,
        style_openings as style_openings,
    )
    from elocute.evaluation.phone_mouth_scores import (
        ContactCount as ContactCount,
        PhoneMouthScore as PhoneMouthScore,
        SpokenTake as SpokenTake,
        mouth_class as mouth_class,
        phone_mouth_score as phone_mouth_score,
    )
    from elocute.evaluation.tracked_mouth_scores import (
        GroupScore as GroupScore,
        MouthScore as MouthScore,
        TrackedMouthReport as TrackedMouthReport,
        evaluate_tracked_mouths as evaluate_tracked_mouths,
    )
    from elocute.evaluation.vertex_regions import (
        VertexRegion as VertexRegion,
        builtin_region as builtin_region,
        published_region as published_region,
        read_vertex_region as read_vertex_region,
    )
    from elocute.evaluation.wild_experiments import (
        WildStudy as WildStudy,
        select_sentences as select_sentences,
        study_wild as study_wild,
    )

__getattr__, __dir__ = lazy(__name__, __file__)
