"""Meshes packed by Draco: read as they were, and refused in one line where they are forged."""

from __future__ import annotations

import numpy as np
import pytest

from elocute.errors import HeadError
from elocute.meshes.parts import read_mesh_parts
from tests.support.gltf_files import glb

DracoPy = pytest.importorskip("DracoPy", reason="needs the extra draco")
SIDE = 12


def grid():
    x, y = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    points = np.stack([x, y, np.sin(x + y)], 2).reshape(-1, 3).astype(np.float32)
    first = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)[:-1, :-1].ravel()
    faces = np.concatenate(
        [
            np.stack([first, first + 1, first + SIDE], 1),
            np.stack([first + 1, first + SIDE + 1, first + SIDE], 1),
        ]
    )
    return points, faces.astype(np.uint32)


def packed(path, stream: bytes, vertices=SIDE * SIDE, corners=6 * (SIDE - 1) ** 2):
    name = "KHR_draco_mesh_compression"
    number = {"bufferView": 0, "attributes": {"POSITION": 0}}
    record = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [name],
        "extensionsRequired": [name],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {"attributes": {"POSITION": 0}, "indices": 1, "extensions": {name: number}}
                ]
            }
        ],
        "accessors": [
            {"componentType": 5126, "count": vertices, "type": "VEC3"}
            | {"min": [0, 0, -1], "max": [SIDE, SIDE, 1]},
            {"componentType": 5125, "count": corners, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": len(stream)}],
        "buffers": [{"byteLength": len(stream)}],
    }
    path.write_bytes(glb(record, stream))
    return path


def stream() -> bytes:
    return DracoPy.encode(*grid(), quantization_bits=16)


def test_packed_vertices_are_read(tmp_path):
    (part,) = read_mesh_parts(
        packed(tmp_path / "a.glb", stream()), max_bytes=10**6, error=HeadError
    )
    points, faces = grid()
    assert len(part.triangles) == len(faces)
    far = np.linalg.norm(part.vertices[:, None] - points, axis=2)
    assert far.min(0).max() < 1e-3 and far.min(1).max() < 1e-3


@pytest.mark.parametrize("what", ["cut", "noise", "count", "huge"])
def test_forged_streams_are_refused(tmp_path, what):
    data, counts = stream(), {}
    if what == "cut":
        data = data[: len(data) // 2]
    elif what == "noise":
        data = data[:11] + np.random.default_rng(1).bytes(len(data) - 11)
    else:
        counts = {"vertices": 7 if what == "count" else 10**9}
    path = packed(tmp_path / "a.glb", data, **counts)
    with pytest.raises(HeadError) as caught:
        read_mesh_parts(path, max_bytes=10**6, error=HeadError)
    assert "\n" not in str(caught.value)
