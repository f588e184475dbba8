"""Lips close: in every face, on the vertices that are drawn."""

import numpy as np
import pytest

from elocute.head import load_builtin_head
from elocute.head.identity import sample_identity
from elocute.head.viseme_shapes import VISEME_SHAPES

PEOPLE = 200


@pytest.fixture(scope="module")
def head():
    return load_builtin_head()


@pytest.fixture(scope="module")
def everyone(head):
    """(person, vertex, 3) m: lip vertices of many neutral faces, full spread, not the tame one."""
    drawn = (
        np.random.default_rng(1).normal(size=(PEOPLE, len(head.identity_basis))).astype(np.float32)
    )
    return head.template + np.tensordot(drawn, head.identity_basis, 1)


def gap_mm(head, vertices):
    """(..., column) upper minus lower contact height; negative where the lips overlap."""
    upper, lower = vertices[..., head.inner_lip_upper, 1], vertices[..., head.inner_lip_lower, 1]
    return 1000 * (upper - lower)


def shape(head, **weights):
    return np.tensordot(head.expression_vector(weights), head.expression_basis, 1)


def viseme(head, name):
    return shape(head, **VISEME_SHAPES[name])


def test_neutral_lips_touch_in_two_hundred_faces(head, everyone):
    gaps = gap_mm(head, everyone)
    assert gaps.max() <= 0
    assert gaps.min() >= -0.4


def test_the_seam_has_no_holes_between_the_columns(head, everyone):
    """Upper vertices between two columns lie on the lower lip's edge, give or take 0.1 mm."""
    ring = head.lip_rings[7]
    between = (29, 31, 33, 35, 37, 1, 3, 5, 7, 9)
    lower = everyone[:, head.inner_lip_lower]
    for column in between:
        vertex = everyone[:, ring[column]]
        edge = np.stack(
            [np.interp(p[0], line[:, 0], line[:, 1]) for p, line in zip(vertex, lower, strict=True)]
        )
        assert (1000 * (vertex[:, 1] - edge)).max() < 0.1


def test_closed_visemes_are_closed_in_two_hundred_faces(head, everyone):
    for name in ("sil", "PP"):
        assert gap_mm(head, everyone + viseme(head, name)).max() <= 0.1


@pytest.mark.parametrize("opening", [0.1, 0.3, 0.6, 1.0])
def test_mouth_close_seals_whatever_the_jaw_does(head, opening):
    closed = head.template + shape(head, jawOpen=opening, mouthClose=opening)
    assert gap_mm(head, closed).max() <= 0.1


def test_mouth_close_keeps_the_height_of_the_lips(head):
    def height(vertices):
        return vertices[head.lip_rings[0][0], 1] - vertices[head.lip_rings[0][19], 1]

    closed = head.template + shape(head, jawOpen=1.0, mouthClose=1.0)
    assert height(closed) == pytest.approx(height(head.template), rel=0.1)


@pytest.mark.parametrize(
    "name",
    ["mouthSmile", "mouthFrown", "mouthDimple", "mouthStretch", "mouthPress"],
)
def test_corner_shapes_keep_closed_lips_closed(head, name):
    moved = head.template + shape(head, **{f"{name}Left": 1.0, f"{name}Right": 1.0})
    assert gap_mm(head, moved).max() <= 0.1


@pytest.mark.parametrize("name", ["mouthRollLower", "mouthRollUpper", "mouthShrugLower"])
def test_middle_shapes_keep_closed_lips_closed(head, name):
    assert gap_mm(head, head.template + shape(head, **{name: 1.0})).max() <= 0.1


@pytest.mark.parametrize("name", ["mouthLowerDown", "mouthUpperUp"])
def test_parted_lips_stay_on_each_other_beside_the_corners(head, name):
    gaps = gap_mm(head, head.template + shape(head, **{f"{name}Left": 0.5, f"{name}Right": 0.5}))
    across = head.template[head.inner_lip_upper, 0] / head.template[head.inner_corners[1], 0]
    assert gaps[np.abs(across) > 0.9].max() < 0.1
    assert np.interp(0.6, across, gaps) > 0.5 * gaps[len(gaps) // 2]


@pytest.mark.parametrize(
    ("name", "edge", "border"),
    [
        ("mouthLowerDown", "inner_lip_lower", "outer_lip_lower"),
        ("mouthUpperUp", "inner_lip_upper", "outer_lip_upper"),
    ],
)
def test_a_lip_that_is_drawn_away_stays_full(head, name, edge, border):
    moved = shape(head, **{f"{name}Left": 1.0, f"{name}Right": 1.0})[:, 1]
    middle = len(head.inner_lip_lower) // 2
    assert 0.75 < moved[getattr(head, border)[middle]] / moved[getattr(head, edge)[middle]] < 1


def test_corners_come_down_with_the_lower_lip_and_the_jaw(head):
    corner = head.inner_corners[1]
    for weights in ({"mouthLowerDownLeft": 1.0, "mouthLowerDownRight": 1.0}, {"jawOpen": 0.3}):
        moved = 1000 * shape(head, **weights)[:, 1]
        lip = moved[head.inner_lip_lower[len(head.inner_lip_lower) // 2]]
        assert 0.15 < moved[corner] / lip < 0.75


def test_open_visemes_open_as_far_as_they_should(head):
    """Middle third, millimetres: ranges from speech (aa widest, W nearly closed)."""
    wanted = {
        "aa": (10, 13),
        "E": (6.5, 9.5),
        "ih": (4, 7),
        "oh": (5.5, 8.5),
        "ou": (2, 4.5),
        "W": (0.5, 2.5),
        "RR": (3, 5.5),
        "CH": (2.5, 5.5),
        "SS": (2, 4.5),
        "DD": (3, 5.5),
        "nn": (3.5, 5.5),
        "kk": (4, 6),
        "TH": (4, 6.5),
        "FF": (0.8, 2),  # the lower lip lies on the incisors, whose edges are seen
    }
    for name, (low, high) in wanted.items():
        middle = gap_mm(head, head.template + viseme(head, name))[4:9].mean()
        assert low <= middle <= high, name


def test_lower_lip_meets_the_incisors_on_f(head):
    vertices = head.template + viseme(head, "FF")
    teeth = vertices[head.regions["teeth_upper"]]
    incisors = teeth[np.abs(teeth[:, 0]) < 0.007]
    edge = incisors[incisors[:, 1].argmin()]
    lip = vertices[head.inner_lip_lower[6]]
    assert abs(lip[1] - edge[1]) < 0.0015
    assert abs(lip[2] - incisors[incisors[:, 1] < edge[1] + 0.002][:, 2].max()) < 0.002


@pytest.mark.parametrize("name", ["SS", "CH"])
def test_teeth_nearly_meet_and_are_seen_in_hisses(head, name):
    vertices = head.template + viseme(head, name)
    upper, lower = (vertices[head.regions[f"teeth_{jaw}"]] for jaw in ("upper", "lower"))
    edge = upper[np.abs(upper[:, 0]) < 0.007][:, 1].min()
    below = lower[np.abs(lower[:, 0]) < 0.005][:, 1].max()
    assert 0 < edge - below < 0.0015
    lip = vertices[head.inner_lip_lower[6], 1]
    assert lip < (below if name == "CH" else edge)


def test_rounded_lips_are_narrow_and_forward(head):
    corners, front = head.outer_corners, head.landmarks[[51, 57]]
    rest_width = np.ptp(head.template[corners, 0])
    for name in ("ou", "W", "CH", "oh"):
        vertices = head.template + viseme(head, name)
        assert np.ptp(vertices[corners, 0]) < 0.8 * rest_width, name
        assert (vertices[front, 2] - head.template[front, 2]).mean() > 0.002, name


def test_tongue_comes_between_the_teeth_on_th(head):
    vertices = head.template + viseme(head, "TH")
    tongue = vertices[head.regions["tongue"]]
    upper = vertices[head.regions["teeth_upper"]]
    tip = tongue[tongue[:, 2].argmax()]
    assert tip[2] > upper[:, 2].max() - 0.002
    lower_lip = vertices[head.inner_lip_lower[6]]
    assert tip[1] > lower_lip[1] - 0.002


def crowns(head, vertices):
    """(crown, vertex, 3): fourteen in each jaw."""
    return np.concatenate(
        [vertices[head.regions[f"teeth_{jaw}"]].reshape(14, -1, 3) for jaw in ("upper", "lower")]
    )


def deepest_mm(points, teeth):
    """How far the deepest point lies inside a crown's convex hull."""
    from scipy.spatial import ConvexHull

    low, high = points.min(0), points.max(0)
    depth = 0.0
    for crown in teeth:
        if (crown.max(0) < low).any() or (crown.min(0) > high).any():
            continue
        planes = ConvexHull(crown).equations
        inside = -(points @ planes[:, :3].T + planes[:, 3]).max(1)
        depth = max(depth, float(inside.max()))
    return 1000 * depth


@pytest.mark.parametrize("person", [None, 0, 1, 2])
def test_no_lip_goes_into_a_tooth_in_speech(head, person):
    face = head.template if person is None else head.identity_template(sample_identity(person))
    lips = np.unique(head.lip_rings[:9])
    for name in VISEME_SHAPES:
        vertices = face + viseme(head, name)
        assert deepest_mm(vertices[lips], crowns(head, vertices)) < 1.0, name
