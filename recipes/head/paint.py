"""Colours (sRGB), materials and texture coordinates."""

from __future__ import annotations

import numpy as np

from elocute.head.looks.eyes import EDGE_RAD, IRIS_RAD
from recipes.head import atlas
from recipes.head.assembly import PARTS
from recipes.head.eyeball import PUPIL_RAD
from recipes.head.face import NeutralFace

MATERIALS = ("skin", "lips", "mouth", "teeth", "gums", "tongue", "eyeball", "hair")
SKIN = (0.735, 0.545, 0.455)
LIP = (0.645, 0.37, 0.345)
INNER = (0.55, 0.29, 0.26)
FLUSH = (0.73, 0.43, 0.36)
BROW, LASH = (0.30, 0.215, 0.165), (0.11, 0.08, 0.07)
SCLERA, IRIS, IRIS_RIM, PUPIL = (
    (0.92, 0.91, 0.89),
    (0.40, 0.29, 0.18),
    (0.20, 0.14, 0.09),
    (0.02,) * 3,
)
TOOTH, TOOTH_ROOT = (0.815, 0.775, 0.70), (0.71, 0.615, 0.505)
BITING, BITING_FROM = (0.71, 0.695, 0.66), 0.80
"""The edge of an incisor lets light through, from this share of its height."""
GAP, GAP_SHARE = (0.42, 0.26, 0.19), 0.70
IVORY = {"upper": np.ones(3), "lower": np.array([1.0, 0.985, 0.955])}
"""What lower teeth, in shade and lit by the sky alone, need beside it so as not to look grey."""
DEEP_TOOTH, DEEP_SHARE, DEEP_M = (0.60, 0.41, 0.34), 0.85, 0.026
GUM, TONGUE, TONGUE_ROOT = (0.90, 0.61, 0.58), (0.74, 0.43, 0.42), (0.46, 0.20, 0.20)
TONGUE_COAT = (0.78, 0.58, 0.55)
TONGUE_TIP_M, TONGUE_DEEP_M = 0.020, 0.056
"""Behind its tip, where a tongue begins to darken and where it has the colour of its root."""


def mix(colours: np.ndarray, other, share: np.ndarray) -> np.ndarray:
    share = np.clip(share, 0, 1)[:, None]
    return colours * (1 - share) + np.asarray(other) * share


def vertex_colours(face: NeutralFace) -> np.ndarray:
    """(vertex, 3) sRGB 0..1."""
    colours = np.zeros((face.assembly.count, 3))
    slices = face.assembly.slices
    colours[slices["skin"]] = _skin(face)
    angle = face.assembly.eye_angle
    for side in ("left", "right"):
        colours[slices[f"eye_{side}"]] = _eye(angle)
    colours[slices["tongue"]] = _tongue(face.vertices[slices["tongue"]])
    for jaw in ("upper", "lower"):
        part = face.assembly.jaws[f"teeth_{jaw}"]
        tooth = mix(np.tile(TOOTH_ROOT, (len(part.shade), 1)), TOOTH, part.shade * 1.35)
        tooth = mix(tooth, BITING, (part.shade - BITING_FROM) / (1 - BITING_FROM))
        tooth = mix(tooth, GAP, GAP_SHARE * part.gap) * part.tone * IVORY[jaw]
        z = face.vertices[slices[f"teeth_{jaw}"], 2]
        # A red mouth colours its back teeth.
        back = DEEP_SHARE * np.clip((z.max() - z - 0.004) / DEEP_M, 0, 1)
        colours[slices[f"teeth_{jaw}"]] = mix(tooth, DEEP_TOOTH, back)
        colours[slices[f"gums_{jaw}"]] = GUM
    colours[slices["bust"]] = SKIN
    brows = face.assembly.attached["brows"].shade
    colours[slices["brows"]] = mix(np.tile(SKIN, (len(brows), 1)), BROW, 0.25 + 0.65 * brows)
    colours[slices["lashes"]] = LASH
    scalp = face.assembly.attached["scalp"].mixture
    colours[slices["scalp"]] = np.clip(scalp @ colours[slices["skin"]], 0, 1)
    return colours


def _tongue(points: np.ndarray) -> np.ndarray:
    """Red at its edge, with a pale coat on its back, darker towards the throat and along the
    groove of its middle."""
    behind = points[:, 2].max() - points[:, 2]
    deep = (behind - TONGUE_TIP_M) / (TONGUE_DEEP_M - TONGUE_TIP_M)
    groove = 0.25 * np.exp(-((points[:, 0] / 0.002) ** 2)) * np.clip(behind / 0.008, 0, 1)
    coat = np.exp(-(((np.abs(points[:, 0]) - 0.006) / 0.0045) ** 2)) * np.clip(behind / 0.012, 0, 1)
    grain = 0.75 + 0.25 * np.cos(900 * np.abs(points[:, 0])) * np.cos(700 * points[:, 2])
    colours = mix(np.tile(TONGUE, (len(points), 1)), TONGUE_COAT, 0.75 * coat * grain)
    return mix(colours, TONGUE_ROOT, np.maximum(deep, groove))


def _eye(angle: np.ndarray) -> np.ndarray:
    colours = np.tile(SCLERA, (len(angle), 1))
    colours = mix(colours, (0.80, 0.52, 0.48), (angle - 0.75) / 0.8)
    colours[angle < IRIS_RAD + 0.001] = IRIS_RIM
    colours[angle < 0.401] = IRIS
    colours[angle < 0.25] = np.array(IRIS) * 1.12
    colours[angle < PUPIL_RAD] = PUPIL
    return colours


def _skin(face: NeutralFace) -> np.ndarray:
    skin = face.skin
    colours = np.tile(SKIN, (len(skin), 1))
    eye = face.assembly.eye_centre
    side = np.abs(skin[:, 0])

    def spot(x_mm: float, y_mm: float, radius_mm: float) -> np.ndarray:
        """Soft spot on the front, seen from the eye: x from the middle, y from eye height."""
        away = np.stack([side * 1000 - x_mm, (skin[:, 1] - eye[1]) * 1000 - y_mm], 1)
        near = np.exp(-((np.linalg.norm(away, axis=1) / radius_mm) ** 2))
        return near * (skin[:, 2] > eye[2] - 0.03)

    colours = mix(colours, FLUSH, 0.30 * spot(35, -36, 19))
    colours = mix(colours, FLUSH, 0.32 * spot(0, -44, 11))
    colours = mix(colours, FLUSH, 0.20 * spot(0, -108, 14))
    colours = mix(
        colours, FLUSH, 0.40 * np.clip((side - 0.068) / 0.012, 0, 1) * (skin[:, 1] > eye[1] - 0.05)
    )
    colours = mix(colours, (0.60, 0.41, 0.37), 0.30 * spot(31, -2, 15))
    colours = mix(colours, (0.54, 0.40, 0.34), 0.35 * spot(31, 20, 9))
    lid = np.zeros(len(skin))
    for loop in (face.anatomy.lid_middle, face.anatomy.lid_back):
        upper = loop[skin[loop, 1] > eye[1] - 0.001]
        inner_corner = skin[loop, 0].min()
        share = 0.8 * np.clip((skin[upper, 0] - inner_corner - 0.002) / 0.008, 0, 1)
        lid[upper] = share
        lid[face.anatomy.skin_mirror[upper]] = share
    colours = mix(colours, LASH, lid)
    rings = face.lips.rings
    for ring, share in zip(range(8), (0.55, 1, 1, 1, 1, 1, 1, 1), strict=True):
        where = np.zeros(len(skin))
        where[rings[ring]] = share
        colours = mix(colours, LIP, where)
    inner = np.zeros(len(skin))
    inner[face.anatomy.inner_mouth] = 1
    inner[rings[7]] = 0.2
    inner[rings[8]] = 0.3
    inner[rings[9]] = 0.55
    return mix(colours, INNER, inner)


def face_materials(face: NeutralFace) -> np.ndarray:
    """(face,) index into MATERIALS."""
    by_part = np.array([0, 6, 6, 5, 3, 3, 4, 4, 0, 7, 7, 0], np.uint8)
    material = by_part[face.assembly.part_of_face]
    quads = face.assembly.quads
    lips = np.isin(quads, face.lips.rings[:8]).all(1)
    inner = np.isin(quads, [*face.anatomy.inner_mouth, *face.lips.rings[7]]).all(1)
    material[lips] = 1
    material[inner] = 2
    return material


def texture(face: NeutralFace) -> tuple[np.ndarray, np.ndarray]:
    """uv (texcoord, 2) and uv_quads (face, 4). Each material has a square of its own: the skin
    with the lips its atlas, eyeballs circles round their axis, teeth and gums their arches
    unrolled, the upper above the lower; other parts lie flat. The bust's lid takes the places of
    the rim beside it."""
    base, anatomy, assembly = face.mh.base, face.anatomy, face.assembly
    fine = assembly.refined
    coarse_uv = base.uv[base.uv_quads[anatomy.skin_faces_of_base]]
    corners = np.einsum("fcs,fsk->fck", fine.corner, coarse_uv[fine.source])
    uv, skin_quads = np.unique(corners.reshape(-1, 2).round(7), axis=0, return_inverse=True)
    skin_quads = skin_quads.reshape(-1, 4)
    uv = atlas.atlas_uv(uv)
    uvs, quads, count = [uv], [skin_quads], len(uv)
    skin_faces = assembly.quads[assembly.part_of_face == 0]
    for place, name in enumerate(PARTS[1:-1]):  # the scalp has no faces of its own
        where = assembly.slices[name]
        mine = assembly.quads[assembly.part_of_face == place + 1]
        points = face.vertices[where]
        if name == "bust":
            uvs.append(_beside_the_rim(face, points, uv, skin_quads, skin_faces))
        elif name.startswith("eye"):
            uvs.append(_round_the_axis(assembly.eye_angle, points))
        elif name.startswith(("teeth", "gums")):
            uvs.append(_unrolled(points, name.endswith("upper")))
        else:
            flat = points[:, [0, 1] if name in ("brows", "lashes") else [0, 2]]
            uvs.append((flat - flat.min(0)) / np.ptp(flat, axis=0).max() * 0.98 + 0.01)
        # The bust's first ring is the skin's rim: its texture starts at the bust's own ring.
        quads.append(np.maximum(mine - where.start, 0) + count)
        count += where.stop - where.start
    return np.clip(np.vstack(uvs), 0, 1), np.vstack(quads)


def _round_the_axis(angle: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Circles of equal angle round the middle, the same for both eyes as seen from the front."""
    side = points[:, :2] - (points[0, :2] + points[-1, :2]) / 2
    length = np.linalg.norm(side, axis=1, keepdims=True)
    reach = np.minimum(angle / EDGE_RAD, 1)[:, None]
    return 0.5 + 0.5 * reach * side / np.maximum(length, 1e-9)


def _unrolled(points: np.ndarray, upper: bool) -> np.ndarray:
    """Along the arch from left to right, and by height."""
    behind = points[:, 2].min()
    along = np.arctan2(points[:, 0], points[:, 2] - behind + 0.002) / np.pi + 0.5
    height = (points[:, 1] - points[:, 1].min()) / np.ptp(points[:, 1])
    return np.stack([0.01 + 0.98 * along, 0.01 + 0.47 * height + 0.51 * upper], 1)


def _beside_the_rim(face, points, uv, skin_quads, skin_faces) -> np.ndarray:
    """The texture's place at the nearest point of the neck's rim, for each vertex of the lid."""
    rim = face.anatomy.rim
    place = np.zeros((face.assembly.count, 2))
    place[skin_faces.ravel()] = uv[skin_quads.ravel()]
    away = np.linalg.norm(points[:, None] - face.vertices[rim][None], axis=2)
    return place[rim[away.argmin(1)]]
