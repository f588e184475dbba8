"""The extension for Blender: its parts without Blender, and all of it in Blender's own module."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from elocute.adoption.characters.open_character import open_character
from elocute.animation import animate
from elocute.export.character_weights import character_motion
from elocute.meshes.gltf_document import gltf_document
from elocute.numerics.quaternions import from_axis_angle, multiply
from tests.support.commands import run_here
from tests.support.gltf_files import arkit, glb

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "integrations/blender/elocute"
HAS_BPY = importlib.util.find_spec("bpy") is not None


def part(path: Path) -> ModuleType:
    """A file of the extension by itself, which needs nothing of Blender."""
    spec = importlib.util.spec_from_file_location(f"blender_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where a dataclass looks its annotations up
    spec.loader.exec_module(module)
    return module


program, take_file, keys = (part(SOURCE / f"{n}.py") for n in ("program", "take_file", "keys"))
build = part(ROOT / "scripts/blender_extension.py").build


@pytest.fixture
def hero(tmp_path) -> Path:
    """A character with ARKit's shapes, one more, and a head that does not rest straight."""
    turned = from_axis_angle(np.array([0.3, 0.2, 0.1]))[[1, 2, 3, 0]].tolist()
    given = arkit()
    given["nodes"].append({"name": "Head", "rotation": turned})
    given["meshes"][0]["extras"]["targetNames"].append("wink of an eye")
    given["meshes"][0]["primitives"][0]["targets"].append({"POSITION": 1})
    given["scenes"][0]["nodes"].append(1)
    given["skins"] = [{"joints": [1]}]
    given["nodes"][0]["skin"] = 0
    path = tmp_path / "hero.glb"
    path.write_bytes(glb(given))
    return path


def test_the_mapping_is_what_the_program_tells(hero):
    rows = program.mapping_rows(run_here(*program.mapping_command("elocute", hero)[1:]).stdout)
    states = {shape: state for shape, state, _ in rows}
    assert states["jawOpen"] in ("moved", "fitted") and states["browInnerUp"] == "moved"
    assert states["wink of an eye"] == "unknown"
    with pytest.raises(ValueError, match="no description of a character"):
        program.mapping_rows('{"kind": "sound"}')


def test_its_command_makes_the_take_that_it_reads(hero, speech_wav, tmp_path):
    wishes = program.Wishes(str(speech_wav), 30000 / 1001, "L042", mood="happy")
    made = tmp_path / "take.glb"
    ended = run_here(*program.animate_command("elocute", wishes, hero, made)[1:])
    assert ended.returncode == 0, ended.stderr
    take = take_file.read_take(made.read_bytes(), "L042")
    motion = animate(speech_wav, fps=30000 / 1001, head=hero, mood="happy").motion
    moved = character_motion(motion, open_character(hero).character)
    assert take.times_s == pytest.approx(motion.times_s, abs=1e-5)
    (shapes,) = take.shapes.values()
    weights = np.stack(list(shapes.values()), axis=1)
    assert weights == pytest.approx(moved.weights[0], abs=1e-6)
    assert "jawOpen" in take.driven and "wink of an eye" not in take.driven
    # From rest by the turn it is where the file has it.
    rest = from_axis_angle(np.array([0.3, 0.2, 0.1]))
    placed = np.stack([multiply(rest, turn) for turn in np.array(take.turns["Head"])])
    assert np.abs(placed[:, [1, 2, 3, 0]] - moved.turns[1]).max() < 1e-6


def test_another_file_is_no_take():
    plain = glb(arkit())
    for data in (b"", b"glTF", plain, plain[:40]):
        with pytest.raises(ValueError, match=r"no take|no \.glb"):
            take_file.read_take(data, "L042")


def test_phones_have_their_times(speech_wav, tmp_path):
    wishes = program.Wishes(str(speech_wav), 30, "a")
    run_here(*program.phones_command("elocute", wishes, tmp_path / "p.json")[1:])
    marks = program.phone_marks((tmp_path / "p.json").read_text(encoding="utf-8"))
    assert len(marks) > 20 and marks == sorted(marks) and "L" in {phone for _, phone in marks}


def test_what_fails_is_told_in_its_last_line():
    fails = [sys.executable, "-c", "import sys; print('one', file=sys.stderr); sys.exit('two')"]
    run = program.Run([[sys.executable, "-c", "print('fine')"], fails, ["never"]])
    run.wait()
    assert run.error == "two" and run.commands == [["never"]]
    run = program.Run([["no-such-program-anywhere"]])
    run.wait()
    assert run.error == "no-such-program-anywhere: No such file or directory"
    with pytest.raises(OSError, match="pip install elocute"):
        program.find_program("no-such-program-anywhere")


def test_what_runs_is_stopped():
    run = program.Run([[sys.executable, "-c", "import time; time.sleep(60)"], ["never"]])
    assert not run.poll()
    run.stop()
    assert run.commands == []


def test_cleaned_keys_are_within_the_tolerance():
    frames = np.arange(200)
    values = np.sin(frames / 9) + np.where(frames == 77, 0.5, 0)
    points = list(zip(frames.tolist(), values.tolist(), strict=True))
    left = keys.cleaned(points, 0.02)
    assert left[0] == points[0] and left[-1] == points[-1] and points[77] in left
    assert len(left) < 70
    back = np.interp(frames, *np.array(left).T)
    assert np.abs(back - values).max() <= 0.02
    assert keys.cleaned(points[:2], 1.0) == points[:2]
    assert keys.needed([0.5, 0.5]) == [0] and keys.needed([0.5, 0.6]) == [0, 1]


def test_the_package_is_what_blender_asks_for(tmp_path):
    first, second = build(tmp_path / "a"), build(tmp_path / "b")
    assert first.read_bytes() == second.read_bytes()
    with zipfile.ZipFile(first) as package:
        manifest = tomllib.loads(package.read("blender_manifest.toml").decode())
        assert {"__init__.py", "scene.py", "program.py"} <= set(package.namelist())
    assert manifest["schema_version"] == "1.0.0" and manifest["id"] == "elocute"
    assert manifest["version"] == first.stem.rpartition("-")[2]
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"] and manifest["type"] == "add-on"
    assert len(manifest["tagline"]) <= 64 and not manifest["tagline"].endswith(".")
    for file in SOURCE.glob("*.py"):
        assert "SPDX-License-Identifier: GPL-3.0-or-later" in file.read_text(encoding="utf-8")


SPEAK = """
import bpy, json, sys
package, program, hero, whole, sound, target = sys.argv[1:]


def places(frame):
    bpy.context.scene.frame_set(frame)
    found = []
    for face in bpy.data.objects:
        if face.type == "MESH" and face.data.shape_keys:
            seen = face.evaluated_get(bpy.context.evaluated_depsgraph_get())
            found += [list(seen.matrix_world @ vertex.co) for vertex in seen.to_mesh().vertices]
    return found


def opened(file):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    bpy.context.scene.render.fps = 30
    bpy.ops.import_scene.gltf(filepath=file)


bpy.ops.extensions.package_install_files(
    filepath=package, repo="user_default", enable_on_install=True
)
addons = bpy.context.preferences.addons
name = next(each for each in addons.keys() if each.endswith(".elocute"))
addons[name].preferences.program = program
bpy.ops.wm.save_userpref()
# As Blender's own importer moves what the program wrote.
opened(whole)
start = round(bpy.data.actions[0].frame_range[0])
result = {"wanted": [places(start + frame) for frame in (0, 20, 45)]}
# As the extension keys it.
opened(hero)
for action in list(bpy.data.actions):
    bpy.data.actions.remove(action)
scene = bpy.context.scene
scene.elocute.face = next(o for o in bpy.data.objects if o.type == "MESH" and o.data.shape_keys)
scene.elocute.sound, scene.elocute.take, scene.elocute.start = sound, "L042", 11
bpy.ops.elocute.mapping()
result["mapping"] = {row.name: row.state for row in scene.elocute.rows}
scene.timeline_markers.new("mine", frame=5)
for _ in range(2):  # a second take of the name replaces the first
    bpy.ops.elocute.speak()
result["actions"] = sorted(action.name for action in bpy.data.actions)
result["found"] = [places(11 + frame) for frame in (0, 20, 45)]
result["marks"] = sorted([mark.frame, mark.name] for mark in scene.timeline_markers)
editor = scene.sequence_editor
sounds = getattr(editor, "strips", None) or editor.sequences
result["sounds"] = [[each.name, each.frame_start] for each in sounds]
scene.elocute.tolerance = 0.002
bpy.ops.elocute.clean()
result["cleaned"] = [places(11 + frame) for frame in (0, 20, 45)]
bpy.ops.elocute.bake()
scene.elocute.strip = True
bpy.ops.elocute.speak()
keys = scene.elocute.face.data.shape_keys
tracks = keys.animation_data.nla_tracks
result["strips"] = [strip.name for track in tracks for strip in track.strips]
scene.elocute.sound = sound + ".missing"
try:
    bpy.ops.elocute.speak()
except RuntimeError as error:
    result["error"] = str(error)
json.dump(result, open(target, "w"))
"""


@pytest.mark.skipif(not HAS_BPY, reason="needs Blender's module bpy")
def test_a_character_speaks_in_blender(speech_wav, tmp_path):
    hero, whole, told = tmp_path / "hero.glb", tmp_path / "whole.glb", tmp_path / "told.json"
    animate(speech_wav, fps=10, look="none", life=0).write(hero)
    made = run_here("animate", speech_wav, "--head", hero, "--fps", 30, "-o", whole)
    assert made.returncode == 0, made.stderr
    # The take alone, or Blender plays the first one too.
    document = gltf_document(whole.read_bytes(), "whole")
    record = dict(document.record)
    record["animations"] = record["animations"][-1:]
    whole.write_bytes(glb(record, bytes(document.binary or b"")))
    command = Path(sys.executable).with_name("elocute")
    words = [sys.executable, "-c", SPEAK, build(tmp_path), command, hero, whole, speech_wav, told]
    user = {"BLENDER_USER_RESOURCES": str(tmp_path / "user"), "HOME": str(tmp_path)}
    ended = subprocess.run(
        list(map(str, words)), capture_output=True, text=True, env={**environment(), **user}
    )
    assert ended.returncode == 0, ended.stderr[-2000:]
    found = json.loads(told.read_text(encoding="utf-8"))
    assert found["mapping"]["jawOpen"] in ("moved", "fitted")
    assert found["actions"] == ["L042", "L042 joints"]
    assert [5, "mine"] in found["marks"] and len(found["marks"]) > 20
    assert found["sounds"] == [[speech_wav.name, 11]]
    assert "L042" in found["strips"]
    assert "pick a sound" in found["error"]
    wanted, seen, cleaned = (np.array(found[name]) for name in ("wanted", "found", "cleaned"))
    assert np.abs(np.diff(wanted, axis=0)).max() > 0.002  # m
    assert np.abs(seen - wanted).max() < 2e-5
    assert np.abs(cleaned - wanted).max() < 1e-3


def environment() -> dict[str, str]:
    import os

    return dict(os.environ)
