"""Meshes and the files that they name."""

import os
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from elocute.errors import HeadError
from elocute.files.meshes import check_picture, read_mesh_file
from tests.support.commands import run_python

TRIANGLE = "v 0 0 0\nv 0 1 0\nv 1 0 0\nvt 0 0\nvt 0 1\nvt 1 0\nusemtl skin\nf 1/1 2/2 3/3\n"


@pytest.fixture
def mesh(tmp_path):
    """A triangle whose material names the picture `skin.png`."""
    (tmp_path / "face.obj").write_text("mtllib face.mtl\n" + TRIANGLE)
    (tmp_path / "face.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
    Image.new("RGB", (4, 4), (200, 10, 10)).save(tmp_path / "skin.png")
    return tmp_path / "face.obj"


def read(path):
    return read_mesh_file(path, max_bytes=1_000_000, error=HeadError, coloured=True)


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
    parts = read(mesh)
    assert parts.vertices.tolist() == [[0, 0, 0], [0, 1, 0], [1, 0, 0]]
    assert parts.triangles.tolist() == [[0, 1, 2]]
    assert parts.colors is not None and parts.colors.tolist() == [[200, 10, 10]] * 3


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
    (inner / "face.obj").write_text(f"mtllib ../face.mtl\n{TRIANGLE}")
    assert [200, 10, 10] not in np.asarray(read(inner / "face.obj").colors).tolist()
    (inner / "face.obj").write_text(f"mtllib {mesh.parent}/face.mtl\n{TRIANGLE}")
    assert [200, 10, 10] not in np.asarray(read(inner / "face.obj").colors).tolist()


def test_nothing_is_printed_of_a_picture_that_is_not_there(tmp_path):
    (tmp_path / "face.ply").write_text(
        "ply\nformat ascii 1.0\ncomment TextureFile /etc/hostname\nelement vertex 3\n"
        "property float x\nproperty float y\nproperty float z\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    code = (
        "from elocute.files.meshes import read_mesh_file; from elocute.errors import HeadError; "
        f"read_mesh_file({str(tmp_path / 'face.ply')!r}, max_bytes=9999, error=HeadError, "
        "coloured=True)"
    )
    done = run_python("-c", code, check=True)
    assert (done.stdout, done.stderr) == ("", "")


def test_materials_that_copy_all_vertices_each_are_refused(tmp_path):
    lines = ["v 0 0 0"] * 20_000 + [f"usemtl m{n}\nf 1 2 3" for n in range(20_000)]
    (tmp_path / "many.obj").write_text("\n".join(lines))
    assert "20000 materials on 20000 vertices" in refused(tmp_path / "many.obj")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("v 0 0 0\n", "0 triangles"),
        ("v 0 0 0\nf 1 2 3\n", "no mesh"),
        ("v 0 0\nf 1 1 1\n", "no mesh"),
        ("hello", "0 vertices"),
        ("", "0 vertices"),
    ],
)
def test_what_is_no_mesh(tmp_path, text, found):
    (tmp_path / "bad.obj").write_text(text)
    assert found in refused(tmp_path / "bad.obj")


def test_texts_of_other_encodings(tmp_path):
    (tmp_path / "latin.obj").write_bytes("# Köpfe\n".encode("latin-1") + TRIANGLE.encode())
    assert len(np.asarray(read(tmp_path / "latin.obj").vertices)) == 3


def test_faces_far_beyond_the_vertices_are_refused(tmp_path):
    """A list as long as the largest number would be made before anything is compared."""
    (tmp_path / "face.obj").write_text(TRIANGLE.replace("3/3", "400000000/400000000"))
    assert "faces that point past 6 vertices" in refused(tmp_path / "face.obj")
