"""A dressed head is a head like any other: same motions, more vertices, readable pictures."""

from __future__ import annotations

import numpy as np
import pytest

from elocute.errors import HeadError
from elocute.head import HeadModel, load_builtin_head, resolve_identity
from elocute.head.looks import Look, dress
from elocute.head.looks.eyes import eye_picture
from elocute.head.looks.pictures import decoded


@pytest.fixture(scope="module")
def head() -> HeadModel:
    return load_builtin_head()


@pytest.fixture(scope="module")
def worn(head: HeadModel) -> HeadModel:
    return dress(head, Look())


def test_the_heads_own_vertices_come_first_and_stay(head: HeadModel, worn: HeadModel) -> None:
    count = head.vertex_count
    assert worn.vertex_count > count
    # But for the balls of the eyes, from which the noise of storage is taken.
    others = np.setdiff1d(np.arange(count), head.regions["eyes"])
    np.testing.assert_array_equal(worn.template[others], head.template[others])
    np.testing.assert_allclose(worn.template[:count], head.template, atol=5e-5)
    np.testing.assert_array_equal(worn.expression_basis[:, :count], head.expression_basis)
    assert worn.expression_names == head.expression_names


def test_every_surface_is_a_material_with_a_readable_picture(worn: HeadModel) -> None:
    assert {"skin", "eyeball", "hair", "brows", "lashes"} <= set(worn.surfaces)
    for name, surface in worn.surfaces.items():
        assert name in worn.material_names
        for picture in (surface.color, surface.normal, surface.roughness):
            assert not picture or min(decoded(picture).shape[:2]) >= 64


def test_hair_turns_with_the_head_and_leaves_the_mouth_alone(worn: HeadModel) -> None:
    hair = np.unique(worn.quads[worn.material == worn.material_names.index("hair")])
    np.testing.assert_allclose(worn.skin_weights[hair].sum(1), 1, atol=1e-4)
    jaw = worn.expression_vector({"jawOpen": 1.0})
    moved = np.linalg.norm(np.tensordot(jaw, worn.expression_basis[:, hair], 1), axis=1)
    assert np.quantile(moved, 0.99) < 0.002


def test_lashes_follow_the_lid_as_it_shuts(worn: HeadModel) -> None:
    lashes = np.unique(worn.quads[worn.material == worn.material_names.index("lashes")])
    left = lashes[worn.template[lashes, 0] > 0]
    tips = left[np.argsort(worn.template[left, 1])[-20:]]
    shut = worn.expression_basis[worn.expression_index("eyeBlinkLeft"), tips]
    assert shut[:, 1].mean() < -0.004


def test_a_dressed_face_is_dressed_after_its_identity(head: HeadModel) -> None:
    wide = dress(head.with_identity(resolve_identity("otto")), Look(hair="swept", sex=1, age=68))
    assert np.isfinite(wide.template).all()


@pytest.mark.parametrize("choice", [{"hair": "mohawk"}, {"age": 8}, {"eyes": "red"}])
def test_unknown_choices_are_refused(choice: dict) -> None:
    with pytest.raises(HeadError, match="look"):
        Look(**choice)


def test_a_dressed_head_is_not_dressed_again(worn: HeadModel) -> None:
    with pytest.raises(HeadError, match="another mesh"):
        dress(worn, Look())


def test_light_skin_is_redder_where_blood_shows_through(head: HeadModel) -> None:
    def redness(tone: float, vertices: np.ndarray) -> float:
        seen = decoded(dress(head, Look(tone=tone, age=25)).surfaces["skin"].color) / 255.0
        place = dict(zip(head.quads.ravel(), head.uv_quads.ravel(), strict=True))
        at = head.uv[[place[v] for v in vertices]]
        rows, columns = ((1 - at[:, 1]) * len(seen)).astype(int), (at[:, 0] * len(seen)).astype(int)
        return float((seen[rows, columns, 0] / seen[rows, columns, 1]).mean())

    tip, jaw = head.landmarks[[30, 31, 33, 35]], head.landmarks[4:13]
    light, dark = (redness(tone, tip) / redness(tone, jaw) for tone in (0.15, 0.85))
    assert light > 1.04
    assert light > dark


def test_pupils_are_as_wide_as_the_look_has_them() -> None:
    def dark(pupils: float) -> float:
        """How wide the dark of the pupil is, in pixels, along the middle of the picture."""
        picture = decoded(eye_picture("blue", pupils)).astype(float).mean(2)
        row = picture[len(picture) // 2]
        return float(np.count_nonzero(row[200:312] < 40))

    drawn = dark(4.2)
    for pupils in (2.0, 3.0, 6.0):
        assert dark(pupils) == pytest.approx(drawn * pupils / 4.2, abs=5)
    wide, usual = (decoded(eye_picture("blue", p)).astype(float) for p in (6.0, 4.2))
    assert np.abs(wide - usual)[:, :170].max() < 12  # the white is left alone


def test_pupils_have_limits() -> None:
    with pytest.raises(HeadError, match="pupils"):
        Look(pupils=9)


@pytest.mark.parametrize("tone", [0.1, 0.9])
def test_the_lining_of_the_mouth_is_flesh(head: HeadModel, tone: float) -> None:
    """Where it meets textured lips, whose vertices are white, it would be a pale streak."""
    worn = dress(head, Look(tone=tone))
    lining = np.unique(worn.quads[worn.material == worn.material_names.index("mouth")])
    red, green, blue = worn.vertex_color[lining].astype(int).T
    assert (red > 1.15 * green).all()
    assert (green > blue).all()
