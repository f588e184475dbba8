"""Characters that three.js wrote, given speech, opened by three.js in a real browser again."""

import base64
import json
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elocute.adoption.characters.open_character import character_head, open_character
from elocute.animation import animate
from elocute.export.character_weights import character_motion
from elocute.export.registry import write
from elocute.motion.curves import ARKIT_NAMES
from elocute.numerics.quaternions import multiply, to_matrices
from tests.support.gltf_files import OCULUS
from tests.support.three_js import bundled, node_program, open_program, validator_issues

pytestmark = [pytest.mark.browser, pytest.mark.system]

SKELETON = [
    ["Hips", None, [0, 0, 0], [np.pi / 2, 0, 0]],
    ["mixamorig:Neck", 0, [0, 1.4, 0], [0.3, 0, 0]],
    ["mixamorig:Head", 1, [0, 0.1, 0], [-0.2, 0, 0]],
    ["mixamorig:LeftEye", 2, [0.03, 0.05, 0.08], [0, 0, 0.4]],
    ["mixamorig:RightEye", 2, [-0.03, 0.05, 0.08], [0, 0, 0]],
]
HEAD = {"name": "Wolf3D_Head", "place": [0, 1.6, 0]}
CHARACTERS = {
    "ARKit": {
        "meshes": [
            {**HEAD, "targets": [*ARKIT_NAMES, "fat"], "rest": {"fat": 0.3}},
            {"name": "Wolf3D_Teeth", "targets": ["jawOpen"], "rest": {}, "place": [0, 1.58, 0.02]},
        ],
        "bones": SKELETON,
        "trs": False,
    },
    "visemes": {
        "meshes": [{**HEAD, "targets": [*OCULUS, "Blink_L", "Blink_R"], "rest": {}}],
        "bones": SKELETON,
        "trs": True,
    },
    "no skeleton": {
        "meshes": [{**HEAD, "targets": [f"BS.{n}" for n in ARKIT_NAMES], "rest": {}}],
        "bones": [],
        "trs": False,
    },
}
PAGE = """
import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
window.open_file = async (text) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const file = await new GLTFLoader().parseAsync(bytes.buffer, "");
  window.file = file;
  window.mixer = new THREE.AnimationMixer(file.scene);
  const clip = file.animations.find((each) => each.name === "speech");
  const turn = () => {
    file.scene.updateMatrixWorld(true);
    const found = {};
    file.scene.traverse((each) => {
      if (each.isBone) found[each.name] = each.getWorldQuaternion(new THREE.Quaternion()).toArray();
    });
    return found;
  };
  const rest = turn();
  mixer.clipAction(clip).play();
  window.at = (time) => {
    mixer.setTime(time);
    const meshes = {};
    file.scene.traverse((each) => {
      if (each.morphTargetDictionary) meshes[each.name] = Object.fromEntries(
        Object.entries(each.morphTargetDictionary).map(
          ([name, index]) => [name, each.morphTargetInfluences[index]]));
    });
    return { meshes, turns: turn() };
  };
  return { rest, clips: file.animations.map((each) => [each.name, each.duration]) };
};
"""


@pytest.fixture(scope="module")
def node(need):
    return node_program(need)


@pytest.fixture(scope="module")
def take(speech_wav):
    return animate(speech_wav, fps=30, look="none", mood="happy").motion


@pytest.fixture(scope="module", params=list(CHARACTERS))
def written(request, node, take, speech_wav, tmp_path_factory):
    """A character by three.js before and after, and what was written into it."""
    folder = tmp_path_factory.mktemp("three")
    program = folder / "make.cjs"
    source = Path(__file__).parents[2] / "support" / "make_character.js"
    program.write_text(bundled(source.read_text(), platform="node"))
    given = CHARACTERS[request.param]
    before, after = folder / "hero.glb", folder / "hero_speaks.glb"
    spec = {**given, "out": str(before), "scene_turn": [-np.pi / 2, 0, 0]}
    subprocess.run([node, program, json.dumps(spec)], check=True, capture_output=True)
    character = open_character(before).character
    write(replace(take, head=character_head(character)), after, sound=speech_wav)
    return before, after, character


@pytest.fixture(scope="module")
def browser(need, tmp_path_factory):
    with open_program(need, PAGE, tmp_path_factory.mktemp("page")) as driver:
        yield driver


@pytest.fixture(scope="module")
def opened(browser, written):
    text = base64.b64encode(written[1].read_bytes()).decode()
    done = "window.open_file(arguments[0]).then(arguments[1], (e) => arguments[1](String(e)))"
    told = browser.execute_async_script(done, text)
    assert isinstance(told, dict), told
    return told


@pytest.mark.parametrize("frame", [0, 31, 77, 140])
def test_shapes_have_the_weights_of_the_curves(opened, browser, written, take, frame):
    _, _, character = written
    moved = character_motion(replace(take, head=character_head(character)), character)
    shown = browser.execute_script("return at(arguments[0])", frame / take.fps)["meshes"]
    document = character.document
    for number, weights in moved.weights.items():
        node = document.records("nodes")[number]
        names = document.records("meshes")[node["mesh"]]["extras"]["targetNames"]
        drawn = shown[node["name"]]
        assert [drawn[name] for name in names] == pytest.approx(weights[frame].tolist(), abs=1e-5)
    if "Wolf3D_Teeth" in shown:
        jaw = take.weights[frame, take.names.index("jawOpen")]
        for mesh in ("Wolf3D_Head", "Wolf3D_Teeth"):
            assert shown[mesh]["jawOpen"] == pytest.approx(jaw, abs=1e-5)
        assert shown["Wolf3D_Head"]["fat"] == pytest.approx(0.3)


@pytest.mark.parametrize("frame", [31, 140])
def test_the_head_turns_as_the_motion_does(opened, browser, take, frame):
    shown = browser.execute_script("return at(arguments[0])", frame / take.fps)["turns"]
    if not shown:
        return  # it has no skeleton
    wanted = to_matrices(multiply(take.rotations[frame, 0], take.rotations[frame, 1]))
    assert np.abs(turned(opened["rest"], shown, "Head") - wanted).max() < 1e-5


def turned(rest, shown, end):
    """(3, 3) how far the joint whose name ends so is turned in the scene from where it rests."""
    name = next(each for each in shown if each.endswith(end))
    first, last = (to_matrices(np.array(each[name])[[3, 0, 1, 2]]) for each in (rest, shown))
    return last @ first.T


def test_the_other_animation_is_still_there(opened, written):
    idle = [["idle", 1]] if "idle" in json.dumps(written[2].document.record) else []
    assert [each[0] for each in opened["clips"]] == [*(each[0] for each in idle), "speech"]


def test_khronos_validator_finds_nothing_new(written, node):
    before, after = (sorted(validator_issues(node, path)) for path in written[:2])
    assert after == before


def test_eyes_turn_by_joints_where_no_shape_does(opened, browser, written, take):
    if not any(control.name.startswith("joint: eye") for control in written[2].controls):
        return  # its shapes are looked at above
    down = take.weights[:, take.names.index("eyeLookDownLeft")]
    frame = int(np.argmax(down))
    shown = browser.execute_script("return at(arguments[0])", frame / take.fps)["turns"]
    head, eye = (turned(opened["rest"], shown, name) for name in ("Head", "LeftEye"))
    looked = head.T @ eye @ [0, 0, 1]
    assert np.degrees(np.arcsin(-looked[1])) == pytest.approx(27 * down[frame], abs=1.5)
