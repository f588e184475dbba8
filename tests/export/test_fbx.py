"""FBX files, opened by ufbx and by Blender, which know nothing of us."""

from __future__ import annotations

import base64
import importlib.util
import io
import json
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from elocute.animation import animate
from elocute.errors import OutputError
from elocute.export.fbx import fbx_bytes, write_fbx
from elocute.export.options import ActionOptions
from elocute.head.surface import Surface
from elocute.meshes.fbx_gltf import without_places
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.motion import Motion
from elocute.numerics.quaternions import from_axis_angle, multiply, to_euler_degrees
from tests.export.heads import picture, plain, sheets
from tests.support.fbx_reader import read_fbx_apart

pytest.importorskip("ufbx")

WHOLE = ActionOptions(profile="elocute", action="L042")
FRAMES = (0, 7, 19)
CLOSE_M = 1e-6


@pytest.fixture(scope="module")
def spoken(speech_wav) -> Motion:
    """Two seconds of speech with a turning head, hair and clothes."""
    whole = animate(speech_wav, fps=10, identity="esi").motion
    assert whole.rotations is not None
    return Motion(whole.head, whole.weights[15:35], 10, rotations=whole.rotations[15:35]).dressed()


@pytest.fixture(scope="module")
def data(spoken) -> bytes:
    return fbx_bytes(spoken, WHOLE)


@pytest.fixture(scope="module")
def found(data, tmp_path_factory) -> dict[str, Any]:
    """What ufbx finds, at some frames and at the middle of two."""
    path = tmp_path_factory.mktemp("fbx") / "take.fbx"
    path.write_bytes(data)
    return read_fbx_apart(path, *(frame / 10 for frame in FRAMES), 0.75)


@pytest.fixture
def sheet():
    """A square with one shape."""
    head = sheets([0], [plain()])
    moved = np.zeros((1, head.vertex_count, 3), np.float32)
    moved[0, 0] = (0, 0, 0.01)
    return replace(head, expression_names=("jawOpen",), expression_basis=moved)


@pytest.fixture
def look(tmp_path):
    """What ufbx finds in a motion's file."""

    def read(motion: Motion, options: ActionOptions | None = None) -> dict[str, Any]:
        write_fbx(motion, tmp_path / "take.fbx", options=options)
        return read_fbx_apart(tmp_path / "take.fbx")

    return read


def test_vertices_are_those_of_the_motion(spoken, found):
    wanted = spoken.vertices()
    assert np.ptp(wanted, axis=0).max() > 0.005
    for frame, seen in zip(FRAMES, found["at"], strict=False):
        apart = np.linalg.norm(np.array(seen["points"]) / 100 - wanted[frame], axis=1)
        assert apart.max() < CLOSE_M, frame


def test_between_frames_it_is_between_them(spoken, found):
    middle = (spoken.vertices(7, 8)[0] + spoken.vertices(8, 9)[0]) / 2
    half = np.array(found["at"][-1]["points"]) / 100
    assert np.abs(half - middle).max() < 1e-4  # m; a turn is no straight line


def test_the_take_its_rate_and_its_unit(found):
    assert found["warnings"] == []
    assert found["takes"] == ["L042"]
    assert (found["fps"], found["unit_m"]) == (10, 0.01)
    assert found["span_s"] == [0, pytest.approx(1.9)]


@pytest.mark.parametrize("fps", [25, 60, 24000 / 1001, 12.5])
def test_any_rate_is_the_files(sheet, look, fps):
    found = look(Motion(sheet, np.array([[0], [1], [0], [1]], np.float32), fps))
    assert found["fps"] == pytest.approx(fps, abs=1e-9)
    assert found["last_s"] == pytest.approx(3 / fps, abs=1e-9)


def test_every_shape_has_a_channel_and_a_curve(spoken, found):
    assert found["channels"] == list(spoken.names)
    for frame, seen in zip(FRAMES, found["at"], strict=False):
        assert seen["weights"] == pytest.approx(spoken.weights[frame], abs=1e-6)
    # What rests has one key.
    resting = int((np.ptp(spoken.weights, axis=0) == 0).sum())
    assert resting <= found["keys"].count(1) < len(spoken.names)


def test_by_default_the_shapes_are_arkit_s_and_the_take_is_speech(motion, look):
    found = look(Motion(motion.head, motion.weights[:3], 30))
    assert set(found["channels"]) == set(ARKIT_NAMES)
    assert found["takes"] == ["speech"]


def test_joints_hold_all_of_a_vertex(spoken, found):
    assert found["joints"] == ["Neck", "Head", "Jaw", "LeftEye", "RightEye"]
    sums = np.zeros(spoken.head.vertex_count)
    for vertices, weights in found["skin"]:
        np.add.at(sums, np.array(vertices), np.array(weights))
    assert np.abs(sums - 1).max() < 1e-5


def test_faces_stay_the_heads_own(spoken, found):
    head = spoken.head
    three = head.quads[:, 3] == head.quads[:, 2]
    assert found["faces"] == np.where(three, 3, 4).tolist()
    assert found["corners"] == head.quads[np.arange(4) < np.where(three, 3, 4)[:, None]].tolist()
    names = [found["materials"][index] for index in found["face_materials"]]
    assert names == [head.material_names[index] for index in head.material]


def test_images_are_inside_in_the_colour_that_is_seen(look):
    grey = picture(np.full((4, 4, 3), 128))
    clear = picture(np.full((4, 4, 4), 128))
    surfaces = [
        Surface(color=grey, normal=grey, tint=(1.0, 0.2, 0.0)),
        Surface(color=clear, opacity="blend"),
    ]
    found = look(Motion(sheets([0, 0.01], surfaces), np.zeros((2, 0), np.float32), 30))
    assert found["materials"] == ["skin_0", "skin_1"]
    assert found["clear"] == [None, "skin_1_color"]
    images = {name: base64.b64decode(data) for name, data in found["images"].items()}
    assert set(images) == {"skin_0_color", "skin_0_normal", "skin_1_color"}
    with Image.open(io.BytesIO(images["skin_0_color"])) as seen:
        shown = np.asarray(seen.convert("RGB"), float).mean(axis=(0, 1))
    assert shown == pytest.approx([128, 128 * 0.2 ** (1 / 2.2), 0], abs=4)
    with Image.open(io.BytesIO(images["skin_1_color"])) as seen:
        assert seen.mode == "RGBA"


def test_its_texts_name_no_places(data):
    assert without_places(data) == data


def test_a_head_without_joints_or_shapes(sheet, look):
    bare = replace(
        sheet,
        expression_names=(),
        expression_basis=sheet.expression_basis[:0],
        joint_names=(),
        joint_parents=(),
        joint_positions=sheet.joint_positions[:0],
        joint_identity_basis=sheet.joint_identity_basis[:, :0],
        skin_weights=sheet.skin_weights[:, :0],
    )
    found = look(Motion(bare, np.zeros((3, 0), np.float32), 30))
    assert np.abs(np.array(found["vertices"]) / 100 - bare.template).max() < CLOSE_M
    assert found["channels"] == found["joints"] == []


def test_the_same_motion_gives_the_same_bytes(motion):
    assert fbx_bytes(motion) == fbx_bytes(motion)


def test_a_folder_that_is_not_there(motion, tmp_path):
    with pytest.raises(OutputError, match="mkdir"):
        write_fbx(motion, tmp_path / "no" / "take.fbx")


@pytest.mark.parametrize("name", ["", " a", "a\n", "x" * 201, "a\0b"])
def test_a_name_that_no_program_shows(name):
    with pytest.raises(OutputError, match=r"`action`: .*allowed: a name of up to 200 bytes"):
        ActionOptions(action=name)


def test_turns_about_three_axes_are_the_turn():
    angles = np.radians([[10, -20, 30], [100, 40, 150], [170, -30, 179], [190, -30, 181]])
    still = np.zeros(len(angles))
    x, y, z = (
        from_axis_angle(np.stack([angles[:, k] if k == axis else still for k in range(3)], axis=1))
        for axis in range(3)
    )
    found = to_euler_degrees(2 * multiply(z, multiply(y, x)))
    assert found[:2] == pytest.approx(np.degrees(angles[:2]))
    assert found[2:] == pytest.approx(np.degrees(angles[2:]))  # on, not back by a turn


READ = """
import bpy, json, sys
source, target, reader = sys.argv[1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.fps = 10
getattr(*{"wm": (bpy.ops.wm, "fbx_import"), "scene": (bpy.ops.import_scene, "fbx")}[reader])(
    filepath=source
)
face = next(each for each in bpy.data.objects if each.type == "MESH")
found = {"shapes": [key.name for key in face.data.shape_keys.key_blocks][1:], "points": []}
found["actions"] = [action.name for action in bpy.data.actions]
found["materials"] = [each.name for each in face.data.materials]
for frame in (0, 7, 19):
    bpy.context.scene.frame_set(int(bpy.data.actions[0].frame_range[0]) + frame)
    seen = face.evaluated_get(bpy.context.evaluated_depsgraph_get())
    places = [seen.matrix_world @ vertex.co for vertex in seen.to_mesh().vertices]
    found["points"].append([[x, z, -y] for x, y, z in places])
json.dump(found, open(target, "w"))
"""


@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="needs Blender's module bpy")
@pytest.mark.parametrize("reader", ["wm", "scene"])
def test_blender_moves_it_alike(spoken, data, reader, tmp_path):
    source, target = tmp_path / "take.fbx", tmp_path / "seen.json"
    source.write_bytes(data)
    command = [sys.executable, "-c", READ, str(source), str(target), reader]
    subprocess.run(command, check=True, capture_output=True)
    found = json.loads(target.read_text())
    assert found["shapes"] == list(spoken.names)
    assert any("L042" in name for name in found["actions"])
    assert "hair" in found["materials"]
    for frame, points in zip(FRAMES, found["points"], strict=True):
        apart = np.linalg.norm(np.array(points) - spoken.vertices(frame, frame + 1)[0], axis=1)
        assert apart.max() < CLOSE_M
