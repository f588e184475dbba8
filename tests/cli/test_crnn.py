"""`elocute train crnn`, `animate --model FILE` and `evaluate wild`, and what they refuse."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.support.commands import run_python

ROOT = Path(__file__).parents[2]
pytest.importorskip("torch")


@pytest.fixture(scope="module")
def folders(speech_shards: Any) -> tuple[Path, Path]:
    return speech_shards.folder, speech_shards.sound_root


@pytest.fixture(scope="module")
def trained(
    folders: tuple[Path, Path], cli: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    """Two short epochs, by the command."""
    output = tmp_path_factory.mktemp("train") / "out"
    made = cli("train", "crnn", *folders, "-o", output, "--epochs", 2, "--device", "cpu", "--json")
    return json.loads(made.stdout)


def test_training_leaves_a_model_that_speaks(
    trained: dict[str, Any], cli: Callable[..., Any], speech_wav: Path, tmp_path: Path
) -> None:
    assert trained["broken"] == [] and trained["epoch"] == 2
    folder = Path(trained["model"]).parent
    assert {"log.csv", "checkpoint.safetensors", "events"} <= {p.name for p in folder.iterdir()}
    for name in ("talk.npz", "talk.glb"):
        cli("animate", speech_wav, "--model", trained["model"], "-o", tmp_path / name, "--json")
        assert (tmp_path / name).stat().st_size > 10_000


def test_bad_input_is_one_line(
    trained: dict[str, Any],
    folders: tuple[Path, Path],
    refused: Callable[..., None],
    tmp_path: Path,
    speech_wav: Path,
) -> None:
    train, out = ("train", "crnn"), ("-o", tmp_path / "new")
    refused(*train, *folders, "-o", Path(trained["model"]).parent, says="--resume")
    refused(*train, tmp_path, folders[1], *out, says="manifest.json")
    refused(*train, folders[0], tmp_path / "none", *out, says="folder of the sounds")
    refused(*train, *folders, *out, "--loss", "mae", says="concordance, mse")
    refused(*train, *folders, *out, "--preset", "publication", says="default, paper")
    refused(*train, *folders, *out, "--device", "cuda:99", says="allowed: auto, cpu")
    animate = ("animate", speech_wav, "-o", tmp_path / "a.npz")
    refused(*animate, "--model", trained["model"], "--style", "calm", says="no styles")
    refused(*animate, "--model", speech_wav, says="unknown")
    wild = ("evaluate", "wild", *folders, *out)
    refused(*wild, "--trainings", "word", says="speaker is missing")
    refused(*wild, "--sentences", tmp_path, says="corpus.json")
    refused(*wild, "--held-out", speech_wav, says="JSON")
    refused(*wild, "--exact", tmp_path, says="manifest.json")
    assert not (tmp_path / "new").exists()


@pytest.mark.slow
def test_the_experiments_small(
    folders: tuple[Path, Path],
    cli: Callable[..., Any],
    refused: Callable[..., None],
    make_corpus: Callable[..., Any],
    tmp_path: Path,
) -> None:
    corpus = make_corpus(tmp_path / "sentences")
    spoken = ("--sentences", corpus.folder, "--subject")
    given = ("evaluate", "wild", *folders, "-o", tmp_path / "w", "--epochs", 1, *spoken)
    refused(*given, "eve", says="plain, broad, tense")
    given = (*given, "broad", "--json")
    table = tmp_path / "wild.tex"
    first = json.loads(cli(*given, "--trainings", "speaker,mse", "--table", table).stdout)
    assert "speaker test & " in table.read_text() and "c5" in table.read_text()
    names = set(first["concordance"])
    assert {"speaker test", "speaker validation", "mse test", "white 0 dB", "babble 20 dB"} <= names
    assert first["concordance"]["sentences state"]["clips"] == 3
    for row in first["concordance"].values():
        assert row["mean"]["low"] <= row["mean"]["value"] <= row["mean"]["high"]
    # Trainings that are whole are not done again.
    stamp = (tmp_path / "w" / "speaker" / "checkpoint.safetensors").stat().st_mtime_ns
    again = json.loads(cli(*given, "--trainings", "speaker,mse", "--resume").stdout)
    assert (tmp_path / "w" / "speaker" / "checkpoint.safetensors").stat().st_mtime_ns == stamp
    assert again["concordance"] == first["concordance"]
    model = tmp_path / "w" / "speaker" / "model.onnx"
    compared = ("benchmarks.crnn_speech", corpus.folder, folders[0], "--subject", "broad")
    told = run_python("-m", *compared, "--models", model, check=True, cwd=ROOT).stdout
    row = first["concordance"]["sentences state"]
    assert f" {row['mean']['value']:.3f} [" in told and f"] {row['weighted']['value']:.3f} " in told


def test_what_is_broken_is_named_and_the_rest_trains(
    speech_shards: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    import shutil

    from elocute.training.crnn.run import train_crnn
    from elocute.training.crnn.settings import CrnnTrainConfig

    shutil.copytree(speech_shards.folder, tmp_path / "s")
    path = sorted((tmp_path / "s").glob("*.parquet"))[-1]
    path.write_bytes(path.read_bytes()[:-9])
    from elocute.corpus.shards import open_shards

    opened = open_shards(tmp_path / "s", speech_shards.sound_root)
    assert [name for name, _ in opened.broken] == [path.name]
    trained, missing = train_crnn(replace(opened), CrnnTrainConfig(epochs=1), tmp_path)
    assert len(trained.log) == 1 and missing == ()
