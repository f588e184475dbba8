"""The shirt sits on every neck: its edge in the skin, no skin through the cloth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from elocute.animation import identity_head
from elocute.head import HeadModel
from elocute.head.looks import PEOPLE, Look, dress
from elocute.head.looks.cards import read_cards
from elocute.head.looks.look import CLOTHES
from elocute.head.normals import vertex_normals
from elocute.registration.closest_points import DenseMesh

FACES = [
    *("mean", "3", "otto", "dana"),
    *(
        pytest.param(who, marks=pytest.mark.slow)
        for who in ("esi", *(str(seed) for seed in range(12) if seed != 3))
    ),
]
"""Four in `make test`, the others where everything is tested."""


def shirt_of(worn: HeadModel) -> np.ndarray:
    """Vertices of the shirt; they are the last."""
    faces = worn.material == worn.material_names.index("clothes")
    return np.unique(worn.quads[faces])


def mesh(head: HeadModel, material: str) -> DenseMesh:
    quads = head.quads[head.material == head.material_names.index(material)]
    used, local = np.unique(quads, return_inverse=True)
    local = local.reshape(-1, 4)
    triangles = np.vstack([local[:, [0, 1, 2]], local[:, [0, 2, 3]]])
    return DenseMesh(head.template[used].astype(float), triangles)


def outside_m(surface: DenseMesh, points: np.ndarray) -> np.ndarray:
    """How far points lie off a surface, along its normals."""
    found = surface.closest(points.astype(float))
    normals = vertex_normals(surface.points, surface.triangles)
    corners = normals[surface.triangles[found.triangle]]
    normal = np.einsum("pk,pkc->pc", found.bary, corners)
    return ((points - found.points) * normal).sum(1)


@pytest.mark.parametrize("cut", [name for name in CLOTHES if name != "none"])
@pytest.mark.parametrize("who", FACES)
def test_no_skin_comes_through_and_no_gap_is_left(who: str, cut: str) -> None:
    head = identity_head(who)
    worn = dress(head, Look(hair="none", clothes=cut))
    shirt = shirt_of(worn)
    skin, cloth, columns = mesh(head, "skin"), mesh(worn, "clothes"), 84
    faces = len(cloth.triangles) // 2
    edge, rolled = shirt[:columns], shirt[2 * columns : 5 * columns]
    assert outside_m(skin, worn.template[edge]).max() < 0.0004
    assert outside_m(skin, worn.template[rolled]).min() > 0.0008
    under = np.intersect1d(read_cards(f"clothes/{cut}").covers, worn.quads)
    assert len(under)
    over = cloth.closest(worn.template[under].astype(float))
    below_the_edge = over.triangle % faces >= columns
    assert (outside_m(skin, over.points[below_the_edge]) > 0.0005).all()


@pytest.mark.parametrize("who", ["mean", "ben", "hana", "3"])
def test_a_collar_is_of_two_layers_with_an_even_edge(who: str) -> None:
    worn = dress(identity_head(who), Look(hair="none", clothes="collar"))
    columns, edge = 84, 12
    rings = worn.template[shirt_of(worn)][: 18 * columns].reshape(18, columns, 3)
    layers = np.linalg.norm(rings[edge - 1] - rings[edge + 1], axis=1)
    assert (layers > 0.0018).all()
    assert (layers < 0.0045).all()
    around = rings[edge]
    bend = np.linalg.norm(np.roll(around, 1, 0) + np.roll(around, -1, 0) - 2 * around, axis=1)
    corners = np.sort(bend)[-3:]  # the points, and the throat between them with its neighbours
    assert corners.min() > 0.006
    assert np.sort(bend)[:-5].max() < 0.0025


def test_a_shirt_shades_the_skin_beside_it() -> None:
    head = identity_head("mean")
    for cut in ("crew", "roll", "collar"):
        worn = dress(head, Look(hair="none", clothes=cut))
        light = worn.occlusion[: head.vertex_count] / head.occlusion
        under = read_cards(f"clothes/{cut}").covers
        face = head.landmarks
        assert light[under].min() < 0.2
        assert (light[face] == 1).all()
        assert light.max() <= 1


def test_shoulders_grow_with_the_neck() -> None:
    def wide(head: HeadModel) -> float:
        worn = dress(head, Look())
        return float(np.ptp(worn.template[shirt_of(worn), 0]))

    assert wide(identity_head("ben")) > wide(identity_head("ada")) + 0.02


def test_a_shirt_stands_still_while_the_face_moves() -> None:
    worn = dress(identity_head("mean"), Look())
    shirt = shirt_of(worn)
    moves = np.linalg.norm(worn.expression_basis[:, shirt], axis=2)
    assert moves.max() < 0.002
    np.testing.assert_allclose(worn.skin_weights[shirt].sum(1), 1, atol=1e-4)


def test_without_clothes_the_head_is_whole() -> None:
    head = identity_head("mean")
    bare = dress(head, replace(PEOPLE["mean"], clothes="none", hair="none", brows="none"))
    covered = np.union1d(read_cards("clothes/crew").covers, head.regions["bust"])
    assert np.isin(covered, bare.quads).all()
    assert "clothes" not in bare.surfaces
