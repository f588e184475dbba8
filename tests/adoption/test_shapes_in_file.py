"""Meshes whose own file is given ARKit's shapes: three.js draws them, nothing else has changed."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs the extra `capture`")

from scipy.spatial import KDTree

import elocute
from elocute.adoption.mesh_without_shapes import MeshAdoption, adopt_mesh
from elocute.adoption.shapes_in_file import with_arkit_shapes
from elocute.errors import HeadError
from elocute.meshes.gltf_additions import GltfAdditions, with_items, with_value
from elocute.meshes.gltf_document import read_gltf
from elocute.motion.curves import ARKIT_NAMES
from tests.support.commands import one_line, run_here
from tests.support.stranger import Stranger, write_stranger
from tests.support.three_js import node_program, open_program, validator_issues

PAGE = """
import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
window.open_file = async (text) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const file = await new GLTFLoader().parseAsync(bytes.buffer, "");
  const meshes = [];
  file.scene.traverse((each) => { if (each.isMesh) meshes.push(each); });
  window.stand = (name) => {
    const found = [], point = new THREE.Vector3();
    for (const mesh of meshes) {
      const dictionary = mesh.morphTargetDictionary ?? {};
      mesh.morphTargetInfluences?.fill(0);
      if (name in dictionary) mesh.morphTargetInfluences[dictionary[name]] = 1;
      mesh.updateWorldMatrix(true, false);
      mesh.skeleton?.bones.forEach((bone) => bone.updateWorldMatrix(true, false));
      for (let i = 0; i < mesh.geometry.attributes.position.count; i += 1) {
        mesh.getVertexPosition(i, point).applyMatrix4(mesh.matrixWorld);
        found.push(point.x, point.y, point.z);
      }
    }
    return found;
  };
  return meshes.length;
};
"""
SHAPES = ("jawOpen", "mouthSmileLeft", "mouthPucker", "eyeBlinkRight", "browInnerUp")


def rigged(stranger: Stranger) -> tuple[Path, Path]:
    """The stranger on two joints of an armature that is turned and scaled, now in metres.

    Its meshes hang from the armature too, which moves what is skinned nowhere.
    """
    document = read_gltf(stranger.file)
    added, text = GltfAdditions(document), document.text
    armature = np.eye(4)
    armature[:3, :3] = 0.01 * np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    joints = [np.eye(4), np.eye(4)]
    joints[1][:3, 3] = [0, 3, 10]
    joints[1][:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    to_metres = np.diag([0.01, 0.01, 0.01, 1])
    worlds = [armature @ joints[0], armature @ joints[0] @ joints[1]]
    inverse = [(np.linalg.inv(world) @ to_metres).T.ravel() for world in worlds]
    binds = added.accessor(np.array(inverse, np.float32), "MAT4")
    first = len(document.records("nodes"))
    hung = [n for n, node in enumerate(document.records("nodes")) if "mesh" in node]
    for node in hung:
        text = with_value(text, ["nodes", node, "skin"], 0)
    for number, mesh in enumerate(document.records("meshes")):
        attributes = mesh["primitives"][0]["attributes"]
        count = document.records("accessors")[attributes["POSITION"]]["count"]
        share = np.random.default_rng(number).random(count)
        weights = np.stack([share, 1 - share, 0 * share, 0 * share], axis=1)
        which = np.tile(np.array([0, 1, 0, 0], np.uint8), (count, 1))
        place: list[str | int] = ["meshes", number, "primitives", 0, "attributes"]
        told = {"bufferView": added.view(which.tobytes()), "componentType": 5121}
        text = with_value(
            text, [*place, "WEIGHTS_0"], added.accessor(weights.astype(np.float32), "VEC4")
        )
        joint_record = told | {"count": count, "type": "VEC4"}
        text = with_value(text, [*place, "JOINTS_0"], added.record(joint_record))
    nodes = [
        {"name": "Armature", "matrix": armature.T.ravel().tolist(), "children": [first + 1, *hung]},
        {"name": "Hips", "children": [first + 2]},
        {"name": "Head", "matrix": joints[1].T.ravel().tolist()},
    ]
    text = with_items(text, ["nodes"], nodes)
    for number, node in enumerate(document.records("nodes")):
        if "children" in node:
            left = [child for child in node["children"] if child not in hung]
            text = with_value(text, ["nodes", number, "children"], left)
    text = with_value(text, ["scenes", 0, "nodes"], [first])
    skin = {"joints": [first + 1, first + 2], "inverseBindMatrices": binds}
    file = stranger.file.with_name("rigged.glb")
    file.write_bytes(added.pack(with_items(text, ["skins"], [skin])))
    marks = stranger.file.with_name("rigged.json")
    marks.write_text(json.dumps({"points": (stranger.marks / 100).tolist()}))
    return file, marks


@pytest.fixture(scope="module", params=["on its own", "on joints"])
def made(request, tmp_path_factory) -> tuple[Path, Path, MeshAdoption, float]:
    """Before and after, how the shapes came over, and the metres in the file's unit."""
    stranger = write_stranger(tmp_path_factory.mktemp("own") / "hero.glb")
    own = request.param == "on its own"
    file, marks = (stranger.file, stranger.landmarks) if own else rigged(stranger)
    adopted = adopt_mesh(file, marks)
    after = file.with_name("hero_arkit.glb")
    after.write_bytes(with_arkit_shapes(adopted, file.name))
    return file, after, adopted, 0.01 if own else 1.0


@pytest.fixture(scope="module")
def browser(need, tmp_path_factory):
    with open_program(need, PAGE, tmp_path_factory.mktemp("page")) as driver:
        yield driver


@pytest.mark.browser
@pytest.mark.system
def test_three_js_moves_it_as_the_adopted_head_moves(browser, made):
    _, after, adopted, metres = made
    text = base64.b64encode(after.read_bytes()).decode()
    script = "const done = arguments[1]; open_file(arguments[0]).then(done, e => done(String(e)))"
    assert browser.execute_async_script(script, text) == 2

    def stand(name: str) -> np.ndarray:
        found = browser.execute_script("return stand(arguments[0])", name)
        return metres * np.reshape(np.array(found, float), (-1, 3))

    head = adopted.adoption.head
    rest = stand("")
    away, nearest = KDTree(head.template).query(rest)
    assert away.max() < 2e-6  # lips that stood apart meet in the file, too
    for name in SHAPES:
        shape = head.expression_basis[head.expression_index(name)]
        # Lips and lids that touch are two vertices at one place: either may be the nearest.
        off = np.linalg.norm(stand(name) - rest - shape[nearest], axis=1)
        assert np.quantile(off, 0.99) < 5e-6, name
        assert np.abs(shape).max() > 1e-3


def test_nothing_else_has_changed(need, made):
    before, after, _, _ = made
    one, other = read_gltf(before), read_gltf(after)
    for name in ("nodes", "materials", "textures", "images", "skins", "scenes", "asset"):
        assert one.record.get(name) == other.record.get(name), name
    for name in ("accessors", "bufferViews"):
        assert other.records(name)[: len(one.records(name))] == one.records(name)
    assert one.binary is not None and other.binary is not None
    size = one.records("buffers")[0]["byteLength"]
    assert bytes(other.binary[:size]) == bytes(one.binary[:size])
    for mesh, own in zip(other.records("meshes"), one.records("meshes"), strict=True):
        assert mesh["extras"] == own.get("extras", {}) | {"targetNames": list(ARKIT_NAMES)}
        ours, theirs = mesh["primitives"][0], own["primitives"][0]
        same = {name: theirs["attributes"][name] for name in theirs["attributes"]}
        assert ours["attributes"] | {"POSITION": same["POSITION"]} == same
    node = node_program(need)
    errors = [each for each in validator_issues(node, after) if each[0] < 2]
    assert errors == [each for each in validator_issues(node, before) if each[0] < 2]


def test_it_is_a_character_that_speaks(made, speech_wav, tmp_path):
    _, after, _, _ = made
    told = json.loads(run_here("info", after, "--json").stdout)
    assert len(told["mapped"]) == 52 and not told["missing"]
    output = tmp_path / "hero_speaks.glb"
    elocute.animate(speech_wav, head=after).write(output)
    assert read_gltf(output).records("animations")[-1]["name"] == "speech"


def test_from_the_command_line(made, tmp_path):
    before, after, _, _ = made
    marks = before.with_suffix(".json")
    output = tmp_path / "hero.glb"
    arguments = ("head", "adopt", before, "--keep-mesh", "--landmarks", marks, "-o", output)
    assert "lips stood" in run_here(*arguments).stdout
    assert output.read_bytes() == after.read_bytes()


def test_what_cannot_take_shapes_is_refused(made, tmp_path):
    before, after, adopted, _ = made
    with pytest.raises(HeadError, match="morph targets"):
        with_arkit_shapes(adopt_mesh(after, before.with_suffix(".json")), "hero.glb")
    twice = read_gltf(before)
    mesh = next(node["mesh"] for node in twice.records("nodes") if "mesh" in node)
    twice.record["nodes"].append({"mesh": mesh})
    instanced = MeshAdoption(**{**vars(adopted), "document": twice})
    with pytest.raises(HeadError, match="several places"):
        with_arkit_shapes(instanced, "hero.glb")
    import trimesh

    bare = tmp_path / "bare.stl"
    trimesh.load(before, force="mesh").export(bare)
    words = ("head", "adopt", bare, "--landmarks", before.with_suffix(".json"))
    one_line(run_here(*words, "-o", tmp_path / "bare.glb"), ".npz")
