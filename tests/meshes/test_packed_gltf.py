"""glTF as other programs pack it: meshopt in both forms, quantized vertices, turned pictures.

The judges are meshoptimizer, whose encoder and decoder the streams come from and are compared with,
and gltfpack, which packs whole files.
"""

from __future__ import annotations

import base64
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scipy.spatial import KDTree

from elocute.animation import animate
from elocute.errors import HeadError
from elocute.meshes import meshopt
from elocute.meshes.parts import read_mesh_parts
from tests.meshes.test_mesh_parts import triangle
from tests.support.stranger import write_stranger
from tests.support.three_js import MODULES, node_program

ENCODE = """
import {MeshoptEncoder as E, MeshoptDecoder as D} from "MODULE";
import fs from "fs";
await E.ready; await D.ready;
const text = bytes => Buffer.from(bytes).toString("base64");
console.log(JSON.stringify(JSON.parse(fs.readFileSync(0)).map(j => {
  const given = Uint8Array.from(Buffer.from(j.data, "base64"));
  const packed = j.mode == "ATTRIBUTES"
    ? E.encodeVertexBufferLevel(given, j.count, j.stride, j.level, j.version)
    : E.encodeGltfBuffer(given, j.count, j.stride, j.mode);
  const back = new Uint8Array(j.count * j.stride);
  D.decodeGltfBuffer(back, j.count, j.stride, packed, j.mode, j.filter);
  return [text(packed), text(back)];
})));
"""
STEPS = {"OCTAHEDRAL": "i", "QUATERNION": "i", "COLOR": "u"}
"""Filters whose results may differ by a step, and the kind of number that they make."""


@pytest.fixture(scope="module")
def node(need) -> str:
    program = node_program(need)
    need((MODULES / "gltfpack").is_dir(), "web/node_modules/gltfpack (npm ci)")
    return program


def job(values: np.ndarray, mode="ATTRIBUTES", filter="NONE", **more: Any) -> dict[str, Any]:
    values = np.ascontiguousarray(values)
    return {
        "data": base64.b64encode(values.tobytes()).decode(),
        "count": len(values),
        "stride": values[0].nbytes,
        "mode": mode,
        "filter": filter,
    } | more


def attribute_jobs(version: int, level: int) -> list[dict[str, Any]]:
    draw = np.random.default_rng(level)
    more: dict[str, Any] = {"version": version, "level": level}
    time = np.linspace(0, 9, 5003)
    wave = np.stack([1000 * np.sin(time), 1000 * np.cos(time), 30 * time, 0 * time], 1)
    octahedral = draw.integers(-60, 60, (900, 4))
    octahedral[:, 2] = 127
    quaternion = draw.integers(-2000, 2000, (900, 4))
    quaternion[:, 3] = 2044 + draw.integers(0, 4, 900)
    exponents, whole = draw.integers(-20, 20, (900, 3)), draw.integers(-(2**20), 2**20, (900, 3))
    color = draw.integers(-20, 20, (900, 4))
    color[:, 0] += 90
    color[:, 3] = 128 + draw.integers(0, 127, 900)
    return [
        job(wave.astype("<i2"), **more),
        job(wave.astype("<f4"), **more),
        job(draw.integers(0, 256, (333, 20), dtype=np.uint8), **more),
        job(draw.integers(0, 256, (17, 256), dtype=np.uint8), **more),
        job(draw.integers(0, 256, (1, 4), dtype=np.uint8), **more),
        job(octahedral.astype("i1"), filter="OCTAHEDRAL", **more),
        job((200 * octahedral).astype("<i2"), filter="OCTAHEDRAL", **more),
        job(quaternion.astype("<i2"), filter="QUATERNION", **more),
        job((exponents << 24 | whole & 0xFFFFFF).astype("<i4"), filter="EXPONENTIAL", **more),
        job(color.astype(np.uint8), filter="COLOR", **more),
    ]


def index_jobs() -> list[dict[str, Any]]:
    draw, side = np.random.default_rng(0), 60
    grid = np.arange(side * side).reshape(side, side)
    corners = [grid[:-1, :-1], grid[1:, :-1], grid[:-1, 1:], grid[1:, 1:]]
    a, b, c, d = (corner.ravel() for corner in corners)
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    return [
        job(faces.astype("<u4").ravel(), "TRIANGLES"),
        job(faces.astype("<u2").ravel(), "TRIANGLES"),
        job(draw.permutation(faces).astype("<u4").ravel(), "TRIANGLES"),
        job(draw.integers(0, 99999, 3000).astype("<u4"), "TRIANGLES"),
        job(draw.integers(0, 99999, 3000).astype("<u4"), "INDICES"),
        job(faces.astype("<u2").ravel(), "INDICES"),
    ]


def test_streams_are_unpacked_as_their_own_library_does(node):
    jobs = [each for v in (0, 1) for level in (0, 2, 3) for each in attribute_jobs(v, level)]
    jobs += index_jobs()
    code = ENCODE.replace("MODULE", str(MODULES / "meshoptimizer" / "index.js"))
    done = subprocess.run(
        [node, "--input-type=module", "-e", code],
        input=json.dumps(jobs),
        capture_output=True,
        text=True,
        check=True,
    )
    for each, (packed, back) in zip(jobs, json.loads(done.stdout), strict=True):
        told = {name: each[name] for name in ("count", "stride", "mode", "filter")}
        found = meshopt.unpacked(base64.b64decode(packed), **told)
        theirs = np.frombuffer(base64.b64decode(back), np.uint8).reshape(found.shape)
        kind = STEPS.get(each["filter"])
        if kind is None:
            assert (found == theirs).all(), told
        else:
            wide = f"<{kind}{each['stride'] // 4}"
            off = found.view(wide).astype(int) - theirs.copy().view(wide)
            assert np.abs(off).max() <= 1, told


def gltfpack(node: str, given: Path, *options: str) -> Path:
    made = given.with_name(f"{given.stem}{''.join(options)}.glb")
    words = [node, MODULES / "gltfpack" / "cli.js", "-i", given, "-o", made, *options]
    subprocess.run(words, check=True, capture_output=True)
    return made


def parts_of(path: Path):
    return read_mesh_parts(path, max_bytes=100_000_000, error=HeadError)


@pytest.fixture(scope="module")
def dressed(tmp_path_factory) -> Path:
    """A head in centimetres with a picture whose colour tells the place, and white teeth."""
    file = tmp_path_factory.mktemp("packed") / "head.glb"
    write_stranger(file)
    return file


def corners_of(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """All corners of triangles (corner, 3), and what colours them (corner, 3)."""
    points, colors = [], []
    for part in parts_of(path):
        corners = part.triangles.ravel()
        points.append(part.vertices[corners])
        colors.append(part.colors[corners])
        if part.picture is not None:
            assert part.uv is not None
            width, height = part.picture.size
            at = part.uv[corners] % 1 * [width, -height] + [0, height]
            x, y = np.clip(at.astype(int), 0, [width - 1, height - 1]).T
            colors[-1] = np.asarray(part.picture)[y, x, :3]
    return np.concatenate(points), np.concatenate(colors)


@pytest.mark.parametrize(
    "options",
    [("-noq",), (), ("-c",), ("-cc", "-ce", "khr"), ("-cz", "-ce", "khr"), ("-c", "-vpn", "-vi")],
    ids=" ".join,
)
def test_files_of_gltfpack_are_the_files_that_it_packed(node, dressed, options):
    points, colors = corners_of(dressed)
    packed_points, packed_colors = corners_of(gltfpack(node, dressed, *options))
    size = np.ptp(points, axis=0).max()
    away, nearest = KDTree(points).query(packed_points)
    assert away.max() < 2e-4 * size  # 14 bits
    assert KDTree(packed_points).query(points)[0].max() < 2e-4 * size
    off = np.abs(colors[nearest].astype(int) - packed_colors).max(axis=1)
    assert np.mean(off <= 12) > 0.98  # where two parts touch, the other may be nearer


def test_a_skinned_head_stands_as_it_did_before_it_was_packed(node, speech_wav, tmp_path):
    whole = tmp_path / "talk.glb"
    animate(speech_wav, life=0).write(whole)
    points, _ = corners_of(whole)
    packed, _ = corners_of(gltfpack(node, whole, "-c"))
    assert KDTree(points).query(packed)[0].max() < 3e-4 * np.ptp(points, axis=0).max()


def test_a_turned_picture_is_where_its_material_puts_it(tmp_path):
    picture = tmp_path / "skin.png"
    Image.new("RGB", (4, 4), (200, 10, 10)).save(picture)
    file = tmp_path / "head.glb"
    quarter = {"offset": [0.25, 0.5], "rotation": np.pi / 2, "scale": [0.5, 2]}
    texture = {"index": 0, "extensions": {"KHR_texture_transform": quarter}}
    material = {"pbrMetallicRoughness": {"baseColorTexture": texture}}
    data = triangle(picture=picture.read_bytes(), changes={"materials": [material]})
    file.write_bytes(data)
    (part,) = parts_of(file)
    # Scaled, then turned, then shifted, v downwards: the extension's own matrices.
    assert part.uv is not None
    down = part.uv * [1, -1] + [0, 1]
    assert np.allclose(down, [[0.25, 0.5], [2.25, 0.5], [0.25, 0.0]])


@pytest.mark.slow
def test_damaged_streams_end_in_one_line(node, dressed, tmp_path):
    packed = gltfpack(node, dressed, "-cc").read_bytes()
    start = packed.index(b"BIN\0") + 4
    draw, file = np.random.default_rng(0), tmp_path / "head.glb"
    for _ in range(60):
        forged = bytearray(packed)
        for place in draw.integers(start, len(packed), draw.integers(1, 4)):
            forged[place] = draw.integers(256)
        file.write_bytes(forged)
        try:
            parts_of(file)
        except HeadError as error:
            assert "\n" not in str(error) and "head.glb" in str(error)


def test_a_stream_that_says_more_than_it_holds_takes_no_memory(node, dressed, tmp_path):
    packed = gltfpack(node, dressed, "-c").read_bytes()
    size = int.from_bytes(packed[12:16], "little")
    record = json.loads(packed[20 : 20 + size])
    for view in record["bufferViews"]:
        note = view.get("extensions", {}).get("EXT_meshopt_compression")
        if note and note["mode"] == "ATTRIBUTES":
            note["count"] = 2_000_000_000
            view["byteLength"] = note["count"] * note["byteStride"]
    record["buffers"][1]["byteLength"] = 10**12
    text = json.dumps(record).encode()
    text += b" " * (-len(text) % 4)
    file = tmp_path / "head.glb"
    rest = packed[20 + size :]
    head = b"glTF" + np.array([2, 20 + len(text) + len(rest), len(text)], "<u4").tobytes()
    file.write_bytes(head + b"JSON" + text + rest)
    with pytest.raises(HeadError, match="take more memory than its size allows"):
        parts_of(file)
