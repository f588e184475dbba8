"""Heads, motions and identities that lie: one line each, and no memory taken on their word."""

import json
import pickle
import zipfile

import numpy as np
import pytest
from scipy.sparse import csc_matrix

from elocute.errors import HeadError, InputError
from elocute.head.builtin import load_builtin_head
from elocute.head.flame import load_flame
from elocute.head.identity import read_identity
from elocute.head.mesh import head_from_arrays
from elocute.head.store import load_head, save_head
from elocute.motion.motion import Motion
from elocute.motion.store import load_motion, save_motion
from elocute.numerics.quaternions import no_turn


def small_head():
    corners = np.random.default_rng(0).normal(size=(12, 3)) * 0.1
    return head_from_arrays(
        "small",
        corners,
        np.array([[0, 1, 2], [3, 4, 5]]),
        expression_names=("open", "wide"),
        expression_basis=np.full((2, 12, 3), 0.01),
    )


@pytest.fixture(params=["head", "motion"])
def stored(request, tmp_path):
    """A stored head or motion: its path and what reads it."""
    if request.param == "head":
        save_head(tmp_path / "small.npz", small_head())
        return tmp_path / "small.npz", load_head
    motion = Motion(small_head(), np.zeros((5, 2), np.float32), 30.0)
    save_motion(motion, tmp_path / "small.npz")
    return tmp_path / "small.npz", load_motion


def refused(path, read):
    with pytest.raises(InputError) as caught:
        read(path)
    message = str(caught.value)
    assert "\n" not in message and path.name in message and len(message) < 700
    return message


def change(path, **changes):
    """Rewrite an archive with other arrays; names hold `__` for a slash."""
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files}
    for name, edit in changes.items():
        keys = [key for key in arrays if key.split("/")[-1] == name]
        for key in keys:
            arrays[key] = edit(arrays[key])
    np.savez(path, **arrays)


def with_texts(**given):
    def edit(raw):
        return np.frombuffer(json.dumps(json.loads(raw.tobytes()) | given).encode(), np.uint8)

    return edit


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"template": lambda a: a * np.nan}, "not finite"),
        ({"template": lambda a: a * np.float32(1e30)}, "up to 1e"),
        ({"template": lambda a: a.astype("U8")}, "template of"),
        ({"uv": lambda a: a + np.inf}, "uv is not finite"),
        ({"quads": lambda a: a + 500}, "quads points past 12"),
        ({"quads": lambda a: a.astype(np.float64)}, "quads"),
        ({"material": lambda a: a + 7}, "material points past"),
        ({"skin_weights": lambda a: a[:3]}, "skin_weights is (3, 1)"),
        ({"texts": with_texts(joint_parents=[0])}, "does not follow its parent"),
        ({"texts": with_texts(joint_parents=["a"])}, "does not follow its parent"),
        ({"texts": with_texts(joint_names=[["a"]])}, "joint_names with an unusable"),
        (
            {"texts": with_texts(expression_names=["a", "a"])},
            "expression_names with an unusable or repeated",
        ),
        ({"texts": with_texts(name="x" * 5000)}, "name that is not text"),
        ({"texts": lambda a: a[:9]}, "no JSON"),
        ({"texts": with_texts(notice=3)}, "notice that is not text"),
    ],
)
def test_what_is_no_head_is_refused(stored, changes, found):
    path, read = stored
    change(path, **changes)
    assert found in refused(path, read)


def test_an_archive_that_unpacks_to_gigabytes_is_refused(stored):
    path, read = stored
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("template.npy", bytes(200_000_000))
    assert "200 MB inside" in refused(path, read)


def test_shapes_that_unfold_to_gigabytes_are_refused(tmp_path):
    motion = Motion(small_head(), np.zeros((5, 2), np.float32), 30.0)
    save_motion(motion, path := tmp_path / "talk.npz")
    names = [f"n{number}" for number in range(9000)]
    change(
        path,
        texts=with_texts(expression_names=names),
        template=lambda a: np.zeros((100_000, 3), np.float32),
    )
    assert "9000 shapes of 100000 vertices" in refused(path, load_motion)


@pytest.mark.parametrize("fps", [0, -1, "a", None, True, 1e300])
def test_frame_rates_that_are_none(tmp_path, fps):
    motion = Motion(small_head(), np.zeros((5, 2), np.float32), 30.0)
    save_motion(motion, path := tmp_path / "talk.npz")
    change(path, texts=with_texts(fps=fps))
    assert "fps" in refused(path, load_motion)


def test_a_head_of_more_vertices_than_two_bytes_count(tmp_path):
    corners = np.zeros((70_000, 3))
    corners[:, 1] = np.linspace(0, 0.2, 70_000)
    save_head(
        tmp_path / "large.npz", head_from_arrays("large", corners, np.array([[0, 1, 69_999]]))
    )
    assert load_head(tmp_path / "large.npz").quads.max() == 69_999


def test_a_regressor_is_not_unfolded_before_its_shape_is_known(tmp_path):
    joints = 400_000_000
    parts = {
        "v_template": np.zeros((3, 3)),
        "shapedirs": np.zeros((3, 3, 1)),
        "posedirs": np.zeros((3, 3, 0)),
        "weights": np.zeros((0, joints)),
        "J_regressor": csc_matrix((joints, 3)),
        "kintree_table": np.array([[-1], [0]]),
        "f": np.array([[0, 1, 2]]),
    }
    path = tmp_path / "flame.pkl"
    path.write_bytes(pickle.dumps(parts, 2))
    assert "weights" in refused(path, load_flame)


@pytest.mark.parametrize(
    "text", ['{"identity": ' + "9" * 5000 + "}", '{"identity": [1e999]}', '{"identity": {}}', "3"]
)
def test_identities_of_other_numbers(tmp_path, text):
    path = tmp_path / "me.json"
    path.write_text(text)
    with pytest.raises(HeadError, match="allowed"):
        read_identity(path)


def test_motions_that_go_where_no_face_is_are_refused(tmp_path):
    path = tmp_path / "far.npz"
    weights = np.zeros((5, 2), np.float32)
    weights[3, 1] = 5e5
    save_motion(Motion(small_head(), weights, 30.0), path)
    assert "a vertex 8.66e+03 m from where it rests, in frame 3; allowed: up to 10 m" in refused(
        path, load_motion
    )
    weights[3, 1] = 500  # 8.7 m
    save_motion(Motion(small_head(), weights, 30.0), path)
    assert load_motion(path).frame_count == 5
    head = load_builtin_head()
    turns = np.tile(no_turn(5)[:, None], (1, len(head.joint_names), 1))
    turns[2, 1] = 1e30
    still = np.zeros((5, len(head.expression_names)), np.float32)
    save_motion(Motion(head, still, 30.0, turns), path)
    assert "in frame 2; allowed: quaternions of length 1" in refused(path, load_motion)
