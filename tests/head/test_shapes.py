"""Expression shapes: symmetric, finite, and doing what their names say."""

from dataclasses import replace

import numpy as np
import pytest

from elocute.head import load_builtin_head
from elocute.head.identity import sample_identity
from elocute.head.shape_reach import shape_reach

FLIP = np.array([-1, 1, 1], np.float32)


@pytest.fixture(scope="module")
def head():
    return load_builtin_head()


def mirrored(head, field):
    return field[head.mirror] * FLIP


def shape(head, **weights):
    return np.tensordot(head.expression_vector(weights), head.expression_basis, 1)


def test_template_is_symmetric(head):
    apart = np.linalg.norm(head.template - mirrored(head, head.template), axis=1)
    assert apart.max() < 1e-4


def test_mirror_map_is_its_own_inverse(head):
    assert np.array_equal(head.mirror[head.mirror], np.arange(head.vertex_count))


def test_every_shape_has_its_mirror_image(head):
    for name, delta in zip(head.expression_names, head.expression_basis, strict=True):
        if name.endswith("Left"):
            partner = name[:-4] + "Right"
        elif name.endswith("Right"):
            partner = name[:-5] + "Left"
        else:
            partner = name
        other = head.expression_basis[head.expression_index(partner)]
        assert np.abs(delta - mirrored(head, other)).max() < 1e-4, name


def test_every_shape_moves_something_but_not_everything(head):
    for name, delta in zip(head.expression_names, head.expression_basis, strict=True):
        length = np.linalg.norm(delta, axis=1)
        assert 0.001 < length.max() < 0.05, name
        assert length[head.regions["neck_rim"]].max() < 1e-4, name
        assert length[head.regions["teeth_upper"]].max() == 0, name


def test_jaw_open_turns_the_lower_teeth_about_the_jaw_joint(head):
    teeth = head.regions["teeth_lower"]
    pivot = head.joint_positions[head.joint_names.index("jaw")]
    before = head.template[teeth] - pivot
    after = before + shape(head, jawOpen=1.0)[teeth]
    turned = np.degrees(
        np.arctan2(before[:, 1], before[:, 2]) - np.arctan2(after[:, 1], after[:, 2])
    )
    assert turned.mean() == pytest.approx(20, abs=0.5)
    assert np.allclose(np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1), atol=5e-5)


def lids_mm(head, vertices, side):
    """(2,) lowest and highest gap between the lids over the width of the eye."""
    upper, lower = (vertices[head.regions[f"lid_{lid}_{side}"]] for lid in ("upper", "lower"))
    upper, lower = upper[upper[:, 0].argsort()], lower[lower[:, 0].argsort()]
    x = np.linspace(max(upper[1, 0], lower[1, 0]), min(upper[-2, 0], lower[-2, 0]), 20)
    gap = np.interp(x, upper[:, 0], upper[:, 1]) - np.interp(x, lower[:, 0], lower[:, 1])
    return 1000 * gap.min(), 1000 * gap.max()


@pytest.mark.parametrize("person", [None, *range(20)])
def test_blinking_closes_the_eyes(head, person):
    face = head if person is None else head.with_identity(sample_identity(person))
    assert lids_mm(face, face.template, "left")[1] > 5
    closed = face.template + shape(face, eyeBlinkLeft=1.0, eyeBlinkRight=1.0)
    for side in ("left", "right"):
        assert lids_mm(face, closed, side)[1] < 0.3
        assert lids_mm(face, closed, side)[0] > -3.5


def test_closed_lids_lie_over_the_eyeball(head):
    closed = head.template + shape(head, eyeBlinkLeft=1.0)
    centre = head.joint_positions[head.joint_names.index("eyeLeft")]
    eye = head.template[head.regions["eye_left"]] - centre
    radius = np.linalg.norm(eye, axis=1).max()
    lids = np.r_[head.regions["lid_upper_left"], head.regions["lid_lower_left"]]
    assert np.linalg.norm(closed[lids] - centre, axis=1).min() > radius - 0.0008


@pytest.mark.parametrize(
    ("name", "axis", "sign"),
    [
        ("eyeLookUpLeft", 1, 1),
        ("eyeLookDownLeft", 1, -1),
        ("eyeLookInLeft", 0, -1),
        ("eyeLookOutLeft", 0, 1),
    ],
)
def test_eyes_look_where_the_name_says(head, name, axis, sign):
    pupil = head.regions["eye_left"][0]
    moved = shape(head, **{name: 1.0})
    assert sign * moved[pupil, axis] > 0.004
    assert np.abs(moved[head.regions["eye_right"]]).max() == 0


@pytest.mark.parametrize(
    ("landmark", "name", "axis", "sign"),
    [
        (54, "mouthSmileLeft", 1, 1),
        (54, "mouthFrownLeft", 1, -1),
        (54, "mouthStretchLeft", 0, 1),
        (51, "mouthUpperUpLeft", 1, 1),
        (57, "mouthLowerDownLeft", 1, -1),
        (8, "jawOpen", 1, -1),
        (8, "jawForward", 2, 1),
        (8, "jawLeft", 0, 1),
        (57, "mouthLeft", 0, 1),
        (24, "browOuterUpLeft", 1, 1),
        (22, "browDownLeft", 1, -1),
        (22, "browInnerUp", 1, 1),
    ],
)
def test_shapes_move_the_way_their_names_say(head, landmark, name, axis, sign):
    moved = shape(head, **{name: 1.0})[head.landmarks[landmark], axis]
    assert sign * moved > 0.0008


def test_combinations_stay_sane(head):
    """Common pairs at full strength: nothing flies off, no face of the lips turns over."""
    lips = np.isin(head.triangles, head.regions["lips"]).all(1)

    def normals(vertices):
        a, b, c = (vertices[head.triangles[lips][:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    rest = normals(head.template)
    pairs = [
        {"jawOpen": 1.0, "mouthClose": 1.0},
        {"jawOpen": 0.5, "mouthPucker": 1.0},
        {"jawOpen": 0.5, "mouthFunnel": 1.0},
        {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0, "jawOpen": 0.5},
        {"mouthPressLeft": 1.0, "mouthPressRight": 1.0, "mouthRollLower": 0.5},
    ]
    for weights in pairs:
        vertices = head.template + shape(head, **weights)
        assert np.linalg.norm(vertices - head.template, axis=1).max() < 0.05
        turned = (normals(vertices) * rest).sum(1) < 0
        assert turned.mean() < 0.12, weights


def test_lids_and_corners_in_one_place_have_no_reach():
    """Of a head that is flat, what another face's eyes are wider by is no number."""
    head = load_builtin_head()
    flat = replace(head, template=head.template * np.array([0, 0, 1], np.float32))
    assert shape_reach(flat, head.template) == {}
    assert "eyeBlinkLeft" in shape_reach(head, head.template)
