"""Rigged meshes as Blender writes them, given shapes, and opened in Blender again."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs the extra `capture`")

from scipy.spatial import KDTree

from elocute.adoption.mesh_without_shapes import adopt_mesh
from elocute.adoption.shapes_in_file import with_arkit_shapes
from tests.support.stranger import Stranger, write_stranger

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("bpy") is None, reason="needs Blender's module bpy"
)
# A head in centimetres on two bones of an armature that is scaled to metres.
WRITE = """
import bpy, json, math, sys
given, glb, fbx = sys.argv[1:]
record = json.load(open(given))
bpy.ops.wm.read_factory_settings(use_empty=True)
bones = bpy.data.armatures.new("Armature")
rig = bpy.data.objects.new("Armature", bones)
bpy.context.collection.objects.link(rig)
bpy.context.view_layer.objects.active = rig
bpy.ops.object.mode_set(mode="EDIT")
for name, low, high in (("Neck", -20, -10), ("Head", -10, 10)):
    bone = bones.edit_bones.new(name)
    bone.head, bone.tail = (0, 0, low), (0, 0, high)
bones.edit_bones["Head"].parent = bones.edit_bones["Neck"]
bpy.ops.object.mode_set(mode="OBJECT")
mesh = bpy.data.meshes.new("Face")
mesh.from_pydata([(x, -z, y) for x, y, z in record["points"]], [], record["triangles"])
face = bpy.data.objects.new("Face", mesh)
bpy.context.collection.objects.link(face)
groups = [face.vertex_groups.new(name=name) for name in ("Neck", "Head")]
for vertex in mesh.vertices:
    share = min(max((vertex.co.z + 10) / 5, 0), 1)
    for group, weight in zip(groups, (1 - share, share)):
        group.add([vertex.index], weight, "REPLACE")
face.parent = rig
face.modifiers.new("Armature", "ARMATURE").object = rig
rig.scale = (0.01, 0.01, 0.01)
bpy.context.view_layer.update()
bpy.ops.export_scene.gltf(filepath=glb)
bpy.ops.export_scene.fbx(filepath=fbx, add_leaf_bones=False)
"""
READ = """
import bpy, json, sys
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=sys.argv[1])
faces = [each for each in bpy.data.objects if each.type == "MESH" and each.data.shape_keys]
found = {}
for name in ("", *sys.argv[3:]):
    places = []
    for face in faces:
        for key in face.data.shape_keys.key_blocks:
            key.value = float(key.name == name)
        seen = face.evaluated_get(bpy.context.evaluated_depsgraph_get())
        places += [list(face.matrix_world @ vertex.co) for vertex in seen.data.vertices]
    found[name] = [[x, z, -y] for x, y, z in places]
json.dump(found, open(sys.argv[2], "w"))
"""
SHAPES = ("jawOpen", "mouthPucker", "eyeBlinkLeft")


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> tuple[Stranger, Path]:
    folder = tmp_path_factory.mktemp("rig")
    stranger = write_stranger(folder / "stranger.glb")
    given = folder / "mesh.json"
    given.write_text(
        json.dumps({"points": stranger.points.tolist(), "triangles": stranger.triangles.tolist()})
    )
    blender(WRITE, given, folder / "hero.glb", folder / "hero.fbx")
    (folder / "hero.json").write_text(json.dumps({"points": (stranger.marks / 100).tolist()}))
    return stranger, folder


def blender(program: str, *arguments: object) -> None:
    words = [sys.executable, "-c", program, *map(str, arguments)]
    subprocess.run(words, check=True, capture_output=True)


@pytest.mark.parametrize("kind", ["glb", "fbx"])
def test_blender_moves_what_it_rigged(written, kind, tmp_path):
    _, folder = written
    made = adopt_mesh(folder / f"hero.{kind}", folder / "hero.json")
    after, seen = tmp_path / "hero_arkit.glb", tmp_path / "seen.json"
    after.write_bytes(with_arkit_shapes(made, "hero"))
    blender(READ, after, seen, *SHAPES)
    found = {name: np.array(places) for name, places in json.loads(seen.read_text()).items()}
    head = made.adoption.head
    away, nearest = KDTree(head.template).query(found[""])
    assert len(found[""]) > 4000 and away.max() < 2e-5
    for name in SHAPES:
        shape = head.expression_basis[head.expression_index(name)]
        off = np.linalg.norm(found[name] - found[""] - shape[nearest], axis=1)
        assert np.quantile(off, 0.99) < 2e-5 and np.abs(shape).max() > 1e-3, name
