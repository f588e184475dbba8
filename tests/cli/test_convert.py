"""`elocute convert`: a motion in the parameters of another standard."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

import elocute
from elocute.export.shape_profiles import convert_curves
from elocute.head.preset_shapes import OCULUS_SHAPES
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.store import load_motion, save_motion
from tests.support.commands import one_line, run_here
from tests.support.gltf_files import arkit, glb, record


@pytest.fixture(scope="module")
def motion(speech_wav):
    return elocute.animate(speech_wav, fps=20, life=0).motion


@pytest.fixture(scope="module")
def talk(motion, tmp_path_factory):
    path = tmp_path_factory.mktemp("convert") / "talk.npz"
    save_motion(motion, path)
    return path


def test_visemes_show_a_jaw_that_follows_the_lips_nearly_as_it_is(speech_wav):
    rules = elocute.animate(speech_wav, fps=20, life=0, model="articulation").motion
    own, theirs = openings(rules, convert_curves(rules, "oculus").curves.values)
    assert np.corrcoef(own, theirs)[0, 1] > 0.99


def openings(motion, values):
    """Openings of a motion, and as its visemes show it, mm; up to that of the widest viseme."""
    mixes = np.stack([motion.head.expression_vector(look) for look in OCULUS_SHAPES.values()])
    again = elocute.Motion(motion.head, values[:, : len(mixes)] @ mixes, motion.fps)
    own, theirs = (measure_mouth(each)["opening_mm"] for each in (motion, again))
    widest = elocute.Motion(motion.head, mixes[[list(OCULUS_SHAPES).index("viseme_aa")]], 20)
    return np.minimum(own, measure_mouth(widest)["opening_mm"]), theirs


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
    own, theirs = openings(motion, values)
    assert values[:, : len(looks)].sum(axis=1).max() <= 1 + 1e-6
    # Of a jaw that moves behind shut lips no viseme knows: without one it is 0.99.
    assert np.corrcoef(own, theirs)[0, 1] > 0.98
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


CURVES = {
    "exportFps": 60.0,
    "facsNames": ["jawOpen", "mouthClose", "mouthPucker"],
    "weightMat": [[0, 0, 0], [0.2, 0, 0], [0.4, 0.1, 0], [0.1, 0, 0.3]],
}


@pytest.mark.parametrize("form", ["Audio2Face", "Azure", "Live Link Face"])
def test_curves_of_others_are_played_edited_and_converted(tmp_path, form):
    path = tmp_path / ("take.csv" if form == "Live Link Face" else "take.json")
    rows = np.array([[row[0], row[2]] for row in CURVES["weightMat"]])
    if form == "Audio2Face":
        path.write_text(json.dumps(CURVES))
    elif form == "Azure":
        frames = np.zeros((4, 55))
        frames[:, [ARKIT_NAMES.index(name) for name in ("jawOpen", "mouthPucker")]] = rows
        path.write_text(json.dumps([{"FrameIndex": 0, "BlendShapes": frames.tolist()}]))
    else:
        lines = [f"00:00:00:{f:02}.000,{a},{b}" for f, (a, b) in enumerate(rows)]
        path.write_text("\n".join(["Timecode,JawOpen,MouthPucker", *lines]))
    hero = tmp_path / "hero.glb"
    hero.write_bytes(glb(arkit()))
    for words in (
        ["render", path, "-o", tmp_path / "plain.npz"],
        ["render", path, "--head", hero, "-o", tmp_path / "talk.glb"],
        ["edit", path, "--shape", "jawOpen=0.1", "-o", tmp_path / "edited.npz"],
        ["edit", path, "--head", hero, "--blinks", "0", "-o", tmp_path / "hero_edited.glb"],
        ["convert", path, "--to", "vrm", "-o", tmp_path / "vowels.json"],
    ):
        done = run_here(*words)
        assert done.returncode == 0, done.stderr
    plain, edited = (load_motion(tmp_path / f"{name}.npz") for name in ("plain", "edited"))
    places = [plain.names.index(name) for name in ("jawOpen", "mouthPucker")]
    assert plain.fps == 60 and np.allclose(plain.weights[:, places], rows)
    assert np.allclose(edited.weights[:, places], np.stack([[0.1] * 4, rows[:, 1]], axis=1))
    assert json.loads((tmp_path / "vowels.json").read_text())["fps"] == 60
    told = json.loads(run_here("info", path, "--json").stdout)
    assert told["kind"] == "curves" and told["frames"] == 4 and "jawOpen" in told["moving"]


def test_curves_on_a_head_without_their_shapes_are_refused(tmp_path):
    (tmp_path / "take.json").write_text(json.dumps(CURVES))
    (tmp_path / "cat.glb").write_bytes(glb(record(("Cat", ["whiskers"]))))
    done = run_here(
        "render", tmp_path / "take.json", "--head", tmp_path / "cat.glb", "-o", tmp_path / "o.glb"
    )
    one_line(done, "none known among its morph targets")
