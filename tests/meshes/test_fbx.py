"""FBX files: texts that cannot name places, and heads that Blender's own module wrote and reads."""

from __future__ import annotations

import importlib.util
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest

from elocute.adoption.characters.open_character import open_character
from elocute.errors import HeadError, MachineError
from elocute.meshes.fbx_gltf import MAGIC, read_fbx, without_places
from elocute.motion.curves import ARKIT_NAMES
from elocute.registration.scan_file import read_scan
from tests.support.commands import run_apart

HAS_BPY = importlib.util.find_spec("bpy") is not None
blender = pytest.mark.skipif(not HAS_BPY, reason="needs Blender's module bpy")


def text(words: bytes) -> bytes:
    return b"S" + struct.pack("<I", len(words)) + words


def record(name, properties, inside=(), *, at: int, wide: bool) -> bytes:
    """A record of a file's version, from the place where it stands."""
    header = struct.Struct("<QQQB" if wide else "<IIIB")
    body = name + b"".join(properties)
    start = at + header.size + len(body)
    for each in inside:
        more = record(*each[:2], *each[2:], at=start, wide=wide)
        body, start = body + more, start + len(more)
    if inside:
        body, start = body + bytes(header.size), start + header.size
    packed = sum(map(len, properties))
    return header.pack(start, len(properties), packed, len(name)) + body


def fbx(*tops, version=7400) -> bytes:
    wide = version >= 7500
    data = MAGIC + struct.pack("<I", version)
    for top in tops:
        data += record(*top, at=len(data), wide=wide)
    return data + bytes(25 if wide else 13) + b"footer"


NUMBERS = np.arange(5, dtype="<f8")
PACKED = zlib.compress(NUMBERS.tobytes())
VIDEO = (
    b"Video",
    [b"L" + struct.pack("<q", 7), text(b"tex\x00\x01Video")],
    [
        (b"Filename", [text(b"C:\\work\\skin.png")]),
        (b"RelativeFilename", [text(b"../../etc/skin.png")]),
        (b"Content", [b"R" + struct.pack("<I", 4) + b"a/b\\"]),
        (b"Drive", [text(b"D:secret.png")]),
    ],
)
ARRAYS = (
    b"Vertices",
    [
        b"d" + struct.pack("<III", 5, 0, 40) + NUMBERS.tobytes(),
        b"d" + struct.pack("<III", 5, 1, len(PACKED)) + PACKED,
    ],
)


@pytest.mark.parametrize("version", [7400, 7700])
def test_texts_that_name_places_name_none_afterwards(version):
    before = fbx(VIDEO, ARRAYS, (b"Name", [text(b"Head:jawOpen")]), version=version)
    after = without_places(before)
    assert len(after) == len(before)
    for word in (b"C__work_skin.png", b".._.._etc_skin.png", b"D_secret.png"):
        assert word in after
    # Numbers, pictures and names stay.
    assert after.count(NUMBERS.tobytes()) == 1 and PACKED in after
    assert b"a/b\\" in after and b"Head:jawOpen" in after and b"tex\x00\x01Video" in after


def damaged(how: str) -> bytes:
    whole = fbx(VIDEO, ARRAYS)
    if how == "cut":
        return whole[: len(whole) // 2]
    if how == "ascii":
        return b"; FBX 7.4.0 project file\nObjects: {\n}\n"
    if how == "end":
        return whole[:27] + struct.pack("<I", 10**9) + whole[31:]
    if how == "back":  # a record that ends before it begins
        return whole[:27] + struct.pack("<I", 5) + whole[31:]
    if how == "length":
        return whole.replace(
            text(b"D:secret.png"), b"S" + struct.pack("<I", 2**32 - 1) + b"D:secret.png"
        )
    return whole[:27] + bytes(np.random.default_rng(3).integers(0, 256, len(whole), np.uint8))


@pytest.mark.parametrize("how", ["cut", "ascii", "end", "back", "length", "noise"])
def test_a_damaged_file_is_told_in_one_line(tmp_path, how):
    path = tmp_path / "head.fbx"
    path.write_bytes(damaged(how))
    with pytest.raises(HeadError, match="no FBX that can be read"):
        read_fbx(path, error=HeadError)
    ended = run_apart("info", path)
    assert ended.returncode == 2 and len(ended.stderr.strip().splitlines()) == 1


@pytest.mark.skipif(HAS_BPY, reason="bpy is here")
def test_without_blender_a_sound_file_says_what_to_install(tmp_path):
    path = tmp_path / "head.fbx"
    path.write_bytes(fbx(VIDEO))
    with pytest.raises(MachineError, match="pip install bpy"):
        read_fbx(path, error=HeadError)


WRITE = """
import bpy, sys
target, names = sys.argv[1], sys.argv[2:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=0.12, location=(0, 0, 1.5))
head = bpy.context.object
head.name = head.data.name = "Face"
head.shape_key_add(name="Basis")
for number, name in enumerate(names):
    key = head.shape_key_add(name=name, from_mix=False)
    for point in list(key.data)[number :: len(names)]:
        point.co.z -= 0.01
picture = bpy.data.images.new("skin", 8, 8)
picture.filepath_raw, picture.file_format = target + ".png", "PNG"
picture.save()
material = bpy.data.materials.new("skin")
material.use_nodes = True
image = material.node_tree.nodes.new("ShaderNodeTexImage")
image.image = picture
shader = material.node_tree.nodes["Principled BSDF"]
material.node_tree.links.new(image.outputs["Color"], shader.inputs["Base Color"])
head.data.materials.append(material)
bpy.ops.export_scene.fbx(filepath=target, path_mode="COPY", embed_textures=True)
"""


@pytest.fixture(scope="module")
def hero(tmp_path_factory):
    """A ball with ARKit's shapes and a picture, as Blender's own writer of FBX makes it."""
    path = tmp_path_factory.mktemp("fbx") / "hero.fbx"
    command = [sys.executable, "-c", WRITE, str(path), *ARKIT_NAMES]
    subprocess.run(command, check=True, capture_output=True)
    return path


@blender
def test_a_characters_shapes_are_found(hero):
    opened = open_character(hero)
    assert {each.name for each in opened.character.controls} >= set(ARKIT_NAMES)
    assert opened.character.document.records("images")


@blender
def test_an_fbx_speaks(hero, speech_wav, tmp_path):
    spoken = tmp_path / "hero_speaks.glb"
    ended = run_apart("animate", speech_wav, "--head", hero, "-o", spoken)
    assert ended.returncode == 0, ended.stderr
    assert open_character(spoken).character.document.records("animations")


@blender
def test_an_fbx_is_a_mesh_in_metres(hero):
    scan = read_scan(hero)
    assert np.ptp(scan.points, axis=0) == pytest.approx([0.24] * 3, abs=0.01)
    assert scan.points[:, 1].mean() == pytest.approx(1.5, abs=0.01)  # Y is up
