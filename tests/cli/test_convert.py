"""`elocute convert`: a motion in the parameters of another standard."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

import elocute
from elocute.export.converted_curves import convert_curves
from elocute.head.preset_shapes import OCULUS_SHAPES
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.store import save_motion
from tests.support.commands import one_line, run_here


@pytest.fixture(scope="module")
def motion(speech_wav):
    return elocute.animate(speech_wav, fps=20, life=0).motion


@pytest.fixture(scope="module")
def talk(motion, tmp_path_factory):
    path = tmp_path_factory.mktemp("convert") / "talk.npz"
    save_motion(motion, path)
    return path


@pytest.mark.parametrize("standard", ["arkit", "oculus", "vrm"])
def test_curves_show_the_motion_again(motion, standard):
    """Played on the head, what is written moves its lips as the motion does, and seals them."""
    made = convert_curves(motion, standard)
    values = made.curves.values
    assert values.min() >= 0 and len(values) == motion.frame_count
    if standard == "arkit":
        assert len(made.curves.names) == 52
        assert np.median(made.residual_mm) < 1
        return
    looks = OCULUS_SHAPES if standard == "oculus" else None
    assert np.median(made.residual_mm) < 5
    if looks is None:
        return
    mixes = np.stack([motion.head.expression_vector(look) for look in looks.values()])
    again = elocute.Motion(motion.head, values[:, : len(looks)] @ mixes, motion.fps)
    own, theirs = (measure_mouth(each)["opening_mm"] for each in (motion, again))
    assert np.corrcoef(own, theirs)[0, 1] > 0.99
    assert theirs[own < 0.02].max() < 0.2


def test_files_hold_names_and_frames(talk, motion, tmp_path):
    table, record = tmp_path / "visemes.csv", tmp_path / "visemes.json"
    said = json.loads(run_here("convert", talk, "--to", "oculus", "-o", table, "--json").stdout)
    assert said["frames"] == motion.frame_count and said["residual_max_mm"] > 0
    assert "residual" in run_here("convert", talk, "--to", "oculus", "-o", record).stdout
    with table.open(newline="") as file:
        rows = list(csv.reader(file))
    stored = json.loads(record.read_text())
    assert rows[0] == ["time_s", *stored["names"]] and rows[0][1] == "viseme_sil"
    assert len(rows) - 1 == len(stored["frames"]) == motion.frame_count
    assert [float(value) for value in rows[7][1:]] == stored["frames"][6]


WRONG = {
    "a standard": (("--to", "maya", "-o", "a.csv"), "--to"),
    "a suffix": (("--to", "vrm", "-o", "a.npz"), "a.npz"),
    "no model": (("--to", "flame", "-o", "a.npz"), "--flame"),
    "a model for nothing": (("--to", "vrm", "--flame", "a.pkl", "-o", "a.csv"), "--flame"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_what_cannot_be_is_one_line(kind, talk, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words, says = WRONG[kind]
    one_line(run_here("convert", talk, *words), says)
    assert not list(tmp_path.iterdir())
