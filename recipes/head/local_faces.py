"""Local components of the identity space: what the principal ones leave, and left against right.

Principal components of whole heads spend themselves on build and outline: wings of the nose,
philtrum, chin and lips are a few cubic millimetres, and little of them differs from its mirror
image. Here MakeHuman's controls of the face count one side at a time, together with smooth bumps
that no control knows: a Gaussian process over the skin, as in Lüthi et al. 2017, "Gaussian process
morphable models". Of both together, as far as no principal component explains them, the directions
of most variance are taken place by place: some that are their own mirror image, some its opposite.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from elocute.numerics.smoothing import smoothstep
from recipes.head.anatomy import CONTACT_RING
from recipes.head.face import NeutralFace
from recipes.head.identity import IdentityBasis, person_row
from recipes.head.marks import landmarks
from recipes.head.population import FOLDERS, SPREAD
from recipes.head.topology import mirrored

PARTS = (
    # name, landmarks in its middle, reach m, components (symmetric, the opposite)
    ("nose", (30, 35), 0.020, 6, 2),
    ("mouth", (33, 51, 54, 57), 0.016, 4, 2),
    ("chin", (8, 10), 0.026, 3, 1),
    ("orbits", (22, 42, 43, 46), 0.016, 4, 2),
    ("all", (30,), 0.080, 2, 1),
)
"""Places of the face; a landmark stands for its twin on the other side as well."""
WHOLE_HEAD = ("head", "neck", "ears")
"""Folders whose controls change no place of the face."""
LEANS = re.compile(r"asym-(brown|cheek|jaw|mouth|nose)-|(nose|mouth)-trans-(in|out)")
"""Controls that move a middle part to one side, or one side alone."""
LID_LINES = re.compile(r"[lr]-eye-(height|corner|scale|epicanthus)|asym-eye-")
"""Controls that bend the edges of lids, left alone: a blink closes the lids of principal faces."""
LEAN_SPREAD = 0.12
"""Standard deviation of these, of their full range."""
ONE_SIDED = 0.35
"""How far both sides differ, of how far people do."""
WIDTHS_M = ((0.005, 0.0009), (0.008, 0.0006), (0.016, 0.0008))
"""Of the process: how wide its bumps are, and their standard deviation along each axis."""
NOSE_ALONE_M = 0.007
"""Narrower bumps than this are a nose's alone."""
BUMPS = 90
"""Leading directions of each width along each axis; narrower ones are noise."""
MORE = ((30, 0.020, 0.7), (35, 0.016, 0.7), (8, 0.024, 0.4))
"""Where there is more of it: landmark (tip and wing of the nose, chin), over what distance,
how much more."""
WINGS = (
    (2578, (0.9, -0.1, 0.45), 0.0045, 0.0012),
    (3767, (-0.5, -0.1, -0.87), 0.0040, 0.0007),
)
"""Round wings, set off by a crease: vertex, direction, width m, standard deviation m."""
FACE_M, FADE_M = 0.062, 0.025
"""From the tip of the nose: how far bumps are whole, and over what distance they fade."""
LID_M, LID_FADE_M = 0.0015, 0.007
"""From the edge of a lid: how far there are none, since it lies on the eyeball; and fading."""
JOINT_MIRROR = (0, 1, 2, 4, 3)
"""Neck, head and jaw lie in the middle; the eyes are each other's."""
MOUTH_FADE_M = 0.015
"""Behind the line where lips meet: over what distance bumps fade."""


def with_local_components(face: NeutralFace, identity: IdentityBasis) -> IdentityBasis:
    """The same identity space with local components after the principal ones; tone, sex and age
    follow the principal ones alone."""
    principal = np.concatenate([identity.vertices, identity.joints], 1)
    rows = np.concatenate([control_rows(face), bump_rows(face)])
    known, rigid = principal.reshape(len(principal), -1), rigid_rows(face)
    of_kind = {
        sign: _unexplained(_without(_of_symmetry(face, rows, sign) * size, rigid), known)
        for sign, size in ((1, 1.0), (-1, ONE_SIDED))
    }
    local = []
    for _, marks, reach_m, *counts in PARTS:
        share = near(face, marks, reach_m)
        for sign, count in zip(of_kind, counts, strict=True):
            found, of_kind[sign] = _leading(face, of_kind[sign], share, count)
            local.append(found)
    local = np.concatenate(local).reshape(-1, *principal.shape[1:])
    whole = np.concatenate([principal, local])
    return replace(
        identity, vertices=whole[:, : face.assembly.count], joints=whole[:, face.assembly.count :]
    )


def control_rows(face: NeutralFace) -> np.ndarray:
    """(control, row, 3) m: what a standard deviation of each control of the face moves."""
    rows, plain = [], person_row(face, face.body)
    for folder in (*FOLDERS, "asym"):
        for name in face.mh.target_names(folder) if folder not in WHOLE_HEAD else ():
            leans = bool(LEANS.match(name))
            if LID_LINES.match(name) or (folder == "asym" and not leans):
                continue
            spread = LEAN_SPREAD / ONE_SIDED if leans else SPREAD[folder]
            # Of a control's two ends a person has one.
            moved = spread / np.sqrt(2) * face.mh.target(f"{folder}/{name}")
            rows.append(person_row(face, face.body + moved) - plain)
    return np.stack(rows).reshape(len(rows), -1, 3)


def bump_rows(face: NeutralFace) -> np.ndarray:
    """(bump, row, 3) m: the leading directions of the process, on skin that stays finished."""
    plain, rows = person_row(face, face.body), []
    for width_m, size_m in WIDTHS_M:
        share = _bumpy(face, width_m < NOSE_ALONE_M)
        places = np.flatnonzero(share)
        skin = face.skin[places]
        apart = np.linalg.norm(skin[:, None] - skin[None], axis=2)
        values, vectors = np.linalg.eigh(np.exp(-0.5 * np.square(apart / width_m)))
        for value, vector in zip(values[-BUMPS:], vectors.T[-BUMPS:], strict=True):
            bump = np.zeros(len(face.skin))
            bump[places] = size_m * np.sqrt(value) * vector
            for axis in np.eye(3):
                moved = (share * bump)[:, None] * axis
                rows.append(person_row(face, face.body, moved) - plain)
    rows += [person_row(face, face.body, moved) - plain for moved in _wings(face)]
    return np.stack(rows).reshape(len(rows), -1, 3)


def _wings(face: NeutralFace) -> list[np.ndarray]:
    """(skin vertex, 3) m of the left wing of the nose, and of the right one."""
    moved = np.zeros_like(face.skin)
    for vertex, direction, width_m, size_m in WINGS:
        apart = np.linalg.norm(face.skin - face.skin[vertex], axis=1)
        moved += size_m * np.exp(-0.5 * np.square(apart / width_m))[:, None] * direction
    return [moved, mirrored(moved, face.anatomy.skin_mirror)]


def _bumpy(face: NeutralFace, nose_alone: bool) -> np.ndarray:
    """(skin vertex,) how much of the process there is, about one on the face, none elsewhere."""
    skin, anatomy = face.skin, face.anatomy
    tip = skin[skin[:, 2].argmax()]
    share = 1 - _fading(np.linalg.norm(skin - tip, axis=1), FACE_M, FADE_M)
    loops = np.concatenate([anatomy.lid_front, anatomy.lid_middle, anatomy.lid_back])
    share *= _fading(
        _distance(skin, skin[np.r_[loops, anatomy.skin_mirror[loops]]]), LID_M, LID_FADE_M
    )
    inside = anatomy.inner_mouth
    contact = skin[face.lips.rings[CONTACT_RING]]
    share[inside] *= 1 - _fading(_distance(skin[inside], contact), 0, MOUTH_FADE_M)
    more = np.zeros((len(MORE), len(skin)))
    for row, (landmark, over_m, much) in zip(more, MORE, strict=True):
        row += much * (1 - _fading(_distance(skin, _both(face, (landmark,))), 0, over_m))
    return share * (more[:2].sum(axis=0) if nose_alone else 1 + more.sum(axis=0))


def _fading(distance: np.ndarray, start_m: float, over_m: float) -> np.ndarray:
    return smoothstep(np.clip((distance - start_m) / over_m, 0, 1))


def _distance(points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(point,) m to the nearest of some places."""
    from scipy.spatial import KDTree

    return np.asarray(KDTree(places).query(points)[0])


def _of_symmetry(face: NeutralFace, rows: np.ndarray, sign: int) -> np.ndarray:
    """(row, number): the part that is its own mirror image (1), or the opposite of it (-1)."""
    count = face.assembly.count
    mirror = np.r_[face.assembly.mirror, count + np.array(JOINT_MIRROR)]
    return ((rows + sign * mirrored(rows, mirror)) / 2).reshape(len(rows), -1)


def rigid_rows(face: NeutralFace) -> np.ndarray:
    """(6, number): along these the face as a whole shifts and turns, which is no shape."""
    share = _face_share(face)
    middle = share @ face.skin / share.sum()
    axes = np.eye(3)
    ways = [np.broadcast_to(axis, face.skin.shape) for axis in axes]
    ways += [np.cross(axis, face.skin - middle) for axis in axes]
    rows = np.zeros((6, face.assembly.count + len(JOINT_MIRROR), 3))
    rows[:, face.skin_slice] = share[:, None] * np.stack(ways)
    return rows.reshape(6, -1)


def _without(rows: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Random faces, rows one standard deviation each, given that nothing of them lies along known
    rows: mixtures that stay as local as the rows are."""
    along = rows @ known.T
    basis, sizes, _ = np.linalg.svd(along, full_matrices=False)
    basis = basis[:, sizes > 1e-6 * sizes[0]]
    return rows - basis @ (basis.T @ rows)


def _unexplained(rows: np.ndarray, known: np.ndarray) -> np.ndarray:
    """The same rows less the mixtures of known rows that come nearest to them."""
    share = np.linalg.solve(known @ known.T, known @ rows.T)
    return rows - share.T @ known


def _leading(
    face: NeutralFace, rows: np.ndarray, share: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """(count, number) directions of most variance of a part of the skin, one standard deviation
    each, and the rows given that nothing lies along these."""
    weights = np.zeros(rows.shape[1] // 3)
    weights[face.skin_slice] = share
    weighed = rows * np.sqrt(np.repeat(weights, 3))
    values, vectors = np.linalg.eigh(weighed @ weighed.T)
    leading = vectors[:, np.argsort(values)[::-1][:count]].T
    found = leading @ rows
    # The greatest displacement points up, out or to the left, whatever the solver's sign.
    greatest = found[np.arange(count), np.abs(found).argmax(axis=1)]
    return found * np.sign(greatest)[:, None], rows - leading.T @ found


def near(face: NeutralFace, marks: tuple[int, ...], reach_m: float) -> np.ndarray:
    """(skin vertex,) 0 to 1: what of the face lies near some landmarks or their twins."""
    away = _distance(face.skin, _both(face, marks))
    return _face_share(face) * (1 - _fading(away, reach_m / 2, reach_m / 2))


def _both(face: NeutralFace, marks: tuple[int, ...]) -> np.ndarray:
    """(place, 3) m of landmarks and of their twins on the other side."""
    vertices = landmarks(face)[list(marks)]
    return face.skin[np.r_[vertices, face.anatomy.skin_mirror[vertices]]]


def _face_share(face: NeutralFace) -> np.ndarray:
    """(skin vertex,) 0 to 1: what of the skin is face, and seen."""
    skin = face.skin
    away = np.linalg.norm(skin - skin[skin[:, 2].argmax()], axis=1)
    share = 1 - _fading(away, FACE_M, FADE_M)
    share[face.anatomy.inner_mouth] = 0
    return share
