"""From the four files of VOCASET and a FLAME head to a talking head, in three commands."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.corpus.importers.split_choice import (
    VOCASET_TEST,
    VOCASET_TRAIN,
    VOCASET_VALIDATION,
)
from elocute.motion.store import load_motion
from tests.support.commands import run_here

pytest.importorskip("torch", reason="needs the extra `train`")


def elocute(*arguments: object) -> str:
    done = run_here(*arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_three_commands(tmp_path: Path, sources: Any, python2: Any, speech_wav: Path) -> None:
    people = (
        VOCASET_TRAIN[0],
        VOCASET_TRAIN[1],
        VOCASET_VALIDATION[0],
        VOCASET_TEST[0],
    )
    sources.write_vocaset(tmp_path / "VOCASET", python2, people)
    flame = tmp_path / "generic_model.pkl"
    flame.write_bytes(python2.dumps(python2.flame(vertices=5023)))

    elocute("corpus", "convert", tmp_path / "VOCASET", "-o", tmp_path / "corpus")
    elocute("train", "voca", tmp_path / "corpus", "-o", tmp_path / "trained", "--epochs", "1")
    elocute(
        "animate",
        speech_wav,
        "--model",
        tmp_path / "trained" / "model.onnx",
        "--head",
        flame,
        "--style",
        people[1],
        "-o",
        tmp_path / "talk.npz",
        "-o",
        tmp_path / "talk.glb",
    )

    motion = load_motion(tmp_path / "talk.npz")
    assert motion.head.vertex_count == 5023
    assert np.ptp(motion.vertices(), axis=0).max() > 1e-4  # it moves
    assert (tmp_path / "talk.glb").read_bytes()[:4] == b"glTF"


@pytest.mark.slow
def test_lips_and_dynamics_are_measured_without_naming_vertices(
    tmp_path: Path, sources: Any, python2: Any
) -> None:
    """On FLAME's mesh the published lists are taken, and the table goes into files."""
    people = (
        VOCASET_TRAIN[0],
        VOCASET_VALIDATION[0],
        VOCASET_TEST[0],
    )
    sources.write_vocaset(tmp_path / "VOCASET", python2, people)
    elocute("corpus", "convert", tmp_path / "VOCASET", "-o", tmp_path / "corpus")
    train = "train", "voca", tmp_path / "corpus", "-o", tmp_path / "trained", "--epochs", "1"
    elocute(*train, "--encoder", "fbank")
    tables = tmp_path / "t.csv", tmp_path / "t.tex"
    measure = (
        "evaluate",
        "corpus",
        tmp_path / "corpus",
        "--model",
        tmp_path / "trained" / "model.onnx",
        "--style",
        "best",
    )
    options = "-o", tmp_path / "report.json", "--table", tables[0], "--table", tables[1]
    shown = elocute(*measure, *options)
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["lips"] == {
        "name": "published:FaceDiffuser vocaset/lve",
        "vertices": 428,
        "sha256": "9b310f02be5d",
    }
    assert report["upper_face"]["vertices"] == 1501
    assert "FDD mm (paper)" in shown and "FDD mm² (code)" in shown and "LVE mm²" in shown
    everybody = report["rows"][-1]
    with tables[0].open(newline="", encoding="utf-8") as file:
        row = list(csv.DictReader(file))[-1]
    assert float(row["LVE mm"]) == everybody["lve_mm"]["value"] > 0
    assert float(row["FDD mm² (code) high"]) == everybody["fdd_code_mm2"]["high"]
    latex = tables[1].read_text(encoding="utf-8")
    assert latex.startswith(r"\begin{tabular}{ll") and r"FDD mm$^2$ (code)" in latex
    assert f"${everybody['lve_mm']['value']:.3g}$" in latex
    (tmp_path / "lips.txt").write_text("1 2 3")
    own = json.loads(elocute(*measure, "--lips", tmp_path / "lips.txt", "--json"))
    assert (own["lips"]["vertices"], own["upper_face"]["vertices"]) == (3, 1501)
