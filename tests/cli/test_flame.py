"""A FLAME head on the command line: every model, edits, parameters; what is refused, in a line."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs the extra `capture`")

from elocute.head.flame import flame_vertices, load_flame
from elocute.head.flame_parameters import load_flame_parameters
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.store import load_motion
from tests.support.commands import one_line, run_here
from tests.support.flame_layout import flame_layout


@pytest.fixture(scope="module")
def flame(python2, tmp_path_factory):
    path = tmp_path_factory.mktemp("flame") / "generic_model.pkl"
    path.write_bytes(python2.dumps(flame_layout().entries))
    return path


def run(*arguments):
    done = run_here(*arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("model", ["articulation", "voca", "crnn"])
def test_every_model_moves_it(flame, speech_wav, model, tmp_path):
    common = "animate", speech_wav, "--model", model, "--fps", 30
    run(*common, "--head", flame, "-o", tmp_path / "flame.npz")
    run(*common, "-o", tmp_path / "builtin.npz")
    theirs, ours = (
        measure_mouth(load_motion(tmp_path / f"{name}.npz"))["opening_mm"]
        for name in ("builtin", "flame")
    )
    assert np.corrcoef(theirs, ours)[0, 1] > 0.99
    assert ours[theirs < 0.05].max(initial=0) < 0.1


@pytest.fixture(scope="module")
def talk(flame, tmp_path_factory):
    from elocute.adoption.registry import open_speaking_head
    from elocute.motion.curves import Curves, motion_from_curves
    from elocute.motion.store import save_motion

    jaw = np.linspace(0, 0.4, 10, dtype=np.float32)[:, None]
    path = tmp_path_factory.mktemp("talk") / "talk.npz"
    save_motion(motion_from_curves(open_speaking_head(flame), Curves(jaw, ("jawOpen",), 10)), path)
    return path


def test_edits_of_a_stored_motion(flame, talk, tmp_path):
    shape = tmp_path / "shape.json"
    shape.write_text(json.dumps({"identity": [1.5, -1.0]}))
    given = "--identity", shape, "--head", flame, "--blinks", "0.5", "--eyes", "5,10"
    run("edit", talk, "-o", tmp_path / "o.npz", *given, "--neck", "0,10,0")
    before, after = load_motion(talk), load_motion(tmp_path / "o.npz")
    assert np.abs(after.head.template - before.head.template).max() > 2e-3
    assert after.weights[5, after.names.index("eyeBlinkLeft")] == pytest.approx(1, abs=0.05)
    assert after.weights[:, after.names.index("eyeLookOutLeft")].min() > 0.1
    assert after.rotations is not None
    over = "--identity-over-time", f"0:{shape}; 1:7"
    run("edit", talk, "-o", tmp_path / "t.npz", *over, "--head", flame)
    assert load_motion(tmp_path / "t.npz").names[-1].startswith("identity")


def test_parameters_and_their_residual(flame, talk, tmp_path):
    model = load_flame(flame)
    pose = np.zeros((2, 15))
    pose[:, 6] = 0.1, 0.2
    given = flame_vertices(model, [1.0, -1.0], [0.5], pose).astype(np.float32)
    np.save(tmp_path / "v.npy", given)
    command = "solve", tmp_path / "v.npy", "--flame", flame, "-o", tmp_path / "p.npz"
    record = json.loads(run(*command, "--zero-pose", "--json"))
    assert record["frames"] == 2 and record["residual_max_mm"] < 0.005
    stored = load_flame_parameters(tmp_path / "p.npz")
    assert np.allclose(stored.pose, pose, atol=1e-3)
    parts = stored.shape, stored.expression, stored.pose, stored.translation
    assert np.abs(flame_vertices(model, *parts) - given).max() < 2e-5


def test_adopted_once_for_all(flame, talk, tmp_path):
    record = json.loads(run("head", "adopt", flame, "-o", tmp_path / "head.npz", "--json"))
    assert record["expressions"] == 55 and record["identities"] == 300 and record["lips"]
    shown = json.loads(run("head", "show", tmp_path / "head.npz", "--json"))
    assert shown["landmarks"] is True


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["edit", "{talk}", "-o", "o.npz", "--identity", "7"], "--head FILE"),
        (["edit", "{talk}", "-o", "o.npz", "--head", "{flame}"], "with --identity"),
        (["edit", "{talk}", "-o", "o.npz", "--head", "{flame}", "--identity", "ada"], "unknown"),
        (["solve", "{talk}", "--flame", "{flame}", "-o", "o.mp4"], "allowed: .npz"),
        (["solve", "{talk}", "--flame", "{flame}", "-o", "o.npz", "--bounded"], "one of them"),
        (["head", "adopt", "{flame}", "-o", "o.glb"], "allowed: .npz"),
        (["head", "adopt", "none.pkl", "-o", "o.npz"], "no such file"),
    ],
)
def test_what_is_refused(words, says, flame, talk, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = [word.format(flame=flame, talk=talk) for word in words]
    one_line(run_here(*words), says)
    assert not list(tmp_path.iterdir())
