"""Metrics against their definitions, written out on small arrays."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_store import Corpus
from elocute.corpus.topologies import BIWI, FLAME, topology_of
from elocute.errors import CorpusError, MotionError
from elocute.evaluation.confidence_intervals import mean_interval, metric_intervals, ratio_interval
from elocute.evaluation.corpus_scores import intensity_correlation
from elocute.evaluation.lip_closures import ClosureCounts, count_closures, lip_opening, short_runs
from elocute.evaluation.metrics import (
    AVERAGED_METRICS,
    TITLES,
    SilentMotion,
    clip_metrics,
    dynamics_deviation,
    lip_vertex_error,
    mean_jerk,
    silent_frames,
    vertex_errors,
)
from elocute.evaluation.model_predictions import recorded_motion
from elocute.evaluation.vertex_regions import (
    VertexRegion,
    builtin_region,
    published_region,
    read_vertex_region,
)
from elocute.head.builtin import load_builtin_head
from elocute.motion import vertex_motion
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.vertex_motion import VertexMotion

FPS = 30.0
LIPS = VertexRegion("some", np.array([1, 4, 6]))


def random_track(seed: int, frames: int = 23, vertices: int = 9) -> VertexMotion:
    rng = np.random.default_rng(seed)
    face = np.random.default_rng(99).normal(size=(vertices, 3))
    return VertexMotion(face + rng.normal(0, 0.002, (frames, vertices, 3)), face, FPS)


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Several blocks a clip, the last one of one frame, so that every seam is met."""
    monkeypatch.setattr(vertex_motion, "BLOCK_FRAMES", 11)


def test_every_metric_is_its_definition() -> None:
    one, two = random_track(1), random_track(2)
    apart = (one.values[:] - two.values[:]) * 1000
    distance = np.linalg.norm(apart, axis=2)
    worst = distance[:, LIPS.indices].max(axis=1)
    assert lip_vertex_error(one, two, LIPS) == pytest.approx(((worst**2).mean(), worst.mean()))
    assert vertex_errors(one, two)[0] == pytest.approx(distance.mean())
    steps = np.diff(one.values, axis=0) - np.diff(two.values, axis=0)
    assert vertex_errors(one, two)[1] == pytest.approx(1000 * np.linalg.norm(steps, axis=2).mean())
    third = np.diff(one.values[:, LIPS.indices] * 1000, 3, axis=0) * FPS**3
    assert mean_jerk(one, LIPS) == pytest.approx(np.linalg.norm(third, axis=2).mean())
    lively = [
        np.linalg.norm((t.values - t.template)[:, LIPS.indices] * 1000, axis=2).std(axis=0)
        for t in (two, one)
    ]
    difference = lively[0] - lively[1]
    expected = (difference.mean(), np.abs(difference).mean())
    assert dynamics_deviation(one, two, LIPS)[:2] == pytest.approx(expected)


def test_dynamics_are_also_what_the_conventional_code_computes() -> None:
    """Squared distances from the neutral face, deviation over time, mean over vertices, true
    minus predicted: loops and all, as published figures are counted."""
    predicted, true = random_track(1), random_track(2)
    spread = []
    for track in (true, predicted):
        motion = (track.values - track.template) * 1000
        squares = [[(frame[v] ** 2).sum() for v in LIPS.indices] for frame in motion]
        spread.append(np.mean(np.std(squares, axis=0)))
    expected = spread[0] - spread[1]
    assert dynamics_deviation(predicted, true, LIPS)[2] == pytest.approx(expected)
    scores = clip_metrics(predicted, true, LIPS, LIPS)
    assert scores.fdd_code_mm2 == pytest.approx(expected)
    assert scores.fdd_code_mm2 != pytest.approx(scores.fdd_mm)


def test_a_clip_is_not_away_from_itself() -> None:
    one = random_track(3)
    scores = clip_metrics(one, one, LIPS, LIPS)
    for name in ("lve_mm2", "lve_mm", "mve_mm", "fdd_mm", "fdd_abs_mm", "velocity_mm"):
        assert getattr(scores, name) == 0
    assert scores.jerk == scores.true_jerk > 0


def test_lips_that_move_in_silence_are_told_from_those_that_speak() -> None:
    """20 frames of tone and 20 of silence; predicted lips go on moving 9 mm/s, true ones stop."""
    going = np.arange(40)[:, None, None] * np.array([0, 0.0003, 0])
    face = np.random.default_rng(9).normal(size=(9, 3))
    predicted = VertexMotion(face + going, face, FPS)
    true = VertexMotion(face + np.minimum(going, going[20]), face, FPS)
    tone = 0.3 * np.sin(np.arange(round(40 / FPS * 16000)) / 5)
    tone[round(20 / FPS * 16000) :] *= 0.005  # 46 dB lower
    silent = silent_frames(Waveform(tone.astype(np.float32), 16000), 40, FPS)
    assert silent.tolist() == [False] * 20 + [True] * 20
    scores = clip_metrics(predicted, true, LIPS, silent=silent)
    assert scores.silence == SilentMotion(silent=19, moving=19, true_moving=0)
    assert scores.lip_intensity == pytest.approx(0.3)
    assert scores.true_lip_intensity == pytest.approx(0.3 * (20 / 39) ** 0.5)
    pooled = metric_intervals([scores, clip_metrics(true, true, LIPS, silent=silent)])
    assert (pooled["lip_leak"].value, pooled["true_lip_leak"].value) == (0.5, 0)
    assert metric_intervals([clip_metrics(true, true, LIPS)])["lip_leak"].record() is None


def test_the_correlation_of_intensities_is_that_within_each_person() -> None:
    """As SciPy has it for values standardised by person; who has one clip is left out."""
    stats = pytest.importorskip("scipy.stats")
    draw = np.random.default_rng(1)
    loudness = draw.uniform(0.01, 0.1, 13)
    intensity = 4 * loudness + draw.normal(0, 0.05, 13)
    people = ["ann"] * 6 + ["bob"] * 6 + ["cy"]
    loudness[6:12] *= 10  # Bob's microphone says nothing of how he speaks
    standard = [
        np.concatenate([stats.zscore(values[:6], ddof=1), stats.zscore(values[6:12], ddof=1)])
        for values in (loudness, intensity)
    ]
    found = intensity_correlation(list(loudness), list(intensity), people)
    assert found.value == pytest.approx(stats.pearsonr(*standard).statistic)
    assert -1 <= found.low < found.value < found.high <= 1
    alone = intensity_correlation([0.1, 0.2], [1, 2], ["ann", "bob"])
    assert alone.record() is None


def test_a_constant_offset_is_measured_in_millimetres() -> None:
    one = random_track(4)
    moved = VertexMotion(one.values + np.array([0.003, 0, 0.004]), one.template, FPS)
    scores = clip_metrics(moved, one, LIPS)
    assert (scores.lve_mm2, scores.lve_mm, scores.mve_mm) == pytest.approx((25, 5, 5))
    assert scores.velocity_mm == pytest.approx(0, abs=1e-9)
    assert scores.fdd_mm != scores.fdd_mm  # no list of the upper face: not available
    assert scores.record()["fdd_mm"] is None


def test_a_still_face_has_lost_all_dynamics() -> None:
    one = random_track(5)
    still = VertexMotion(np.repeat(one.template[None], one.frame_count, axis=0), one.template, FPS)
    signed, absolute, _ = dynamics_deviation(still, one, LIPS)
    assert signed == absolute > 0
    assert dynamics_deviation(one, still, LIPS)[0] == -signed


def test_weights_and_the_vertices_they_make_are_one_motion() -> None:
    rng = np.random.default_rng(6)
    face, basis = rng.normal(size=(9, 3)), rng.normal(size=(4, 9, 3)) * 0.01
    weights = rng.random((25, 4))
    low = VertexMotion(weights, face, FPS, basis)
    high = VertexMotion(face + np.tensordot(weights, basis, 1), face, FPS)
    assert vertex_errors(low, high)[0] == pytest.approx(0, abs=1e-9)
    other = random_track(7, 25)
    other = VertexMotion(other.values, face, FPS)
    assert lip_vertex_error(low, other, LIPS) == pytest.approx(lip_vertex_error(high, other, LIPS))


def test_what_cannot_be_compared_is_refused() -> None:
    one = random_track(8)
    for other in (random_track(8, 22), random_track(8, 23, 8)):
        with pytest.raises(CorpusError, match=r"prediction|motion"):
            clip_metrics(one, other)
    with pytest.raises(CorpusError, match="frames per second"):
        clip_metrics(one, VertexMotion(one.values, one.template, 60.0))
    with pytest.raises(MotionError, match="allowed"):
        VertexMotion(one.values, one.template[:3], FPS)


def test_short_frames_have_no_steps() -> None:
    one = random_track(9, 1)
    assert vertex_errors(one, one)[1] == mean_jerk(one, LIPS) == 0


class TestClosures:
    def test_rests_and_both_ends_are_no_closures(self) -> None:
        closed = np.array([1, 1, 0, 1, 1, 0, 0, *[1] * 20, 0, 1, 0, 1], bool)
        assert short_runs(closed, FPS) == [(3, 5), (28, 29)]
        assert short_runs(np.ones(5, bool), FPS) == short_runs(np.zeros(5, bool), FPS) == []
        assert short_runs(closed[3:7], FPS) == []

    def test_met_missed_and_invented(self) -> None:
        true = np.full(60, 5.0)
        true[[10, 11, 30]] = 0.0
        predicted = np.full(60, 5.0)
        predicted[[12, 50]] = 0.1
        assert count_closures(predicted, true, FPS) == ClosureCounts(
            wanted=2, met=1, made=2, right=1
        )
        assert count_closures(true, true, FPS) == ClosureCounts(2, 2, 2, 2)

    def test_the_opening_is_that_of_the_mouth_measures(self, corpus: Corpus) -> None:
        head, weights = load_builtin_head(), np.array(corpus.frames("plain.s0"))
        track = VertexMotion(weights, head.template, corpus.fps, head.expression_basis)
        expected = measure_mouth(Motion(head, weights, corpus.fps))["opening_mm"]
        np.testing.assert_allclose(lip_opening(track), expected, atol=1e-3)

    def test_another_topology_has_no_lips(self) -> None:
        with pytest.raises(CorpusError, match="built-in"):
            lip_opening(random_track(1))


class TestVertexLists:
    def test_the_built_in_lists(self) -> None:
        head = load_builtin_head()
        lips, upper, eyes = (builtin_region(name) for name in ("lips", "upper_face", "eyes"))
        assert len(lips.indices) == len(head.regions["lips"])
        assert not np.isin(lips.indices, upper.indices).any()
        assert np.isin(eyes.indices, upper.indices).all()
        assert head.template[upper.indices, 1].min() > head.template[lips.indices, 1].max()
        with pytest.raises(CorpusError, match="upper_face"):
            builtin_region("ears")

    @pytest.mark.parametrize(
        ("topology", "which", "count", "digest"),
        [
            (FLAME, "lips", 428, "9b310f02be5d"),
            (FLAME, "upper_face", 1501, "6bee22a9fdf7"),
            (BIWI, "lips", 4996, "bf030dc9cf39"),
            (BIWI, "upper_face", 7784, "8e311af01cc6"),
        ],
    )
    def test_the_published_lists(self, topology, which, count, digest) -> None:
        found = published_region(topology, which)
        assert (len(found.indices), found.digest) == (count, digest)
        assert (np.diff(found.indices) > 0).all() and found.indices[-1] < topology.vertices
        assert topology_of(topology.vertices) is topology

    def test_another_mesh_has_no_published_list(self) -> None:
        assert topology_of(5024) is None
        with pytest.raises(CorpusError, match="lips, upper_face"):
            published_region(FLAME, "ears")

    def test_the_hash_is_of_the_sorted_numbers(self, tmp_path: Path) -> None:
        raw = np.array([3, 5, 8], "<i8").tobytes()
        (tmp_path / "a.json").write_text("[8, 3, 5, 5]")
        (tmp_path / "a.txt").write_text("5 3\n8,")
        np.save(tmp_path / "a.npy", np.array([5, 8, 3], np.uint16))
        for name in ("a.json", "a.txt", "a.npy"):
            read = read_vertex_region(tmp_path / name, 9)
            assert read.indices.tolist() == [3, 5, 8]
            assert read.digest == hashlib.sha256(raw).hexdigest()[:12]
            assert read.record()["name"] == f"file:{name}"

    @pytest.mark.parametrize(
        ("name", "content", "told"),
        [
            ("a.json", "{", "no JSON"),
            ("a.json", '{"a": 1}', "no list of numbers"),
            ("a.json", "[[1], 2]", "no list"),
            ("a.json", "[1.5]", "no list of numbers"),
            ("a.json", "[]", "whole numbers"),
            ("a.json", "[1e400]", "beyond what a number holds"),
            ("a.txt", "1 two", "no list"),
            ("a.txt", "-1", "vertex -1"),
            ("a.txt", "3 9", "vertex 9"),
            ("a.txt", "9" * 40, "no list"),
            ("a.npy", "hello", "no NumPy array"),
            ("a.npy", "", "no NumPy array"),
            ("a.pkl", "x", "no pickle"),
            ("a.vtx", "x", "suffix"),
            ("a.pp", "<point x='1'/>", "with a mesh"),
            ("none/a.txt", None, "no such file"),
        ],
    )
    def test_no_list(self, tmp_path: Path, name: str, content: str | None, told: str) -> None:
        if content is not None:
            (tmp_path / name).write_text(content)
        with pytest.raises(CorpusError, match=told):
            read_vertex_region(tmp_path / name, 9)


class TestBootstrap:
    def test_a_mean_lies_within_its_interval_and_the_seed_decides(self) -> None:
        values = np.random.default_rng(0).normal(3, 1, 50).tolist()
        first = mean_interval(values, seed=1)
        assert first == mean_interval(values, seed=1) != mean_interval(values, seed=2)
        assert first.value == pytest.approx(np.mean(values))
        # A normal mean's interval is ±1.96 standard errors.
        half = 1.96 * np.std(values) / np.sqrt(50)
        assert first.high - first.value == pytest.approx(half, rel=0.15)
        assert first.value - first.low == pytest.approx(half, rel=0.15)

    def test_ratios_are_pooled_and_nothing_is_nothing(self) -> None:
        assert ratio_interval([1, 0], [1, 3]).value == 0.25
        assert ratio_interval([], []).record() is None
        assert ratio_interval([0, 0], [0, 0]).record() is None
        assert mean_interval([1.0, float("nan")]).record() is None
        assert mean_interval([2.0]).record() == {"value": 2.0, "low": 2.0, "high": 2.0}

    def test_a_summary_of_a_corpus_is_json(self, corpus: Corpus) -> None:
        lists = builtin_region("lips"), builtin_region("upper_face")
        clips = [
            clip_metrics(recorded_motion(corpus, a), recorded_motion(corpus, a), *lists, mouth=True)
            for a in ("plain.s1", "broad.s1")  # in which an m is said
        ]
        summary = metric_intervals(clips)
        assert summary["mve_mm"].value == 0
        assert summary["closure_recall"].value == summary["closure_precision"].value == 1
        json.dumps({name: i.record() for name, i in summary.items()}, allow_nan=False)


def test_columns_of_tables_are_metrics_and_titled_once() -> None:
    counted = {"closure_recall", "closure_precision", "lip_leak", "true_lip_leak"}
    counted |= {"slcc", "true_slcc"}  # over clips, by `subject_scores`
    assert set(TITLES) - counted <= set(AVERAGED_METRICS)
    assert set(AVERAGED_METRICS) - set(TITLES) == {"fdd_abs_mm"}  # in the JSON alone
    assert len(set(TITLES.values())) == len(TITLES)
