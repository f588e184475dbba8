"""From the four files of VOCASET and a FLAME head to a talking head, in three commands."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.corpus.importers import vocaset
from elocute.motion.store import load_motion

pytest.importorskip("torch", reason="needs the extra `train`")


def elocute(*arguments: object) -> str:
    command = [
        sys.executable, "-c", "from elocute.cli import main; main()", *map(str, arguments)
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_three_commands(tmp_path: Path, sources: Any, python2: Any, speech_wav: Path) -> None:
    people = (vocaset.TRAIN[0], vocaset.TRAIN[1], vocaset.VALIDATION[0], vocaset.TEST[0])
    sources.write_vocaset(tmp_path / "VOCASET", python2, people)
    flame = tmp_path / "generic_model.pkl"
    flame.write_bytes(python2.dumps(python2.flame(vertices=5023)))

    elocute("corpus", "convert", tmp_path / "VOCASET", "-o", tmp_path / "corpus")
    elocute("train", "voca", tmp_path / "corpus", "-o", tmp_path / "trained", "--epochs", "1")
    elocute(
        "animate", speech_wav, "--model", tmp_path / "trained" / "model.onnx", "--head", flame,
        "--style", people[1], "-o", tmp_path / "talk.npz", "-o", tmp_path / "talk.glb",
    )  # fmt: skip

    motion = load_motion(tmp_path / "talk.npz")
    assert motion.head.vertex_count == 5023
    assert np.ptp(motion.vertices(), axis=0).max() > 1e-4  # it moves
    assert (tmp_path / "talk.glb").read_bytes()[:4] == b"glTF"
