"""Reads the meshes of a glTF file at rest, with the colours of their materials.

Skinned meshes stand where their joints put them. Vertices may be quantized, sparse, or packed
by meshopt or Draco (`gltf_arrays`).
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.meshes.gltf_arrays import GltfArrays
from elocute.meshes.gltf_document import GltfDocument
from elocute.meshes.gltf_nodes import NodeTree
from elocute.meshes.mesh_file import (
    ALPHA_MODES,
    GREY,
    MeshPart,
    PartOrigin,
    check_picture,
    factor_color,
    opened_picture,
    tinted,
)

Matrix = NDArray[np.float64]

LIST, STRIP, FAN = 4, 5, 6
VERTEX_BYTES, SKINNED_BYTES, CORNER_BYTES, JOINT_BYTES = 128, 600, 32, 512
"""What is built of each, at most, before it is thinned out to what a part keeps."""
TRANSFORM = "KHR_texture_transform"
SPECULAR = "KHR_materials_pbrSpecularGlossiness"
WEBP = "EXT_texture_webp"
CLEAR = 0.98
"""Alpha of a material from which on it is solid."""


def gltf_parts(
    document: GltfDocument, arrays: GltfArrays, subject: str, budget: int, error: type[InputError]
) -> Iterator[MeshPart]:
    """The parts of a file that was checked, in the order of its scene.

    budget: bytes that its pictures may take, unpacked. Raises an `error` for pictures that are
    none, damaged or too large; others for content that does not fit its records.
    """
    tree = NodeTree(document)
    pictures = _Pictures(document, arrays, subject, budget, error)
    skins = _Skins(document, arrays, tree)
    for node in tree.shown():
        record = tree.nodes[node]
        if "mesh" not in record:
            continue
        mesh = document.records("meshes")[record["mesh"]]
        for number, primitive in enumerate(mesh["primitives"]):
            part = _part(document, arrays, skins, pictures, node, number, primitive)
            if part is not None:
                yield part


def _part(
    document: GltfDocument,
    arrays: GltfArrays,
    skins: _Skins,
    pictures: _Pictures,
    node: int,
    number: int,
    primitive: dict[str, Any],
) -> MeshPart | None:
    attributes = primitive["attributes"]
    if "POSITION" not in attributes or primitive.get("mode", LIST) not in (LIST, STRIP, FAN):
        return None
    _charge(document, arrays, primitive)
    points = arrays.values(attributes["POSITION"]).astype(np.float64, copy=False)
    triangles = _triangles(arrays, primitive, len(points))
    is_used = np.zeros(len(points), bool)
    is_used[triangles] = True
    used = np.flatnonzero(is_used)
    if not len(used):
        return None
    corners = (np.cumsum(is_used) - 1)[triangles]
    placed = skins.placed(node, attributes, used)
    linear = placed[:, :3, :3]
    points = np.einsum("vab,vb->va", linear, points[used, :3]) + placed[:, :3, 3]
    material = _material(document, primitive)
    picture, uv, opacity = pictures.of(material, attributes, used)
    colors = _colors(arrays, attributes, material, used)
    record = skins.tree.nodes[node]
    mesh = document.records("meshes")[record["mesh"]]
    names = (skins.tree.name(node), mesh.get("name"), material.get("name"))
    return MeshPart(
        next((name for name in names if isinstance(name, str) and name), f"mesh {node}")[:80],
        points,
        corners.astype(np.int64, copy=False),
        uv,
        picture,
        np.tile(np.array(GREY, np.uint8), (len(used), 1)) if colors is None else colors,
        picture is not None or colors is not None,
        opacity,
        PartOrigin(
            node,
            record["mesh"],
            number,
            used.astype(np.int64),
            document.records("accessors")[attributes["POSITION"]]["count"],
            linear,
        ),
    )


def _charge(document: GltfDocument, arrays: GltfArrays, primitive: dict[str, Any]) -> None:
    """Count what is built of a primitive, whose accessors may hold nothing but their lengths.

    Raises ValueError where it is too much.
    """
    accessors, attributes = document.records("accessors"), primitive["attributes"]
    points = corners = accessors[attributes["POSITION"]]["count"]
    if "indices" in primitive:
        corners = accessors[primitive["indices"]]["count"]
    if primitive.get("mode", LIST) != LIST:
        corners *= 3
    each = SKINNED_BYTES if "JOINTS_0" in attributes else VERTEX_BYTES
    arrays.take(points * each + corners * CORNER_BYTES)


def _triangles(arrays: GltfArrays, primitive: dict[str, Any], count: int) -> NDArray[np.int64]:
    """(face, 3) corners. Raises ValueError where they point past the vertices."""
    if "indices" in primitive:
        line = arrays.values(primitive["indices"])[:, 0].astype(np.int64)
    else:
        line = np.arange(count)
    mode = primitive.get("mode", LIST)
    if mode == LIST:
        faces = line[: len(line) // 3 * 3].reshape(-1, 3)
    elif mode == STRIP:
        faces = np.stack([line[:-2], line[1:-1], line[2:]], axis=1)
        faces[1::2] = faces[1::2, ::-1]
    else:
        faces = np.stack([np.full(max(len(line) - 2, 0), line[0]), line[1:-1], line[2:]], axis=1)
    if faces.size and not 0 <= faces.min() <= faces.max() < count:
        raise ValueError(f"triangles that point past {count} vertices")
    return faces


def image_bytes(document: GltfDocument, arrays: GltfArrays, number: int) -> bytes:
    """An image of a file, packed as it is. Raises ValueError for bytes that are not there."""
    record = document.records("images")[number]
    if "bufferView" in record:
        return arrays.view(record["bufferView"]).tobytes()
    return base64.b64decode(record["uri"].partition(",")[2])


class _Skins:
    """Where nodes and skins put vertices; the joints of a skin are placed once."""

    def __init__(self, document: GltfDocument, arrays: GltfArrays, tree: NodeTree) -> None:
        self._document, self._arrays, self.tree = document, arrays, tree
        self._worlds: dict[int, Matrix] = {}

    def placed(self, node: int, attributes: dict[str, int], used: NDArray[np.intp]) -> Matrix:
        """(vertex, 4, 4) from a primitive's own space to the scene's: its node's or its joints'."""
        own = np.broadcast_to(self.tree.world(node), (len(used), 4, 4))
        number = self.tree.nodes[node].get("skin")
        if number is None or "JOINTS_0" not in attributes:
            return own
        worlds, arrays = self._joints(number), self._arrays
        placed, total = np.zeros((len(used), 4, 4)), np.zeros(len(used))
        for joints_name, weights_name in (("JOINTS_0", "WEIGHTS_0"), ("JOINTS_1", "WEIGHTS_1")):
            if joints_name not in attributes:
                continue
            joints = arrays.values(attributes[joints_name])[used].astype(np.int64)
            weights = arrays.values(attributes[weights_name])[used].astype(np.float64)
            for joint, weight in zip(joints.T, weights.T, strict=True):
                placed += weight[:, None, None] * worlds[joint]
                total += weight
        held = total > 1e-6
        return np.where(held[:, None, None], placed / np.where(held, total, 1)[:, None, None], own)

    def _joints(self, number: int) -> Matrix:
        """(joint, 4, 4) of a skin, from where its vertices are to where they stand."""
        if number not in self._worlds:
            skin = self._document.records("skins")[number]
            self._arrays.take(len(skin["joints"]) * JOINT_BYTES)
            worlds = np.stack([self.tree.world(joint) for joint in skin["joints"]])
            if "inverseBindMatrices" in skin:
                inverse = self._arrays.values(skin["inverseBindMatrices"]).astype(np.float64)
                worlds = worlds @ inverse[: len(worlds)].reshape(-1, 4, 4).transpose(0, 2, 1)
            self._worlds[number] = worlds
        return self._worlds[number]


def _material(document: GltfDocument, primitive: dict[str, Any]) -> dict[str, Any]:
    number = primitive.get("material")
    return {} if number is None else document.records("materials")[number]


def base_color(material: dict[str, Any]) -> tuple[dict[str, Any], Any]:
    """What a material says of its colour: the texture's record, and the linear factor."""
    extensions = material.get("extensions", {})
    if SPECULAR in extensions:
        record = extensions[SPECULAR]
        return record.get("diffuseTexture", {}), record.get("diffuseFactor")
    record = material.get("pbrMetallicRoughness", {})
    return record.get("baseColorTexture", {}), record.get("baseColorFactor")


def _colors(
    arrays: GltfArrays,
    attributes: dict[str, int],
    material: dict[str, Any],
    used: NDArray[np.intp],
) -> NDArray[np.uint8] | None:
    """(vertex, 3) sRGB of the vertices, else of the material, else None."""
    if "COLOR_0" in attributes:
        shares = arrays.values(attributes["COLOR_0"])[used, :3]
        if shares.dtype.kind != "f":  # of writers that forget to call them normalized
            shares = shares / float(np.iinfo(shares.dtype).max)
        # Kept as they are, though they should be linear: scanners' programs write sRGB.
        return np.round(255 * np.clip(np.nan_to_num(shares), 0, 1)).astype(np.uint8)
    factor = base_color(material)[1]
    if factor is None:
        return None
    return np.tile(factor_color(factor).astype(np.uint8), (len(used), 1))


class _Pictures:
    """The pictures of a file's materials, decoded once each."""

    def __init__(
        self,
        document: GltfDocument,
        arrays: GltfArrays,
        subject: str,
        budget: int,
        error: type[InputError],
    ) -> None:
        self._document, self._arrays = document, arrays
        self._subject, self._budget, self._error = subject, budget, error
        self._known: dict[tuple[int, Any, tuple[float, ...]], tuple[Any, str]] = {}

    def of(
        self, material: dict[str, Any], attributes: dict[str, int], used: NDArray[np.intp]
    ) -> tuple[Any, NDArray[np.float64] | None, str]:
        """The picture of a material, the places of vertices in it, and how its alpha is meant."""
        texture, factor = base_color(material)
        mode = material.get("alphaMode")
        plain = None, None, ALPHA_MODES.get(str(mode), "opaque")
        source = self._source(texture)
        shift = texture.get("extensions", {}).get(TRANSFORM, {})
        name = f"TEXCOORD_{shift.get('texCoord', texture.get('texCoord', 0))}"
        tint = _tint(factor, mode)
        if source is None and len(tint) > 3:  # a cornea
            return tinted(_white(), tint), np.zeros((len(used), 2)), "blend"
        if source is None or name not in attributes:
            return plain
        uv = self._arrays.values(attributes[name])[used, :2].astype(np.float64)
        uv = transformed_uv(uv, shift)
        if not np.isfinite(uv).all():
            return plain
        picture, opacity = self._once(source, mode, ())
        if tint:
            picture, _ = self._once(source, mode, tint)
        opacity = "blend" if len(tint) > 3 else opacity
        return picture, uv * [1, -1] + [0, 1], opacity

    def _once(self, source: int, mode: Any, tint: tuple[float, ...]) -> tuple[Any, str]:
        key = source, mode, tint
        if key not in self._known:
            if tint:
                picture, opacity = self._known[source, mode, ()]
                self._charge(*picture.size)
                self._known[key] = tinted(picture, tint), opacity
            else:
                self._known[key] = self._opened(source, mode)
        return self._known[key]

    def _charge(self, width: int, height: int) -> None:
        self._budget -= 4 * width * height
        if self._budget < 0:
            raise self._error.about(
                self._subject,
                found=f"a picture of {width} × {height} pixels",
                allowed="pictures that unpack to less",
            )

    def _source(self, texture: dict[str, Any]) -> int | None:
        """The number of an image that can be read."""
        if "index" not in texture:
            return None
        record = self._document.records("textures")[texture["index"]]
        packed = record.get("extensions", {}).get(WEBP, {})
        return packed.get("source", record.get("source"))

    def _opened(self, number: int, mode: Any) -> tuple[Any, str]:
        """The picture, whose size is known before its pixels are decoded."""
        data = image_bytes(self._document, self._arrays, number)
        width, height = check_picture(data, self._subject, self._error)
        self._charge(width, height)
        return opened_picture(data, self._subject, self._error, mode)


def _tint(factor: Any, mode: Any) -> tuple[float, ...]:
    """A material's linear RGB, and alpha where it is clear; nothing for white."""
    numbers = [] if factor is None else np.ravel(np.asarray(factor, np.float64)).tolist()
    clear = mode == "BLEND" and len(numbers) > 3 and numbers[3] < CLEAR
    kept = tuple(numbers[: 4 if clear else 3])
    return kept if any(number != 1 for number in kept) else ()


def _white() -> Any:
    from PIL import Image

    return Image.new("RGB", (1, 1), (255, 255, 255))


def transformed_uv(uv: NDArray[np.float64], shift: dict[str, Any]) -> NDArray[np.float64]:
    """Places (vertex, 2) as KHR_texture_transform scales, turns and shifts them."""
    angle = float(shift.get("rotation", 0))
    sine, cosine = np.sin(angle), np.cos(angle)
    scaled = uv * np.array(shift.get("scale", [1, 1]), float)
    turned = scaled @ np.array([[cosine, -sine], [sine, cosine]])
    return turned + np.array(shift.get("offset", [0, 0]), float)
