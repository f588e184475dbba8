"""Avatars and animations of VRM 1.0, loaded and played by three-vrm, its reference for the web."""

from __future__ import annotations

import json
import struct
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from elocute.adoption.characters.open_character import character_head, open_character
from elocute.errors import OutputError
from elocute.export.options import VrmaOptions
from elocute.export.registry import write
from elocute.export.shape_profiles import Targets, target_shapes
from elocute.export.vrm import standing, vrm_bytes
from elocute.export.vrm_animation import vrma_bytes
from elocute.head.mesh import head_from_arrays
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.edits import with_gaze, with_pose
from elocute.motion.motion import Motion
from tests.support.gltf_files import arkit, glb
from tests.support.three_js import MODULES, bundled, node_program, validator_issues

REQUIRED = (
    *("hips", "spine", "head"),
    *("leftUpperLeg", "leftLowerLeg", "leftFoot", "rightUpperLeg", "rightLowerLeg", "rightFoot"),
    *("leftUpperArm", "leftLowerArm", "leftHand", "rightUpperArm", "rightLowerArm", "rightHand"),
)
"""Bones without which a file is no VRM 1.0."""
PRESETS = (
    *("aa", "ih", "ou", "ee", "oh", "blink", "blinkLeft", "blinkRight"),
    *("lookUp", "lookDown", "lookLeft", "lookRight"),
    *("happy", "angry", "sad", "relaxed", "surprised"),
)
FRAMES = (0, 17, 41)
EVERY = 37  # of the vertices, those compared
CLOSE_M = 2e-5
PLAYER = """
import * as THREE from "three";
import { readFileSync } from "node:fs";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { VRMLoaderPlugin, VRMHumanBoneName } from "@pixiv/three-vrm";
import { VRMAnimationLoaderPlugin, VRMLookAtQuaternionProxy, createVRMAnimationClip }
  from "@pixiv/three-vrm-animation";
const told = [];
console.warn = (...words) => told.push(words.join(" "));
const [avatar, animations, times, every] = JSON.parse(process.argv[2]);
const loader = new GLTFLoader();
loader.register((parser) => new VRMLoaderPlugin(parser));
loader.register((parser) => new VRMAnimationLoaderPlugin(parser));
const opened = async (path) => {
  const bytes = readFileSync(path);
  const start = bytes.byteOffset;
  return loader.parseAsync(bytes.buffer.slice(start, start + bytes.length), "");
};
const points = (vrm) => {
  const found = [], place = new THREE.Vector3();
  vrm.scene.traverse((mesh) => {
    if (!mesh.morphTargetDictionary) return;
    mesh.skeleton.update();
    const rest = mesh.geometry.attributes.position;
    for (let index = 0; index < rest.count; index += every) {
      mesh.getVertexPosition(index, place);
      found.push([rest.getX(index), rest.getY(index), rest.getZ(index), ...place.toArray()]);
    }
  });
  return found;
};
(async () => {
  const played = {};
  let facts;
  for (const path of animations) {
    const { vrm } = (await opened(avatar)).userData;
    vrm.scene.updateMatrixWorld(true);
    facts = {
      meta: vrm.meta,
      presets: Object.keys(vrm.expressionManager.presetExpressionMap),
      custom: Object.keys(vrm.expressionManager.customExpressionMap),
      bones: Object.fromEntries(Object.values(VRMHumanBoneName).flatMap((name) => {
        const node = vrm.humanoid.getRawBoneNode(name);
        return node ? [[name, node.getWorldPosition(new THREE.Vector3()).toArray()]] : [];
      })),
      view: vrm.lookAt.getLookAtWorldPosition(new THREE.Vector3()).toArray(),
      hidden: vrm.firstPerson.meshAnnotations.map((each) => each.type),
    };
    const proxy = new VRMLookAtQuaternionProxy(vrm.lookAt);
    proxy.name = "proxy";
    vrm.scene.add(proxy);
    const [animation] = (await opened(path)).userData.vrmAnimations;
    const mixer = new THREE.AnimationMixer(vrm.scene);
    mixer.clipAction(createVRMAnimationClip(animation, vrm)).play();
    played[path] = times.map((time) => {
      mixer.setTime(time);
      vrm.update(0);
      vrm.scene.updateMatrixWorld(true);
      return points(vrm);
    });
  }
  process.stdout.write(JSON.stringify({ facts, played, told }));
})();
"""


@pytest.fixture(scope="module")
def spoken(motion) -> Motion:
    """A second and a half of the take; the head turns, the eyes wander."""
    cut = Motion(motion.head, motion.weights[60:105], motion.fps)
    cut = with_pose(cut, "neck", [(0.0, (0, 0, 0)), (1.2, (4, -9, 3))])
    cut = with_pose(cut, "head", [(0.0, (2, 5, 0)), (1.4, (-6, 12, 2))])
    return with_gaze(cut, [(0.0, (8.0, -12.0)), (0.7, (-6.0, 10.0)), (1.4, (3.0, 20.0))])


@pytest.fixture(scope="module")
def files(spoken, tmp_path_factory):
    folder = tmp_path_factory.mktemp("vrm")
    write(spoken, folder / "talk.vrm")
    write(spoken, folder / "talk.vrma")
    write(spoken, folder / "sync.vrma", perfect_sync=True)
    return folder


@pytest.fixture(scope="module")
def node(need) -> str:
    program = node_program(need)
    need((MODULES / "@pixiv" / "three-vrm").is_dir(), "three-vrm in web/node_modules (npm ci)")
    return program


@pytest.fixture(scope="module")
def played(files, node, spoken):
    """What three-vrm makes of the files."""
    program = files / "play.cjs"
    program.write_text(bundled(PLAYER, platform="node"))
    given = [
        str(files / "talk.vrm"),
        [str(files / "talk.vrma"), str(files / "sync.vrma")],
        [frame / spoken.fps for frame in FRAMES],
        EVERY,
    ]
    done = subprocess.run(
        [node, program, json.dumps(given)], capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout)


def shown(motion: Motion, shapes: Targets) -> np.ndarray:
    """(frame, vertex, 3) m of the motion by the targets of a profile, standing."""
    weights = np.clip(shapes.weights(motion), 0, 1)
    looks = np.zeros((len(shapes.names), len(motion.names)), np.float32)
    for row, name in enumerate(shapes.names):
        if name in motion.names:
            looks[row, motion.names.index(name)] = 1
    looks = getattr(shapes, "looks", looks)
    return standing(replace(motion, weights=weights @ looks)).vertices()


@pytest.mark.system
@pytest.mark.parametrize(("name", "profile"), [("talk.vrma", "vrm"), ("sync.vrma", "arkit")])
def test_three_vrm_moves_the_skin_as_the_motion_does(played, files, spoken, name, profile):
    """Expressions, neck, head and gaze, all together."""
    wanted = shown(spoken, target_shapes(spoken.head, profile))
    rest = standing(spoken).head.template
    for frame, points in zip(FRAMES, played["played"][str(files / name)], strict=True):
        points = np.array(points)
        apart = np.linalg.norm(points[:, None, :3] - rest, axis=2)
        assert apart.min(axis=1).max() < 1e-6
        off = np.linalg.norm(points[:, 3:] - wanted[frame][apart.argmin(axis=1)], axis=1)
        assert off.max() < CLOSE_M
    assert np.linalg.norm(wanted[41] - rest, axis=1).max() > 0.01


@pytest.mark.system
def test_it_has_what_a_vrm_has_to_have(played):
    facts = played["facts"]
    assert played["told"] == []
    assert set(REQUIRED) | {"chest", "neck", "leftEye", "rightEye"} == set(facts["bones"])
    assert set(facts["presets"]) == set(PRESETS)
    assert set(facts["custom"]) == set(ARKIT_NAMES)
    assert facts["hidden"] == ["thirdPersonOnly"]


@pytest.mark.system
def test_a_body_stands_on_the_ground_below_the_head(played):
    bones = {name: np.array(place) for name, place in played["facts"]["bones"].items()}
    assert 0 < bones["leftFoot"][1] < 0.1
    heights = [bones[name][1] for name in ("hips", "spine", "chest", "neck", "head", "leftEye")]
    assert heights == sorted(heights) and 1.5 < heights[-1] < 1.7
    for name in ("UpperArm", "LowerArm", "Hand", "UpperLeg", "LowerLeg", "Foot", "Eye"):
        left, right = bones[f"left{name}"], bones[f"right{name}"]
        assert left[0] > 0 and left == pytest.approx(right * [-1, 1, 1], abs=1e-6)
    eyes = (bones["leftEye"] + bones["rightEye"]) / 2
    assert played["facts"]["view"] == pytest.approx(eyes, abs=1e-5)
    arm = [bones[f"left{name}"][1] for name in ("UpperArm", "LowerArm", "Hand")]
    assert np.ptp(arm) < 1e-6  # a T pose


@pytest.mark.system
def test_khronos_validator_finds_no_error(files, node):
    for name in ("talk.vrm", "talk.vrma", "sync.vrma"):
        assert [each for each in validator_issues(node, files / name) if each[0] <= 1] == []


def extension(data: bytes, name: str) -> dict:
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length])["extensions"][name]


def test_what_is_allowed_with_our_head_and_with_another(spoken):
    meta = extension(vrm_bytes(spoken), "VRMC_vrm")["meta"]
    assert meta["licenseUrl"] == "https://vrm.dev/licenses/1.0/"
    assert meta["otherLicenseUrl"].startswith("https://creativecommons.org/publicdomain/zero")
    assert (meta["commercialUsage"], meta["modification"]) == (
        "corporation",
        "allowModificationRedistribution",
    )
    other = replace(spoken, head=replace(spoken.head, notice="Copyright Somebody", name="hero"))
    meta = extension(vrm_bytes(other), "VRMC_vrm")["meta"]
    assert meta == {
        "name": "hero",
        "licenseUrl": "https://vrm.dev/licenses/1.0/",
        "copyrightInformation": "Copyright Somebody",
        "authors": ["unknown"],
    }


def test_an_animation_says_no_more_than_it_may(spoken):
    """Neither eyes nor looks: these are the gaze."""
    told = extension(vrma_bytes(spoken), "VRMC_vrm_animation")
    assert set(told["humanoid"]["humanBones"]) == {*REQUIRED, "chest", "neck"}
    assert set(told["expressions"]) == {"preset"}
    assert not any(name.startswith("look") for name in told["expressions"]["preset"])
    perfect = extension(vrma_bytes(spoken, VrmaOptions(True)), "VRMC_vrm_animation")
    assert set(perfect["expressions"]["custom"]) == set(ARKIT_NAMES) and "lookAt" not in perfect


def test_a_character_that_is_a_vrm_keeps_its_file(spoken, files, tmp_path):
    """And moves in it, or by an animation that any VRM takes."""
    head = character_head(open_character(files / "talk.vrm").character)
    moved = replace(spoken, head=replace(spoken.head, character=head.character))
    write(moved, tmp_path / "hero.vrm")
    write(moved, tmp_path / "hero.vrma")
    before, after = (files / "talk.vrm").read_bytes(), (tmp_path / "hero.vrm").read_bytes()
    assert extension(before, "VRMC_vrm") == extension(after, "VRMC_vrm")
    assert (tmp_path / "hero.vrma").read_bytes() == (files / "talk.vrma").read_bytes()


def test_a_character_that_is_none_is_refused(spoken, tmp_path):
    (tmp_path / "hero.glb").write_bytes(glb(arkit()))
    head = character_head(open_character(tmp_path / "hero.glb").character)
    with pytest.raises(OutputError, match=r"a character that is no VRM .*; write a \.glb"):
        write(
            replace(spoken, head=replace(spoken.head, character=head.character)),
            tmp_path / "hero.vrm",
        )


def test_a_head_without_the_shapes_is_refused(spoken, tmp_path):
    triangle = head_from_arrays("bare", np.eye(3) / 10, np.array([[0, 1, 2]]))
    bare = Motion(triangle, np.zeros((2, 0), np.float32), 30)
    for name in ("bare.vrm", "bare.vrma"):
        with pytest.raises(OutputError, match="a head without"):
            write(bare, tmp_path / name)
    assert list(tmp_path.iterdir()) == []
