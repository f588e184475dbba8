"""Meshes with materials: what is read of them, and what is refused before it costs anything."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import pytest
from PIL import Image

from elocute.errors import HeadError
from elocute.files.mesh_parts import read_mesh_parts
from tests.files.test_meshes import large_picture
from tests.support.gltf_files import glb

POINTS = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0]], np.float32)
UV = np.array([[0, 0], [0, 1], [1, 0]], np.float32)
CORNERS = np.array([0, 1, 2], np.uint16)


def triangle(points=POINTS, picture: bytes = b"", changes: dict[str, Any] | None = None) -> bytes:
    """A .glb of one triangle, with a picture where one is given; records may be changed."""
    pieces = [points.tobytes(), UV.tobytes(), CORNERS.tobytes() + b"\0\0", picture]
    starts = np.cumsum([0, *map(len, pieces)]).tolist()
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": len(piece)}
        for start, piece in zip(starts, pieces, strict=False)
        if piece
    ]
    record: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "head", "translation": [0, 0, 2]}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0, "TEXCOORD_0": 1},
                        "indices": 2,
                        "material": 0,
                    }
                ]
            }
        ],
        "materials": [{"name": "skin", "pbrMetallicRoughness": {"metallicFactor": 0}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}
            | {"min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": views,
        "buffers": [{"byteLength": starts[-1]}],
    }
    if picture:
        record["images"] = [{"bufferView": 3, "mimeType": "image/png"}]
        record["textures"] = [{"source": 0}]
        material = record["materials"][0]["pbrMetallicRoughness"]
        material["baseColorTexture"] = {"index": 0}
    return glb(record | (changes or {}), b"".join(pieces))


def read(path, data: bytes):
    path.write_bytes(data)
    return read_mesh_parts(path, max_bytes=10_000_000, error=HeadError)


def refused(path, data: bytes) -> str:
    with pytest.raises(HeadError) as caught:
        read(path, data)
    message = str(caught.value)
    assert "\n" not in message and path.name in message
    return message


def test_a_part_has_its_place_its_picture_and_its_name(tmp_path):
    picture = tmp_path / "skin.png"
    Image.new("RGB", (4, 4), (200, 10, 10)).save(picture)
    (part,) = read(tmp_path / "head.glb", triangle(picture=picture.read_bytes()))
    assert part.vertices.tolist() == (POINTS + [0, 0, 2]).tolist()  # noqa: RUF005
    assert part.picture.getpixel((1, 1)) == (200, 10, 10) and part.opacity == "opaque"
    assert part.uv is not None and part.name == "head" and part.coloured


def test_what_does_not_fit_is_refused(tmp_path):
    file = tmp_path / "head.glb"
    nan = POINTS.copy()
    nan[1, 1] = np.nan
    assert "finite" in refused(file, triangle(nan))
    far = {"accessors": [{"componentType": 5126, "count": 3_000_000_000, "type": "VEC3"}]}
    assert "accessor" in refused(file, triangle(changes=far))
    elsewhere = {"buffers": [{"byteLength": 9, "uri": "../secret.bin"}]}
    assert "other" in refused(file, triangle(changes=elsewhere))
    assert refused(file, triangle(changes={"meshes": [], "nodes": [{"name": "nothing"}]}))
    assert refused(file, triangle()[:80])


def test_a_picture_that_unpacks_to_gigabytes_is_refused(tmp_path):
    bomb = large_picture(30_000, 30_000)
    assert refused(tmp_path / "head.glb", triangle(picture=bomb))


def test_a_mesh_of_another_kind_is_refused(tmp_path):
    assert "mesh" in refused(tmp_path / "head.stl", b"solid nothing\nendsolid\n")
    assert "mesh" in refused(tmp_path / "head.stl", struct.pack("<80sI", b"", 4_000_000_000))
    assert json.dumps(refused(tmp_path / "head.ply", b"ply\nformat ascii 1.0\nend_header\n"))
