"""A FLAME head on the command line: every model, edits, parameters; what is refused, in a line."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs the extra `capture`")

from elocute.head.builtin import load_builtin_head
from elocute.head.flame import flame_vertices, load_flame
from elocute.head.flame_parameters import load_flame_parameters, save_flame_parameters
from elocute.motion.curves import curves_from_motion, motion_from_curves
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.store import load_motion
from elocute.numerics.quaternions import multiply, to_axis_angle
from tests.support.commands import one_line, run_here
from tests.support.flame_layout import flame_layout
from tests.support.gltf_files import arkit, glb


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

    jaw = np.linspace(0, 0.4, 4, dtype=np.float32)[:, None]
    path = tmp_path_factory.mktemp("talk") / "talk.npz"
    save_motion(motion_from_curves(open_speaking_head(flame), Curves(jaw, ("jawOpen",), 4)), path)
    return path


def test_edits_of_a_stored_motion(flame, talk, tmp_path):
    shape = tmp_path / "shape.json"
    shape.write_text(json.dumps({"identity": [1.5, -1.0]}))
    given = "--identity", shape, "--head", flame, "--blinks", "0.5", "--eyes", "5,10"
    run("edit", talk, "-o", tmp_path / "o.npz", *given, "--neck", "0,10,0")
    before, after = load_motion(talk), load_motion(tmp_path / "o.npz")
    assert np.abs(after.head.template - before.head.template).max() > 2e-3
    assert after.weights[2, after.names.index("eyeBlinkLeft")] == pytest.approx(1, abs=0.05)
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


@pytest.fixture(scope="module")
def parameters(flame, talk, tmp_path_factory):
    """The mouth that opens, in FLAME's parameters, with a nod of the neck."""
    path = tmp_path_factory.mktemp("parameters") / "p.npz"
    run("convert", talk, "--to", "flame", "--flame", flame, "-o", path)
    found = load_flame_parameters(path)
    found.pose[:, 3] = np.linspace(0, 0.2, 4)
    save_flame_parameters(path, found)
    return found, path


def _vhap(found, path):
    pose, count = found.pose, len(found.pose)
    np.savez(
        path,
        shape=found.shape,
        expr=found.expression.astype(np.float32),
        rotation=pose[:, :3],
        neck_pose=pose[:, 3:6],
        jaw_pose=pose[:, 6:9],
        eyes_pose=pose[:, 9:],
        translation=found.translation,
        static_offset=np.zeros((1, 7, 3)),
        timestep_id=np.arange(count),
    )


def _gaussian_avatars(found, path):
    path.mkdir()
    for frame in range(len(found.pose)):
        np.savez(
            path / f"{frame:05}.npz",
            shape=found.shape[None],
            expr=found.expression[frame][None],
            neck_pose=found.pose[frame, 3:6][None],
            jaw_pose=found.pose[frame, 6:9][None],
        )


def _emoca(found, path):
    path.mkdir()
    for frame in range(len(found.pose)):
        each = path / f"{frame + 1:06}_000"
        each.mkdir()
        np.save(each / "exp.npy", found.expression[frame])
        np.save(each / "shape.npy", found.shape)
        np.save(each / "pose.npy", np.concatenate([found.pose[frame, 3:6], found.pose[frame, 6:9]]))


@pytest.mark.parametrize("layout", [None, _vhap, _gaussian_avatars, _emoca])
def test_parameters_move_any_head(flame, talk, parameters, layout, tmp_path):
    found, path = parameters
    if layout is not None:
        path = tmp_path / ("given.npz" if layout is _vhap else "given")
        layout(found, path)
    out = tmp_path / "back.npz"
    rate = () if layout is None else ("--input-fps", "4")
    run("render", path, "--flame", flame, *rate, "-o", out)
    back, given = load_motion(out), load_motion(talk)
    assert back.fps == 4 and back.head.name == load_builtin_head().name
    opening = measure_mouth(back)["opening_mm"]
    wanted = measure_mouth(
        motion_from_curves(load_builtin_head(), curves_from_motion(given).select(("jawOpen",)))
    )["opening_mm"]
    assert np.corrcoef(opening, wanted)[0, 1] > 0.99
    assert opening.max() == pytest.approx(wanted.max(), rel=0.2)
    assert back.rotations is not None
    turned = np.degrees(to_axis_angle(multiply(back.rotations[:, 0], back.rotations[:, 1])))
    assert turned[-1, 0] == pytest.approx(np.degrees(0.2), abs=0.1)


def test_parameters_on_a_character_as_curves_and_edited(flame, parameters, tmp_path):
    _, path = parameters
    hero = tmp_path / "hero.glb"
    hero.write_bytes(glb(arkit()))
    run("render", path, "--flame", flame, "--head", hero, "-o", tmp_path / "talk.glb")
    run("convert", path, "--flame", flame, "--to", "arkit", "-o", tmp_path / "talk.csv")
    run("edit", path, "--flame", flame, "--shape", "jawOpen=0.1", "-o", tmp_path / "e.npz")
    edited = load_motion(tmp_path / "e.npz")
    assert np.allclose(edited.weights[:, edited.names.index("jawOpen")], 0.1)
    assert (tmp_path / "talk.glb").is_file() and (tmp_path / "talk.csv").is_file()


def test_adopted_once_for_all(flame, talk, tmp_path):
    record = json.loads(run("head", "adopt", flame, "-o", tmp_path / "head.npz", "--json"))
    assert record["expressions"] == 55 and record["identities"] == 300 and record["lips"]
    shown = json.loads(run("head", "show", tmp_path / "head.npz", "--json"))
    assert shown["landmarks"] is True


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["edit", "{talk}", "-o", "o.npz", "--identity", "7"], "--head FILE"),
        (["render", "{parameters}", "-o", "o.npz"], "allowed: --flame with the model"),
        (["render", "{talk}", "--flame", "{flame}", "-o", "o.npz"], "--flame: given; allowed"),
        (["render", "{parameters}", "--flame", "none.pkl", "-o", "o.npz"], "no such file"),
        (["edit", "{talk}", "-o", "o.npz", "--head", "{flame}"], "with --identity"),
        (["edit", "{talk}", "-o", "o.npz", "--head", "{flame}", "--identity", "ada"], "unknown"),
        (["solve", "{talk}", "--flame", "{flame}", "-o", "o.mp4"], "allowed: .npz"),
        (["solve", "{talk}", "--flame", "{flame}", "-o", "o.npz", "--bounded"], "one of them"),
        (["head", "adopt", "{flame}", "-o", "o.glb"], "allowed: .npz"),
        (["head", "adopt", "none.pkl", "-o", "o.npz"], "no such file"),
    ],
)
def test_what_is_refused(words, says, flame, talk, parameters, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    given = {"flame": flame, "talk": talk, "parameters": parameters[1]}
    words = [word.format(**given) for word in words]
    one_line(run_here(*words), says)
    assert not list(tmp_path.iterdir())
