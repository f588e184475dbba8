"""Describes light, finishes and views to the viewer, so that it draws heads as pictures do."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from elocute.export.gltf import corners_of
from elocute.head.looks.folds import folds_of
from elocute.head.model import HeadModel
from elocute.head.mouth_opening import ENDS, LEAST_REACH_M, REACH
from elocute.head.surface import EYE, Surface
from elocute.render import shading
from elocute.render.backends_and_views import VIEWS
from elocute.render.camera import FIELD_DEG, portrait
from elocute.render.lights import RIGS, Triple
from elocute.render.parts import Part, Parts
from elocute.render.shadow import shadow_view

SHADOW_SIDE = 192
"""Pixels of the viewer's shadow: those of the fast profile."""
LIGHT_GROUNDS = {"studio": ((0.88, 0.89, 0.90), (0.72, 0.735, 0.75))}
"""By the light, the ground's colours beside light controls; other lights keep their own ground."""


def viewer_stage(head: HeadModel, light: str = "studio") -> dict[str, Any]:
    """The light that falls on a head, in the words of `web/src/shading.js`.

    Parameters
    ----------
    head : HeadModel
        The head as it is drawn.
    light : str
        A key of `RIGS`.

    Returns
    -------
    dict
        Of plain values: `glsl` (`shading.glsl`), `exposure`, `key_view` (16, by columns), `taps`,
        `shadow_side`, `shadow_bias`, `ground` (two sRGB colours of 0 to 255), `light_ground` (the
        same beside light controls, or None where it stays), and `parts`, by the name of the
        material; `folds` where a material has them, `mouth` where one has the lips, and
        `openness_glsl`, what lips leave of the light on what is in it.
    """
    rig, parts = RIGS[light], Parts(head)
    key = shadow_view(head, rig)
    folds = [index for index, name in enumerate(head.material_names) if _folds(head, name)]
    return {
        "glsl": shading.glsl(rig),
        "exposure": parts.exposure(rig),
        "key_view": key.matrix.T.ravel().tolist(),
        "taps": key.taps(SHADOW_SIDE),
        "shadow_side": SHADOW_SIDE,
        "shadow_bias": shading.SHADOW_BIAS,
        "ground": _bytes(rig.middle, rig.margin),
        "light_ground": _bytes(*LIGHT_GROUNDS[light]) if light in LIGHT_GROUNDS else None,
        "parts": {part.name: _part(part) for part in parts.parts},
        "folds": _fold_zones(head, folds[0]) if folds else None,
        "mouth": _mouth(head),
        "openness_glsl": shading.OPENNESS_GLSL,
    }


def _bytes(*colors: Triple) -> list[list[float]]:
    return [np.round(255 * np.array(each)).tolist() for each in colors]


def _folds(head: HeadModel, name: str) -> bool:
    return bool(head.surfaces.get(name, Surface()).folds) and folds_of(head) is not None


def _fold_zones(head: HeadModel, material: int) -> dict[str, Any]:
    """What strengths are computed from; pairs are corners of the material's part of the .glb."""
    folds, surface = folds_of(head), head.surfaces[head.material_names[material]]
    assert folds is not None
    vertices, _, _ = corners_of(head, material)
    # Vertices are sorted, so the first corner of each is found by halving.
    pairs = np.searchsorted(vertices, folds.pairs)
    return {
        "material": head.material_names[material],
        "pairs": pairs.tolist(),
        "zone": folds.zone.tolist(),
        "weight": np.round(folds.weight.astype(float), 5).tolist(),
        "reach": np.round(folds.reach.astype(float), 5).tolist(),
        "depth": surface.fold_depth,
        "lines": surface.fold_lines,
        "step": shading.FOLD_STEP,
    }


def _mouth(head: HeadModel) -> dict[str, Any] | None:
    """What `mouth_opening` reads off a pose; corners of the .glb's part of the first material that
    has all of the lips' line, None where none has."""
    lips = head.inner_lip_upper, head.inner_lip_lower, head.inner_corners
    places = np.concatenate(lips)
    if not len(places) or not len(head.inner_corners):
        return None
    for index, name in enumerate(head.material_names):
        vertices, _, _ = corners_of(head, index)
        if np.isin(places, vertices).all():
            upper, lower, ends = (np.searchsorted(vertices, each).tolist() for each in lips)
            return {
                "material": name,
                "upper": upper,
                "lower": lower,
                "corners": ends,
                "ends": ENDS,
                "reach": REACH,
                "least_reach": LEAST_REACH_M,
            }
    return None


def _part(part: Part) -> dict[str, Any]:
    return {
        "finish": asdict(part.finish),
        "rough": float(part.rough),
        "tint": list(map(float, part.surface.tint)),
        "normal_scale": float(part.surface.normal_scale),
        "eye": [getattr(part.surface, name) for name in EYE],
        "both_sides": part.surface.both_sides,
        "turns": part.turns,
        "rounded": part.rounded,
        "casts": part.casts,
        "inside": part.inside,
        "core": part.core,
        "fringe_gain": part.fringe_gain,
    }


def viewer_views(head: HeadModel) -> dict[str, Any]:
    """Where the camera of a picture stands in each view of a square one.

    Returns
    -------
    dict
        `field_deg`, and `views`: by name, `position` and `target` (3,) in m.
    """
    cameras = {name: portrait(head, name) for name in VIEWS}
    return {
        "field_deg": FIELD_DEG,
        "views": {
            name: {"position": one.position.tolist(), "target": one.target.tolist()}
            for name, one in cameras.items()
        },
    }
