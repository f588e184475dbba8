"""Baked occlusion: how much of the sky each vertex sees, the mouth slightly open."""

from __future__ import annotations

import numpy as np

from elocute.numerics.smoothing import smoothstep
from recipes.head.anatomy import CONTACT_RING, CORNERS

RAYS = 96
REACH_M = 0.12
BOUNCE = 0.13  # red flesh lights the backs of the teeth: black ones look like holes
EAR, EAR_OPEN = 0.10, 1.2  # folds of an ear are small and read by their shade alone
# And the mouth itself: dark red from the side, no black gap; how deep it lies where it is darkest.
LINING, THROAT, TONGUE, LINING_M = 0.64, 0.26, 0.22, 0.052
CORNER_FROM, CORNER = 0.66, 0.62  # from where to a corner the line of the lips fades, and how much
FOLD_M, FOLD = 0.006, 0.20  # the soft fold that it ends in: how far round it is shade, how much
BACK_TEETH = {"upper": 0.30, "lower": 0.48}  # what light reaches the last of them
GUM_LIGHT, GUM_FALL = 0.75, 1.3  # in front, over the bounce, and how it falls with depth
LIP_SHADE = 0.50  # what lips leave of the light on the teeth at the gum


def occlusion(
    vertices: np.ndarray, triangles: np.ndarray, normals: np.ndarray, reach_m: float = REACH_M
) -> np.ndarray:
    """(vertex,) share of cosine-weighted rays that leave the head, 0..1."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene()
    TriangleMesh(scene, vertices[triangles].astype(np.float32))
    rng = np.random.default_rng(0)
    u, turn = (np.arange(RAYS) + 0.5) / RAYS, np.pi * (3 - 5**0.5) * np.arange(RAYS)
    local = np.stack([np.sqrt(u) * np.cos(turn), np.sqrt(u) * np.sin(turn), np.sqrt(1 - u)], 1)
    side = np.cross(normals, [0.0, 1.0, 0.1])
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    up = np.cross(normals, side)
    spin = rng.uniform(0, 2 * np.pi, len(vertices))[:, None]
    side, up = np.cos(spin) * side + np.sin(spin) * up, np.cos(spin) * up - np.sin(spin) * side
    free = np.zeros(len(vertices))
    origin = (vertices + normals * 4e-4).astype(np.float32)
    for ray in local:
        direction = (ray[0] * side + ray[1] * up + ray[2] * normals).astype(np.float32)
        hit = scene.run(origin, direction, dists=np.full(len(origin), reach_m, np.float32))
        free += hit < 0
    return free / RAYS


def shading(face, vertices: np.ndarray, triangles: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(vertex,) 0..1: `occlusion` softened on the skin outside, deepened inside the mouth."""
    free = occlusion(vertices, triangles, normals)
    light = 0.55 + 0.45 * np.clip(free * 1.25, 0, 1)
    slices = face.assembly.slices
    ears = face.ears.auricle
    deep = EAR + (1 - EAR) * np.clip(free[slices["skin"]] * EAR_OPEN, 0, 1)
    light[slices["skin"]] += ears * (deep - light[slices["skin"]])
    inside = np.zeros(len(vertices), bool)
    inside[face.anatomy.inner_mouth] = True
    for name in ("tongue", "gums_upper", "gums_lower", "teeth_upper", "teeth_lower"):
        inside[slices[name]] = True
    front = face.vertices[slices["teeth_upper"], 2].max()
    depth = np.clip((front - face.vertices[:, 2]) / 0.030, 0, 1)
    deep = (1 - depth) ** 1.3 * np.clip(0.35 + 1.6 * free, 0, 1)
    light[inside] = np.clip(LINING + (1 - LINING) * deep[inside], 0, 1)
    lining = face.anatomy.inner_mouth
    behind = np.clip((front - face.vertices[lining, 2]) / LINING_M, 0, 1)
    light[lining] = LINING + (THROAT - LINING) * behind**1.1
    # The inner side of the lips: lamps behind the head would else light the far one from within.
    near_lips = face.lips.rings[[5, 6, 7, 8, 9]]
    near = np.clip((np.abs(face.lips.across) - CORNER_FROM) / (1 - CORNER_FROM), 0, 1)
    faded = CORNER * smoothstep(near)
    for ring, most, outer in zip(
        near_lips, (0.75, 0.62, 0.54, 0.38, 0.30), (1, 1, 0.8, 0.2, 0), strict=True
    ):
        light[ring] = np.minimum(light[ring], most + (1 - most) * faded * outer)
    corners = face.vertices[face.lips.rings[CONTACT_RING][list(CORNERS)]]
    skin = face.vertices[slices["skin"]]
    away = np.linalg.norm(skin[:, None] - corners, axis=2).min(axis=1)
    light[slices["skin"]] *= 1 - FOLD * np.exp(-((away / FOLD_M) ** 2))
    tongue = face.vertices[slices["tongue"]]
    forward = (tongue[:, 2] - tongue[:, 2].min()) / np.ptp(tongue[:, 2])
    groove = np.clip(np.abs(tongue[:, 0]) / 0.004, 0, 1)  # a shallow fold along the middle
    light[slices["tongue"]] = TONGUE + 0.55 * forward**2.2 * (0.70 + 0.30 * groove)
    for jaw, brightest in (("upper", 0.68), ("lower", 0.95)):
        teeth = slices[f"teeth_{jaw}"]
        from_gum = np.clip(1.2 * face.assembly.jaws[f"teeth_{jaw}"].shade, 0, 1)
        near_gum = LIP_SHADE + (1 - LIP_SHADE) * from_gum
        last = BACK_TEETH[jaw]
        lit = last + (1 - last) * (1 - depth[teeth]) ** 1.3
        light[teeth] = np.minimum(lit, brightest) * near_gum
        gums = slices[f"gums_{jaw}"]
        light[gums] = BOUNCE + GUM_LIGHT * (1 - depth[gums]) ** GUM_FALL
    return light
