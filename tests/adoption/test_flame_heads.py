"""The built-in head's shapes on a mesh laid out as FLAME's, against what they truly are there."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs the extra `capture`")

from elocute.adoption.carrying import adopt
from elocute.adoption.flame import adopt_flame, with_flame_landmarks
from elocute.adoption.registry import open_speaking_head
from elocute.adoption.shape_transfer import apart_on
from elocute.errors import HeadError, MotionError
from elocute.head.builtin import load_builtin_head
from elocute.head.flame import flame_vertices, load_flame
from elocute.head.flame_to_head import head_from_flame
from elocute.head.identity import resolve_identity
from elocute.head.mesh import head_from_arrays
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.edits import with_blinks, with_gaze, with_identity
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from tests.support.flame_layout import FACE_VERTICES, flame_layout


@pytest.fixture(scope="module")
def layout():
    return flame_layout(resolve_identity("ada"))


@pytest.fixture(scope="module")
def flame_file(layout, python2, tmp_path_factory):
    path = tmp_path_factory.mktemp("flame") / "generic_model.pkl"
    path.write_bytes(python2.dumps(layout.entries))
    return path


@pytest.fixture(scope="module")
def model(flame_file):
    return load_flame(flame_file)


@pytest.fixture(scope="module")
def adoption(model):
    return adopt_flame(model)


@pytest.fixture(scope="module")
def head(adoption):
    return adoption.head


@pytest.fixture(scope="module")
def speech():
    """Curves of the first seconds of the example."""
    import elocute
    from elocute.audio.read import read_audio
    from elocute.audio.waveform import Waveform
    from recipes.example import TARGET

    sound = read_audio(TARGET, sample_rate=16000)
    return elocute.animate(Waveform(sound.samples[: 4 * 16000], 16000)).curves


def moved(head, **weights):
    return head.template + np.tensordot(head.expression_vector(weights), head.expression_basis, 1)


def lip_gaps_mm(adoption, vertices):
    """Between lines of the lips, all along them: vertices of the two do not lie over each other."""
    along = np.linspace(0.02, 0.98, 97)
    face = adoption.transfer.target
    apart = apart_on(face, "inner_upper", "inner_lower", np.asarray(vertices, float), along)
    return 1000 * apart[..., 1]


class TestShapes:
    def test_are_those_of_the_face_that_it_truly_is(self, head, layout):
        """Jaw and closure are FLAME's own, and the tongue is not there."""
        own = {"jawOpen", "mouthClose", "tongueTipUp", "tongueDental"}
        alike, off_mm = {}, {}
        for name in set(head.expression_names) - own:
            found = head.expression_basis[head.expression_index(name), :FACE_VERTICES]
            true = layout.truth(name)
            alike[name] = (found * true).sum() / np.sqrt((found**2).sum() * (true**2).sum())
            length = np.linalg.norm(true, axis=1)
            off = np.linalg.norm(found - true, axis=1)[length > 0.05 * length.max()]
            off_mm[name] = 1000 * off.mean()
        assert min(alike.values()) > 0.9, min(alike, key=alike.__getitem__)
        assert np.mean(list(alike.values())) > 0.98
        assert max(off_mm.values()) < 1.5 and np.mean(list(off_mm.values())) < 0.45

    def test_the_jaw_is_flames_joint(self, head, model):
        opened = head.expression_basis[head.expression_index("jawOpen")]
        poses = np.zeros((401, 15))
        poses[:, 6] = np.radians(np.arange(401) / 10)
        off = np.abs(flame_vertices(model, pose=poses) - model.template - opened).max(axis=(1, 2))
        assert 15 < np.argmin(off) / 10 < 25 and off.min() < 1e-4

    def test_without_a_jaw_joint_it_is_carried_over_like_the_rest(self, layout, model):
        bare = head_from_arrays("mesh", model.template, model.triangles)
        found = adopt(load_builtin_head(), with_flame_landmarks(bare)).head
        opened = found.expression_basis[found.expression_index("jawOpen"), :FACE_VERTICES]
        true = layout.truth("jawOpen")
        assert (opened * true).sum() / np.sqrt((opened**2).sum() * (true**2).sum()) > 0.99

    @pytest.mark.slow
    def test_size_place_and_units_make_no_difference(self, model, head):
        """A head twice as large, turned and far away moves twice as far, in its own axes."""
        turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
        bare = head_from_arrays("mesh", model.template, model.triangles)
        away = head_from_arrays("far", 2 * model.template @ turn.T + 3, model.triangles)
        near, far = (
            adopt(load_builtin_head(), with_flame_landmarks(each)).head for each in (bare, away)
        )
        difference = far.expression_basis @ turn / 2 - near.expression_basis
        assert np.abs(difference).max() < 2e-3 and np.sqrt((difference**2).mean()) < 1e-4


class TestLips:
    def test_rest_closed(self, head, adoption):
        assert lip_gaps_mm(adoption, head.template).max() < 0.1

    def test_p_b_m_seal_whatever_the_jaw_does(self, head, adoption):
        for opening in (0.1, 0.3, 0.6, 1.0):
            closed = moved(head, jawOpen=opening, mouthClose=opening)
            assert lip_gaps_mm(adoption, closed).max() < 0.15

    def test_the_gap_over_speech_is_the_built_in_heads(self, head, speech):
        theirs = measure_mouth(motion_from_curves(load_builtin_head(), speech))["opening_mm"]
        ours = measure_mouth(motion_from_curves(head, speech))["opening_mm"]
        assert np.corrcoef(theirs, ours)[0, 1] > 0.99
        assert ours[theirs < 0.05].max() < 0.1 and (theirs < 0.05).sum() > 5

    def test_seal_on_other_faces_of_flame(self, head, adoption):
        for seed in range(5):
            face = head.with_identity(resolve_identity(str(seed), head))
            closed = moved(face, jawOpen=0.4, mouthClose=0.4)
            assert lip_gaps_mm(adoption, closed).max() < 0.3

    def test_identities_are_flames_away_from_the_lips(self, head, model):
        change = np.abs(head.identity_basis - np.moveaxis(model.identity_basis, 2, 0)).max(
            axis=(0, 2)
        )
        assert (change > 1e-5).mean() < 0.2 and change.max() < 1e-3


class TestEyes:
    def test_lids_meet(self, head):
        shut = moved(head, eyeBlinkLeft=1.0, eyeBlinkRight=1.0)
        for side in ("left", "right"):
            upper, lower = (head.regions[f"lid_{lid}_{side}"] for lid in ("upper", "lower"))
            open_mm, shut_mm = (
                1000 * (points[upper, 1].mean() - points[lower, 1].mean())
                for points in (head.template, shut)
            )
            assert open_mm > 4 and shut_mm < 0.5

    def test_balls_turn_and_stay_where_they_are(self, head, layout):
        looking = moved(head, eyeLookOutLeft=1.0)
        left, right = layout.eyes
        middle = head.template[left].mean(axis=0)
        assert np.abs(looking[left].mean(axis=0) - middle).max() < 2e-3
        assert np.array_equal(looking[right], head.template[right])
        front = left[head.template[left, 2].argmax()]
        assert looking[front, 0] - head.template[front, 0] > 3e-3

    def test_gaze_and_blinks_of_a_motion(self, head):
        still = Motion(head, np.zeros((60, len(head.expression_names)), np.float32), 60)
        looking = with_blinks(with_gaze(still, (5, 12)), [0.5])
        names = looking.names
        assert looking.weights[:, names.index("eyeLookOutLeft")].min() > 0.2
        assert looking.weights[30, names.index("eyeBlinkRight")] == pytest.approx(1, abs=0.01)


@pytest.fixture(scope="module")
def stored(head, speech, tmp_path_factory):
    from elocute.motion.store import load_motion, save_motion

    path = tmp_path_factory.mktemp("stored") / "talk.npz"
    save_motion(motion_from_curves(head, speech), path)
    return load_motion(path)


class TestStoredMotion:
    def test_takes_flames_shape_parameters(self, stored, head):
        coefficients = np.array([1.0, -2.0, 0.5], np.float32)
        changed = with_identity(stored, coefficients, space=head)
        assert np.allclose(
            changed.head.template, head.with_identity(coefficients).template, atol=2e-5
        )
        assert np.array_equal(changed.weights, stored.weights)

    def test_says_what_it_needs(self, stored):
        with pytest.raises(MotionError, match="did not travel"):
            with_identity(stored, [1.0])


class TestOtherHeads:
    @pytest.mark.slow
    def test_a_flame_file_and_a_mesh_of_flame_speak(self, flame_file, head, tmp_path):
        import trimesh

        opened = open_speaking_head(flame_file)
        assert np.array_equal(opened.expression_basis, head.expression_basis)
        assert open_speaking_head(flame_file) is opened
        mesh = trimesh.Trimesh(head.template, head.triangles, process=False)
        (tmp_path / "face.ply").write_bytes(mesh.export(file_type="ply"))
        spoken = open_speaking_head(tmp_path / "face.ply")
        assert spoken.expression_names == load_builtin_head().expression_names

    def test_another_mesh_is_refused_in_a_line(self, python2, tmp_path):
        path = tmp_path / "small.pkl"
        path.write_bytes(python2.dumps(python2.flame(vertices=200)))
        with pytest.raises(HeadError, match=r"small\.pkl: .*200 vertices; allowed: FLAME's 5023"):
            open_speaking_head(path)

    @pytest.mark.slow
    def test_a_ball_is_no_face(self, python2, tmp_path):
        path = tmp_path / "ball.pkl"
        path.write_bytes(python2.dumps(python2.flame(vertices=5023)))
        with pytest.raises(HeadError, match=r"ball\.pkl: landmarks: .*; allowed: ") as told:
            open_speaking_head(path)
        assert "\n" not in str(told.value)

    def test_landmarks_that_are_no_face_are_refused(self, model, head):
        flat = head.template * [1.0, 0.3, 1.0]
        bare = head_from_arrays("flat", flat, model.triangles)
        with pytest.raises(HeadError, match=r"landmarks .* mm off those of a face"):
            adopt(load_builtin_head(), with_flame_landmarks(bare))

    def test_a_face_with_an_open_mouth_is_refused(self, model, head):
        opened = flame_vertices(model, pose=np.eye(15)[6] * 0.3)[0]
        bare = head_from_arrays("open", opened, model.triangles)
        with pytest.raises(HeadError, match=r"lips .* mm apart; allowed: a face with closed lips"):
            adopt(load_builtin_head(), with_flame_landmarks(bare))

    def test_a_head_without_landmarks_is_refused(self, model):
        with pytest.raises(HeadError, match="no landmarks"):
            adopt(load_builtin_head(), head_from_flame(model))


def test_curves_need_no_more_than_names(head):
    curves = Curves(np.full((3, 1), 0.5, np.float32), ("jawOpen",), 30)
    assert motion_from_curves(head, curves).vertices().shape == (3, 5023, 3)
