"""A head of another topology without shapes, as a glTF file with its 68 landmarks beside it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from elocute.adoption.flame_places import FLAME_LANDMARKS
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from tests.support.flame_layout import flame_layout

CM = 100.0


@dataclass(frozen=True, eq=False)
class Stranger:
    """What was written: points (vertex, 3) and landmarks (68, 3) in centimetres."""

    file: Path
    landmarks: Path
    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    marks: NDArray[np.float64]


def write_stranger(file: Path, color: tuple[int, int, int] = (205, 160, 140)) -> Stranger:
    """A face in centimetres, of one picture's colour, with lower teeth; landmarks in a .json.

    Each triangle of the skin has its own corners, as programs write them at seams.
    """
    import trimesh
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    person = resolve_identity("ada")
    entries = flame_layout(person).entries
    points, triangles = CM * entries["v_template"], entries["f"].astype(int)
    loose = triangles.ravel()
    skin = trimesh.Trimesh(points[loose], np.arange(len(loose)).reshape(-1, 3), process=False)
    uv = np.random.default_rng(0).random((len(loose), 2))
    picture = PBRMaterial(name="skin", baseColorTexture=Image.new("RGB", (64, 64), color))
    skin.visual = TextureVisuals(uv=uv, material=picture)
    own = load_builtin_head().with_identity(person)
    quads = own.quads[np.isin(own.quads, own.regions["teeth_lower"]).all(axis=1)]
    used, corners = np.unique(quads, return_inverse=True)
    corners = corners.reshape(quads.shape)
    halves = np.concatenate([corners[:, :3], corners[:, [0, 2, 3]]])
    teeth = trimesh.Trimesh(CM * own.template[used], halves, process=False)
    white = PBRMaterial(name="teeth", baseColorFactor=[250, 250, 250, 255])
    teeth.visual = TextureVisuals(uv=np.zeros((len(used), 2)), material=white)
    scene = trimesh.Scene()
    scene.add_geometry(skin, node_name="skin")
    scene.add_geometry(teeth, node_name="teeth")
    scene.export(file, file_type="glb")
    marks = points[list(FLAME_LANDMARKS)]
    landmarks = file.with_suffix(".json")
    landmarks.write_text(json.dumps({"points": marks.tolist()}))
    return Stranger(file, landmarks, points, triangles, marks)
