"""Heads by other hands, as characters: proportions and shapes of their own, on other meshes."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.meshes.gltf_document import GltfDocument
from elocute.meshes.gltf_nodes import NodeTree
from elocute.motion.curves import ARKIT_NAMES
from elocute.numerics.quaternions import from_axis_angle
from tests.support.flame_layout import FACE_VERTICES, FlameLayout, flame_layout
from tests.support.gltf_files import glb, parts_of_glb

Floats = NDArray[np.float64]
VISEMES = ("PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "ih", "oh", "ou")


def character(
    points: Floats, triangles: NDArray[np.integer], shapes: dict[str, Floats], **more: Any
) -> bytes:
    """A .glb of a mesh (vertex, 3) with morph targets (vertex, 3) by name."""
    arrays = [points.astype("<f4"), triangles.astype("<u4").reshape(-1, 1)]
    arrays += [each.astype("<f4") for each in shapes.values()]
    views, accessors, start = [], [], 0
    for number, each in enumerate(arrays):
        views.append({"buffer": 0, "byteOffset": start, "byteLength": each.nbytes})
        start += each.nbytes
        kind = {"componentType": 5125, "type": "SCALAR"} if number == 1 else {"componentType": 5126}
        accessors.append({"bufferView": number, "count": len(each), "type": "VEC3"} | kind)
        if number != 1:
            accessors[-1] |= {"min": each.min(axis=0).tolist(), "max": each.max(axis=0).tolist()}
    primitive = {
        "attributes": {"POSITION": 0},
        "indices": 1,
        "targets": [{"POSITION": 2 + place} for place in range(len(shapes))],
    }
    mesh = {"name": "Head", "primitives": [primitive], "extras": {"targetNames": list(shapes)}}
    given: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "Head", "mesh": 0}],
        "meshes": [mesh],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": start}],
    }
    return glb(given | more, b"".join(each.tobytes() for each in arrays))


@cache
def _face() -> FlameLayout:
    return flame_layout()


def face() -> tuple[Floats, NDArray[np.int64]]:
    """A face on another mesh than the built-in head's, m."""
    entries = _face().entries
    points, triangles = entries["v_template"], entries["f"].astype(np.int64)
    skin = (triangles < FACE_VERTICES).all(axis=1)
    return points[:FACE_VERTICES], triangles[skin]


def arkit_shapes(jaw: float = 1.0, close: float = 1.0) -> dict[str, Floats]:
    """ARKit's shapes of it; its jaw opens so much wider, of which mouthClose takes back a share."""
    shapes = {name: _face().truth(name) for name in ARKIT_NAMES}
    shapes["jawOpen"] = jaw * shapes["jawOpen"]
    shapes["mouthClose"] = jaw * close * shapes["mouthClose"]
    return shapes


def viseme_shapes(opening: float = 1.0) -> dict[str, Floats]:
    """Visemes of it, by the names of VISEMES, whose jaws open so much wider."""
    single = {name: _face().truth(name) for look in VISEME_SHAPES.values() for name in look}
    single["jawOpen"] = opening * single["jawOpen"]
    single["mouthClose"] = opening * single["mouthClose"]
    return {
        name: np.sum([share * single[n] for n, share in VISEME_SHAPES[name].items()], axis=0)
        for name in VISEMES
    }


def drawn_face(columns: int = 61) -> tuple[Floats, NDArray[np.int64], dict[str, Floats]]:
    """A drawn face, 22 cm high with a mouth 3 cm wide: a bent sheet with a slit in it.

    Its vowels A, I, U, E and O open the mouth far, as such faces do; points, triangles, shapes.
    """
    across, down = np.linspace(-0.09, 0.09, columns), np.linspace(0.11, -0.11, 89)
    upper, lower = down[down >= -0.045], np.r_[-0.045, down[down < -0.045]]
    rows = np.r_[upper, -0.045, lower] if upper[-1] > -0.045 else np.r_[upper, lower]
    split = int(np.flatnonzero(np.diff(rows) == 0)[0])
    x, y = (each.ravel() for each in np.meshgrid(across, rows))
    z = 0.1 * np.sqrt(np.maximum(0, 1 - (x / 0.1) ** 2 - (np.minimum(y + 0.05, 0) / 0.08) ** 2))
    points = np.stack([x, y, z], axis=1)
    corner = np.arange(len(points)).reshape(len(rows), columns)
    quads, is_slit = [], np.abs(across) < 0.0151
    for row in range(len(rows) - 1):
        if row == split:
            continue
        a, b = corner[row], corner[row + 1]
        quads.append(np.stack([a[:-1], b[:-1], b[1:], a[1:]], axis=1))
    quads = np.concatenate(quads)
    # Beside the slit the two edges are one.
    joined = np.arange(len(points))
    joined[corner[split + 1][~is_slit]] = corner[split][~is_slit]
    joined[corner[split + 1][np.flatnonzero(is_slit)[[0, -1]]]] = corner[split][
        np.flatnonzero(is_slit)[[0, -1]]
    ]
    quads = joined[quads]
    triangles = np.concatenate([quads[:, :3], quads[:, [0, 2, 3]]])
    lip = np.where(np.arange(len(points)) >= corner[split + 1][0], -1.0, 1.0)
    near = np.exp(-np.square((y + 0.045) / 0.02)) * np.maximum(0, 1 - (x / 0.0156) ** 2)
    chin = np.clip((-y - 0.045) / 0.03, 0, 1) * (lip < 0)

    def shape(rise: float, fall: float, wide: float, jaw: float) -> Floats:
        moved = np.zeros_like(points)
        moved[:, 1] = near * np.where(lip > 0, rise, -fall) - jaw * chin
        moved[:, 0] = wide * x * np.exp(-np.square((y + 0.045) / 0.02) - np.square(x / 0.02))
        return moved

    shapes = {
        "A": shape(0.004, 0.021, 0.0, 0.004),
        "I": shape(0.002, 0.004, 0.4, 0.001),
        "U": shape(0.002, 0.005, -0.5, 0.001),
        "E": shape(0.003, 0.010, 0.2, 0.002),
        "O": shape(0.004, 0.016, -0.3, 0.003),
        "Close": shape(0.0, 0.0, -0.02, 0.0),
    }
    return points, triangles, shapes


Face = tuple[Floats, NDArray[np.int64], dict[str, Floats]]
UNLIT: dict[str, Any] = {"extensions": {"KHR_materials_unlit": {}}}
EYES = {"Left": [0.032, 0.03, 0.06], "Right": [-0.032, 0.03, 0.06]}


def rigged(
    face: Face,
    *,
    turn: tuple[float, ...] = (0.0, 0.0, 0.0),
    scale: tuple[float, ...] = (1.0, 1.0, 1.0),
    **more: Any,
) -> bytes:
    """A character whose face hangs from its head's joint; its root is turned and scaled."""
    points, triangles, shapes = face
    quaternion = from_axis_angle(np.array(turn))[[1, 2, 3, 0]].tolist()
    leaning = from_axis_angle(np.array([0.4, 0.0, 0.2]))
    # The head's joint is laid anyhow; its mesh is laid back.
    straight = (leaning * [1, -1, -1, -1])[[1, 2, 3, 0]].tolist()
    nodes: list[dict[str, Any]] = [
        {"name": "Root", "children": [1], "rotation": quaternion, "scale": list(scale)},
        {"name": "Head", "children": [2, 3, 4], "rotation": leaning[[1, 2, 3, 0]].tolist()},
        {"name": "Face", "mesh": 0, "rotation": straight},
        *({"name": f"{side}Eye"} for side in ("Left", "Right")),
    ]
    tree = tree_of(nodes)
    for node, side in ((3, "Left"), (4, "Right")):
        inner = np.linalg.inv(tree.world(0)) @ tree.world(1)
        nodes[node]["translation"] = (inner[:3, :3].T @ EYES[side]).tolist()
    more = {"nodes": nodes, "scenes": [{"nodes": [0]}]} | more
    return character(points, triangles, shapes, **more)


def tree_of(nodes: list[dict[str, Any]]) -> NodeTree:
    """Where nodes stand."""
    return NodeTree(GltfDocument(b"", "", {"nodes": nodes}, None))


def painted(
    face: Face,
    color: list[float],
    *,
    uv: Floats | None = None,
    picture: bytes | None = None,
    **record: Any,
) -> bytes:
    """The face in one material; picture: its colours, laid by places uv (vertex, 2)."""
    points, triangles, shapes = face
    data = character(points, triangles, shapes)
    given, binary = parts_of_glb(data)
    lit: dict[str, Any] = {"baseColorFactor": color, "metallicFactor": 0, "roughnessFactor": 0.7}
    own: dict[str, Any] = {"name": "Paint", "pbrMetallicRoughness": lit, **record}
    primitive = given["meshes"][0]["primitives"][0]
    primitive["material"] = 0

    def view(content: bytes) -> int:
        nonlocal binary
        given["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(binary), "byteLength": len(content)}
        )
        binary += content + bytes(-len(content) % 4)
        return len(given["bufferViews"]) - 1

    if picture is not None:
        places = np.full((len(points), 2), 0.25) if uv is None else uv
        accessor: dict[str, Any] = {
            "bufferView": view(places.astype("<f4").tobytes()),
            "componentType": 5126,
        }
        given["accessors"].append(accessor | {"count": len(points), "type": "VEC2"})
        primitive["attributes"]["TEXCOORD_0"] = len(given["accessors"]) - 1
        given["images"] = [{"bufferView": view(picture), "mimeType": "image/png"}]
        given["textures"] = [{"source": 0}]
        texture: dict[str, Any] = {"index": 0}
        if "shift" in record:
            texture["extensions"] = {"KHR_texture_transform": own.pop("shift")}
        own["pbrMetallicRoughness"] = {"baseColorTexture": texture} | lit
    given["materials"] = [own]
    given["buffers"] = [{"byteLength": len(binary)}]
    return glb(given, binary)
