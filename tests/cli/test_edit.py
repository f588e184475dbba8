"""`elocute edit` as a person meets it."""

import json

import numpy as np
import pytest
import soundfile

from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.edits import with_blinks, with_identity_over_time, with_pose
from elocute.motion.store import load_motion, save_motion
from tests.support.commands import run_here as run


@pytest.fixture(scope="module")
def talk(tmp_path_factory):
    """Three seconds at 20 fps, stored."""
    jaw = (0.3 * np.sin(np.arange(60) / 5) ** 2).astype(np.float32)
    head = load_builtin_head()
    path = tmp_path_factory.mktemp("edit") / "talk.npz"
    save_motion(motion_from_curves(head, Curves(jaw[:, None], ("jawOpen",), 20.0)), path)
    return path


def test_everything_at_once_is_what_the_library_does(talk, tmp_path):
    result = run(
        "edit",
        talk,
        "-o",
        tmp_path / "o.npz",
        "--neck",
        "0:0,0,0; 1.5:0,20,0",
        "--blinks",
        "0.5,2.1",
        "--identity-over-time",
        "0:ada; 2:ben",
        "--json",
    )
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["frames"] == 60
    faces = [(0, resolve_identity("ada")), (2, resolve_identity("ben"))]
    wanted = with_blinks(with_identity_over_time(load_motion(talk), faces), [0.5, 2.1])
    wanted = with_pose(wanted, "neck", [(0, (0, 0, 0)), (1.5, (0, 20, 0))])
    assert np.array_equal(load_motion(tmp_path / "o.npz").vertices(), wanted.vertices())


def test_more_options_and_formats(talk, tmp_path):
    rate = 16000
    soundfile.write(tmp_path / "s.wav", np.sin(np.arange(3 * rate) / 20) * 0.1, rate)
    result = run(
        "edit",
        talk,
        "-o",
        tmp_path / "o.glb",
        "-o",
        tmp_path / "o.npz",
        "-o",
        tmp_path / "o.mp4",
        "--head-pose",
        "0,10,0",
        "--jaw",
        "2,0,0",
        "--eyes",
        "5,10",
        "--identity",
        "ada",
        "--shape",
        "mouthSmileLeft=0.4",
        "--blink-per-min",
        "20",
        "--replace-blinks",
        "--from",
        "1",
        "--to",
        "1.5",
        "--fps",
        "10",
        "--sound",
        tmp_path / "s.wav",
        "--size",
        "96",
        "--backend",
        "embreex",
    )
    assert result.returncode == 0, result.stderr
    motion = load_motion(tmp_path / "o.npz")
    assert motion.frame_count == 5 and motion.fps == 10
    assert motion.weights[2, motion.names.index("mouthSmileLeft")] == pytest.approx(0.4)
    assert motion.rotations is not None
    assert soundfile.info(tmp_path / "o.wav").duration == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--neck", "0,0"], "--neck"),
        (["--jaw", "0:1,2,x"], "--jaw"),
        (["--neck", "1:0,0,0; 0:0,0,0"], "rising"),
        (["--eyes", "0,80"], "32 degrees"),
        (["--eyes", "1e308,0"], "1e+308 in a keyframe"),
        (["--neck", "0,1e308,0"], "1e+308 in a keyframe"),
        (["--shape", "jawOpen=1e38"], "1e+38 in a keyframe"),
        (["--blinks", "99"], "99 s"),
        (["--blink-per-min", "nan"], "minute"),
        (["--identity", "nobody"], "nobody"),
        (["--identity", "ada", "--identity-over-time", "0:ada"], "two faces"),
        (["--identity-over-time", "ada; ben"], "seconds:value"),
        (["--shape", "earWiggle=1"], "earWiggle"),
        (["--from", "50"], "cut"),
        (["--fps", "0"], "fps"),
        (["--sound", "none.wav"], "none.wav"),
    ],
)
def test_bad_input_is_one_line_and_nothing_is_written(talk, tmp_path, options, says):
    result = run("edit", talk, "-o", tmp_path / "o.npz", *options)
    lines = result.stderr.strip().splitlines()
    assert result.returncode == 2 and len(lines) == 1, result.stderr
    assert lines[0].startswith("elocute: ") and says in lines[0]
    assert not list(tmp_path.iterdir())


def test_an_unknown_suffix_is_refused_before_anything(talk, tmp_path):
    result = run("edit", talk, "-o", tmp_path / "o.npz", "-o", tmp_path / "o.max")
    assert result.returncode == 2 and "max" in result.stderr
    assert not list(tmp_path.iterdir())


class TestSolve:
    def test_vertices_become_the_motion_again(self, talk, tmp_path):
        assert run("edit", talk, "-o", tmp_path / "v.npy", "--to", "0.2").returncode == 0
        result = run("solve", tmp_path / "v.npy", "-o", tmp_path / "o.npz", "--fps", "20", "--json")
        record = json.loads(result.stdout)
        assert record["frames"] == 4 and record["residual_p95_mm"] < 0.01
        solved = load_motion(tmp_path / "o.npz")
        assert solved.fps == 20
        assert np.abs(solved.weights - load_motion(talk).weights[:4]).max() < 0.001

    def test_a_motion_on_its_own_head_and_on_another(self, talk, tmp_path):
        turned = ("edit", talk, "-o", tmp_path / "m.npz", "--to", "0.1", "--neck", "0,20,0")
        assert run(*turned, "--identity", "ada").returncode == 0
        for extra in ((), ("--identity", "ada"), ("--head", tmp_path / "m.npz")):
            result = run("solve", tmp_path / "m.npz", "-o", tmp_path / "o.npz", *extra)
            assert result.returncode == 0 and "residual 0.000" in result.stdout, result.stderr
        result = run(
            "solve",
            tmp_path / "m.npz",
            "-o",
            tmp_path / "o.npz",
            "--zero-pose",
            "--bounded",
            "--json",
        )
        assert json.loads(result.stdout)["residual_mean_mm"] > 1

    @pytest.mark.parametrize("change", ["displacements", "Z upwards", None])
    def test_vertices_of_something_else_are_told(self, talk, tmp_path, change):
        vertices = load_motion(talk).vertices()[:2]
        if change == "displacements":
            vertices = vertices - vertices[:1]
        elif change:
            vertices = vertices[:, :, [0, 2, 1]] * np.array([1, -1, 1], np.float32)
        np.save(tmp_path / "v.npy", vertices)
        result = run("solve", tmp_path / "v.npy", "-o", tmp_path / "o.npz")
        assert result.returncode == 0
        assert ("mm from the nearest that the head comes to" in result.stderr) == bool(change)

    @pytest.mark.parametrize("content", [b"", b"hello", b"\x93NUMPY\x01\x00", None])
    def test_no_vertices(self, tmp_path, content):
        if content is None:
            np.save(tmp_path / "v.npy", np.zeros((2, 5, 3)))
        else:
            (tmp_path / "v.npy").write_bytes(content)
        result = run("solve", tmp_path / "v.npy", "-o", tmp_path / "o.npz")
        lines = result.stderr.strip().splitlines()
        assert result.returncode == 2 and len(lines) == 1, result.stderr
        assert not (tmp_path / "o.npz").exists()
