"""`elocute evaluate features` trains with each encoder and measures both."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.commands import Result, run_apart

pytest.importorskip("torch", reason="needs the extra `train`")


def features(*arguments: object) -> Result:
    return run_apart("evaluate", "features", *arguments)


@pytest.mark.slow
def test_two_encoders_are_compared(tmp_path: Path, make_corpus: Callable[..., object]) -> None:
    make_corpus(tmp_path / "corpus")
    done = features(tmp_path / "corpus", "-o", tmp_path / "out", "--epochs", 1, "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report == json.loads((tmp_path / "out" / "report.json").read_text())
    assert list(report["encoders"]) == ["phones", "fbank"]
    errors = [row["lve_mm"]["value"] for row in report["encoders"].values()]
    assert all(0 < error < 50 for error in errors) and errors[0] != errors[1]
    for name in ("phones/model.onnx", "fbank/model.onnx", "mouth.png"):
        assert (tmp_path / "out" / name).stat().st_size > 0


def test_a_wrong_encoder_is_told_before_anything_is_trained(
    tmp_path: Path, make_corpus: Callable[..., object]
) -> None:
    make_corpus(tmp_path / "corpus")
    done = features(tmp_path / "corpus", "-o", tmp_path / "out", "--encoders", "phones,ears")
    assert done.returncode == 2
    assert "ears" in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()
