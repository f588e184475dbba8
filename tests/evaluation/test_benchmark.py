"""The published protocol: figures as the scripts behind published tables give them.

`as_published` follows those scripts (CodeTalker's and FaceDiffuser's) loop by loop on arrays, and
shares nothing with the package but the lists of vertices.
"""

from __future__ import annotations

import csv
import json
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.corpus.topologies import BIWI, FLAME, published_indices
from elocute.errors import CorpusError
from elocute.evaluation.benchmark import benchmark_scores, score_predictions
from elocute.evaluation.benchmark_files import (
    BENCHMARKS,
    Truth,
    find_predictions,
    open_benchmark_truth,
)
from elocute.evaluation.metrics import lip_vertex_error
from elocute.evaluation.vertex_regions import VertexRegion, published_region
from elocute.motion.vertex_motion import MM, VertexMotion
from tests.support.commands import refused, succeeds

ONE, TWO = BENCHMARKS["vocaset"].subjects
CONDITIONS = ("FaceTalk_170728_03272_TA", "FaceTalk_170904_00128_TA")
Arrays = dict[str, np.ndarray]


def head_sized(vertices: int, seed: int) -> np.ndarray:
    """(vertex, 3) float64 as large as a head."""
    return np.random.default_rng(seed).uniform(-0.1, 0.1, (vertices, 3))


def moving(template: np.ndarray, frames: int, seed: int) -> np.ndarray:
    """(frame, vertex, 3) float32 within some millimetres of the template."""
    noise = np.random.default_rng(seed).normal(0, 0.002, (frames, *template.shape))
    return (
        template + noise.cumsum(axis=0) / np.sqrt(np.arange(1, frames + 1))[:, None, None]
    ).astype(np.float32)


def as_published(
    true: Arrays, predicted: dict[str, np.ndarray], templates: Arrays, lips: Any, upper: Any
) -> dict[str, float]:
    """LVE, MVE and FDD of predictions called SUBJECT_SENTENCE_condition_SUBJECT."""
    all_true, all_predicted, differences = [], [], []
    for stem, vertices_predicted in predicted.items():
        clip = stem.split("_condition_")[0]
        subject = clip[: clip.rindex("_")]
        vertices_true = true[clip]
        vertices_predicted = vertices_predicted[: len(vertices_true)]
        vertices_true = vertices_true[: len(vertices_predicted)]
        deviations = []
        for vertices in (vertices_true, vertices_predicted):
            motion = vertices.astype(np.float64) - templates[subject]
            squares = np.sum(np.square(motion[:, upper]), axis=2)
            deviations.append(np.mean(np.std(squares, axis=0)))
        differences.append(deviations[0] - deviations[1])
        all_true.extend(vertices_true.astype(np.float64))
        all_predicted.extend(vertices_predicted.astype(np.float64))
    error = np.array(all_true) - np.array(all_predicted)
    worst = np.max(np.sum(np.square(error[:, lips]), axis=2), axis=1)
    return {
        "lve": float(np.mean(worst)),
        "mve": float(np.mean(np.linalg.norm(error, axis=2))),
        "fdd": float(np.mean(differences)),
        "fdd_absolute": float(np.mean(np.abs(differences))),
    }


@pytest.fixture(scope="module")
def vocaset(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Arrays, Arrays]:
    """vertices_npy of four test clips and one of training, flat, 60 frames a second."""
    folder = tmp_path_factory.mktemp("vocaset")
    (folder / "vertices_npy").mkdir()
    subjects = (ONE, TWO, CONDITIONS[0])
    templates = {name: head_sized(5023, index) for index, name in enumerate(subjects)}
    (folder / "templates.pkl").write_bytes(pickle.dumps(templates))
    clips = {}
    for seed, (who, what) in enumerate(
        [(ONE, 21), (ONE, 40), (TWO, 22), (TWO, 33), (TWO, 1), (CONDITIONS[0], 30)]
    ):
        name = f"{who}_sentence{what:02}"
        clips[name] = moving(templates[who], 60 + seed, seed)
        np.save(folder / "vertices_npy" / f"{name}.npy", clips[name].reshape(60 + seed, -1))
    tested = {name: values for name, values in clips.items() if who_tests(name)}
    return folder, tested, templates


def who_tests(name: str) -> bool:
    return name.startswith((ONE, TWO)) and not name.endswith("sentence01")


def write_predictions(folder: Path, true: Arrays, *, every: int = 1, flat: bool = True) -> Arrays:
    """Files of every clip in two conditions; lengths differ from the truth by up to two frames."""
    folder.mkdir()
    written = {}
    for seed, (name, values) in enumerate(true.items()):
        for place, condition in enumerate(CONDITIONS):
            kept = values[::every]
            noise = np.random.default_rng(100 + seed + 7 * place).normal(0, 0.001, kept.shape)
            predicted = (kept + noise).astype(np.float32)
            length = (seed + place) % 3
            predicted = predicted[:-length] if length == 1 else predicted
            if length == 2:
                predicted = np.concatenate([predicted, predicted[-2:]])
            stem = f"{name}_condition_{condition}"
            written[stem] = predicted
            np.save(
                folder / f"{stem}.npy",
                predicted.reshape(len(predicted), -1) if flat else predicted,
            )
    return written


@pytest.mark.parametrize(("every", "flat"), [(1, True), (2, False)])
def test_figures_are_those_of_the_published_scripts(
    vocaset: tuple[Path, Arrays, Arrays], tmp_path: Path, every: int, flat: bool
) -> None:
    """Every second frame of the truth is found by itself, as FaceFormer's loader keeps them."""
    folder, true, templates = vocaset
    predicted = write_predictions(tmp_path / "ours", true, every=every, flat=flat)
    more = tmp_path / "lips.txt"
    more.write_text("5 7 4000")
    shown = succeeds(
        "evaluate",
        "benchmark",
        "vocaset",
        tmp_path / "ours",
        *("--truth", folder, "--lips", more, "--table", tmp_path / "scores.csv", "--json"),
    ).stdout
    report = json.loads(shown)
    kept = {name: values[::every] for name, values in true.items()}
    upper = published_indices(FLAME, "upper_face")
    lists = [published_indices(FLAME, "lips"), np.array([5, 7, 4000])]
    assert len(report["rows"]) == 2
    for row, lips in zip(report["rows"], lists, strict=True):
        expected = as_published(kept, predicted, templates, lips, upper)
        for name, value in expected.items():
            assert row[name]["value"] == pytest.approx(value, rel=1e-5), name
            assert row[name]["low"] <= row[name]["value"] <= row[name]["high"]
        assert row["lips"]["vertices"] == len(lips)
        assert row["sequences"] == 8
    assert report["rows"][0]["lips"]["sha256"] == "9b310f02be5d"
    assert report["upper_face"]["sha256"] == "6bee22a9fdf7"
    assert report["every"] == {"ours": every}
    (note,) = report["notes"]
    assert "8 files of 4 of 4 test clips in 2 conditions" in note and "cut by up to 2" in note
    rows = list(csv.DictReader((tmp_path / "scores.csv").read_text().splitlines()))
    assert float(rows[1]["LVE²"]) == pytest.approx(report["rows"][1]["lve"]["value"])


def test_a_corpus_is_the_same_truth(vocaset: tuple[Path, Arrays, Arrays], tmp_path: Path) -> None:
    """vertices_npy with sounds, converted by `corpus convert`, gives the figures of the folder."""
    import soundfile

    folder, true, _ = vocaset
    source = tmp_path / "source"
    source.mkdir()
    (source / "templates.pkl").write_bytes((folder / "templates.pkl").read_bytes())
    (source / "vertices_npy").symlink_to(folder / "vertices_npy")
    (source / "wav").mkdir()
    for path in (folder / "vertices_npy").glob("*.npy"):
        seconds = len(np.load(path, mmap_mode="r")) / 60
        noise = np.random.default_rng(0).normal(0, 0.1, round(seconds * 16000))
        soundfile.write(source / "wav" / f"{path.stem}.wav", noise, 16000)
    succeeds("corpus", "convert", source, "-o", tmp_path / "corpus", "--fps", 60)
    write_predictions(tmp_path / "ours", true)
    reports = [
        json.loads(
            succeeds(
                "evaluate", "benchmark", "vocaset", tmp_path / "ours", "--truth", where, "--json"
            ).stdout
        )
        for where in (folder / "vertices_npy", tmp_path / "corpus")
    ]
    for name in ("lve", "mve", "fdd", "fdd_paper", "lve_distance"):
        one, other = (report["rows"][0][name]["value"] for report in reports)
        assert one == pytest.approx(other, rel=1e-4), name


def test_several_methods_and_conditions(
    vocaset: tuple[Path, Arrays, Arrays], tmp_path: Path
) -> None:
    folder, true, templates = vocaset
    predicted = write_predictions(tmp_path / "ours", true)
    plain = tmp_path / "theirs"
    plain.mkdir()
    for name, values in true.items():
        np.save(plain / f"voca_{name}.npy", values)
    shown = succeeds(
        "evaluate", "benchmark", "vocaset", tmp_path / "ours", plain, "--truth", folder
    ).stdout.splitlines()
    assert shown[1].startswith("ours") and shown[2].startswith("theirs")
    assert [float(x) for x in shown[2].split()[-6:]] == [0] * 6
    assert any("4 files of 4 of 4 test clips, every frame" in line for line in shown)
    one = json.loads(
        succeeds(
            "evaluate",
            "benchmark",
            "vocaset",
            tmp_path / "ours",
            *("--truth", folder, "--condition", CONDITIONS[1], "--json"),
        ).stdout
    )["rows"][0]
    chosen = {stem: values for stem, values in predicted.items() if stem.endswith(CONDITIONS[1])}
    lips, upper = (published_indices(FLAME, which) for which in ("lips", "upper_face"))
    assert one["lve"]["value"] == pytest.approx(
        as_published(true, chosen, templates, lips, upper)["lve"], rel=1e-5
    )


def test_biwi_is_scored_over_test_a(tmp_path: Path) -> None:
    """23370 vertices, sentences e37 to e40 of the six subjects; those of Test-B are left out."""
    truth_folder, ours = tmp_path / "vertices_npy", tmp_path / "npy"
    truth_folder.mkdir()
    ours.mkdir()
    templates = {name: 5 * head_sized(23370, index) for index, name in enumerate(("F2", "M5"))}
    (tmp_path / "templates.pkl").write_bytes(pickle.dumps(templates))
    true, predicted = {}, {}
    for seed, (who, what) in enumerate([("F2", "e37"), ("M5", "e40"), ("F2", "e01")]):
        true[f"{who}_{what}"] = moving(templates[who], 4, seed)
        np.save(truth_folder / f"{who}_{what}.npy", true[f"{who}_{what}"].reshape(4, -1))
        stem = f"{who}_{what}_condition_{who}"
        predicted[stem] = moving(templates[who], 5, 10 + seed)
        np.save(ours / f"{stem}.npy", predicted[stem].reshape(5, -1))
    np.save(ours / "F1_e37_condition_F2.npy", predicted["F2_e37_condition_F2"])
    benchmark = BENCHMARKS["biwi"]
    truth = open_benchmark_truth(benchmark, tmp_path)
    files = find_predictions(truth, ours, condition="own")
    assert [each.clip for each in files] == ["F2_e37", "M5_e40"]
    lips = published_region(BIWI, "lips")
    upper = published_region(BIWI, "upper_face")
    (row,) = benchmark_scores("ours", score_predictions(truth, files, [lips], upper), [lips])
    del predicted["F2_e01_condition_F2"]
    expected = as_published(true, predicted, templates, lips.indices, upper.indices)
    for name, value in expected.items():
        assert row.intervals[name].value == pytest.approx(value, rel=1e-5), name


@pytest.fixture
def truth(vocaset: tuple[Path, Arrays, Arrays]) -> Truth:
    return open_benchmark_truth(BENCHMARKS["vocaset"], vocaset[0])


def _one_nan(values: np.ndarray) -> np.ndarray:
    spoilt = values.copy()
    spoilt[7, 4000, 1] = np.nan
    return spoilt


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda v: v[:, :5000], r"5000 vertices; allowed: .*5023"),
        (lambda v: v.astype(np.int32), "int32"),
        (_one_nan, "NaN or infinity in frame 7"),
        (lambda v: v * 1000, "times as large as the true one"),
        (lambda v: v[:0], "no frame"),
    ],
)
def test_a_file_that_cannot_be_scored_is_named(
    vocaset: tuple[Path, Arrays, Arrays],
    truth: Truth,
    tmp_path: Path,
    spoil: Callable[[np.ndarray], np.ndarray],
    told: str,
) -> None:
    _, true, _ = vocaset
    write_predictions(tmp_path / "ours", true)
    files = find_predictions(truth, tmp_path / "ours")
    np.save(files[3].path, spoil(true[files[3].clip]))
    lips, upper = (published_region(FLAME, which) for which in ("lips", "upper_face"))
    with pytest.raises(CorpusError, match=told) as error:
        score_predictions(truth, files, [lips], upper)
    assert files[3].path.name in str(error.value)


def test_missing_clips_another_rate_and_missing_faces_are_told(
    vocaset: tuple[Path, Arrays, Arrays], tmp_path: Path
) -> None:
    folder, true, _ = vocaset
    ours = tmp_path / "ours"
    write_predictions(ours, true)
    for path in ours.glob(f"{TWO}_sentence22*"):
        path.unlink()
    asked = "evaluate", "benchmark", "vocaset", ours, "--truth", folder
    refused(*asked, says=(f"1 of 4 test clips missing: {TWO}_sentence22", "--partial"))
    assert "6 files of 3 of 4" in succeeds(*asked, "--partial").stdout
    third = tmp_path / "third"
    third.mkdir()
    for name, values in true.items():
        np.save(third / f"{name}.npy", values[::3])
    asked = "evaluate", "benchmark", "vocaset", third, "--truth", folder
    refused(*asked, says=("21 frames; allowed: 62", "--every"))
    succeeds(*asked, "--every", 3)
    for wrong, told in (
        (("vocaset", ours, "--truth", tmp_path), "none of vocaset's test clips"),
        (("vocaset", ours, "--truth", tmp_path / "nowhere"), "no such folder"),
        (("lrs3", ours, "--truth", folder), "vocaset, biwi"),
        (("vocaset", ours, ours, "--truth", folder), "a folder twice"),
        (("biwi", ours, "--truth", folder), "none of biwi's test clips"),
        (("vocaset", ours, "--truth", folder, "--condition", "nobody"), "in condition nobody"),
        (
            ("vocaset", ours, "--truth", folder, "--templates", folder / "no.pkl"),
            "no such file; allowed: the data's templates.pkl",
        ),
    ):
        refused("evaluate", "benchmark", *wrong, says=told)


def write_own(folder: Path, vertices: int) -> tuple[Arrays, Arrays]:
    """Two subjects of a mesh that nobody knows; names may hold `_`."""
    (folder / "vertices_npy").mkdir(parents=True)
    templates = {name: head_sized(vertices, i) for i, name in enumerate(("ann_b", "ann"))}
    (folder / "templates.pkl").write_bytes(
        pickle.dumps({name: face.tolist() for name, face in templates.items()})
    )
    clips = {}
    for seed, (who, what) in enumerate([("ann_b", "s1"), ("ann", "s1"), ("ann", "hello")]):
        clips[f"{who}_{what}"] = moving(templates[who], 20, seed)
        np.save(folder / "vertices_npy" / f"{who}_{what}.npy", clips[f"{who}_{what}"])
    return clips, templates


def test_a_data_set_of_ones_own(tmp_path: Path) -> None:
    """Any mesh, every clip; lists as files: masks of a pickle, and points picked in MeshLab."""
    true, templates = write_own(tmp_path / "own", 300)
    (tmp_path / "ours").mkdir()
    predicted = {}
    for seed, (name, values) in enumerate(true.items()):
        noise = np.random.default_rng(seed).normal(0, 1e-3, values.shape)
        predicted[f"{name}_condition_ann"] = (values + noise).astype(np.float32)
        np.save(tmp_path / "ours" / f"x_{name}_condition_ann.npy", (values + noise))
    lips, brows = np.array([4, 9, 200]), np.arange(20, 60)
    upright = np.isin(np.arange(300), brows)
    masks = tmp_path / "FLAME_masks.pkl"
    masks.write_bytes(pickle.dumps({"lips": lips, "forehead": upright, "nose": np.array([1])}))
    places = templates["ann_b"][lips] + 1e-4
    points = "".join(
        f'<point active="1" name="{n}" x="{x}" y="{y}" z="{z}"/>'
        for n, (x, y, z) in enumerate(places)
    )
    (tmp_path / "lips.pp").write_text(
        f"<!DOCTYPE PickedPoints>\n<PickedPoints>{points}</PickedPoints>"
    )
    asked = ("evaluate", "benchmark", "own", tmp_path / "ours", "--truth", tmp_path / "own")
    lists = ("--lips", masks, "--lips", tmp_path / "lips.pp", "--upper-face", f"{masks}:forehead")
    report = json.loads(succeeds(*asked, *lists, "--json").stdout)
    expected = as_published(true, predicted, templates, lips, brows)
    assert [row["lips"]["name"] for row in report["rows"]] == [
        "file:FLAME_masks.pkl:lips",
        "file:lips.pp",
    ]
    for row in report["rows"]:
        assert (row["lips"]["vertices"], row["sequences"]) == (3, 3)
        for name, value in expected.items():
            assert row[name]["value"] == pytest.approx(value, rel=1e-4), name
    own = json.loads(succeeds(*asked, *lists, "--condition", "own", "--partial", "--json").stdout)
    assert own["rows"][0]["sequences"] == 2  # `ann` is not the subject of ann_b_s1
    refused(*asked, says="no published lists; allowed: --lips FILE and --upper-face FILE")
    refused(
        *asked, *lists[:-1], masks, says="no region 'upper_face'; allowed: forehead, lips, nose"
    )
    refused(*asked, *lists[:-1], f"{masks}:brows", says="no region 'brows'")
    refused(*asked[:-1], tmp_path / "ours", *lists, says="templates.pkl: no such file")
    (tmp_path / "ours" / "x_ann_hello_condition_ann.npy").unlink()
    refused(*asked, *lists, says="1 of 3 test clips missing: ann_hello")


def test_ones_own_clips_on_flame_have_the_published_lists(tmp_path: Path) -> None:
    true, templates = write_own(tmp_path / "own", 5023)
    truth = open_benchmark_truth(None, tmp_path / "own" / "vertices_npy")
    assert sorted(truth.clips) == sorted(true) and truth.benchmark.topology is FLAME
    read = truth.clips["ann_b_s1"]()
    assert np.array_equal(read.template, templates["ann_b"].astype(np.float32))
    assert [each.clip for each in find_predictions(truth, tmp_path / "own" / "vertices_npy")] == (
        sorted(true)
    )


def test_the_lip_error_is_that_of_torchmetrics() -> None:
    lve = pytest.importorskip("torchmetrics.functional.multimodal.lve")
    torch = pytest.importorskip("torch")
    template = head_sized(200, 1)
    true, predicted = (VertexMotion(moving(template, 30, n), template, 1.0) for n in (1, 2))
    lips = VertexRegion("lips", np.array([3, 50, 51, 199]))
    squared, _ = lip_vertex_error(predicted, true, lips)
    both = (torch.from_numpy(each.values) for each in (predicted, true))
    theirs = lve.lip_vertex_error(*both, mouth_map=lips.indices.tolist())
    assert squared / MM**2 == pytest.approx(float(theirs), rel=1e-5)


def test_timing_is_that_of_lips_so_many_frames_late(
    vocaset: tuple[Path, Arrays, Arrays], tmp_path: Path
) -> None:
    """Lips of the truth and of a method that is two frames late; MTM asks for FLAME's mesh."""
    pytest.importorskip("numba")
    templates = vocaset[2]
    late, folder = tmp_path / "late", tmp_path / "vertices_npy"
    late.mkdir()
    folder.mkdir()
    (tmp_path / "templates.pkl").write_bytes(pickle.dumps(templates))
    for number, what in enumerate((21, 22)):
        gap = np.zeros((64, 5023, 3))
        gap[:, 3504, 1] = -0.02 - 0.005 * np.sin(2 * np.pi * (np.arange(64) + 3 * number) / 9)
        face = np.where(np.isin(np.arange(5023), (3504, 3531))[:, None], 0, templates[ONE])
        vertices = (face + gap).astype(np.float32)
        np.save(folder / f"{ONE}_sentence{what}.npy", vertices[2:].reshape(62, -1))
        np.save(late / f"{ONE}_sentence{what}.npy", vertices[:-2].reshape(62, -1))
    asked = ("evaluate", "benchmark", "vocaset", late, "--truth", folder, "--timing")
    (row,) = json.loads(succeeds(*asked, "--json").stdout)["rows"]
    assert row["mtm"]["value"] == pytest.approx(2, abs=0.2)
    assert "MTM, frames" in succeeds(*asked).stdout.splitlines()[0]
    for path in late.glob("*.npy"):
        np.save(path, np.repeat(np.load(path)[:1], 62, axis=0))  # lips that do not move
    assert succeeds(*asked).stdout.splitlines()[1].split()[-1] == "none"


def test_timing_needs_to_know_the_middles_of_the_lips(tmp_path: Path) -> None:
    (tmp_path / "vertices_npy").mkdir()
    template = head_sized(40, 1)
    (tmp_path / "templates.pkl").write_bytes(pickle.dumps({"ann": template}))
    np.save(tmp_path / "vertices_npy" / "ann_one.npy", moving(template, 5, 1).reshape(5, -1))
    (tmp_path / "lips.txt").write_text("1 2 3")
    lists = ("--lips", tmp_path / "lips.txt", "--upper-face", tmp_path / "lips.txt")
    asked = ("evaluate", "benchmark", "own", tmp_path / "vertices_npy", "--truth", tmp_path)
    refused(*asked, *lists, "--timing", says="leave --timing out")
