"""Motion: exact low-rank storage, rotations, curves, measures."""

import numpy as np
import pytest

from elocute.errors import MotionError
from elocute.head.builtin import load_builtin_head
from elocute.motion.curves import ARKIT_NAMES, Curves, curves_from_motion, motion_from_curves
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth, write_measures
from elocute.motion.store import load_motion, save_motion


@pytest.fixture(scope="module")
def head():
    return load_builtin_head()


def moving(head, fps=60.0, **curves):
    """A motion of a few named curves."""
    names = tuple(curves)
    values = np.stack([np.asarray(curves[name], np.float32) for name in names], axis=1)
    return motion_from_curves(head, Curves(values, names, fps))


def ramp(peak=1.0, frames=30):
    return np.linspace(0, peak, frames)


def test_vertices_are_the_sum_of_shapes(head):
    motion = moving(head, jawOpen=ramp(0.5), mouthPucker=ramp(0.8))
    weights = motion.weights.astype(float)
    wanted = np.tensordot(weights, head.expression_basis.astype(float), 1) + head.template
    assert np.abs(motion.vertices() - wanted).max() < 1e-7


def test_blocks_are_the_same_vertices(head):
    motion = moving(head, jawOpen=ramp())
    assert np.array_equal(np.concatenate(list(motion.blocks(7))), motion.vertices())
    assert np.abs(np.stack(list(motion.faces())) - motion.vertices()).max() < 1e-8
    assert np.abs(np.stack(list(motion.faces(3, -2))) - motion.vertices(3, -2)).max() < 1e-8


def test_stored_motion_comes_back_exactly(head, tmp_path):
    turned = np.tile(np.array([1, 0, 0, 0], np.float32), (30, len(head.joint_names), 1))
    turned[:, 0, 1] = 0.1
    motion = Motion(head, moving(head, jawOpen=ramp()).weights, 59.94, turned)
    save_motion(motion, tmp_path / "talk.npz")
    back = load_motion(tmp_path / "talk.npz")
    assert back.fps == motion.fps and back.names == motion.names
    assert np.array_equal(back.weights, motion.weights)
    assert back.rotations is not None and np.array_equal(back.rotations, turned)
    assert np.array_equal(back.head.expression_basis, head.expression_basis)
    assert np.array_equal(back.vertices(), motion.vertices())
    assert (tmp_path / "talk.npz").stat().st_size < motion.vertices().nbytes


def test_a_nod_turns_the_head_and_measures_nothing(head):
    still = moving(head, jawOpen=np.full(3, 0.2))
    angle = 0.3
    turned = np.tile(np.array([1, 0, 0, 0], np.float32), (3, len(head.joint_names), 1))
    turned[1, head.joint_names.index("head")] = [np.cos(angle / 2), np.sin(angle / 2), 0, 0]
    motion = Motion(head, still.weights, 60, turned)
    points = motion.vertices()
    assert np.abs(points[0] - still.vertices()[0]).max() < 1e-6
    nose = head.landmarks[30]
    assert points[1, nose, 1] < points[0, nose, 1] - 0.01  # pitching forwards
    assert np.array_equal(measure_mouth(motion).values, measure_mouth(still).values)


def test_another_rate_keeps_time(head):
    motion = moving(head, jawOpen=np.sin(np.arange(120) / 20) ** 2)
    slow = motion.at_fps(30)
    assert slow.frame_count == 60 and slow.duration_s == pytest.approx(motion.duration_s)
    assert np.allclose(slow.weights, motion.weights[::2], atol=1e-6)


def test_an_unknown_curve_is_refused(head):
    with pytest.raises(MotionError, match="earWiggle"):
        moving(head, earWiggle=ramp())


@pytest.mark.parametrize(
    ("weights", "fps", "says"),
    [
        (np.zeros((0, 55)), 60, "one frame"),
        (np.zeros((4, 3)), 60, "frames"),
        (np.full((4, 55), np.nan), 60, "frame 0"),
        (np.zeros((4, 55)), 0, "fps"),
    ],
)
def test_malformed_motion_is_refused(head, weights, fps, says):
    with pytest.raises(MotionError, match=says):
        Motion(head, weights, fps)


def test_arkit_names_are_apples_52():
    assert len(ARKIT_NAMES) == len(set(ARKIT_NAMES)) == 52
    assert ARKIT_NAMES[0] == "eyeBlinkLeft" and ARKIT_NAMES[-1] == "tongueOut"


def test_curves_and_motion_are_two_views(head):
    motion = moving(head, jawOpen=ramp(0.4))
    assert np.allclose(curves_from_motion(motion)["jawOpen"], ramp(0.4), atol=1e-6)


def test_measures_say_what_the_mouth_does(head):
    rest = measure_mouth(moving(head, jawOpen=[0.0]))
    wide = measure_mouth(moving(head, jawOpen=[0.6]))
    kiss = measure_mouth(moving(head, mouthPucker=[1.0]))
    assert rest["opening_mm"][0] == 0 and rest["jaw_mm"][0] == 0
    assert 40 < rest["width_mm"][0] < 65
    assert wide["opening_mm"][0] > 8 and wide["jaw_mm"][0] > 5
    assert kiss["width_mm"][0] < rest["width_mm"][0] - 5
    assert kiss["protrusion_mm"][0] > 2


def test_measures_are_written_with_their_times(head, tmp_path):
    write_measures(measure_mouth(moving(head, jawOpen=ramp())), tmp_path / "mouth.csv")
    lines = (tmp_path / "mouth.csv").read_text().splitlines()
    assert lines[0] == "time_s,opening_mm,width_mm,protrusion_mm,jaw_mm"
    assert len(lines) == 31 and lines[7].startswith("0.1000,")


class TestBadFiles:
    """No file makes us crash, execute or take memory."""

    @pytest.mark.parametrize("content", [b"", b"PK", b"hello", b"PK\x03\x04" + b"\0" * 100])
    def test_what_is_no_motion(self, tmp_path, content):
        path = tmp_path / "bad.npz"
        path.write_bytes(content)
        with pytest.raises(MotionError, match=r"bad\.npz") as caught:
            load_motion(path)
        assert "\n" not in str(caught.value)

    def test_a_missing_file(self, tmp_path):
        with pytest.raises(MotionError, match="no such file"):
            load_motion(tmp_path / "none.npz")

    def test_an_npz_of_something_else(self, tmp_path):
        np.savez(tmp_path / "other.npz", a=np.zeros(3))
        with pytest.raises(MotionError, match="not a readable motion"):
            load_motion(tmp_path / "other.npz")

    def test_a_pickle_inside_is_never_run(self, tmp_path):
        class Bomb:
            def __reduce__(self):
                return (open, (str(tmp_path / "boom"), "w"))

        np.savez(tmp_path / "bomb.npz", texts=np.array([Bomb()], dtype=object))
        (tmp_path / "boom").unlink(missing_ok=True)
        with pytest.raises(MotionError):
            load_motion(tmp_path / "bomb.npz")
        assert not (tmp_path / "boom").exists()

    @pytest.mark.parametrize(
        "forge",
        [
            lambda a: a | {"basis/vertex": np.full_like(a["basis/vertex"], 4_000_000)},
            lambda a: a | {"weights": a["weights"][:, :3]},
            lambda a: a | {"head/quads": a["head/quads"] + 10_000_000},
            lambda a: {k: v for k, v in a.items() if k != "head/template"},
            lambda a: a | {"head/template": a["head/template"] * np.nan},
            lambda a: a | {"texts": np.frombuffer(b"[" * 50_000, np.uint8)},
        ],
    )
    def test_a_forged_motion(self, head, tmp_path, forge):
        save_motion(moving(head, jawOpen=ramp()), tmp_path / "good.npz")
        with np.load(tmp_path / "good.npz") as stored:
            arrays = {name: stored[name] for name in stored.files}
        np.savez(tmp_path / "forged.npz", **forge(arrays))
        with pytest.raises(MotionError, match="forged"):
            load_motion(tmp_path / "forged.npz")


def test_a_curve_that_is_not_there_says_the_nearest():
    curves = Curves(np.zeros((2, 52), np.float32), ARKIT_NAMES, 60.0)
    with pytest.raises(KeyError, match=r"no curve 'JawOpne'; nearest: jawOpen"):
        curves["JawOpne"]
    with pytest.raises(KeyError, match=r"no curve 'cape'; there are eyeBlinkLeft, "):
        curves["cape"]
