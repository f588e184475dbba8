"""Reads the materials of a glTF file: factors, textures and where their places are.

Beside what glTF itself has: unlit materials, specular and glossiness, textures shifted and scaled,
WebP, and the MToon of a VRM, version 0 or 1, as paint in two tones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from elocute.files.json_records import finite_number
from elocute.meshes.gltf_arrays import GltfArrays
from elocute.meshes.gltf_document import GltfDocument
from elocute.meshes.gltf_meshes import SPECULAR, TRANSFORM, WEBP, base_color, image_bytes

Triple = tuple[float, float, float]

UNLIT, MTOON = "KHR_materials_unlit", "VRMC_materials_mtoon"
NOT_READ = {"KHR_texture_basisu": "KTX2", "EXT_texture_avif": "AVIF"}
"""Extensions of textures, and what their pictures are packed as."""
KTX2, AVIF = b"\xabKTX 20\xbb", (b"ftypavif", b"ftypavis")
FACTOR_MAX = 1000.0
WHITE: Triple = (1.0, 1.0, 1.0)
NONE = (0.5, 0.5, 0.5, 1.0)
"""What no material colours: grey, as scans without colours are; in white no light shows a shape."""
SHADE_OF_VRM0: Triple = (0.97, 0.81, 0.86)
"""sRGB, of an MToon that names none."""


@dataclass(frozen=True)
class Texture:
    """An image and how it is laid on a mesh."""

    image: int  # its number in the file
    attribute: str  # of a primitive, that has places in it
    shift: dict[str, Any]  # as KHR_texture_transform has it; {} without
    packed: str = ""  # "KTX2" or "AVIF", which are not read


@dataclass(frozen=True)
class GltfMaterial:
    """A material; factors are linear."""

    name: str
    factor: Triple
    alpha: float
    color: Texture | None
    normal: Texture | None
    normal_scale: float
    rough: Texture | None  # green: roughness, blue: metal
    occlusion: Texture | None
    roughness: float
    metal: float
    mode: str  # OPAQUE, MASK or BLEND
    cutoff: float
    both_sides: bool
    shade: Triple | None  # of one that light does not meet: factor of its colour in its shade


def read_material(document: GltfDocument, number: int | None) -> GltfMaterial:
    """A material of a file by its number; None: what a primitive without one has."""
    record: dict[str, Any] = {} if number is None else document.records("materials")[number]
    texture, factor = base_color(record)
    linear = _numbers(factor, (1.0, 1.0, 1.0, 1.0) if number is not None else NONE)
    color = _texture(document, texture)
    lit = _record(record, "pbrMetallicRoughness")
    rough = _texture(document, _record(lit, "metallicRoughnessTexture"))
    glossy = _record(_record(record, "extensions"), SPECULAR)
    # A material that says nothing of metal would be all metal; makers of faces do not mean that.
    metal = _number(lit.get("metallicFactor"), 0.0 if rough is None else 1.0)
    shade = None if number is None else _shade(document, number, record, linear[:3])
    emissive = _texture(document, _record(record, "emissiveTexture"))
    if color is None and emissive is not None and max(linear[:3]) == 0:  # lit beforehand
        color, linear, shade = emissive, (*WHITE, linear[3]), WHITE
    name = record.get("name")
    mode = record.get("alphaMode")
    return GltfMaterial(
        name[:80] if isinstance(name, str) and name else f"material {number}",
        linear[:3],
        linear[3],
        color,
        _texture(document, _record(record, "normalTexture")),
        _number(_record(record, "normalTexture").get("scale"), 1.0),
        rough,
        _texture(document, _record(record, "occlusionTexture")),
        1 - _number(glossy.get("glossinessFactor"), 1.0)
        if glossy
        else _number(lit.get("roughnessFactor"), 1.0),
        0.0 if glossy else min(metal, 1.0),
        mode if mode in ("MASK", "BLEND") else "OPAQUE",
        _number(record.get("alphaCutoff"), 0.5),
        record.get("doubleSided") is True,
        shade,
    )


def picture_of(document: GltfDocument, arrays: GltfArrays, texture: Texture) -> tuple[bytes, str]:
    """The packed bytes of a texture's image, and "" or what it is packed as that is not read."""
    data = image_bytes(document, arrays, texture.image)
    if data.startswith(KTX2):
        return b"", "KTX2"
    if data[4:12] in AVIF:
        return b"", "AVIF"
    return data, texture.packed


def _shade(
    document: GltfDocument, number: int, record: dict[str, Any], factor: Triple
) -> Triple | None:
    """What is left of a painted material's colour in its shade; None of one that light meets."""
    extensions = _record(record, "extensions")
    if MTOON in extensions:
        shade = _numbers(_record(extensions, MTOON).get("shadeColorFactor"), (0.0, 0.0, 0.0))
        return _share(shade, factor)
    old = _record(_record(document.record, "extensions"), "VRM").get("materialProperties")
    own = old[number] if isinstance(old, list) and number < len(old) else None
    shader = own.get("shader") if isinstance(own, dict) else None
    if own is not None and shader == "VRM/MToon":
        colors = _record(own, "vectorProperties")
        shade = _numbers(colors.get("_ShadeColor"), (*SHADE_OF_VRM0, 1.0))
        linear = tuple(np.power(np.clip(shade[:3], 0, 1), 2.2).tolist())
        return _share((linear[0], linear[1], linear[2]), factor)
    unlit = UNLIT in extensions or (isinstance(shader, str) and shader.startswith("VRM/Unlit"))
    return WHITE if unlit else None


def _share(shade: tuple[float, ...], factor: Triple) -> Triple:
    red, green, blue = np.clip(np.array(shade[:3]) / np.maximum(factor, 1e-3), 0, 1).tolist()
    return red, green, blue


def _texture(document: GltfDocument, record: dict[str, Any]) -> Texture | None:
    """A texture by the record that names it; None where it names none, or one without an image."""
    number, textures = record.get("index"), document.records("textures")
    if not isinstance(number, int) or not 0 <= number < len(textures):
        return None
    texture = textures[number]
    others = _record(texture, "extensions")
    source, packed = _record(others, WEBP).get("source", texture.get("source")), ""
    for name, kind in NOT_READ.items():
        if source is None and name in others:
            source, packed = _record(others, name).get("source"), kind
    if not isinstance(source, int) or not 0 <= source < len(document.records("images")):
        return None
    shift = _record(_record(record, "extensions"), TRANSFORM)
    places = shift.get("texCoord", record.get("texCoord", 0))
    return Texture(
        source, f"TEXCOORD_{places}", {k: shift[k] for k in _SHIFTS if k in shift}, packed
    )


_SHIFTS = ("offset", "rotation", "scale")


def _record(holder: Any, name: str) -> dict[str, Any]:
    value = holder.get(name) if isinstance(holder, dict) else None
    return value if isinstance(value, dict) else {}


def _number(value: Any, default: float) -> float:
    number = finite_number(value)
    return default if number is None else min(max(number, 0.0), FACTOR_MAX)


def _numbers(values: Any, default: tuple[float, ...]) -> Any:
    """As many numbers as `default` has, each that is missing taken from there."""
    given = list(values) if isinstance(values, list) else []
    given += [None] * len(default)
    return tuple(_number(one, other) for one, other in zip(given, default, strict=False))
