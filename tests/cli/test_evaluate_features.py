"""`elocute evaluate features` trains with each encoder and measures both."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("torch", reason="needs the extra `train`")


def elocute(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [
        sys.executable,
        "-c",
        "from elocute.cli import main; main()",
        "evaluate",
        "features",
        *map(str, arguments),
    ]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_two_encoders_are_compared(tmp_path: Path, make_corpus: Callable[..., object]) -> None:
    make_corpus(tmp_path / "corpus")
    done = elocute(tmp_path / "corpus", "-o", tmp_path / "out", "--epochs", 1, "--json")
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
    done = elocute(tmp_path / "corpus", "-o", tmp_path / "out", "--encoders", "phones,ears")
    assert done.returncode == 2
    assert "ears" in done.stderr and done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()
