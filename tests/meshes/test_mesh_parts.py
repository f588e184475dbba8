"""Meshes with materials: what is read of them, and what is refused before it costs anything."""

from __future__ import annotations

import json
import struct
import tracemalloc
from typing import Any

import numpy as np
import pytest
from PIL import Image

from elocute.errors import HeadError
from elocute.meshes.gltf_nodes import local_matrix
from elocute.meshes.parts import read_mesh_parts
from tests.meshes.test_meshes import large_picture
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


def test_the_colour_of_a_material_tints_its_picture(tmp_path):
    """As grey hair is dyed; a factor is linear."""
    picture = tmp_path / "hair.png"
    Image.new("RGB", (4, 4), (200, 100, 10)).save(picture)
    colour = {"baseColorFactor": [0.5, 1.0, 0.0, 1.0], "baseColorTexture": {"index": 0}}
    dyed = {"materials": [{"pbrMetallicRoughness": colour}]}
    (part,) = read(tmp_path / "head.glb", triangle(picture=picture.read_bytes(), changes=dyed))
    red = 200 * 0.5 ** (1 / 2.2)
    assert part.picture.getpixel((1, 1)) == (pytest.approx(red, abs=1), 100, 0)
    assert part.opacity == "opaque"


def test_a_clear_material_is_clear(tmp_path):
    """As the cornea before an iris, which nobody would see otherwise."""
    record = {"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.1]}, "alphaMode": "BLEND"}
    (part,) = read(tmp_path / "head.glb", triangle(changes={"materials": [record]}))
    assert part.opacity == "blend" and part.uv is not None and len(part.uv) == 3
    assert part.picture.getpixel((0, 0)) == (255, 255, 255, 26)
    record["alphaMode"] = "OPAQUE"
    (part,) = read(tmp_path / "head.glb", triangle(changes={"materials": [record]}))
    assert part.opacity == "opaque" and part.picture is None


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


def nothing_but_lengths(count: int, **attributes: int) -> bytes:
    """A file of accessors without bytes, which are zeros by the specification."""
    kinds = {"POSITION": (5126, "VEC3"), "JOINTS_0": (5121, "VEC4"), "WEIGHTS_0": (5126, "VEC4")}
    return glb(
        {
            "asset": {"version": "2.0"},
            "nodes": [{"mesh": 0} | ({"skin": 0} if "JOINTS_0" in attributes else {}), {}],
            "skins": [{"joints": [1]}],
            "meshes": [{"primitives": [{"attributes": attributes}]}],
            "accessors": [
                {"componentType": kinds[name][0], "type": kinds[name][1], "count": count}
                for name in attributes
            ],
        }
    )


@pytest.mark.parametrize(
    "data",
    [
        nothing_but_lengths(40_000_000, POSITION=0),
        nothing_but_lengths(7_000_000, POSITION=0),
        nothing_but_lengths(2_000_000, POSITION=0, JOINTS_0=1, WEIGHTS_0=2),
    ],
)
def test_what_a_file_only_says_takes_no_memory(tmp_path, data):
    tracemalloc.start()
    try:
        told = refused(tmp_path / "a.glb", data)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
    assert "more memory than its size allows" in told and "1 GB" in told


def test_a_skin_is_placed_once_for_all_its_parts(tmp_path, monkeypatch):
    """Each of 200 parts stands where its joint does, and no joint is placed for each of them."""
    placed = []
    monkeypatch.setattr(
        "elocute.meshes.gltf_nodes.local_matrix",
        lambda node: placed.append(node) or local_matrix(node),
    )
    joints, parts = 500, 200
    pieces = [POINTS.tobytes(), bytes(12), np.tile(np.array([1, 0, 0, 0], np.float32), 3).tobytes()]
    starts = np.cumsum([0, *map(len, pieces)]).tolist()
    attributes = {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2}
    record = {
        "asset": {"version": "2.0"},
        "nodes": [
            {"mesh": 0, "skin": 0},
            *({"translation": [0, 0, 1], "children": [n + 1]} for n in range(1, joints)),
            {"translation": [0, 0, 1]},
        ],
        "skins": [{"joints": list(range(1, joints + 1))[::-1]}],
        "meshes": [{"primitives": [{"attributes": attributes}] * parts}],
        "accessors": [
            {"bufferView": number, "componentType": kind, "type": width, "count": 3}
            for number, (kind, width) in enumerate([(5126, "VEC3"), (5121, "VEC4"), (5126, "VEC4")])
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(piece)}
            for start, piece in zip(starts, pieces, strict=False)
        ],
        "buffers": [{"byteLength": starts[-1]}],
    }
    path = tmp_path / "a.glb"
    path.write_bytes(glb(record, b"".join(pieces)))
    found = read_mesh_parts(path, max_bytes=10**6, error=HeadError)
    assert len(found) == parts
    assert np.allclose(found[-1].vertices, POINTS + np.array([0, 0, joints]))
    assert len(placed) == joints + 1
