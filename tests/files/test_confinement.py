"""A mesh or a network cannot make the libraries that read it open files elsewhere, or addresses.

Python's own audit events tell what was opened. Run with the lowest and the newest Pillow and
onnxruntime by scripts/matrix.py.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from elocute.encoders.onnx_graph import step, write_graph
from tests.support.commands import SAME_ELOCUTE, run_python

WATCHED = """
import json, os, sys
import numpy, onnxruntime, PIL.Image, PIL.PngImagePlugin, elocute
from pathlib import Path
from elocute.registration.scan_file import read_scan
from elocute.errors import InputError
from elocute.files.onnx_session import open_session
from elocute.files.reading import FileKind
from elocute.head.mesh import read_mesh
readers = {
    "scan": read_scan,
    "mesh": read_mesh,
    "network": lambda path: open_session(path, FileKind("a network", 10**6)),
}
opened = []
def watch(event, arguments):
    if event == "open" and isinstance(arguments[0], (str, bytes, os.PathLike)):
        opened.append(os.path.realpath(os.fsdecode(arguments[0])))
    elif event.startswith(("socket.", "urllib.", "subprocess.")):
        opened.append(event)
sys.addaudithook(watch)
try:
    readers[sys.argv[1]](Path(sys.argv[2]))
except InputError:
    pass
print(json.dumps(opened))
"""


def opened(reader: str, path: Path) -> set[str]:
    """Real paths below the test's folder that were opened, and events of networks and programs."""
    result = run_python("-c", WATCHED, reader, path, check=True, env=SAME_ELOCUTE)
    room = str(path.parent.parent.resolve())
    found = json.loads(result.stdout)
    return {name for name in found if name.startswith(room) or ("." in name and "/" not in name)}


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A folder for the scan; what it must not reach lies beside that folder."""
    (tmp_path / "scan").mkdir()
    Image.new("RGB", (4, 4), (200, 10, 10)).save(tmp_path / "secret.png")
    (tmp_path / "secret.mtl").write_text("newmtl m\nmap_Kd secret.png\n")
    (tmp_path / "secret.bin").write_bytes(bytes(36))
    return tmp_path / "scan"


@pytest.mark.parametrize("reader", ["scan", "mesh"])
@pytest.mark.parametrize("way", ["above", "absolute", "address"])
@pytest.mark.parametrize("named", ["material", "texture"])
def test_an_obj_reaches_nothing_outside_its_folder(room: Path, reader: str, way: str, named: str):
    secret = "secret.mtl" if named == "material" else "secret.png"
    place = {
        "above": f"../{secret}",
        "absolute": str(room.parent / secret),
        "address": f"http://127.0.0.1:9/{secret}",
    }[way]
    material = place if named == "material" else "a.mtl"
    (room / "a.mtl").write_text(f"newmtl m\nmap_Kd {place}\n")
    (room / "a.obj").write_text(
        f"mtllib {material}\nv 0 0 0\nv .2 0 0\nv 0 .2 0\nv .2 .2 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
        "vt 1 1\nusemtl m\nf 1/1 2/2 3/3\nf 2/2 4/4 3/3\n"
    )
    allowed = {str((room / name).resolve()) for name in ("a.obj", "a.mtl")}
    assert opened(reader, room / "a.obj") <= allowed


def test_what_is_opened_is_seen(room: Path):
    """The texture beside a scan is read: this way of looking misses nothing."""
    Image.new("RGB", (4, 4)).save(room / "skin.png")
    (room / "a.mtl").write_text("newmtl m\nmap_Kd skin.png\n")
    (room / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv .2 0 0\nv 0 .2 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
        "usemtl m\nf 1/1 2/2 3/3\n"
    )
    names = ("a.obj", "a.mtl", "skin.png")
    assert opened("scan", room / "a.obj") == {str((room / name).resolve()) for name in names}


@pytest.mark.parametrize("reader", ["scan", "mesh"])
def test_a_ply_reaches_nothing_but_itself(room: Path, reader: str):
    (room / "a.ply").write_text(
        "ply\nformat ascii 1.0\ncomment TextureFile ../secret.png\nelement vertex 3\n"
        "property float x\nproperty float y\nproperty float z\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0\n.2 0 0\n0 .2 0\n3 0 1 2\n"
    )
    assert opened(reader, room / "a.ply") <= {str((room / "a.ply").resolve())}


def test_other_formats_are_refused_before_they_are_opened(room: Path):
    """glTF and its kin name buffers and pictures in other files."""
    (room / "a.gltf").write_text(
        '{"asset": {"version": "2.0"}, "buffers": [{"uri": "../secret.bin"}]}'
    )
    assert opened("mesh", room / "a.gltf") == set()
    assert opened("scan", room / "a.gltf") == {str(room / "a.gltf")}  # and nothing that it names


def test_a_network_reaches_nothing_but_itself(room: Path):
    weights = {"w": np.eye(30, dtype=np.float32)}  # kept in a file called `beside`
    graph = write_graph([step("MatMul", "x w", "y")], weights, {"x": 30}, {"y": 30})
    (room / "a.onnx").write_bytes(graph)
    (room / "beside").write_bytes(weights["w"].tobytes())
    assert opened("network", room / "a.onnx") <= {str((room / "a.onnx").resolve())}
