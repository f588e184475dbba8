"""Edits of motions: pose, faces over time, blinks, gaze, cuts; one after another, and stored."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from elocute.errors import MotionError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity, sample_identity
from elocute.head.shape_reach import lid_gap
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.edits import (
    cut,
    with_blinks,
    with_gaze,
    with_identity,
    with_identity_over_time,
    with_pose,
    with_shape,
    without_pose,
)
from elocute.motion.motion import Motion
from elocute.motion.store import load_motion, save_motion
from elocute.numerics.quaternions import to_axis_angle


@pytest.fixture(scope="module")
def head():
    return load_builtin_head()


@pytest.fixture(scope="module")
def talk(head):
    """Two seconds at 30 fps; the jaw goes up and down."""
    jaw = (0.3 * np.sin(np.arange(60) / 5) ** 2).astype(np.float32)
    return motion_from_curves(head, Curves(jaw[:, None], ("jawOpen",), 30.0))


def still(head, frames, fps=60.0):
    return Motion(head, np.zeros((frames, len(head.expression_names)), np.float32), fps)


def turned(motion: Motion) -> NDArray[np.float32]:
    """The rotations of a motion that has some."""
    assert motion.rotations is not None
    return motion.rotations


def gaps_mm(motion):
    """(frame, 2) mean gap between the lids."""
    head = motion.head
    return np.array(
        [[1000 * lid_gap(head, v, side) for side in ("left", "right")] for v in motion.vertices()]
    )


def stored(motion, tmp_path):
    save_motion(motion, tmp_path / "m.npz")
    return load_motion(tmp_path / "m.npz")


class TestPose:
    @pytest.mark.parametrize("joint", ["neck", "head", "jaw", "eyeLeft", "eyeRight"])
    def test_the_opposite_angles_take_a_pose_back(self, talk, joint):
        turns = [(0.2, (5, 10, -3)), (1.0, (0, -30, 8)), (1.7, (12, 0, 0))]
        there = with_pose(talk, joint, turns)
        assert np.abs(there.vertices() - talk.vertices()).max() > 0.001
        back = with_pose(there, joint, [(t, tuple(-a for a in xyz)) for t, xyz in turns])
        assert np.abs(back.vertices() - talk.vertices()).max() < 1e-6

    def test_a_pose_comes_after_the_one_that_was_there(self, talk):
        first = with_pose(with_pose(talk, "neck", (0, 20, 0)), "neck", (10, 0, 0))
        second = with_pose(with_pose(talk, "neck", (10, 0, 0)), "neck", (0, 20, 0))
        once = with_pose(talk, "neck", (0, 20, 0)).vertices()
        pivot = talk.head.joint_positions[0]
        x = np.radians(10)
        turn = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
        assert np.abs(first.vertices() - ((once - pivot) @ turn.T + pivot)).max() < 1e-6
        assert np.abs(first.vertices() - second.vertices()).max() > 0.001

    def test_signs_are_as_documented(self, talk):
        nose = talk.head.landmarks[30]
        rest = talk.vertices()[0]
        assert with_pose(talk, "head", (20, 0, 0)).vertices()[0, nose, 1] < rest[nose, 1] - 0.01
        assert with_pose(talk, "head", (0, 20, 0)).vertices()[0, nose, 0] > rest[nose, 0] + 0.01
        crown = rest[:, 1].argmax()
        assert with_pose(talk, "head", (0, 0, 20)).vertices()[0, crown, 0] < rest[crown, 0] - 0.01

    def test_keyframes_are_met_and_nothing_overshoots_or_jerks(self, head):
        motion = with_pose(
            still(head, 121), "neck", [(0.5, (0, 0, 0)), (1.0, (0, 20, 0)), (1.5, (0, 30, 0))]
        )
        yaw = np.degrees(to_axis_angle(turned(motion)[:, 0]))[:, 1]
        assert yaw[[0, 30, 60, 90, 120]] == pytest.approx([0, 0, 20, 30, 30], abs=1e-4)
        assert np.diff(yaw).min() > -1e-4
        assert np.abs(np.diff(yaw, 2)).max() < 0.2
        assert yaw[61] - yaw[60] > 0.3  # on its way it does not stop

    def test_radians_and_a_whole_turn(self, talk):
        a = with_pose(talk, "head", (0, np.pi / 6, 0), degrees=False)
        assert np.allclose(a.vertices(), with_pose(talk, "head", (0, 30, 0)).vertices())
        spun = with_pose(talk, "neck", [(0, (0, 0, 0)), (1, (0, 360, 0))])
        assert np.abs(spun.vertices()[30] - talk.vertices()[30]).max() < 1e-6
        assert np.abs(spun.vertices()[15] - talk.vertices()[15]).max() > 0.1

    def test_other_spellings_of_a_joint(self, talk):
        for name in ("eye_left", "left_eye", "EyeLeft"):
            posed = turned(with_pose(talk, name, (0, 9, 0)))
            assert np.array_equal(posed, turned(with_pose(talk, "eyeLeft", (0, 9, 0))))

    def test_a_jaw_pose_leaves_the_jaw_shape_alone(self, talk):
        posed = with_pose(talk, "jaw", (10, 0, 0))
        assert np.array_equal(posed.weights, talk.weights)
        assert np.array_equal(without_pose(posed).vertices(), talk.vertices())

    @pytest.mark.parametrize(
        ("joint", "turns", "says"),
        [
            ("tail", (0, 0, 0), "tail"),
            ("neck", (0, 0), "three"),
            ("neck", [], "keyframe"),
            ("neck", [(1, (0, 0, 0)), (0, (0, 0, 0))], "rising"),
            ("neck", [(0, (0, np.nan, 0))], "finite"),
            ("neck", [(0, (0, 1, 0)), (1, (0, 1))], "one length"),
            ("neck", "0:0,0,0", "keyframes"),
        ],
    )
    def test_bad_poses_are_refused(self, talk, joint, turns, says):
        with pytest.raises(MotionError, match=says):
            with_pose(talk, joint, turns)


FACES = ((0.0, "ada"), (1.0, "ben"), (1.5, "chidi"))


@pytest.fixture(scope="module")
def changing(head):
    keys = [(t, resolve_identity(name)) for t, name in FACES]
    return with_identity_over_time(still(head, 60, 30.0), keys)


class TestIdentity:
    def test_every_keyframe_is_that_face(self, head, changing):
        for time, name in FACES:
            face = head.with_identity(resolve_identity(name))
            frame = round(time * 30)
            assert np.abs(changing.vertices(frame, frame + 1)[0] - face.template).max() < 1e-6

    def test_between_keyframes_it_is_straight(self, changing):
        v = changing.vertices()
        assert np.abs(v[15] - (v[0] + v[30]) / 2).max() < 1e-6
        assert np.abs(v[45:] - v[45]).max() < 1e-6

    def test_lids_shut_on_every_face(self, head, changing):
        shut = [0.1, 0.5, 1.0, 1.9]
        blinking = with_blinks(changing, shut)
        for moment in shut:
            frame = round(moment * 30)
            frames = cut(blinking, frame / 30, (frame + 1) / 30)
            assert gaps_mm(frames).max() < 0
        before = with_blinks(still(head, 60, 30.0), shut)
        keys = [(t, resolve_identity(name)) for t, name in FACES]
        after = with_identity_over_time(before, keys)
        assert np.abs(after.vertices() - blinking.vertices()).max() < 1e-6

    def test_one_face_just_changes_the_head(self, head, talk):
        ben = resolve_identity("ben")
        edited, wanted = with_identity(talk, ben), Motion(head.with_identity(ben), talk.weights, 30)
        assert np.array_equal(edited.vertices(), wanted.vertices())
        assert edited.names == talk.names
        assert np.array_equal(edited.head.vertex_color, wanted.head.vertex_color)

    def test_a_stored_face_can_be_exchanged(self, head, talk, tmp_path):
        blinking = with_blinks(talk, [0.5])
        ada = stored(with_identity(blinking, resolve_identity("ada")), tmp_path)
        assert len(ada.head.identity_basis) == 0
        ben = with_identity(ada, resolve_identity("ben"))
        wanted = with_identity(blinking, resolve_identity("ben"))
        assert np.abs(ben.vertices() - wanted.vertices()).max() < 1e-6
        assert np.allclose(ben.head.joint_positions, wanted.head.joint_positions)

    def test_called_again_it_replaces(self, head, changing, tmp_path):
        again = with_identity(stored(with_blinks(changing, [1.0]), tmp_path), sample_identity(3))
        assert again.names == head.expression_names
        wanted = with_blinks(with_identity(still(head, 60, 30.0), sample_identity(3)), [1.0])
        assert np.abs(again.vertices() - wanted.vertices()).max() < 1e-6

    def test_few_coefficients_make_few_components(self, talk):
        # VOCA's Figure 7: the first component from +2 to -2 standard deviations.
        swung = with_identity_over_time(talk, [(0, [2.0]), (1, [-2.0])])
        assert swung.names[len(talk.names) :] == ("identity000",)

    def test_faces_that_come_again_cost_nothing(self, talk, changing):
        assert changing.names[-2:] == ("identity000", "identity001")
        assert len(changing.names) == len(talk.names) + 2
        ada, ben = resolve_identity("ada"), resolve_identity("ben")
        there = with_identity_over_time(talk, [(0, ada), (1, ben), (1.5, ada), (1.6, ada)])
        assert len(there.names) == len(talk.names) + 1
        wanted = with_identity(talk, ada).vertices()
        assert np.abs(there.vertices() - wanted)[[0, 45, 59]].max() < 1e-6

    def test_other_heads_say_what_is_missing(self, head, talk):
        other = replace(head.with_identity(resolve_identity("ada")), name="somebody")
        with pytest.raises(MotionError, match="somebody"):
            with_identity(Motion(other, talk.weights, 30), [1.0])
        with pytest.raises(MotionError, match="at most 77"):
            with_identity(talk, np.zeros(78))


class TestBlinks:
    @pytest.mark.parametrize("fps", [10.0, 24.0, 59.94, 120.0])
    @pytest.mark.parametrize("frames", [1, 2, 5, 600])
    @pytest.mark.parametrize("count", [0, 1, 2, 7, 40])
    def test_any_number_in_any_clip(self, head, frames, count, fps):
        motion = still(head, frames, fps)
        moments = np.linspace(0, motion.duration_s, count, endpoint=False)
        lid = with_blinks(motion, moments.tolist()).weights[
            :, head.expression_index("eyeBlinkLeft")
        ]
        for moment in moments:
            frame = min(round(moment * fps), frames - 1)
            assert lid[frame] == pytest.approx(1)
        assert count or not lid.any()
        assert lid.max() <= 1 + 1e-6
        # Nothing jumps: no faster than the steepest place of one blink, 1.5 in 70 ms.
        assert np.abs(np.diff(lid)).max(initial=0) <= min(1, 1.5 / 0.07 / fps) + 1e-5

    @pytest.mark.parametrize("frames", [1, 2, 5])
    def test_lids_shut_and_lips_stay(self, head, frames):
        motion = still(head, frames)
        blinking = with_blinks(motion, [0.0])
        assert gaps_mm(blinking)[0].max() < 0 and gaps_mm(motion).min() > 4
        lips = head.regions["lips"]
        assert np.array_equal(blinking.vertices()[:, lips], motion.vertices()[:, lips])

    def test_added_or_instead(self, head):
        once = with_blinks(still(head, 120), [0.5])
        lid = head.expression_index("eyeBlinkRight")
        both = with_blinks(once, [1.5]).weights[:, lid]
        assert both[30] == 1 and both[90] == 1
        instead = with_blinks(once, [1.5], replace=True).weights[:, lid]
        assert instead[30] == 0 and instead[90] == 1
        assert not with_blinks(once, replace=True).weights.any()

    def test_blinks_a_minute(self, head):
        motion = still(head, 6000)
        lid = head.expression_index("eyeBlinkLeft")
        curve = with_blinks(motion, per_minute=12, seed=4).weights[:, lid]
        count = (np.diff((curve > 0.5).astype(int)) == 1).sum()
        assert 10 <= count <= 30 and curve[0] == curve[-1] == 0
        again = with_blinks(motion, per_minute=12, seed=4).weights[:, lid]
        other = with_blinks(motion, per_minute=12, seed=5).weights[:, lid]
        assert np.array_equal(curve, again) and not np.array_equal(curve, other)

    def test_what_is_refused(self, head):
        for bad in ([3.0], [-0.1], [np.nan]):
            with pytest.raises(MotionError, match="blink"):
                with_blinks(still(head, 60), bad)
        with pytest.raises(MotionError, match="minute"):
            with_blinks(still(head, 60), per_minute=-1)
        bare = replace(
            head,
            expression_names=head.expression_names[1:],
            expression_basis=head.expression_basis[1:],
        )
        with pytest.raises(MotionError, match="eyeBlinkLeft"):
            with_blinks(still(bare, 60), [0.5])


class TestGaze:
    @pytest.mark.parametrize("where", [(0, 20), (0, -15), (15, 0), (-12, 0)])
    def test_both_eyes_look_there(self, head, where):
        looking = with_gaze(still(head, 1), where).vertices()[0]
        for side in ("left", "right"):
            ball = head.regions[f"eye_{side}"]
            front = ball[head.template[ball, 2].argsort()[-12:]]
            moved = (looking - head.template)[front].mean(axis=0)
            # The front of the eye goes down for +x and to +X for +y.
            assert np.sign(moved[0].round(4)) == np.sign(where[1])
            assert np.sign(moved[1].round(4)) == -np.sign(where[0])

    def test_too_far_is_refused(self, head):
        with pytest.raises(MotionError, match="reaches 32"):
            with_gaze(still(head, 2), (0, 50))

    def test_eye_joints_turn_where_there_are_no_shapes(self, head):
        kept = [i for i, n in enumerate(head.expression_names) if not n.startswith("eyeLook")]
        plain = replace(
            head,
            expression_names=tuple(head.expression_names[i] for i in kept),
            expression_basis=head.expression_basis[kept],
        )
        looking = with_gaze(still(plain, 2), (0, 40))
        angles = np.degrees(to_axis_angle(turned(looking)))
        assert np.allclose(angles[:, 3:], [0, 40, 0], atol=1e-4) and not angles[:, :3].any()


def test_shapes_are_set_and_added(talk):
    smiling = with_shape(talk, "mouthSmileLeft", [(0, 0), (1, 0.5)])
    column = talk.names.index("mouthSmileLeft")
    assert smiling.weights[[0, 30, 59], column] == pytest.approx([0, 0.5, 0.5])
    more = with_shape(smiling, "mouthSmileLeft", 0.25, add=True)
    assert more.weights[59, column] == pytest.approx(0.75)
    assert not with_shape(talk, "jawOpen", 0).weights.any()
    with pytest.raises(MotionError, match="earWiggle"):
        with_shape(talk, "earWiggle", 1)


def test_cuts_keep_their_frames(talk):
    part = cut(with_pose(talk, "neck", (0, 9, 0)), 0.5, 1.0)
    assert part.frame_count == 15 and np.array_equal(part.weights, talk.weights[15:30])
    assert len(turned(part)) == 15
    assert cut(talk, 1.9, 99).frame_count == 3
    for bad in ((1.0, 1.0), (-1, 1), (5, 6), (np.nan, 1)):
        with pytest.raises(MotionError, match="cut"):
            cut(talk, *bad)


def test_edits_compose_and_are_stored_exactly(talk, tmp_path):
    edited = with_pose(talk, "neck", [(0, (0, -30, 0)), (2, (0, 30, 0))])
    edited = with_blinks(edited, [0.3, 1.99], per_minute=20)
    faces = [(0, resolve_identity("ada")), (1, resolve_identity("ben"))]
    edited = with_gaze(with_identity_over_time(edited, faces), (5, 10))
    other = with_gaze(with_identity_over_time(talk, faces), (5, 10))
    other = with_blinks(other, [0.3, 1.99], per_minute=20)
    other = with_pose(other, "neck", [(0, (0, -30, 0)), (2, (0, 30, 0))])
    assert np.abs(edited.vertices() - other.vertices()).max() < 1e-6
    back = stored(edited, tmp_path)
    assert np.array_equal(back.vertices(), edited.vertices())
    assert np.isfinite(back.at_fps(25).vertices()).all()
