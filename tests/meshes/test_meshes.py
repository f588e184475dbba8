"""Meshes and the files that they name."""

import os
import struct
import zlib

import pytest
from PIL import Image

from elocute.errors import ElocuteWarning, HeadError
from elocute.meshes.mesh_file import check_picture
from elocute.meshes.parts import read_mesh_parts

TRIANGLE = "v 0 0 0\nv 0 1 0\nv 1 0 0\nvt 0 0\nvt 0 1\nvt 1 0\nusemtl skin\nf 1/1 2/2 3/3\n"


@pytest.fixture
def mesh(tmp_path):
    """A triangle whose material names the picture `skin.png`."""
    (tmp_path / "face.obj").write_text("mtllib face.mtl\n" + TRIANGLE)
    (tmp_path / "face.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
    Image.new("RGB", (4, 4), (200, 10, 10)).save(tmp_path / "skin.png")
    return tmp_path / "face.obj"


def read(path):
    return read_mesh_parts(path, max_bytes=1_000_000, error=HeadError)


def refused(path):
    with pytest.raises(HeadError) as caught:
        read(path)
    message = str(caught.value)
    assert "\n" not in message and len(message) < 500
    return message


def large_picture(width, height):
    """A PNG of a few kilobytes that promises so many pixels."""
    rows = zlib.compress(bytes(1000), 9)
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)), (b"IDAT", rows)]
    told = [
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in [*chunks, (b"IEND", b"")]
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(told)


def test_colours_come_from_the_picture_in_the_same_folder(mesh):
    (part,) = read(mesh)
    assert part.vertices.tolist() == [[0, 0, 0], [0, 1, 0], [1, 0, 0]]
    assert part.triangles.tolist() == [[0, 1, 2]] and part.name == "skin"
    assert part.picture.getcolors() == [(16, (200, 10, 10))] and part.coloured
    assert part.uv is not None and part.uv.tolist() == [[0, 0], [0, 1], [1, 0]]


def test_a_picture_that_unpacks_to_gigabytes_is_refused(mesh):
    (mesh.parent / "skin.png").write_bytes(large_picture(40_000, 40_000))
    assert "a picture of far too many pixels" in refused(mesh)
    (mesh.parent / "skin.png").write_bytes(large_picture(9000, 8000))
    assert "a picture of 9000 × 8000 pixels" in refused(mesh)
    assert check_picture(large_picture(1000, 900), "x") == (1000, 900)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
@pytest.mark.parametrize("name", ["face.mtl", "skin.png", "face.obj"])
def test_a_pipe_is_never_waited_for(mesh, name):
    (mesh.parent / name).unlink()
    os.mkfifo(mesh.parent / name)
    assert "no regular file" in refused(mesh)


def test_files_elsewhere_are_not_looked_for(mesh):
    inner = mesh.parent / "inner"
    inner.mkdir()
    for place in ("..", mesh.parent):
        (inner / "face.obj").write_text(f"mtllib {place}/face.mtl\n{TRIANGLE}")
        with pytest.warns(ElocuteWarning, match=r"material file 'face\.mtl' is not there"):
            (part,) = read(inner / "face.obj")
        assert part.picture is None and not part.coloured


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("v 0 0 0\n", "1 points without triangles"),
        ("v 0 0 0\nf 1 2 3\n", "faces that point past 1 vertices"),
        ("v 0 0\nf 1 1 1\n", "line 1, 'v 0 0'"),
        ("v 0 0 0\nf 0 1 1\n", "line 2, 'f 0 1 1'"),
        ("v 0 0 0\nf 1 1 -2\n", "line 2, 'f 1 1 -2'"),
        ("hello", "no vertices"),
        ("", "no vertices"),
    ],
)
def test_what_is_no_mesh(tmp_path, text, found):
    (tmp_path / "bad.obj").write_text(text)
    assert found in refused(tmp_path / "bad.obj")


@pytest.mark.parametrize("encoding", ["utf-8", "latin-1"])
def test_texts_of_other_encodings(mesh, encoding):
    """A material's name is the same in both files, and a picture's is that of the file."""
    for file in (mesh, mesh.with_suffix(".mtl")):
        text = file.read_text().replace("skin", "Mädchen")
        file.write_bytes(("# Köpfe\n" + text).encode(encoding))
    (mesh.parent / "skin.png").rename(mesh.parent / "mädchen.PNG")
    (part,) = read(mesh)
    assert part.name == "Mädchen" and part.picture.getpixel((0, 0)) == (200, 10, 10)


def test_faces_far_beyond_the_vertices_are_refused(tmp_path):
    (tmp_path / "face.obj").write_text(TRIANGLE.replace("3/3", "400000000/400000000"))
    assert "faces that point past 3 vertices" in refused(tmp_path / "face.obj")
