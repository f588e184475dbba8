"""`elocute evaluate corpus`: models against recorded clips.

The fixture's clips were made by the articulation driver, so the driver in the speaker's own style
is the truth, and everything else is away from it.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.animation import animate
from elocute.audio.read import read_audio
from elocute.corpus.corpus_store import Corpus
from elocute.errors import ModelError
from elocute.evaluation.model_predictions import clip_predictor, recorded_motion
from elocute.evaluation.vertex_regions import builtin_region
from elocute.head.builtin import load_builtin_head
from elocute.models.feature_extraction import extract_features
from elocute.models.model_shapes import basis_of
from elocute.models.protocol import FrameSpan
from elocute.models.registry import open_model

Cli = Callable[..., Any]
SPEAKERS = ("plain", "broad", "tense")


RULES = "--model", "articulation"
"""What made the corpus of these tests."""


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory, make_corpus: Callable[..., Corpus]) -> Corpus:
    """`plain` says three clips of the train part, `tense` one of the test part."""
    return make_corpus(tmp_path_factory.mktemp("corpus") / "clips")


def rows_of(report: dict[str, Any]) -> dict[tuple[str, str], dict[str, Any]]:
    return {(row["subject"], row["style"]): row for row in report["rows"]}


def test_the_best_style_is_the_one_that_made_the_clips(cli: Cli, corpus: Corpus) -> None:
    measure = "evaluate", "corpus", corpus.folder, *RULES, "--contacts", "auto", "--json"
    best = json.loads(cli(*measure, "--style", "best").stdout)
    assert list(rows_of(best)) == [("tense", "tense"), ("all", "best")]
    row = rows_of(best)["tense", "tense"]
    assert row["clips"] == 1 and row["lve_mm"]["value"] < 0.01
    each = json.loads(cli(*measure).stdout)
    lips = {
        style: row["lve_mm"]["value"] for (who, style), row in rows_of(each).items() if who == "all"
    }
    assert min(lips, key=lambda style: lips[style]) == "tense"
    assert set(SPEAKERS) < set(lips) and lips["broad"] > 0.3
    assert each["lips"]["sha256"] == builtin_region("lips").digest


def test_lips_that_meet_are_counted(cli: Cli, corpus: Corpus) -> None:
    options = "--part", "train", "--style", "plain", "--json", "--contacts", "both"
    report = json.loads(cli("evaluate", "corpus", corpus.folder, *RULES, *options).stdout)
    assert [row["contacts"] for row in report["rows"]] == ["off", "off", "auto", "auto"]
    bare, finished = (row for row in report["rows"] if row["subject"] == "plain")
    assert bare["clips"] == finished["clips"] == 3
    assert finished["closure_recall"]["value"] == finished["closure_precision"]["value"] == 1
    assert bare["closure_recall"]["value"] < 0.5
    both = *RULES, *options[:4], "--contacts", "both"
    shown = cli("evaluate", "corpus", corpus.folder, *both).stdout
    assert [line.split()[2] for line in shown.splitlines()[1:5]] == ["off", "off", "auto", "auto"]


@pytest.mark.slow
def test_a_trained_model_knows_its_speakers(cli: Cli, learned: Any, tmp_path: Path) -> None:
    folder, report = learned.corpus.folder, tmp_path / "report.json"
    shown = cli("evaluate", "corpus", folder, "--model", learned.model, "-o", report).stdout
    rows = rows_of(json.loads(report.read_text()))
    assert len(rows) == 4 * 3
    for name in ("broad", "tense"):
        errors = {style: rows[name, style]["mve_mm"]["value"] for style in SPEAKERS}
        assert min(errors, key=lambda style: errors[style]) == name
    for row in rows.values():
        interval = row["velocity_mm"]
        assert interval["low"] <= interval["value"] <= interval["high"]
    assert f"lips: builtin:lips, {len(builtin_region('lips').indices)} vertices" in shown
    assert sum(line.startswith("broad ") for line in shown.splitlines()) == 3


def test_one_mix_a_few_clips_and_lips_of_ones_own(cli: Cli, corpus: Corpus, tmp_path: Path) -> None:
    (tmp_path / "lips.txt").write_text("4 2 9")
    report = json.loads(
        cli(
            "evaluate",
            "corpus",
            corpus.folder,
            "--part",
            "train",
            "--limit",
            1,
            "--json",
            "--style",
            "broad:0.5,plain:0.5",
            "--lips",
            tmp_path / "lips.txt",
        ).stdout
    )
    assert report["clips"] == 1 and report["lips"]["vertices"] == 3
    assert list(rows_of(report)) == [
        ("plain", "broad:0.5,plain:0.5"),
        ("all", "broad:0.5,plain:0.5"),
    ]


def test_another_topology_has_no_lips_of_its_own(
    cli: Cli, refused: Cli, sources: Any, tmp_path: Path
) -> None:
    """60 vertices: the built-in shapes do not fit, a model trained on them does."""
    pytest.importorskip("torch", reason="needs the extra `train`")
    sources.write_folder(tmp_path / "later", ("ann", "bob", "cy"))
    folder, out = tmp_path / "corpus", tmp_path / "out"
    cli("corpus", "convert", tmp_path / "later", "-o", folder)
    refused("evaluate", "corpus", folder, says="60 vertices")
    cli("train", "voca", folder, "-o", out, "--epochs", 1, "--encoder", "fbank", "--json")
    options = "--model", out / "model.onnx", "--style", "even"
    shown = cli("evaluate", "corpus", folder, *options).stdout
    assert "lips: not available" in shown and "closures: not available" in shown
    assert "MVE mm" in shown and "LVE" not in shown


def test_predictions_are_of_the_clips_length_over_its_speakers_face(corpus: Corpus) -> None:
    predict = clip_predictor(open_model("articulation"), corpus, contacts=True)
    one, true = predict("tense.own2", "tense"), recorded_motion(corpus, "tense.own2")
    assert (one.frame_count, one.fps) == (true.frame_count, true.fps)
    assert np.array_equal(one.template, corpus.template("tense"))
    np.testing.assert_allclose(one.values, true.values, atol=1e-3)
    even = predict("tense.own2", "even")
    assert np.abs(even.values[:] - one.values[:]).max() > 0.05


def test_nobody_blinks(speech_wav: Path) -> None:
    """As blinks cannot be heard, they would only be wrong."""
    driver, sound = open_model(), read_audio(speech_wav)
    blink = driver.components.index("eyeBlinkLeft")
    heard, span = extract_features(driver, sound)[0], FrameSpan.whole(588, 60.0)
    weights = driver.weights(heard, driver.style("plain"), span)
    assert weights[:, blink].max() == 0 < animate(sound).motion.weights[:, blink].max()


def test_shapes_are_found_by_name_in_any_order() -> None:
    head = load_builtin_head()
    names = head.expression_names[7], head.expression_names[2]
    assert np.array_equal(basis_of(names, None), head.expression_basis[[7, 2]])
    with pytest.raises(ModelError, match="weights of trunk"):
        basis_of((*names, "trunk"), None)


@pytest.mark.slow
def test_contacts_are_made_for_models_of_the_built_in_head(
    cli: Cli, refused: Cli, learned: Any, sources: Any, tmp_path: Path
) -> None:
    """Also where the model itself hears something else than phones."""
    folder, out = learned.corpus.folder, tmp_path / "out"
    cli("train", "voca", folder, "-o", out, "--epochs", 1, "--encoder", "fbank", "--json")
    measure = "evaluate", "corpus", folder, "--contacts", "auto", "--style", "plain", "--json"
    for model in ("articulation", out / "model.onnx", "crnn"):
        assert '"contacts": "auto"' in cli(*measure, "--model", model).stdout
    sources.write_folder(tmp_path / "later", ("ann", "bob", "cy"))
    other, out = tmp_path / "corpus", tmp_path / "other"
    cli("corpus", "convert", tmp_path / "later", "-o", other)
    cli("train", "voca", other, "-o", out, "--epochs", 1, "--encoder", "fbank", "--json")
    measure = "evaluate", "corpus", other, "--contacts", "auto", "--style", "even"
    refused(*measure, "--model", out / "model.onnx", says="moves by its own basis")


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--part", "exam"], "test, validation, train"),
        (["--split", "other"], "default"),
        (["--style", "nobody"], "drawl"),
        (["--model", "nothing"], "unknown; allowed: articulation"),
        (["--model", "nothing.onnx"], "no such file"),
        (["--limit", "-1"], "--limit"),
        (["--contacts", "some"], "auto, off, both"),
        (["--table", "t.xlsx"], ".csv or .tex"),
        (["--seed", "-1"], "--seed"),
        (["--lips", "nothing.txt"], "nothing.txt"),
        (["-o", "{}/report.txt"], ".json"),
        (["-o", "{}/none/report.json"], "mkdir"),
    ],
)
def test_what_cannot_be_measured_is_one_line(
    refused: Cli, corpus: Corpus, tmp_path: Path, options: list[str], told: str
) -> None:
    given = [option.format(tmp_path) for option in options]
    report = [] if "-o" in options else ["-o", tmp_path / "report.json"]
    refused("evaluate", "corpus", corpus.folder, *given, *report, says=told)
    assert list(tmp_path.iterdir()) == []


def test_an_empty_part_and_no_corpus_are_told(refused: Cli, learned: Any, tmp_path: Path) -> None:
    options = "--part", "validation"
    refused("evaluate", "corpus", learned.corpus.folder, *options, says="no clip in validation")
    refused("evaluate", "corpus", tmp_path, says="corpus.json")
