"""Takes of a character: many in one file, and a take without the character."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from elocute.adoption.characters.open_character import open_character
from elocute.errors import OutputError
from elocute.export.character_weights import character_motion
from elocute.export.gltf_character import actions_of
from elocute.export.options import GlbOptions
from elocute.export.registry import write
from elocute.meshes.gltf_arrays import GltfArrays
from elocute.meshes.gltf_document import read_gltf
from elocute.motion.motion import Motion
from elocute.motion.store import load_motion
from tests.support.gltf_files import arkit, glb
from tests.support.three_js import node_program, validator_issues

FAST = ("--fps", "10")


@pytest.fixture(scope="module")
def hero(tmp_path_factory) -> Path:
    """A character with ARKit's shapes and a walk of its own."""
    given = arkit()
    given["accessors"] += [
        {"componentType": 5126, "count": 1, "type": "SCALAR", "min": [0], "max": [0]},
        {"componentType": 5126, "count": 1, "type": "VEC3"},
    ]
    walk = {"input": 2, "output": 3}
    moved = {"sampler": 0, "target": {"node": 0, "path": "translation"}}
    given["animations"] = [{"name": "walk", "samplers": [walk], "channels": [moved]}]
    path = tmp_path_factory.mktemp("hero") / "hero.glb"
    path.write_bytes(glb(given))
    return path


@pytest.fixture
def lines(tmp_path, speech_wav) -> Path:
    """A folder with two recordings."""
    folder = tmp_path / "lines"
    folder.mkdir()
    for name in ("L01", "L02"):
        shutil.copy(speech_wav, folder / f"{name}{speech_wav.suffix}")
    return folder


def weights(path: Path, name: str) -> np.ndarray:
    """(frame, target) of the animation of a name."""
    document = read_gltf(path)
    animation = document.records("animations")[actions_of(document).index(name)]
    arrays = GltfArrays(document)
    rows = arrays.values(animation["samplers"][0]["output"])
    frames = len(arrays.values(animation["samplers"][0]["input"]))
    return rows.reshape(frames, -1)


def test_takes_stand_side_by_side_in_one_file(cli, run, hero, lines, speech_wav, tmp_path, need):
    into = tmp_path / "hero_all.glb"
    first = cli("animate", lines / f"L01{speech_wav.suffix}", *FAST, "--head", hero, "--into", into)
    assert first.stdout.strip() == str(into)
    before = weights(into, "L01")
    cli(
        *("animate", lines / f"L02{speech_wav.suffix}", *FAST, "--head", hero, "--into", into),
        *("--action", "second line", "--style", "broad"),
    )
    assert actions_of(read_gltf(into)) == ["walk", "L01", "second line"]
    assert np.array_equal(weights(into, "L01"), before)
    assert np.abs(weights(into, "second line") - before).max() > 0.01
    assert not into.with_suffix(".wav").exists()
    data = into.read_bytes()
    again = run("animate", lines / f"L01{speech_wav.suffix}", *FAST, "--head", hero, "--into", into)
    assert again.returncode == 2 and into.read_bytes() == data
    assert "an animation 'L01' already" in again.stderr and "--replace-action" in again.stderr
    cli(
        *("animate", lines / f"L01{speech_wav.suffix}", *FAST, "--head", hero, "--into", into),
        *("--style", "broad", "--replace-action"),
    )
    assert actions_of(read_gltf(into)) == ["walk", "L01", "second line"]
    assert np.abs(weights(into, "L01") - before).max() > 0.01
    issues = validator_issues(node_program(need), into)
    assert [each for each in issues if each[0] <= 1 and "ZERO" not in each[1]] == []


def test_a_folder_and_a_table_name_their_takes(cli, run, hero, lines, speech_wav, tmp_path):
    into = tmp_path / "all.glb"
    told = run("animate", lines, *FAST, "--head", hero, "--into", into)
    assert told.returncode == 0, told.stderr
    assert actions_of(read_gltf(into)) == ["walk", "L01", "L02"]
    told = run("animate", lines, *FAST, "--head", hero, "--into", into)
    assert told.returncode == 0 and "2 of 2 there already" in told.stderr
    table = lines / "lines.csv"
    suffix = speech_wav.suffix
    table.write_text(
        f"id,audio,action,into\nA1,L01{suffix},,\nA2,L02{suffix},Second,\nB1,L01{suffix},,b.glb\n"
        f"C1,L01{suffix},,../c.glb\n",
        encoding="utf-8",
    )
    out = tmp_path / "out"
    told = run("animate", "--table", table, *FAST, "--head", hero, "--into", out / "a.glb")
    assert told.returncode == 1 and "C1: row 5: into: '../c.glb'" in told.stderr
    assert actions_of(read_gltf(out / "a.glb")) == ["walk", "A1", "Second"]
    assert actions_of(read_gltf(out / "b.glb")) == ["walk", "B1"]
    data = (out / "a.glb").read_bytes()
    told = run("animate", "--table", table, *FAST, "--head", hero, "--into", out / "a.glb")
    assert "3 of 4 there already" in told.stderr and (out / "a.glb").read_bytes() == data


def test_a_column_names_the_take_of_a_file_of_its_own(cli, lines, speech_wav, tmp_path):
    table = lines / "lines.csv"
    table.write_text(f"id,audio,action\nA1,L01{speech_wav.suffix},Greeting\n", encoding="utf-8")
    cli(
        "animate",
        "--table",
        table,
        *FAST,
        "--look",
        "none",
        "-o",
        tmp_path / "out",
        "--format",
        "glb",
    )
    assert actions_of(read_gltf(tmp_path / "out" / "A1.glb")) == ["Greeting"]


def test_what_cannot_be_one_file_is_told(refused, hero, lines, tmp_path, speech_wav):
    sound, into = lines / f"L01{speech_wav.suffix}", tmp_path / "all.glb"
    refused("animate", sound, says="--output: missing; allowed: a file or a folder, or --into")
    refused(
        "animate", sound, "--into", into, says="the head builtin; allowed: --head with a character"
    )
    refused(
        "animate", sound, *FAST, "--head", hero, "--into", tmp_path / "a.csv", says="suffix '.csv'"
    )
    refused("animate", sound, *FAST, "--head", hero, "--into", hero, says="hero.glb")
    refused(
        *("animate", lines, *FAST, "--head", hero, "--into", into, "--action", "one"),
        says="--action: one name for 2 recordings",
    )
    refused(
        *("animate", lines, *FAST, "--head", hero, "--into", into, "--jobs", "2"),
        says="--jobs: --into; allowed",
    )
    assert not into.exists()


def test_a_file_of_another_character_is_left_alone(motion_of, hero, tmp_path):
    other = arkit()
    other["nodes"][0]["name"] = "somebody else"
    into = tmp_path / "all.glb"
    into.write_bytes(glb(other))
    with pytest.raises(OutputError, match=r"another character than hero\.glb.*'somebody else'"):
        write(motion_of(hero), into, add=True)
    into.write_bytes(b"glTF")
    with pytest.raises(OutputError, match="ends early"):
        write(motion_of(hero), into, add=True)
    assert into.read_bytes() == b"glTF"


@pytest.fixture
def motion_of(speech_wav):
    from elocute.animation import animate

    return lambda head: animate(speech_wav, fps=30, head=head, look="none").motion


def test_a_take_without_the_character(cli, hero, speech_wav, tmp_path, motion_of, need):
    alone, stored = tmp_path / "take.glb", tmp_path / "take.npz"
    cli(
        *("animate", speech_wav, "--head", hero, "--fps", "60", "--action", "L01"),
        *("--animation-only", "-o", alone, "-o", stored),
    )
    assert stored.stat().st_size <= 100_000
    motion = load_motion(stored)
    assert motion.head.character is None
    character = open_character(hero).character
    moved = character_motion(motion, character)
    assert weights(alone, "L01") == pytest.approx(moved.weights[0], abs=1e-6)
    document = read_gltf(alone)
    own = read_gltf(hero)
    assert [each["name"] for each in document.records("nodes")] == [
        each["name"] for each in own.records("nodes")
    ]
    names = own.records("meshes")[0]["extras"]["targetNames"]
    assert document.records("meshes")[0]["extras"]["targetNames"] == names
    assert actions_of(document) == ["L01"] and not document.records("images")
    errors = [each for each in validator_issues(node_program(need), alone) if each[0] == 0]
    assert errors == []
    # The stored take plays on the character again.
    cli("render", stored, "--head", hero, "--into", tmp_path / "back.glb", "--action", "L01")
    assert np.array_equal(weights(tmp_path / "back.glb", "L01"), weights(alone, "L01"))


def test_the_built_in_head_s_take_without_its_mesh(motion, tmp_path):
    path = tmp_path / "take.glb"
    write(motion, path, animation_only=True)
    document = read_gltf(path)
    assert path.stat().st_size < 100_000 + motion.weights.nbytes + 5 * 16 * motion.frame_count
    assert [each["name"] for each in document.records("nodes")] == [
        *("face", "Neck", "Head", "Jaw", "LeftEye", "RightEye")
    ]
    names = document.records("meshes")[0]["extras"]["targetNames"]
    jaw = weights(path, "speech")[:, names.index("jawOpen")]
    assert jaw == pytest.approx(motion.weights[:, motion.names.index("jawOpen")], abs=1e-6)


@pytest.fixture
def motion(speech_wav) -> Motion:
    from elocute.animation import animate

    return animate(speech_wav, fps=30, look="none").motion


def test_takes_of_the_built_in_head_need_its_file(motion, tmp_path):
    with pytest.raises(OutputError, match="`add` with elocute; allowed: a character of your own"):
        write(motion, tmp_path / "all.glb", add=True)
    with pytest.raises(OutputError, match="`add`: `animation_only` too"):
        GlbOptions(add=True, animation_only=True)


def test_a_head_with_shapes_of_its_own_stays_with_its_take(motion, tmp_path):
    from dataclasses import replace

    names = ("other", *motion.names[1:])
    other = Motion(replace(motion.head, expression_names=names), motion.weights, 30)
    with pytest.raises(OutputError, match="which has shapes of its own"):
        write(other, tmp_path / "take.npz", animation_only=True)
