"""glTF files whose vertices are packed by Draco, written anew with plain vertices."""

from __future__ import annotations

import copy
import importlib.util
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.files import draco_child
from elocute.files.gltf_document import GltfDocument, packed

DRACO = "KHR_draco_mesh_compression"
TIME_MAX_S = 60.0
COUNT_MAX = 3_000_000
ALLOWED = "sound Draco streams of up to 3,000,000 corners"
TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def draco_is_here() -> bool:
    """Whether the library that unpacks Draco is installed."""
    return importlib.util.find_spec("DracoPy") is not None


def has_draco(document: GltfDocument) -> bool:
    """Whether a primitive in the binary chunk is packed by Draco."""
    return document.binary is not None and any(
        DRACO in _extensions(primitive)
        for mesh in document.records("meshes")
        for primitive in mesh.get("primitives", [])
    )


def _extensions(record: dict[str, Any]) -> dict[str, Any]:
    """The extensions of a record; {} where there are none."""
    extensions = record.get("extensions", {})
    return extensions if isinstance(extensions, dict) else {}


def without_draco(document: GltfDocument, path: Path, error: type[InputError]) -> bytes:
    """The file as a .glb with plain vertices.

    Parameters
    ----------
    document : GltfDocument
        With its vertices in the binary chunk.
    path : Path
        For messages.
    error : type of InputError
        The class to raise.

    Returns
    -------
    bytes

    Raises
    ------
    InputError
        Of the class `error`, for streams that are damaged or are not what the file says.
    """
    record, binary = copy.deepcopy(document.record), bytes(document.binary or b"")
    try:
        primitives = [
            primitive
            for mesh in record.get("meshes", [])
            for primitive in mesh["primitives"]
            if DRACO in _extensions(primitive)
        ]
        notes = [primitive["extensions"].pop(DRACO) for primitive in primitives]
        total = sum(
            record["accessors"][place]["count"]
            for primitive in primitives
            for place in (primitive["indices"], primitive["attributes"]["POSITION"])
        )
        if total > COUNT_MAX:
            raise error.about(path, found=f"{total} packed corners", allowed=ALLOWED)
        unpacked = _unpacked([_stream(record, note, binary) for note in notes])
        pieces: list[bytes | memoryview] = [binary, bytes(-len(binary) % 4)]
        for index, (primitive, note) in enumerate(zip(primitives, notes, strict=True)):
            _place(record, primitive["indices"], unpacked[f"f{index}"], pieces)
            for name, number in note["attributes"].items():
                place = primitive["attributes"][name]
                _place(record, place, unpacked[f"a{index}_{number}"], pieces)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OSError) as problem:
        raise error.about(
            path, found="a Draco stream that cannot be read", allowed=ALLOWED
        ) from problem
    for name in ("extensionsUsed", "extensionsRequired"):
        record[name] = [word for word in record.get(name, []) if word != DRACO]
    record["buffers"][0]["byteLength"] = sum(map(len, pieces))
    return packed(json.dumps(record), pieces)


def _stream(record: dict[str, Any], note: dict[str, Any], binary: bytes) -> bytes:
    view = record["bufferViews"][note["bufferView"]]
    if view.get("buffer") != 0:
        raise ValueError("a stream outside the binary chunk")
    start = view.get("byteOffset", 0)
    return binary[start : start + view["byteLength"]]


def _unpacked(streams: list[bytes]) -> dict[str, NDArray[Any]]:
    """What the child makes of the streams. Raises ValueError where it ends otherwise."""
    lengths = json.dumps([len(stream) for stream in streams]).encode()
    try:
        child = subprocess.run(
            [sys.executable, "-I", draco_child.__file__],
            input=b"".join([lengths, b"\n", *streams]),
            capture_output=True,
            timeout=TIME_MAX_S,
            check=True,
        )
    except subprocess.SubprocessError as problem:
        raise ValueError("the stream ended its reader") from problem
    header, _, data = child.stdout.partition(b"\n")
    arrays, start = {}, 0
    for name, kind, shape in json.loads(header):
        arrays[name] = np.frombuffer(data, kind, math.prod(shape), start).reshape(shape)
        start += arrays[name].nbytes
    return arrays


def _place(
    record: dict[str, Any], index: int, values: NDArray[Any], pieces: list[bytes | memoryview]
) -> None:
    """Append an accessor's values to the chunk. Raises ValueError for another count."""
    accessor = record["accessors"][index]
    shape = (accessor["count"], WIDTHS[accessor["type"]])
    if values.size != shape[0] * shape[1]:
        raise ValueError("a stream of another count than the accessor's")
    data = np.ascontiguousarray(values.reshape(shape), TYPES[accessor["componentType"]]).tobytes()
    view = {"buffer": 0, "byteOffset": sum(map(len, pieces)), "byteLength": len(data)}
    record.setdefault("bufferViews", []).append(view)
    accessor.update(bufferView=len(record["bufferViews"]) - 1, byteOffset=0)
    pieces += [data, bytes(-len(data) % 4)]
