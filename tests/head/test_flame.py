"""FLAME: its files, its equations against a plain spelling of the paper, and heads of it."""

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csc_matrix
from scipy.spatial.transform import Rotation

from elocute.errors import HeadError, InputError
from elocute.export.registry import write
from elocute.head.flame import flame_vertices, load_flame
from elocute.head.flame_to_head import head_from_flame
from elocute.head.store import load_head, save_head
from elocute.motion.edits.pose import with_pose
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.store import load_motion, save_motion
from elocute.numerics.rotation_vectors import to_matrices


@pytest.fixture(scope="module")
def raw(python2):
    return python2.flame()


@pytest.fixture
def load(python2, tmp_path):
    """Write these entries as FLAME's files are written, and load them."""

    def load_entries(entries, protocol=2, **options):
        path = tmp_path / "generic_model.pkl"
        path.write_bytes(python2.dumps(entries, protocol))
        return load_flame(path, **options)

    return load_entries


@pytest.fixture(scope="module")
def model(python2, raw, tmp_path_factory):
    path = tmp_path_factory.mktemp("flame") / "generic_model.pkl"
    path.write_bytes(python2.dumps(raw))
    return load_flame(path)


@pytest.fixture(scope="module")
def head(model):
    return head_from_flame(model)


@pytest.fixture(scope="module")
def talk(head):
    weights = np.zeros((4, 100), np.float32)
    weights[:, 0], weights[:, 7] = [0, 1, 2, 1], [0, -1, 0, 1]
    turns = np.zeros((4, 5, 4), np.float32)
    turns[..., 0], turns[..., 1] = np.cos(0.1), np.sin(0.1)
    return Motion(head, weights, 30.0, turns)


def by_the_paper(raw, shape, expression, pose, translation):
    """Equations 1 to 5 of the paper, one joint and one vertex at a time."""
    template, components = raw["v_template"].x, raw["shapedirs"].x
    regressor, weights = raw["J_regressor"].toarray(), raw["weights"]
    coefficients = np.zeros(400)
    coefficients[: len(shape)] = shape
    coefficients[300 : 300 + len(expression)] = expression
    shaped = template.copy()
    for k, coefficient in enumerate(coefficients):
        shaped += coefficient * components[:, :, k]
    joints = np.array([sum(w * v for w, v in zip(row, shaped, strict=True)) for row in regressor])
    turns = []
    for vector in np.reshape(pose, (5, 3)):
        angle = np.linalg.norm(vector)
        x, y, z = vector / angle if angle else vector
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        turns.append(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
    bent = np.concatenate([(turn - np.eye(3)).ravel() for turn in turns[1:]])
    corrected = shaped + raw["posedirs"] @ bent
    world = []
    for joint, parent in enumerate([None, 0, 1, 1, 1]):
        own = np.eye(4)
        own[:3, :3] = turns[joint]
        own[:3, 3] = joints[joint] - (0 if parent is None else joints[parent])
        world.append(own if parent is None else world[parent] @ own)
    result = np.zeros_like(template)
    for vertex, point in enumerate(corrected):
        for joint in range(5):
            from_rest = point - joints[joint]
            moved = world[joint][:3, :3] @ from_rest + world[joint][:3, 3]
            result[vertex] += weights[vertex, joint] * moved
    return result + translation


class TestEquations:
    def test_vertices_are_those_of_the_paper(self, raw, model):
        rng = np.random.default_rng(1)
        frames = 3
        shape = rng.normal(size=300)
        expression = rng.normal(size=(frames, 100))
        pose = rng.normal(0, 0.5, (frames, 15))
        shift = rng.normal(size=(frames, 3))
        found = flame_vertices(model, shape, expression, pose, shift)
        assert found.shape == (frames, 200, 3) and found.dtype == np.float64
        for frame in range(frames):
            expected = by_the_paper(raw, shape, expression[frame], pose[frame], shift[frame])
            assert np.abs(found[frame] - expected).max() < 1e-6

    def test_few_coefficients_and_a_single_joint(self, raw, model):
        pose = np.zeros(15)
        pose[6] = 0.4  # the jaw
        found = flame_vertices(model, [1.0, -2.0], [0.5], pose)[0]
        assert np.abs(found - by_the_paper(raw, [1, -2], [0.5], pose, 0)).max() < 1e-6

    def test_nothing_given_is_the_template(self, raw, model):
        assert np.allclose(flame_vertices(model), raw["v_template"].x[None], atol=1e-12)

    def test_blocks_make_no_difference(self, model):
        pose = np.random.default_rng(2).normal(0, 0.2, (150, 15))
        together = flame_vertices(model, pose=pose)
        assert np.allclose(together[130], flame_vertices(model, pose=pose[130])[0], atol=1e-12)

    @pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-5, 1.0, np.pi, 7.0])
    def test_rotations_of_any_size(self, angle):
        turn = to_matrices(np.array([0.0, 0.0, angle]))
        c, s = np.cos(angle), np.sin(angle)
        assert np.allclose(turn, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-12)

    @pytest.mark.parametrize(
        "given",
        [
            {"shape": np.zeros(301)},
            {"expression": np.zeros(101)},
            {"pose": np.zeros(14)},
            {"translation": np.zeros(2)},
            {"shape": [np.nan]},
            {"shape": "wide"},
            {"pose": np.zeros((0, 15))},
            {"pose": np.zeros((2, 15)), "shape": np.zeros((3, 5))},
        ],
    )
    def test_sizes_that_do_not_fit(self, model, given):
        with pytest.raises(HeadError, match="FLAME: "):
            flame_vertices(model, **given)


class TestFiles:
    @pytest.mark.parametrize("protocol", [0, 1, 2])
    def test_every_protocol_of_python_2(self, load, python2, protocol):
        raw = python2.flame(vertices=20, components=8)
        model = load(raw, protocol)
        assert np.array_equal(model.template, raw["v_template"].x)
        assert np.allclose(model.joint_regressor, raw["J_regressor"].toarray())
        assert model.parents == (-1, 0, 1, 1, 1)
        assert model.triangles.dtype == np.int32 and np.array_equal(model.triangles, raw["f"])

    def test_components_are_identities_then_expressions(self, load, python2):
        raw = python2.flame(vertices=20, components=400)
        model = load(raw)
        assert model.identity_basis.shape == (20, 3, 300)
        assert np.array_equal(model.expression_basis, raw["shapedirs"].x[:, :, 300:])
        assert load(raw, identity_count=100).expression_basis.shape == (20, 3, 300)
        few = load(python2.flame(vertices=20, components=150))
        assert few.identity_basis.shape[2] == 150 and few.expression_basis.shape[2] == 0

    def test_plain_arrays_and_a_dense_regressor_do_too(self, load, raw):
        plain = {name: getattr(value, "x", value) for name, value in raw.items()}
        plain["J_regressor"] = raw["J_regressor"].toarray()
        plain["kintree_table"] = np.array([[-1, 0, 1, 1, 1], [0, 1, 2, 3, 4]], np.int64)
        model = load(plain | {"unknown": [1, 2, 3]})
        assert np.array_equal(model.template, raw["v_template"].x)
        assert model.parents == (-1, 0, 1, 1, 1)

    def test_full_size_is_quick(self, python2, tmp_path):
        raw = python2.flame(vertices=5023)
        path = tmp_path / "generic_model.pkl"
        path.write_bytes(python2.dumps(raw))
        started = time.process_time()
        model = load_flame(path)
        assert model.vertex_count == 5023
        loaded = time.process_time()
        assert loaded - started < 3  # 54 MB
        pose = np.random.default_rng(0).normal(0, 0.1, (60, 15))
        assert flame_vertices(model, np.ones(300), np.ones(100), pose).shape == (60, 5023, 3)
        assert time.process_time() - loaded < 5

    @pytest.mark.parametrize(
        ("key", "value", "word"),
        [
            ("v_template", np.zeros((200, 2)), "template is (200, 2)"),
            ("v_template", np.full((200, 3), np.nan), "template is not finite"),
            ("v_template", np.zeros((1, 3)), "1 vertices"),
            ("v_template", "text", "v_template is str"),
            ("shapedirs", np.zeros((100, 3, 400)), "identity_basis is (100, 3, 300)"),
            ("shapedirs", np.zeros((200, 3)), "shapedirs is float64 (200, 3)"),
            ("shapedirs", np.zeros((200, 3, 1500)), "1500 components"),
            ("posedirs", np.zeros((200, 3, 35)), "pose_basis is (200, 3, 35)"),
            ("J_regressor", csc_matrix((2**30, 3)), "sparse matrix (1073741824, 3)"),
            ("J_regressor", None, "J_regressor is NoneType"),
            ("weights", np.ones((200, 5)), "do not sum to one"),
            ("weights", np.zeros((200, 70)), "weights are (200, 70)"),
            ("kintree_table", np.array([[9, 2, 1, 1, 1], [0, 1, 2, 3, 4]]), "root first"),
            ("kintree_table", np.zeros((3, 5), int), "kintree_table is (3, 5)"),
            ("kintree_table", np.zeros((2, 5)), "whole numbers"),
            ("f", np.full((9, 3), 200), "point past 200"),
            ("f", np.full((9, 3), 2**32 - 1, np.uint32), "point past 200"),
            ("f", np.zeros((9, 4), int), "triangles is (9, 4)"),
            ("f", np.zeros((0, 3), int), "or none"),
            ("bs_style", "dqbs", "bs_style"),
            ("bs_type", np.zeros(3), "bs_type"),
        ],
    )
    def test_parts_that_do_not_fit_are_named(self, load, raw, key, value, word):
        with pytest.raises(HeadError) as caught:
            load(raw | {key: value})
        assert word in str(caught.value) and "generic_model.pkl" in str(caught.value)
        assert "\n" not in str(caught.value)

    def test_other_files_are_refused(self, load, tmp_path):
        with pytest.raises(HeadError, match=r"no v_template, shapedirs, .*allowed: a FLAME model"):
            load({"subject": 3})
        with pytest.raises(HeadError, match="no v_template"):
            load([1, 2])
        with pytest.raises(InputError, match=r"none\.pkl: no such file"):
            load_flame(tmp_path / "none.pkl")
        with pytest.raises(HeadError, match="identity_count"):
            load({}, identity_count=-1)


class TestHeads:
    def test_has_flames_bases_and_joints(self, head, model):
        assert head.expression_names[:2] == ("flameExpression000", "flameExpression001")
        assert head.identity_basis.shape == (300, 200, 3)
        assert head.joint_names == ("root", "neck", "jaw", "eyeLeft", "eyeRight")
        assert np.array_equal(head.triangles, model.triangles)
        coefficients = np.random.default_rng(0).normal(size=300).astype(np.float32)
        someone = head.with_identity(coefficients)
        assert np.allclose(someone.template, flame_vertices(model, coefficients)[0], atol=1e-6)
        joints = model.joint_regressor @ flame_vertices(model, coefficients)[0]
        assert np.allclose(someone.joint_positions, joints, atol=1e-6)

    def test_turns_and_moves_as_flame_s_equations_say(self, head, model):
        chance = np.random.default_rng(0)
        shape = chance.normal(size=300).astype(np.float32)
        weights = chance.normal(size=(3, 100)).astype(np.float32)
        pose = chance.normal(0, 0.3, (3, 5, 3))
        turns = Rotation.from_rotvec(pose.reshape(-1, 3)).as_quat().reshape(3, 5, 4)
        turns = turns[..., [3, 0, 1, 2]].astype(np.float32)
        someone = head.with_identity(shape)
        still = flame_vertices(model, shape, weights)
        turned = flame_vertices(model, shape, weights, pose.reshape(3, 15))
        assert np.allclose(Motion(someone, weights, 30).vertices(), still, atol=1e-6)
        assert np.allclose(Motion(someone, weights, 30, turns).vertices(), turned, atol=2e-6)
        by_skin_alone = replace(someone, pose_basis=someone.pose_basis[:0])
        apart = Motion(by_skin_alone, weights, 30, turns).vertices() - turned
        assert np.abs(apart).max() > 1e-3

    def test_edits_turn_a_neck_and_a_jaw_as_flame_does(self, head, model):
        speech = Motion(head, np.zeros((2, 100), np.float32), 30.0)
        nodding = with_pose(with_pose(speech, "head", (10, 20, 0)), "jaw", (15, 0, 0))
        assert nodding.rotations is not None
        turns = np.roll(nodding.rotations[0], -1, axis=1)
        vectors = [Rotation.from_quat(turn).as_rotvec() for turn in turns]
        expected = flame_vertices(model, pose=np.ravel(vectors))
        assert np.allclose(nodding.vertices()[:1], expected, atol=1e-6)
        assert np.abs(vectors[1]).max() > 0.3 and np.abs(vectors[2]).max() > 0.2

    def test_a_motion_of_it_survives_being_stored(self, talk, tmp_path):
        save_motion(talk, tmp_path / "talk.npz")
        again = load_motion(tmp_path / "talk.npz")
        assert np.array_equal(again.vertices(), talk.vertices())
        assert again.head.notice == talk.head.notice and not len(again.head.landmarks)
        save_head(tmp_path / "head.npz", talk.head)
        assert load_head(tmp_path / "head.npz").mirror.shape == (0,)

    @pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply", ".npy", ".png"])
    def test_every_writer_takes_it(self, talk, tmp_path, suffix):
        options = {"size": (200, 200), "backend": "embreex"} if suffix == ".png" else {}
        write(talk, tmp_path / f"talk{suffix}", **options)
        assert (tmp_path / f"talk{suffix}").exists()

    def test_a_glb_of_it_is_read_by_others(self, talk, tmp_path):
        import trimesh

        write(talk, tmp_path / "talk.glb")
        scene = trimesh.load_scene(tmp_path / "talk.glb")
        assert sum(len(mesh.faces) for mesh in scene.geometry.values()) == len(talk.head.triangles)

    def test_what_needs_lips_or_eyes_says_so(self, talk, head):
        with pytest.raises(HeadError, match="'FLAME': no lips to measure"):
            measure_mouth(talk)
        with pytest.raises(HeadError, match="'FLAME': no landmarks"):
            _ = head.eye_distance_m
        with pytest.raises(InputError, match="no ARKit curves"):
            write(talk, "talk.csv")

    def test_places_are_still_checked(self, head):
        with pytest.raises(HeadError, match="landmarks is"):
            replace(head, landmarks=np.zeros(5, np.int32))
        with pytest.raises(HeadError, match="landmarks points past"):
            replace(head, landmarks=np.full(68, 200, np.int32))

    def test_eyeballs_have_an_iris(self, model):
        weights = np.tile([0.0, 1, 0, 0, 0], (200, 1))
        weights[:60] = [0, 0, 0, 1, 0]
        head = head_from_flame(replace(model, skin_weights=weights))
        assert len(np.unique(head.vertex_color[:60], axis=0)) >= 2
        assert np.array_equal(np.unique(head.vertex_color[60:], axis=0), [[206, 162, 142]])
