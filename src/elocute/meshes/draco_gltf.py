"""glTF files whose vertices are packed by Draco."""

from __future__ import annotations

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
from elocute.meshes import draco_child
from elocute.meshes.gltf_arrays import TYPES, GltfArrays
from elocute.meshes.gltf_checks import WIDTHS
from elocute.meshes.gltf_document import GltfDocument

DRACO = "KHR_draco_mesh_compression"
TIME_MAX_S = 60.0
COUNT_MAX = 3_000_000
ALLOWED = "sound Draco streams of up to 3,000,000 corners"


def draco_is_here() -> bool:
    """Whether the library that unpacks Draco is installed."""
    return importlib.util.find_spec("DracoPy") is not None


def has_draco(document: GltfDocument) -> bool:
    """Whether a primitive is packed by Draco."""
    return bool(_packed(document))


def _packed(document: GltfDocument) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """The primitives that Draco packed, and how."""
    found = []
    for mesh in document.records("meshes"):
        for primitive in mesh["primitives"]:
            extensions = primitive.get("extensions")
            note = extensions.get(DRACO) if isinstance(extensions, dict) else None
            if isinstance(note, dict):
                found.append((primitive, note))
    return found


def draco_arrays(document: GltfDocument, path: Path, error: type[InputError]) -> GltfArrays:
    """The accessors of a file, with what Draco packed.

    Parameters
    ----------
    document : GltfDocument
        The file.
    path : Path
        For messages.
    error : type of InputError
        The class to raise.

    Returns
    -------
    GltfArrays

    Raises
    ------
    InputError
        Of the class `error`, for streams that are damaged or are not what the file says.
    """
    packed, plain = _packed(document), GltfArrays(document)
    accessors = document.records("accessors")
    found: dict[int, NDArray[Any]] = {}
    try:
        total = sum(
            accessors[place]["count"]
            for primitive, _ in packed
            for place in (primitive["indices"], primitive["attributes"]["POSITION"])
        )
        if total > COUNT_MAX:
            raise error.about(path, found=f"{total} packed corners", allowed=ALLOWED)
        streams = [plain.view(note["bufferView"]).tobytes() for _, note in packed]
        unpacked = _unpacked(streams)
        for index, (primitive, note) in enumerate(packed):
            parts = {primitive["indices"]: unpacked[f"f{index}"]}
            for name, number in note["attributes"].items():
                parts[primitive["attributes"][name]] = unpacked[f"a{index}_{number}"]
            for place, values in parts.items():
                found[place] = _stored(accessors[place], values)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OSError) as problem:
        if isinstance(problem, InputError):
            raise
        raise error.about(
            path, found="a Draco stream that cannot be read", allowed=ALLOWED
        ) from problem
    return GltfArrays(document, found)


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


def _stored(accessor: dict[str, Any], values: NDArray[Any]) -> NDArray[Any]:
    """(count, width) as an accessor stores them. Raises ValueError for another count."""
    shape = (accessor["count"], WIDTHS[accessor["type"]])
    if values.size != shape[0] * shape[1]:
        raise ValueError("a stream of another count than the accessor's")
    return values.reshape(shape).astype(TYPES[accessor["componentType"]])
