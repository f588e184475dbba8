"""Heads, motion, meshes, scans and registered frames."""

from __future__ import annotations

import io
import json
import pickle
import shutil
import struct
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tests.fuzz.fuzzing.seeds.making import VERTICES, module, place, small_head, small_motion


def motions(folder: Path) -> None:
    from elocute.motion.store import save_motion

    save_motion(small_motion(), place(folder, "turning") / "talk.npz")
    save_motion(small_motion(turning=False), place(folder, "still") / "talk.npz")


def heads(folder: Path) -> None:
    from elocute.head.store import save_head

    save_head(place(folder, "small") / "head.npz", small_head())


def characters(folder: Path) -> None:
    """ARKit's shapes on a skeleton, visemes, and VRMs of both versions."""
    from tests.support.gltf_files import OCULUS, arkit, glb, inline, record

    joints = {"nodes": [{"mesh": 0, "skin": 0}, {"name": "Neck", "children": [2]}]}
    joints["nodes"].append({"name": "Head", "rotation": [0, 0.6, 0, 0.8], "scale": [1, 2, 1]})
    whole = arkit(**joints, skins=[{"joints": [1, 2]}], buffers=[{"byteLength": 8}])
    (place(folder, "arkit") / "face.glb").write_bytes(glb(whole, bytes(8)))
    spoken = record(("Head", [*OCULUS, "eyesClosed"]), ("Teeth", ["jaw_open"]))
    spoken["nodes"][1]["translation"] = [0.01, 0, 0]
    spoken |= {"buffers": [inline(bytes(8))], "bufferViews": [{"buffer": 0, "byteLength": 8}]}
    (place(folder, "visemes") / "face.gltf").write_text(json.dumps(spoken))
    vowels = record(("Face", ["m0", "m1"]))
    bind = {"node": 0, "mesh": 0, "index": 0, "weight": 1}
    bones = {"head": {"node": 0}, "leftEye": {"node": 0}}
    look = {"type": "bone", "rangeMapVerticalUp": {"inputMaxValue": 90, "outputScale": 10}}
    vowels["extensions"] = {
        "VRMC_vrm": {
            "expressions": {"preset": {"aa": {"morphTargetBinds": [bind], "isBinary": True}}},
            "humanoid": {"humanBones": bones},
            "lookAt": look,
        }
    }
    (place(folder, "vrm1") / "face.vrm").write_bytes(glb(vowels))
    group = {"name": "A", "presetName": "a", "binds": [bind | {"weight": 100}]}
    vowels["extensions"] = {
        "VRM": {
            "blendShapeMaster": {"blendShapeGroups": [group]},
            "humanoid": {"humanBones": [{"bone": "head", "node": 0}]},
            "firstPerson": {"lookAtTypeName": "Bone"},
        }
    }
    (place(folder, "vrm0") / "face.vrm").write_bytes(glb(vowels))


def surfaces(folder: Path) -> None:
    """Meshes in glTF: with a picture that is turned, on a joint, and packed by meshopt."""
    from tests.meshes.test_mesh_parts import CORNERS, POINTS, triangle
    from tests.support.gltf_files import glb, meshopt_attributes, meshopt_indices

    picture = io.BytesIO()
    Image.new("RGB", (3, 2), (200, 90, 40)).save(picture, "PNG")
    shift = {"KHR_texture_transform": {"offset": [0.5, 0], "rotation": 0.3, "scale": [2, 1]}}
    skin = {"baseColorTexture": {"index": 0, "extensions": shift}}
    dressed = triangle(
        picture=picture.getvalue(),
        changes={
            "materials": [{"name": "skin", "alphaMode": "MASK", "pbrMetallicRoughness": skin}]
        },
    )
    (place(folder, "picture") / "face.glb").write_bytes(dressed)
    weights = np.tile(np.array([0.5, 0.5, 0, 0], np.float32), (3, 1)).tobytes()
    streams = [
        meshopt_attributes(POINTS.view(np.uint8)),
        meshopt_indices(CORNERS),
        weights,
        bytes(12),
    ]
    starts = np.cumsum([0, *map(len, streams)]).tolist()
    told = [("ATTRIBUTES", 3, 12), ("INDICES", 3, 2)]
    views: list[dict[str, Any]] = []
    for start, data, (mode, count, stride) in zip(starts, streams, told, strict=False):
        note = {"buffer": 0, "byteOffset": start, "byteLength": len(data)}
        note |= {"mode": mode, "count": count, "byteStride": stride}
        views.append(
            {"buffer": 1, "byteLength": count * stride}
            | {"extensions": {"EXT_meshopt_compression": note}}
        )
    views += [
        {"buffer": 0, "byteOffset": start, "byteLength": len(data)}
        for start, data in zip(starts[2:], streams[2:], strict=False)
    ]
    attributes = {"POSITION": 0, "WEIGHTS_0": 2, "JOINTS_0": 3}
    rigged = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["EXT_meshopt_compression"],
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "skin": 0}, {"scale": [2, 2, 2], "children": [2]}, {"name": "Head"}],
        "skins": [{"joints": [1, 2]}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC4"},
            {"bufferView": 3, "componentType": 5121, "count": 3, "type": "VEC4"},
        ],
        "bufferViews": views,
        "buffers": [
            {"byteLength": starts[-1]},
            {"byteLength": 42, "extensions": {"EXT_meshopt_compression": {"fallback": True}}},
        ],
    }
    (place(folder, "rigged") / "face.glb").write_bytes(glb(rigged, b"".join(streams)))


def flame(folder: Path) -> None:
    python2 = module("tests/conftest.py").Python2()
    entries = python2.flame(vertices=60, components=400)
    for protocol in (0, 2):
        path = place(folder, f"protocol{protocol}") / "model.pkl"
        path.write_bytes(python2.dumps(entries, protocol))


def flame_parameters(folder: Path) -> None:
    from elocute.head.flame_parameters import FlameParameters, save_flame_parameters

    rng = np.random.default_rng(0)
    parts = rng.normal(size=3), rng.normal(size=(2, 4)), np.zeros((2, 15)), np.zeros((2, 3))
    save_flame_parameters(place(folder, "small") / "parameters.npz", FlameParameters(*parts))


def flame_layouts(folder: Path) -> None:
    exp, jaw = np.zeros((3, 5)), np.full((3, 3), 0.1)
    exp[1] = np.nan
    np.savez(place(folder, "vhap") / "parameters.npz", expr=exp, jaw_pose=jaw, fps=30.0)
    body = np.zeros((3, 165))
    np.savez(place(folder, "beat") / "parameters.npz", expressions=jaw, poses=body, betas=jaw[0])


def meshes(folder: Path) -> None:
    """Text and binary meshes of the size of a head."""
    import trimesh

    head = small_head()
    mesh = trimesh.Trimesh(head.template, head.triangles, process=False)
    for name, kind, options in (
        ("obj", "obj", {}),
        ("binary", "ply", {"encoding": "binary"}),
        ("ascii", "ply", {"encoding": "ascii"}),
    ):
        data: Any = mesh.export(file_type=kind, **options)
        data = data.encode() if isinstance(data, str) else data
        (place(folder, name) / f"mesh.{kind}").write_bytes(data)


def big_endian(folder: Path) -> None:
    """A .ply in the other order of bytes, and one of triangles and quads."""
    head = small_head()
    opening = (
        f"ply\nformat binary_big_endian 1.0\nelement vertex {VERTICES}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {len(head.triangles)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    faces = b"".join(struct.pack(">B3i", 3, *map(int, row)) for row in head.triangles)
    points = head.template.astype(">f4").tobytes()
    (place(folder, "big_endian") / "mesh.ply").write_bytes(opening.encode() + points + faces)
    quad = struct.pack(">B4i", 4, *map(int, [*head.triangles[0], head.triangles[1][2]]))
    mixed = opening.encode() + points + quad + faces[len(quad) - 4 :]
    (place(folder, "mixed") / "mesh.ply").write_bytes(mixed)
    strip = opening.replace("element face", "element tristrips").encode()
    (place(folder, "strips") / "mesh.ply").write_bytes(strip + points + faces)


def scans(folder: Path) -> None:
    """As `meshes`, one that our own writer wrote, and one with a texture."""
    from PIL import Image

    from elocute.registration.scan_file import write_scan

    meshes(folder)
    big_endian(folder)
    head = small_head()
    colours = np.full((VERTICES, 3), 120, np.uint8)
    write_scan(place(folder, "ours") / "scan.ply", head.template, head.triangles, colours)
    import trimesh

    solid = trimesh.Trimesh(head.template, head.triangles, process=False)
    for kind in ("stl", "stl_ascii"):
        data: Any = solid.export(file_type=kind)
        data = data.encode() if isinstance(data, str) else data
        (place(folder, kind) / "scan.stl").write_bytes(data)
    textured = place(folder, "textured")
    lines = ["mtllib scan.mtl", "usemtl skin"]
    lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in head.template[:12]]
    lines += [f"vt {i / 12:.3f} {i / 24:.3f}" for i in range(12)]
    lines += [f"f {i}/{i} {i + 1}/{i + 1} {i + 2}/{i + 2}" for i in range(1, 11)]
    (textured / "scan.obj").write_text("\n".join(lines) + "\n")
    (textured / "scan.mtl").write_text("newmtl skin\nKd 1 1 1\nmap_Kd skin.png\n")
    Image.new("RGB", (8, 8), (200, 150, 130)).save(textured / "skin.png")


def textures(folder: Path) -> None:
    """A textured scan for every kind of picture."""
    from PIL import Image

    from elocute.meshes.mesh_file import PICTURE_FORMATS

    scans(folder / "made")
    lines = (folder / "made" / "textured" / "scan.obj").read_text()
    shutil.rmtree(folder / "made")
    colours = np.arange(24 * 16 * 3, dtype=np.uint8).reshape(24, 16, 3)
    for kind in PICTURE_FORMATS:
        inner, name = place(folder, kind), f"skin.{kind.lower()}"
        (inner / "scan.obj").write_text(lines)
        (inner / "scan.mtl").write_text(f"newmtl skin\nKd 1 1 1\nmap_Kd {name}\n")
        Image.fromarray(colours).save(inner / name, kind)


def vertex_lists(folder: Path) -> None:
    numbers = np.array([1, 5, 9, 30], np.int64)
    np.save(place(folder, "npy") / "lips.npy", numbers)
    (place(folder, "json") / "lips.json").write_text(json.dumps(numbers.tolist()))
    (place(folder, "txt") / "lips.txt").write_text("1, 5 9\n30\n")
    regions = {"lips": numbers, "brows": np.arange(100) < 9}
    np.savez(place(folder, "npz") / "lips.npz", **regions)
    (place(folder, "pkl") / "lips.pkl").write_bytes(pickle.dumps(regions))


def frames(folder: Path) -> None:
    """A registered frame of a capture, and the person's own face beside it."""
    from elocute.capture.sequence_tracking import FrameRecord, write_frame
    from elocute.registration.accuracy import SurfaceError
    from elocute.registration.model_fit import ModelParameters
    from elocute.registration.register import Registration
    from elocute.registration.zero_pose import HeadPose

    points = small_head().template.astype(np.float64)
    surface = SurfaceError(**dict.fromkeys(SurfaceError.__dataclass_fields__, 0.5))
    shape = ModelParameters(np.zeros(2), np.zeros(3), HeadPose(np.zeros(3), np.zeros((2, 3))))
    found = Registration(points, points, shape, 0 * points, surface, 1.0, 0.1, ("a note",))
    record = FrameRecord(3, "", surface, 1.0, 68, 0.1, ("a note",))
    write_frame(place(folder, "good") / "00003.npz", "key", record, found)
    write_frame(place(folder, "flagged") / "00003.npz", "key", FrameRecord(3, "lost"), None)
