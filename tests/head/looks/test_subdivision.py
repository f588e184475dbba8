"""The face that is drawn is finer than the one that is moved, and otherwise the same."""

from __future__ import annotations

import numpy as np
import pytest

from elocute.animation import identity_head
from elocute.head import HeadModel, load_builtin_head
from elocute.head.looks import Look, dress
from elocute.head.looks.subdivision import finer_face, made_finer
from elocute.head.normals import vertex_normals


@pytest.fixture(scope="module")
def head() -> HeadModel:
    return load_builtin_head()


@pytest.fixture(scope="module")
def finer(head: HeadModel) -> HeadModel:
    return made_finer(head)


def turns_deg(head: HeadModel, material: str, points: np.ndarray) -> np.ndarray:
    """(edge,) angles between neighbouring triangles of a material."""
    triangles = head.triangles[head.triangle_material == head.material_names.index(material)]
    a, b, c = (points[triangles[:, k]].astype(float) for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-15)
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(sides.T)
    same = (sides[order][1:] == sides[order][:-1]).all(1)
    one, other = order[:-1][same] // 3, order[1:][same] // 3
    return np.degrees(np.arccos(np.clip((normals[one] * normals[other]).sum(1), -1, 1)))


@pytest.mark.parametrize("material", ["tongue", "lips", "teeth"])
def test_what_had_corners_is_rounder(head: HeadModel, finer: HeadModel, material: str) -> None:
    speaking = {"jawOpen": 0.5, "mouthSmileLeft": 0.4, "mouthSmileRight": 0.4}
    before, after = (
        turns_deg(
            each,
            material,
            each.template
            + np.tensordot(each.expression_vector(speaking), each.expression_basis, 1),
        )
        for each in (head, finer)
    )
    assert np.quantile(after, 0.9) < 0.75 * np.quantile(before, 0.9)


def test_old_vertices_stay_first_and_where_they_were(finer: HeadModel, head: HeadModel) -> None:
    count = head.vertex_count
    assert finer.vertex_count == count + finer_face().more
    assert np.abs(finer.template[:count] - head.template).max() < 1e-6
    assert np.array_equal(finer.expression_basis[:, :count], head.expression_basis)
    assert np.allclose(finer.skin_weights.sum(1), 1, atol=1e-5)


def test_new_vertices_lie_on_the_surface(finer: HeadModel, head: HeadModel) -> None:
    new = finer.template[head.vertex_count :]
    off_mm = 1000 * np.linalg.norm(new - finer_face().between(head.template), axis=1)
    assert np.median(off_mm) < 0.15
    assert off_mm.max() < 2.0  # across the edge of the tongue


def test_no_crack_opens_and_no_piece_lies_on_another(finer: HeadModel, head: HeadModel) -> None:
    def sides(each: HeadModel) -> tuple[set[tuple[int, ...]], int]:
        """Edges that one face alone has, and the most faces at an edge."""
        pairs = each.quads[:, [[0, 1], [1, 2], [2, 3], [3, 0]]].reshape(-1, 2)
        pairs = np.sort(pairs[pairs[:, 0] != pairs[:, 1]], axis=1)
        pairs, times = np.unique(pairs, axis=0, return_counts=True)
        return {tuple(pair) for pair in pairs[times == 1].tolist()}, int(times.max())

    open_before, _ = sides(head)
    open_after, most = sides(finer)
    assert most == 2
    middles = dict(enumerate(finer_face().ends.tolist(), head.vertex_count))
    halves = {pair for pair in open_after if pair not in open_before}
    for pair in halves:  # of an edge that was open before: roots of teeth
        (middle,) = [middles[vertex] for vertex in pair if vertex in middles]
        assert tuple(middle) in open_before
        assert set(pair) & set(middle)


def test_textures_do_not_shift(finer: HeadModel, head: HeadModel) -> None:
    """New corners lie halfway in the texture too: the middle of a triangle is a mixture of its
    corners there as it is in space."""
    skin = head.material == head.material_names.index("skin")
    low, high = head.uv[head.uv_quads[skin]].min((0, 1)), head.uv[head.uv_quads[skin]].max((0, 1))
    finer_skin = finer.material == finer.material_names.index("skin")
    at = finer.uv[finer.uv_quads[finer_skin]]
    assert (at >= low - 1e-6).all() and (at <= high + 1e-6).all()

    def area(corners: np.ndarray) -> float:
        (x, y), (u, v) = (corners[:, 2] - corners[:, 0]).T, (corners[:, 3] - corners[:, 1]).T
        return float(np.abs(x * v - y * u).sum() / 2)

    assert area(at) == pytest.approx(area(head.uv[head.uv_quads[skin]]), rel=2e-3)


SHARES = np.array([(a, b, 6 - a - b) for a in range(7) for b in range(7 - a)]) / 6


@pytest.mark.parametrize("who", ["mean", "ben", "otto", "5"])
def test_brows_lie_on_the_skin(who: str) -> None:
    worn = dress(identity_head(who), Look(brows="full", hair="none", clothes="none"))
    names = worn.material_names
    brows = worn.template[np.unique(worn.quads[worn.material == names.index("brows")])]
    skin = worn.template[worn.triangles[worn.triangle_material == names.index("skin")]]
    near = np.abs(skin.mean(1)[:, None] - brows[::5]).max(2).min(1) < 0.008
    normals = np.cross(skin[near, 1] - skin[near, 0], skin[near, 2] - skin[near, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    places = np.einsum("sk,tkc->tsc", SHARES, skin[near])
    for brow in brows:
        away = brow - places
        triangle = (away * away).sum(2).min(1).argmin()
        assert ((brow - skin[near][triangle, 0]) @ normals[triangle]) > 0


@pytest.mark.parametrize("who", ["hana", "chidi", "5"])
def test_nobodys_eyes_have_dents(head: HeadModel, who: str) -> None:
    """Normals, in which a window is mirrored, turn as those of the mean head's eyes do."""
    worn, plain = dress(identity_head(who), Look()), dress(head, Look())
    for eye in ("eye_left", "eye_right"):
        ball = head.regions[eye]
        of = np.column_stack([plain.template[ball], np.ones(len(ball))])
        turned = np.linalg.inv(np.linalg.lstsq(of, worn.template[ball], rcond=None)[0][:3]).T
        own, other = (vertex_normals(each.template, each.triangles)[ball] for each in (worn, plain))
        expected = other @ turned
        expected /= np.linalg.norm(expected, axis=1, keepdims=True)
        angles = np.degrees(np.arccos(np.clip((own * expected).sum(1), -1, 1)))
        assert angles.max() < 0.5
