"""Every style of hair on many faces: the face is free, the scalp closed, hair lies outside."""

from __future__ import annotations

import io

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import KDTree

from elocute.head import HeadModel, load_builtin_head, resolve_identity
from elocute.head.looks import Look, dress
from elocute.head.looks.look import HAIR
from elocute.head.normals import vertex_normals

STYLES = [style for style in HAIR if style != "none"]
LONG = ("long", "waves")
FACES = [
    "101",
    *(pytest.param(who, marks=pytest.mark.slow) for who in ("mean", "otto", "hana", "7", "23")),
]
"""One in `make test`, the others where everything is tested."""
EYES_MOUTH_MM = (44.0, -66.0, 20.0)
"""Half the width of what must be free, and its heights from the eyes."""
Dressed = tuple[HeadModel, HeadModel, NDArray[np.float32]]


def dressed(style: str, who: str) -> Dressed:
    """The bare head, the dressed one, and the places of its hair (vertex, 3) m."""
    bare = load_builtin_head().with_identity(resolve_identity(who))
    worn = dress(bare, Look(hair=style))
    index = np.unique(worn.quads[worn.material == worn.material_names.index("hair")])
    return bare, worn, worn.template[index]


@pytest.fixture(scope="module", params=FACES)
def who(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module", params=STYLES)
def haired(request: pytest.FixtureRequest, who: str) -> Dressed:
    """Each style on each face, made once for all that is asked of it."""
    return dressed(request.param, who)


def test_hair_leaves_eyes_and_mouth_free(haired: Dressed) -> None:
    bare, _, hair = haired
    eyes = bare.joint_positions[bare.joint_names.index("eyeLeft")]
    wide, low, high = EYES_MOUTH_MM
    x, y = 1000 * np.abs(hair[:, 0]), 1000 * (hair[:, 1] - eyes[1])
    before = hair[:, 2] > eyes[2] - 0.01
    assert not (before & (x < wide) & (y > low) & (y < high)).any()


def test_hair_lies_outside_of_the_head(haired: Dressed) -> None:
    """Roots are sunk; all else is over the skin."""
    bare, _, hair = haired
    skin = bare.regions["skin"]
    normals = vertex_normals(bare.template, bare.triangles)[skin]
    away, nearest = KDTree(bare.template[skin]).query(hair)
    above = ((hair - bare.template[skin][nearest]) * normals[nearest]).sum(1)
    near = away < 0.03
    assert (above[near] < -0.006).mean() < 0.01


@pytest.mark.parametrize("style", STYLES)
def test_the_scalp_is_closed(style: str) -> None:
    """Near every place of the crown and the back of the head there is hair."""
    bare, worn, _ = dressed(style, "mean")
    eyes = bare.joint_positions[bare.joint_names.index("eyeLeft"), 1]
    scalp = bare.template[bare.regions["skin"]]
    crown = scalp[(scalp[:, 1] - eyes > 0.075) | ((scalp[:, 2] < -0.10) & (scalp[:, 1] > eyes))]
    quads = worn.quads[worn.material == worn.material_names.index("hair")]
    corners = worn.template[quads]
    away, _ = KDTree(np.vstack([corners.mean(1), corners.reshape(-1, 3)])).query(crown)
    assert away.max() < (0.045 if style == "afro" else 0.020)


@pytest.mark.parametrize("style", LONG)
@pytest.mark.parametrize("clothes", ["crew", "roll", "collar"])
def test_long_hair_lies_on_the_shirt(style: str, clothes: str, who: str) -> None:
    """Of whoever: what lies under a collar's edge is all that is in the cloth."""
    bare = load_builtin_head().with_identity(resolve_identity(who))
    worn = dress(bare, Look(hair=style, clothes=clothes))
    of = {
        name: np.unique(worn.quads[worn.material == worn.material_names.index(name)])
        for name in ("hair", "clothes")
    }
    normals = vertex_normals(worn.template, worn.triangles)[of["clothes"]]
    cloth = worn.template[of["clothes"]]
    away, nearest = KDTree(cloth).query(worn.template[of["hair"]])
    above = ((worn.template[of["hair"]] - cloth[nearest]) * normals[nearest]).sum(1)
    assert (above[away < 0.02] < -0.002).mean() < 0.03


def test_hair_stays_with_the_scalp_while_the_face_moves() -> None:
    _, worn, _ = dressed("long", "mean")
    hair = np.unique(worn.quads[worn.material == worn.material_names.index("hair")])
    for shape in ("jawOpen", "mouthSmileLeft", "browDownLeft"):
        weights = worn.expression_vector({shape: 1.0})
        moved = np.linalg.norm(np.tensordot(weights, worn.expression_basis[:, hair], 1), axis=1)
        assert np.quantile(moved, 0.95) < 0.003, shape


def bends(head: HeadModel) -> NDArray[np.float64]:
    """Degrees by which locks beside the face turn from one pair of vertices to the next."""
    quads = head.quads[head.material == head.material_names.index("hair")]
    after = np.full(len(head.template), -1)
    after[quads[:, 0]], after[quads[:, 1]] = quads[:, 3], quads[:, 2]
    first = np.flatnonzero(after >= 0)
    first = first[after[after[first]] >= 0]
    second, third = after[first], after[after[first]]
    eye = head.joint_positions[head.joint_names.index("eyeLeft")]
    beside = (head.template[second, 1] < eye[1]) & (head.template[second, 2] > eye[2] - 0.06)
    ways = np.diff(head.template[np.stack([first, second, third], 1)[beside]], axis=1)
    ways /= np.linalg.norm(ways, axis=2, keepdims=True)
    return np.degrees(np.arccos(np.clip((ways[:, 0] * ways[:, 1]).sum(1), -1, 1)))


def test_straight_hair_is_not_bent_like_wire_and_waves_wave(who: str) -> None:
    for style in ("long", "bob"):
        _, worn, _ = dressed(style, who)
        assert np.median(bends(worn)) < 5, style
    assert np.median(bends(dressed("waves", who)[1])) > 14


@pytest.mark.parametrize("style", ["curls", "coils", "buzz"])
def test_what_closes_the_scalp_under_short_curls_fades_out_at_the_hairline(style: str) -> None:
    """Its mesh ends in steps, which nobody sees."""
    _, worn, _ = dressed(style, "mean")
    color = worn.surfaces["hair"].color
    assert color is not None
    alpha = np.asarray(Image.open(io.BytesIO(color)).convert("RGBA"))[..., 3]
    uv_quads = worn.uv_quads[worn.material == worn.material_names.index("hair")]
    shell = uv_quads[(worn.uv[uv_quads][..., 0] < 0.5).all(1)]  # locks are in the right half
    sides = np.sort(np.concatenate([shell[:, [k, (k + 1) % 4]] for k in range(4)]), axis=1)
    pairs, count = np.unique(sides, axis=0, return_counts=True)
    u, v = worn.uv[np.unique(pairs[count == 1])].T
    rows, columns = (1 - v) * alpha.shape[0], u * alpha.shape[1]
    edge = alpha[rows.astype(int), columns.astype(int)]
    assert len(edge) > 100 and np.quantile(edge, 0.95) < 40


@pytest.mark.parametrize("style", ["bob", *LONG])
def test_blown_cheeks_push_hair_aside(style: str, who: str) -> None:
    bare, worn, _ = dressed(style, who)
    skin = bare.regions["skin"]
    hair = np.unique(worn.quads[worn.material == worn.material_names.index("hair")])
    moved = worn.template + worn.expression_basis[worn.expression_index("cheekPuff")]
    above = []
    for points in (worn.template, moved):
        normals = vertex_normals(points[: bare.vertex_count], bare.triangles)[skin]
        away, nearest = KDTree(points[skin]).query(points[hair])
        beside = ((points[hair] - points[skin][nearest]) * normals[nearest]).sum(1)
        above.append(np.where(away < 0.02, beside, 0))
    assert ((above[0] > 0.001) & (above[1] < -0.0015)).mean() < 0.001
