"""The scripts of examples/ run as a reader runs them, made small."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest
import soundfile

from tests.support.commands import run_python

ROOT = Path(__file__).parents[1]
SCRIPTS = sorted((ROOT / "examples").glob("*.py"))


def run(script: str, *arguments: object) -> str:
    alone = os.environ | {"OMP_NUM_THREADS": "1"}  # threads would wait for each other beside tests
    done = run_python(ROOT / "examples" / script, *arguments, env=alone)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def speech(tmp_path_factory: pytest.TempPathFactory, speech_wav: Path) -> Path:
    """A second and a half of the example."""
    samples, rate = soundfile.read(speech_wav, start=16000, frames=48000)
    path = tmp_path_factory.mktemp("speech") / "speech.wav"
    soundfile.write(path, samples, rate)
    return path


@pytest.mark.slow
def test_an_animator_gets_scenes_and_videos(speech: Path, tmp_path: Path) -> None:
    said = run("animator.py", speech, tmp_path / "out", "--size", 64)
    broad, calm = (float(number) for number in re.findall(r"([\d.]+) mm", said))
    assert broad > calm
    made = {path.name for path in (tmp_path / "out").iterdir()}
    assert made == {"broad.glb", "broad.mp4", "calm.glb", "calm.mp4"}


def test_an_avatar_gets_every_frame_in_order(speech: Path) -> None:
    frames = [json.loads(line) for line in run("avatar.py", speech).splitlines()]
    times = [frame["time_s"] for frame in frames]
    assert times == pytest.approx([f / 60 for f in range(90)], abs=1e-3)
    assert max(frame["curves"].get("jawOpen", 0) for frame in frames) > 0.1


@pytest.mark.slow
def test_a_researcher_trains_and_measures(tmp_path: Path) -> None:
    pytest.importorskip("lightning_fabric", reason="needs the extra `train`")
    said = run("research.py", tmp_path / "out", "--epochs", 2)
    errors = re.findall(r"^ *(\w+) in the style +(\w+): lip vertex error ([\d.]+) mm$", said, re.M)
    assert len(errors) == 12 and all(0 < float(error) < 30 for *_, error in errors)


@pytest.mark.slow
def test_a_capture_knows_its_error(tmp_path: Path) -> None:
    pytest.importorskip("scipy", reason="needs the extra `capture`")
    said = run("capture.py", tmp_path / "out", "--seconds", 0.07, "--points", 15000)
    assert "registered" in said
    (error,) = re.findall(r"lips: ([\d.]+) mm", said)
    assert float(error) < 2


def test_every_example_is_in_the_documentation_and_tested_here() -> None:
    page = (ROOT / "docs/use/examples.md").read_text(encoding="utf-8")
    tests = Path(__file__).read_text(encoding="utf-8")
    assert SCRIPTS
    for script in SCRIPTS:
        assert f'--8<-- "examples/{script.name}"' in page and f'run("{script.name}"' in tests
