"""The profiles oculus and vrm: what the fit leaves, and the files as three.js opens them."""

import base64

import numpy as np
import pytest

from elocute.adoption.characters.open_character import open_character
from elocute.errors import OutputError
from elocute.export.gltf import glb_bytes
from elocute.export.options import GlbOptions
from elocute.export.shape_profiles import FittedShapes, target_shapes
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from tests.support.gltf_files import OCULUS
from tests.support.three_js import node_program, open_program, validator_issues

VRM = (
    *("aa", "ih", "ou", "ee", "oh", "blink", "blinkLeft", "blinkRight"),
    *("lookUp", "lookDown", "lookLeft", "lookRight"),
    *("happy", "angry", "sad", "relaxed", "surprised"),
)
"""Presets of the specification, without `neutral`."""
AA = {"oculus": "viseme_aa", "vrm": "aa"}
EVERY = 37  # of the vertices, those compared
PAGE = """
import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
window.open_file = async (text) => {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const file = await new GLTFLoader().parseAsync(bytes.buffer, "");
  const mixer = new THREE.AnimationMixer(file.scene);
  mixer.clipAction(file.animations[0]).play();
  const meshes = [];
  file.scene.traverse((each) => { if (each.morphTargetDictionary) meshes.push(each); });
  window.at = (time, every) => {
    mixer.setTime(time);
    file.scene.updateMatrixWorld(true);
    const points = [], place = new THREE.Vector3();
    for (const mesh of meshes) {
      mesh.skeleton.update();
      const rest = mesh.geometry.attributes.position;
      for (let index = 0; index < rest.count; index += every) {
        mesh.getVertexPosition(index, place);
        points.push([rest.getX(index), rest.getY(index), rest.getZ(index), ...place.toArray()]);
      }
    }
    return points;
  };
  return meshes[0].morphTargetDictionary;
};
"""


@pytest.fixture(scope="module")
def spoken(motion) -> Motion:
    """Three seconds of the take, with lips that meet."""
    return Motion(motion.head, motion.weights[60:150], motion.fps)


def shown(motion: Motion, profile: str) -> Motion:
    """The motion as the targets of a profile show it, on the head's own shapes."""
    shapes = target_shapes(motion.head, profile)
    assert isinstance(shapes, FittedShapes)
    return Motion(motion.head, shapes.weights(motion) @ shapes.looks, motion.fps)


def test_targets_are_called_as_the_standards_have_them(motion):
    visemes = target_shapes(motion.head, "oculus").names
    assert visemes[:15] == tuple(f"viseme_{name.removeprefix('viseme_')}" for name in OCULUS)
    assert {"eyeBlinkLeft", "browInnerUp", "cheekPuff"} <= set(visemes[15:])
    assert not any(name.startswith(("mouth", "jaw", "tongue")) for name in visemes)
    assert target_shapes(motion.head, "vrm").names == VRM


@pytest.mark.parametrize("profile", ["oculus", "vrm"])
def test_weights_are_shares_and_few_at_a_time(spoken, profile):
    shapes = target_shapes(spoken.head, profile)
    weights = shapes.weights(spoken)
    assert weights.min() >= 0 and weights.max() <= 1
    mouth = weights[:, [shapes.names.index(name) for name in shapes.report(spoken)["mouth"]]]
    assert mouth.sum(axis=1).max() <= 1 + 1e-6
    assert (mouth > 0.02).sum(axis=1).mean() < 5


def test_lips_that_seal_take_the_viseme_that_seals_them(spoken):
    pressed = spoken.weights[:, spoken.names.index("mouthPressLeft")]
    sealed = target_shapes(spoken.head, "oculus").weights(spoken)[:, 1]
    assert (pressed > 0.49).sum() > 3 and sealed[pressed > 0.49].min() > 0.97
    assert sealed[measure_mouth(spoken)["opening_mm"] > 5].max() < 0.1


def test_silence_is_what_the_other_visemes_leave(spoken):
    weights = target_shapes(spoken.head, "oculus").weights(spoken)
    assert weights[:, 0] == pytest.approx(np.maximum(1 - weights[:, 1:15].sum(axis=1), 0))
    still = Motion(spoken.head, np.zeros_like(spoken.weights[:2]), 30)
    assert (target_shapes(spoken.head, "oculus").weights(still)[:, 0] == 1).all()


@pytest.mark.parametrize(("profile", "closed_mm", "r"), [("oculus", 0.1, 0.98), ("vrm", 0.4, 0.97)])
def test_lips_open_as_they_do_and_close_where_they_do(spoken, profile, closed_mm, r):
    wanted = measure_mouth(spoken)["opening_mm"]
    had = measure_mouth(shown(spoken, profile))["opening_mm"]
    # Weights that sum to one open a mouth as far as the widest viseme does.
    shapes = target_shapes(spoken.head, profile)
    assert isinstance(shapes, FittedShapes)
    alone = Motion(spoken.head, shapes.looks[[shapes.names.index(AA[profile])]], 30)
    wanted = np.minimum(wanted, measure_mouth(alone)["opening_mm"])
    assert (wanted < 0.05).sum() > 3
    assert had[wanted < 0.05].max() < closed_mm
    assert np.corrcoef(wanted, had)[0, 1] > r


@pytest.mark.parametrize("profile", ["oculus", "vrm"])
def test_what_is_left_is_told(spoken, profile):
    told = target_shapes(spoken.head, profile).report(spoken)
    off = [
        np.linalg.norm(one - other, axis=1).max()
        for frame in range(0, spoken.frame_count, 30)
        for one, other in zip(
            spoken.vertices(frame, frame + 30),
            shown(spoken, profile).vertices(frame, frame + 30),
            strict=True,
        )
    ]
    assert told["take_mm"] == pytest.approx(1000 * max(off), abs=2e-3)
    frowning = spoken.weights.copy()
    frowning[:, spoken.names.index("browDownLeft")] = 0.5
    frowned = Motion(spoken.head, frowning, spoken.fps)
    left_out = target_shapes(spoken.head, profile).report(frowned)["left_out"]
    assert ("browDownLeft" in left_out) == (profile == "vrm")


def test_lids_and_gaze_are_taken_over(spoken):
    curves = spoken.weights.copy()
    curves[:, spoken.names.index("eyeBlinkLeft")] = 0.7
    curves[:, spoken.names.index("eyeLookOutLeft")] = 0.4
    curves[:, spoken.names.index("eyeLookInRight")] = 0.2
    moved = Motion(spoken.head, curves, spoken.fps)
    shapes = target_shapes(spoken.head, "vrm")
    found = dict(zip(shapes.names, shapes.weights(moved)[0].tolist(), strict=True))
    assert found["blinkLeft"] == pytest.approx(0.7) and found["blink"] == 0
    assert found["lookLeft"] == pytest.approx(0.3) and found["lookRight"] == 0


def test_what_cannot_be_asked_for():
    with pytest.raises(OutputError, match=r"`visemes`: profile oculus, which has .*; leave it out"):
        GlbOptions(profile="oculus", visemes=True)


def test_a_head_without_the_shapes_is_refused(spoken):
    from dataclasses import replace

    bare = replace(spoken.head, expression_names=tuple(f"own{i}" for i in range(55)))
    with pytest.raises(OutputError, match=r"profile vrm: a head without .*; allowed: "):
        glb_bytes(Motion(bare, spoken.weights, 30), options=GlbOptions(profile="vrm"))


@pytest.fixture(scope="module", params=["oculus", "vrm"])
def written(request, spoken, tmp_path_factory):
    """The name of a profile, and a file of it."""
    path = tmp_path_factory.mktemp("profile") / "talk.glb"
    path.write_bytes(glb_bytes(spoken, options=GlbOptions(profile=request.param)))
    return request.param, path


def test_a_file_is_understood_as_a_character(written):
    """The very mapping that is for other people's files."""
    profile, path = written
    character = open_character(path).character
    moved = {control.name for control in character.controls if control.fitted}
    assert moved >= ({"viseme_PP", "viseme_U"} if profile == "oculus" else {"aa", "ih", "ou"})


@pytest.mark.system
def test_khronos_validator_finds_no_error(written, need):
    issues = validator_issues(node_program(need), written[1])
    assert [issue for issue in issues if issue[0] <= 1] == []


@pytest.fixture(scope="module")
def browser(need, tmp_path_factory):
    with open_program(need, PAGE, tmp_path_factory.mktemp("page")) as driver:
        yield driver


@pytest.mark.browser
@pytest.mark.system
def test_three_js_moves_the_skin_as_the_fit_does(written, browser, spoken):
    profile, path = written
    text = base64.b64encode(path.read_bytes()).decode()
    done = "window.open_file(arguments[0]).then(arguments[1], (e) => arguments[1](String(e)))"
    places = browser.execute_async_script(done, text)
    assert tuple(sorted(places, key=places.get)) == target_shapes(spoken.head, profile).names
    head = spoken.head
    for frame in (0, 41, 80):
        points = browser.execute_script(
            "return at(arguments[0], arguments[1])", frame / spoken.fps, EVERY
        )
        rest, found = np.split(np.array(points), 2, axis=1)
        apart = np.stack([np.abs(head.template - place).max(axis=1) for place in rest])
        vertices = apart.argmin(axis=1)
        assert apart.min(axis=1).max() < 1e-6
        wanted = shown(spoken, profile).vertices(frame, frame + 1)[0][vertices]
        assert np.abs(found - wanted).max() < 2e-5
