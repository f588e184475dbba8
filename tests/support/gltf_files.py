"""Small characters as glTF files, put together record by record."""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.motion.curves import ARKIT_NAMES

OCULUS = tuple(
    f"viseme_{name}"
    for name in (
        *("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR"),
        *("aa", "E", "I", "O", "U"),
    )
)


def record(*heads: tuple[str, list[str]], **more: Any) -> dict[str, Any]:
    """A file with a mesh for each head: its name and its morph targets.

    Every accessor is of zeros, which takes no buffer.
    """
    accessors = [_points(0.1), _points(0.001)]
    meshes, nodes = [], []
    for number, (name, targets) in enumerate(heads):
        primitive = {"attributes": {"POSITION": 0}, "targets": [{"POSITION": 1}] * len(targets)}
        meshes.append({"name": name, "primitives": [primitive], "extras": {"targetNames": targets}})
        nodes.append({"name": f"{name} node", "mesh": number, "translation": [float(number), 0, 0]})
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "accessors": accessors,
    } | more


def _points(size: float) -> dict[str, Any]:
    ends = {"min": [-size] * 3, "max": [size] * 3}
    return {"componentType": 5126, "count": 3, "type": "VEC3"} | ends


def glb(given: dict[str, Any] | str | bytes, binary: bytes | None = None) -> bytes:
    """The bytes of a .glb."""
    text = json.dumps(given) if isinstance(given, dict) else given
    letters = text.encode() if isinstance(text, str) else text
    letters += b" " * (-len(letters) % 4)
    chunks = struct.pack("<I4s", len(letters), b"JSON") + letters
    if binary is not None:
        binary += b"\0" * (-len(binary) % 4)
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def parts_of_glb(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON of a .glb, and its binary chunk."""
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[20 + length + 8 :]


def inline(data: bytes) -> dict[str, Any]:
    """A buffer as text."""
    uri = f"data:application/octet-stream;base64,{base64.b64encode(data).decode()}"
    return {"byteLength": len(data), "uri": uri}


def arkit(**more: Any) -> dict[str, Any]:
    return record(("Face", list(ARKIT_NAMES)), **more)


def meshopt_attributes(elements: NDArray[np.uint8]) -> bytes:
    """Elements (count, stride) as a stream of meshopt's attributes in which every delta is a byte.

    Up to sixteen of them, of up to 32 bytes.
    """
    count, stride = elements.shape
    before = np.concatenate([elements[:1], elements[:-1]]).astype(np.int16)
    delta = ((elements.astype(np.int16) - before + 128) % 256 - 128).T
    zigzag = np.where(delta < 0, -2 * delta - 1, 2 * delta).astype(np.uint8)
    padded = np.pad(zigzag, ((0, 0), (0, 16 - count)))
    blocks = b"".join(b"\x03" + row.tobytes() for row in padded)
    return b"\xa0" + blocks + bytes(32 - stride) + elements[0].tobytes()


def meshopt_indices(indices: NDArray[np.integer]) -> bytes:
    """Indices below sixteen as a stream of meshopt's index sequences."""
    steps = np.diff(indices.astype(int), prepend=0)
    codes = [2 * (-2 * step - 1 if step < 0 else 2 * step) for step in steps.tolist()]
    return b"\xd1" + bytes(codes) + bytes(4)
