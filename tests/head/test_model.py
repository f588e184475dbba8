"""The built-in head as it ships: what it holds, how it loads, how it is stored."""

from dataclasses import replace

import numpy as np
import pytest

from elocute.errors import HeadError
from elocute.head import load_builtin_head, load_head, save_head
from elocute.head.builtin import BUILTIN_HEAD_PATH
from elocute.head.identity import IDENTITY_COUNT, sample_identity
from elocute.head.store import BASIS_STEP_M
from tests.support.commands import run_python


@pytest.fixture(scope="module")
def head():
    return load_builtin_head()


def test_has_what_the_other_layers_count_on(head):
    assert head.vertex_count < 9000
    assert head.identity_basis.shape[0] == IDENTITY_COUNT == 77
    assert head.expression_names[0] == "eyeBlinkLeft"
    assert head.expression_names[51] == "tongueOut"
    assert head.expression_names[52:] == ("mouthLabiodental", "tongueTipUp", "tongueDental")
    assert head.joint_names == ("neck", "head", "jaw", "eyeLeft", "eyeRight")
    assert head.joint_parents == (-1, 0, 1, 1, 1)
    for name in ("face", "lips", "eyes", "teeth", "tongue"):
        assert len(head.regions[name])
    assert "CC0" in head.notice


def test_is_small_on_disk():
    assert BUILTIN_HEAD_PATH.stat().st_size < 3_000_000


def test_loads_in_a_fraction_of_a_second():
    code = (
        "import time, numpy; from elocute.head import load_builtin_head;"
        "t = time.process_time(); load_builtin_head(); print(time.process_time() - t)"
    )
    times = [float(run_python("-c", code, check=True).stdout) for _ in range(3)]
    assert min(times) < 0.15


def test_is_an_upright_head_in_metres(head):
    height = np.ptp(head.template[head.regions["skin"], 1])
    assert 0.25 < height < 0.40  # with the bust
    nose, chin, crown = head.template[head.landmarks[30]], head.template[head.landmarks[8]], 0.0
    crown = head.template[:, 1].max()
    assert nose[2] > head.joint_positions[1, 2] + 0.08  # +Z points out of the face
    assert chin[1] < nose[1] < crown  # +Y is up
    assert head.template[head.regions["eye_left"], 0].mean() > 0.02  # +X is its own left
    assert 0.08 < head.eye_distance_m < 0.11


def test_faces_are_wound_outwards(head):
    for part in ("skin", "eye_left", "eye_right", "tongue", "teeth_upper", "teeth_lower"):
        vertices = head.regions[part]
        triangles = head.triangles[np.isin(head.triangles, vertices).all(1)]
        centred = head.template.astype(float) - head.template[vertices].mean(0)
        a, b, c = (centred[triangles[:, k]] for k in range(3))
        assert (np.cross(b, c) * a).sum() > 0, part


def test_no_triangle_is_degenerate(head):
    a, b, c = (head.template[head.triangles[:, k]].astype(float) for k in range(3))
    doubled_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert doubled_area.min() > 1e-10
    assert len(head.triangle_material) == len(head.uv_triangles) == len(head.triangles)


def test_landmarks_mirror_each_other(head):
    left_of = [*range(16, -1, -1), *range(26, 16, -1), *range(27, 31), *range(35, 30, -1)]
    left_of += [45, 44, 43, 42, 47, 46, 39, 38, 37, 36, 41, 40]
    assert np.array_equal(head.mirror[head.landmarks[:48]], head.landmarks[left_of])
    x = head.template[head.landmarks, 0]
    assert x[0] < x[8] < x[16]  # the first landmark is on the head's right
    assert x[36] < x[39] < x[42] < x[45]
    assert x[48] < x[51] < x[54]


def test_ears_stand_off_the_skull_and_are_hollow(head):
    eye = head.joint_positions[head.joint_names.index("eyeLeft")]
    skin = head.template[head.regions["skin"]]
    behind = skin[:, 2].max() - skin[:, 2]
    ear = (skin[:, 0] > 0.065) & (behind > 0.095) & (behind < 0.135)
    ear &= (skin[:, 1] < eye[1] + 0.012) & (skin[:, 1] > eye[1] - 0.046)
    points = skin[ear & (skin[:, 0] > 0.072)].astype(float)
    across = np.linalg.lstsq(np.c_[points[:, 1:], np.ones(len(points))], points[:, 0], rcond=None)[
        0
    ]
    assert 18 < np.degrees(np.arctan(-across[1])) < 27
    light = head.occlusion[head.regions["skin"]][ear]
    assert light.min() < 0.45
    assert light.max() > 0.9


def test_skin_weights_sum_to_one(head):
    assert np.allclose(head.skin_weights.sum(1), 1, atol=1e-6)
    assert head.skin_weights.min() >= 0
    lower_teeth = head.regions["teeth_lower"]
    assert np.all(head.skin_weights[lower_teeth, head.joint_names.index("jaw")] == 1)


def test_survives_being_stored(head, tmp_path):
    save_head(tmp_path / "head.npz", head)
    again = load_head(tmp_path / "head.npz")
    assert again.expression_names == head.expression_names
    assert np.array_equal(again.quads, head.quads)
    assert np.array_equal(again.template, head.template)
    assert np.array_equal(again.trait_basis, head.trait_basis)
    assert np.abs(again.expression_basis - head.expression_basis).max() <= BASIS_STEP_M
    assert [path.name for path in tmp_path.iterdir()] == ["head.npz"]


def test_a_head_of_the_first_versions_is_read(head, tmp_path):
    save_head(tmp_path / "head.npz", head)
    with np.load(tmp_path / "head.npz") as stored:
        np.savez(tmp_path / "old.npz", **{n: stored[n] for n in stored if n != "trait_basis"})
    assert not len(load_head(tmp_path / "old.npz").trait_basis)


def test_refuses_what_is_no_head(tmp_path, head):
    path = tmp_path / "bad.npz"
    path.write_bytes(b"PK but no archive")
    with pytest.raises(HeadError, match="damaged, or something else"):
        load_head(path)
    np.savez(path, template=np.zeros((3, 3)))
    with pytest.raises(HeadError, match="not a readable head"):
        load_head(path)
    with pytest.raises(HeadError, match="no such file"):
        load_head(tmp_path / "missing.npz")
    with pytest.raises(HeadError, match="vertex_color"):
        replace(head, vertex_color=head.vertex_color[:5])
    with pytest.raises(HeadError, match="not finite"):
        replace(head, template=np.full_like(head.template, np.nan))


def test_another_face_keeps_its_shapes_but_not_the_identity_space(head):
    someone = head.with_identity(sample_identity(7))
    moved = np.linalg.norm(someone.template - head.template, axis=1)
    assert 0.001 < moved.mean() < 0.03
    assert len(someone.identity_basis) == 0
    jaw_open = head.expression_index("jawOpen")
    assert np.array_equal(someone.expression_basis[jaw_open], head.expression_basis[jaw_open])
    with pytest.raises(HeadError, match="at most 0"):
        someone.with_identity(sample_identity(8))


def test_skin_tone_changes_skin_and_leaves_eyes_and_teeth(head):
    dark = head.with_identity(50 * head.tone_basis[1:])
    skin = np.setdiff1d(head.regions["face"], head.regions["lips"])
    assert dark.vertex_color[skin].mean() < 0.8 * head.vertex_color[skin].mean()
    for part in ("eyes", "teeth", "tongue"):
        same = dark.vertex_color[head.regions[part]] == head.vertex_color[head.regions[part]]
        assert same.all()


def test_unknown_expression_is_named(head):
    with pytest.raises(HeadError, match="mouthOpen"):
        head.expression_vector({"mouthOpen": 1.0})
