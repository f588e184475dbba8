"""`elocute train voca` from a corpus folder to a model that animates."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.commands import run_apart

pytest.importorskip("torch", reason="needs the extra `train`")


def test_a_corpus_becomes_a_model_that_animates(
    tmp_path: Path, make_corpus: Callable[..., object], speech_wav: Path
) -> None:
    make_corpus(tmp_path / "corpus")
    done = run_apart(
        "train",
        "voca",
        tmp_path / "corpus",
        "-o",
        tmp_path / "out",
        "--epochs",
        2,
        "--encoder",
        "fbank",
        "--device",
        "cpu",
        "--json",
    )
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["epoch"] == 2
    for name in ("model.onnx", "checkpoint.safetensors", "log.csv", "sample.png"):
        assert (tmp_path / "out" / name).stat().st_size > 0
    again = run_apart(
        "animate", speech_wav, "--model", tmp_path / "out" / "model.onnx", "-o", tmp_path / "t.npz"
    )
    assert again.returncode == 0, again.stderr
    full = run_apart("train", "voca", tmp_path / "corpus", "-o", tmp_path / "out")
    assert full.returncode == 2
    assert "--resume" in full.stderr


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["nowhere"], "corpus.json"),
        (["{corpus}", "--epochs", "0"], "epochs"),
        (["{corpus}", "--device", "cuda:99"], "no such device here; allowed: auto, cpu"),
        (["{corpus}", "--device", "gpu"], "auto, cpu, cuda, cuda:N, mps"),
        (["{corpus}", "--encoder", "ears"], "phones"),
        (["{corpus}", "--split", "other"], "default"),
    ],
)
def test_what_cannot_be_trained_is_one_line(
    tmp_path: Path, make_corpus: Callable[..., object], arguments: list[str], told: str
) -> None:
    make_corpus(tmp_path / "corpus")
    given = [word.format(corpus=tmp_path / "corpus") for word in arguments]
    done = run_apart("train", "voca", *given, "-o", tmp_path / "out")
    assert done.returncode == 2
    assert told in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out" / "model.onnx").exists()


def test_a_training_goes_on_only_where_one_began(
    tmp_path: Path, make_corpus: Callable[..., object]
) -> None:
    make_corpus(tmp_path / "corpus")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "log.csv").write_text("my notes")
    done = run_apart("train", "voca", tmp_path / "corpus", "-o", tmp_path / "mine", "--resume")
    assert done.returncode == 2 and "no checkpoint.safetensors beside it" in done.stderr
    assert (tmp_path / "mine" / "log.csv").read_text() == "my notes"
