"""A model laid out as FLAME's files are, on a mesh that is not the built-in head's.

FLAME may not be passed on, so the tests make their own: the built-in head on the dual of its mesh
(a vertex for each face), cut at the neck, its mouth open behind the lips as FLAME's is, with balls
for eyes, FLAME's counts (5023 vertices, 300 + 100 components, five joints), and vertices numbered
so that the published landmarks of FLAME lie where they should. The shapes that it would have if
it were the built-in head are known vertex by vertex, so what is carried over can be judged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.flame_places import FLAME_LANDMARKS
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel

FACE_VERTICES, EYE_RINGS, EYE_COLUMNS = 3931, 17, 32
INNERMOST_RING = 8  # of the lips: behind it the mouth is open
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class FlameLayout:
    """The file's entries, and the truth about its face.

    Attributes
    ----------
    entries
        As `load_flame` reads them.
    corners
        (face vertex, 4) vertices of the built-in head of which each vertex is the mean.
    person
        The built-in head with the face that the file's template has.
    eyes
        (2, vertex) numbers of the eyeballs' vertices, left first.
    """

    entries: dict[str, Any]
    corners: Ints
    person: HeadModel
    eyes: Ints

    def truth(self, name: str) -> Floats:
        """(face vertex, 3) m: a shape of the built-in head on this mesh."""
        basis = self.person.expression_basis[self.person.expression_index(name)]
        return basis[self.corners].mean(axis=1)


def flame_layout(identity: NDArray[np.floating] | None = None, seed: int = 0) -> FlameLayout:
    """A model whose template is a face of the built-in head (the mean face by default)."""
    head = load_builtin_head()
    person = head.with_identity(
        np.zeros(50, np.float32) if identity is None else identity.astype(np.float32)
    )
    corners, triangles = _dual_face(head)
    order = _numbering(head, corners, seed)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    corners, triangles = corners[order], place[triangles]
    spheres, sphere_triangles = zip(
        *(_eyeball(person, side) for side in ("left", "right")), strict=True
    )
    count = len(spheres[0])
    eyes = FACE_VERTICES + np.arange(2 * count).reshape(2, count)
    template = np.concatenate([_on_face(person.template, corners), *spheres])
    triangles = np.concatenate([triangles, *(eyes[i][sphere_triangles[i]] for i in range(2))])
    entries = _entries(head, person, template, triangles, corners, eyes, seed)
    return FlameLayout(entries, corners, person, eyes)


def _on_face(values: NDArray[np.floating], corners: Ints) -> Floats:
    return values[corners].mean(axis=1).astype(np.float64)


def _entries(
    head: HeadModel,
    person: HeadModel,
    template: Floats,
    triangles: Ints,
    corners: Ints,
    eyes: Ints,
    seed: int,
) -> dict[str, Any]:
    from scipy.sparse import csc_matrix

    vertices = len(template)
    weights = _skin_weights(head, corners, eyes, vertices)
    joints = person.joint_positions[[0, 1, 2, 3, 4]].astype(np.float64)
    # FLAME's own: pose correctives and what expressions do near the jaw joint, small and smooth.
    rng = np.random.default_rng(seed)
    posedirs = np.zeros((vertices, 3, 36))
    jaw = weights[:, 2] * (1 - weights[:, 2]) * 4
    posedirs[:, :, 9:18] = 2e-3 * jaw[:, None, None] * rng.normal(size=(1, 3, 9))
    return {
        "v_template": template,
        "shapedirs": _components(head, template, corners, eyes, rng),
        "posedirs": posedirs,
        "J_regressor": csc_matrix(_regressor(template, joints)),
        "weights": weights,
        "kintree_table": np.array([[2**32 - 1, 0, 1, 1, 1], [0, 1, 2, 3, 4]], np.uint32),
        "f": triangles.astype(np.uint32),
        "bs_style": "lbs",
        "bs_type": "lrotmin",
    }


def _dual_face(head: HeadModel) -> tuple[Ints, Ints]:
    """(vertex, 4) corners of the faces that are vertices now, and (triangle, 3)."""
    inside = np.setdiff1d(head.regions["inner_mouth"], head.lip_rings[: INNERMOST_RING + 1])
    names = [head.material_names.index(name) for name in ("skin", "lips", "mouth")]
    kept = np.isin(head.material, names) & ~np.isin(head.quads, inside).any(axis=1)
    quads = head.quads[kept].astype(np.int64)
    height = head.template[quads, 1].mean(axis=1)
    depth = head.template[quads, 2].mean(axis=1)
    # What goes first lies low and far back: the cut slants from under the chin to the nape.
    rank = np.argsort(-(height + 1.2 * depth))
    low, high = 0, len(quads)
    while high - low > 1:
        middle = (low + high) // 2
        corners, _ = _dual(quads[np.sort(rank[:middle])])
        low, high = (middle, high) if len(corners) <= FACE_VERTICES else (low, middle)
    corners, triangles = _dual(quads[np.sort(rank[:low])])
    return _padded(head, corners, triangles)


def _dual(quads: Ints) -> tuple[Ints, Ints]:
    around: dict[int, dict[int, tuple[int, int]]] = {}
    for number, quad in enumerate(quads):
        ring = list(dict.fromkeys(quad.tolist()))
        for i, vertex in enumerate(ring):
            following = ring[(i + 1) % len(ring)]
            around.setdefault(vertex, {})[following] = (number, ring[i - 1])
    triangles = []
    for fan in around.values():
        start = next(iter(fan))
        polygon, at = [], start
        while at in fan and len(polygon) <= len(fan):
            number, at = fan[at]
            polygon.append(number)
            if at == start:
                triangles += [
                    (polygon[0], polygon[i], polygon[i + 1]) for i in range(1, len(polygon) - 1)
                ]
                break
    used, flat = np.unique(np.array(triangles), return_inverse=True)
    return quads[used], flat.reshape(-1, 3)


def _padded(head: HeadModel, corners: Ints, triangles: Ints) -> tuple[Ints, Ints]:
    """Triangles of the scalp divided until there are as many vertices as in FLAME."""
    missing = FACE_VERTICES - len(corners)
    back = np.argsort(head.template[corners[triangles[:, 0]], 2].mean(axis=1))[:missing]
    extra = [corners[triangles[t]].reshape(-1)[[0, 5, 10, 2]] for t in back]
    new = len(corners) + np.arange(missing)
    a, b, c = triangles[back].T
    split = [np.stack(rows, axis=1) for rows in ((a, b, new), (b, c, new), (c, a, new))]
    triangles = np.concatenate([np.delete(triangles, back, axis=0), *split])
    return np.concatenate([corners, np.array(extra, np.int64).reshape(missing, 4)]), triangles


def _numbering(head: HeadModel, corners: Ints, seed: int) -> Ints:
    """(vertex,) which vertex gets each number: shuffled, but with FLAME's landmarks in place."""
    points = _on_face(head.template, corners)
    numbers: dict[int, int] = {}
    for landmark, number in enumerate(FLAME_LANDMARKS):
        wanted = _landmark_place(head, landmark)
        far = np.linalg.norm(points - wanted, axis=1)
        if landmark >= 48:
            # The two lips nearly touch: a landmark belongs to the one that it is on.
            far[~np.isin(corners, head.landmarks[landmark]).any(axis=1)] += 1
        far[list(numbers.values())] = np.inf
        numbers[number] = int(far.argmin())
    rest = np.setdiff1d(np.arange(len(corners)), list(numbers.values()))
    free = np.setdiff1d(np.arange(len(corners)), list(numbers))
    order = np.empty(len(corners), np.int64)
    order[list(numbers)] = list(numbers.values())
    order[free] = np.random.default_rng(seed).permutation(rest)
    return order


def _landmark_place(head: HeadModel, landmark: int) -> Floats:
    """(3,) m: the built-in head's, but eyes by the edges of the lids, where FLAME has them."""
    for first, side in ((36, "right"), (42, "left")):
        if first <= landmark < first + 6:
            upper, lower = (
                head.template[head.regions[f"lid_{lid}_{side}"]] for lid in ("upper", "lower")
            )
            outwards = np.abs(upper[:, 0])
            inner, outer = outwards.min(), outwards.max()
            shares = {
                "right": (1, 0.67, 0.33, 0, 0.33, 0.67),
                "left": (0, 0.33, 0.67, 1, 0.67, 0.33),
            }
            part = landmark - first
            share, lid = shares[side][part], lower if part > 3 else upper
            x = inner + share * (outer - inner)
            if share in (0, 1):
                ends = [edge[np.abs(np.abs(edge[:, 0]) - x).argmin()] for edge in (upper, lower)]
                return np.mean(ends, axis=0)
            return lid[np.abs(np.abs(lid[:, 0]) - x).argmin()].astype(np.float64)
    return head.template[head.landmarks[landmark]].astype(np.float64)


def _eyeball(person: HeadModel, side: str) -> tuple[Floats, Ints]:
    """A ball of 546 vertices where the built-in eye is."""
    ball = person.template[person.regions[f"eye_{side}"]].astype(np.float64)
    middle = person.joint_positions[person.joint_names.index(f"eye{side.capitalize()}")]
    radius = np.median(np.linalg.norm(ball - middle, axis=1))
    polar = np.pi * np.arange(1, EYE_RINGS + 1) / (EYE_RINGS + 1)
    around = 2 * np.pi * np.arange(EYE_COLUMNS) / EYE_COLUMNS
    ring = np.stack(
        [
            np.outer(np.sin(polar), np.cos(around)),
            np.outer(np.sin(polar), np.sin(around)),
            np.repeat(np.cos(polar)[:, None], EYE_COLUMNS, axis=1),
        ],
        axis=2,
    ).reshape(-1, 3)
    points = middle + radius * np.concatenate([[[0, 0, 1]], ring, [[0, 0, -1]]])
    triangles = []
    for column in range(EYE_COLUMNS):
        after = (column + 1) % EYE_COLUMNS
        triangles.append((0, 1 + column, 1 + after))
        last = 1 + (EYE_RINGS - 1) * EYE_COLUMNS
        triangles.append((len(points) - 1, last + after, last + column))
        for row in range(EYE_RINGS - 1):
            a, b = 1 + row * EYE_COLUMNS + column, 1 + row * EYE_COLUMNS + after
            triangles += [(a, a + EYE_COLUMNS, b + EYE_COLUMNS), (a, b + EYE_COLUMNS, b)]
    return points, np.array(triangles)


def _skin_weights(head: HeadModel, corners: Ints, eyes: Ints, vertices: int) -> Floats:
    """FLAME's five joints have the built-in five's places: what nods the head is its neck."""
    weights = np.zeros((vertices, 5))
    weights[: len(corners)] = _on_face(head.skin_weights, corners)
    for side in range(2):
        weights[eyes[side], 3 + side] = 1
    return weights / weights.sum(axis=1, keepdims=True)


def _regressor(template: Floats, joints: Floats) -> Floats:
    """(joint, vertex): the least squared mix of the vertices around that gives each joint."""
    result = np.zeros((len(joints), len(template)))
    for row, joint in zip(result, joints, strict=True):
        near = np.argsort(np.linalg.norm(template - joint, axis=1))[:200]
        system = np.concatenate([template[near].T, np.ones((1, len(near)))])
        row[near] = np.linalg.lstsq(system, np.append(joint, 1.0), rcond=None)[0]
    return result


def _components(
    head: HeadModel, template: Floats, corners: Ints, eyes: Ints, rng: np.random.Generator
) -> Floats:
    """(vertex, 3, 400): faces of the built-in head, nothing up to 300, then expressions."""
    identity = np.zeros((300, len(template), 3))
    own = len(head.identity_basis)
    identity[:own, : len(corners)] = head.identity_basis[:, corners].mean(axis=2)
    for side, joint in enumerate((3, 4)):
        identity[:own, eyes[side]] = head.joint_identity_basis[:, None, joint]
    shapes = np.zeros((len(head.expression_names), len(template), 3))
    shapes[:, : len(corners)] = head.expression_basis[:, corners].mean(axis=2)
    # Half of them mixes of its shapes, half waves through space, so that no two are alike.
    mixes = rng.normal(0, 0.25, (50, len(shapes)))
    waves = rng.normal(0, 30, (50, 3)), rng.uniform(0, 6, 50), rng.normal(0, 5e-4, (50, 1, 3))
    phases = np.sin(waves[0] @ template.T + waves[1][:, None])
    expression = np.concatenate([np.tensordot(mixes, shapes, 1), phases[:, :, None] * waves[2]])
    return np.moveaxis(np.concatenate([identity, expression]), 0, 2)
