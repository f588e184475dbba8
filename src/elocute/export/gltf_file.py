"""Builds a .glb: JSON records and one buffer."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.export.options import ACTION
from elocute.meshes.gltf_document import packed

COMPONENTS = {"float32": 5126, "uint32": 5125, "uint16": 5123, "uint8": 5121}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
"""By how many numbers an element has."""
ARRAY_BUFFER, ELEMENT_BUFFER = 34962, 34963
INDEX_MAX = 65534
"""The largest index of 16 bits: 65535 restarts a strip and may not be one."""


@dataclass
class GltfFile:
    """JSON and buffer of a glTF 2.0 file."""

    # the records, by the names of the specification; empty lists are left out of the file
    json: dict[str, Any] = field(default_factory=lambda: _empty_json())
    _chunks: list[bytes] = field(default_factory=list)
    _still: dict[tuple[int, bool], int] = field(default_factory=dict)
    _known: dict[bytes, int] = field(default_factory=dict)
    _size: int = 0

    def add(self, kind: str, record: dict[str, Any]) -> int:
        """Append a record to the list `kind`; its index there."""
        self.json[kind].append(record)
        return len(self.json[kind]) - 1

    def uses(self, extension: str) -> None:
        """Name an extension that some record has."""
        if extension not in self.json["extensionsUsed"]:
            self.json["extensionsUsed"].append(extension)

    def view(self, data: bytes, target: int | None = None) -> int:
        """A buffer view of `data`, aligned to four bytes."""
        pad = -len(data) % 4
        view: dict[str, Any] = {"buffer": 0, "byteOffset": self._size, "byteLength": len(data)}
        if target:
            view["target"] = target
        self._chunks.append(data + b"\0" * pad)
        self._size += len(data) + pad
        return self.add("bufferViews", view)

    def array(
        self, values: NDArray[Any], target: int | None = None, bounds: bool = False, **extra: Any
    ) -> int:
        """An accessor over a dense array of float32, or of whole numbers without a sign."""
        width = 1 if values.ndim == 1 else values.shape[1]
        record: dict[str, Any] = {
            "bufferView": self.view(np.ascontiguousarray(values).tobytes(), target),
            "componentType": COMPONENTS[values.dtype.name],
            "count": len(values),
            "type": KINDS[width],
            **extra,
        }
        if bounds:
            low, high = values.min(axis=0), values.max(axis=0)
            record |= {"min": np.atleast_1d(low).tolist(), "max": np.atleast_1d(high).tolist()}
        return self.add("accessors", record)

    def attribute(self, values: NDArray[Any], bounds: bool = False, **extra: Any) -> int:
        """An accessor over something of each vertex."""
        return self.array(values, ARRAY_BUFFER, bounds, **extra)

    def indices(self, corners: NDArray[np.integer[Any]], count: int) -> int:
        """An accessor over corners of triangles that have so many vertices."""
        return self.array(corners.astype(index_type(count)), ELEMENT_BUFFER)

    def sparse(
        self, rows: NDArray[np.intp], values: NDArray[np.float32], count: int, bounds: bool
    ) -> int:
        """An accessor of `count` vectors that are zero but for `rows`."""
        record: dict[str, Any] = {
            "componentType": COMPONENTS["float32"],
            "count": count,
            "type": "VEC3",
        }
        if not len(rows):
            return self._unmoved(record, bounds)
        if bounds:
            low, high = values.min(axis=0), values.max(axis=0)
            if len(rows) < count:
                low, high = np.minimum(low, 0), np.maximum(high, 0)
            record |= {"min": low.tolist(), "max": high.tolist()}
        indices = rows.astype(index_type(count))
        record["sparse"] = {
            "count": len(rows),
            "indices": {
                "bufferView": self.shared(indices.tobytes()),
                "componentType": COMPONENTS[indices.dtype.name],
            },
            "values": {"bufferView": self.view(values.astype(np.float32).tobytes())},
        }
        return self.add("accessors", record)

    def shared(self, data: bytes) -> int:
        """A buffer view of `data`; equal bytes are stored once."""
        if data not in self._known:
            self._known[data] = self.view(data)
        return self._known[data]

    def _unmoved(self, record: dict[str, Any], bounds: bool) -> int:
        """Vectors that are all zero; every target that moves nothing shares them."""
        key = record["count"], bounds
        if key not in self._still:
            ends = {"min": [0.0] * 3, "max": [0.0] * 3} if bounds else {}
            self._still[key] = self.add("accessors", record | ends)
        return self._still[key]

    def pack(self, *more_buffers: dict[str, Any]) -> bytes:
        """The file; more_buffers: records of buffers that are not in it."""
        self.json["buffers"] = [{"byteLength": self._size}, *more_buffers]
        record = {name: value for name, value in self.json.items() if value != []}
        return packed(json.dumps(record, separators=(",", ":")), [*self._chunks, b""])


def index_type(count: int) -> type[np.unsignedinteger[Any]]:
    """The type of indices of so many elements."""
    return np.uint16 if count - 1 <= INDEX_MAX else np.uint32


class Channels:
    """What moves in an animation, all by one clock: an accessor of seconds."""

    def __init__(self, clock: int) -> None:
        self._clock = clock
        self.samplers: list[dict[str, Any]] = []
        self.channels: list[dict[str, Any]] = []

    def move(self, node: int, path: str, output: int) -> None:
        """A node is moved by the values of an accessor; path: "weights", "rotation", …"""
        self.samplers.append({"input": self._clock, "output": output, "interpolation": "LINEAR"})
        target = {"node": node, "path": path}
        self.channels.append({"sampler": len(self.samplers) - 1, "target": target})

    def animation(self, name: str = ACTION) -> dict[str, Any]:
        """The record of the animation."""
        return {"name": name, "samplers": self.samplers, "channels": self.channels}


def unit_xyzw(turns: NDArray[Any]) -> NDArray[np.float32]:
    """Quaternions wxyz (frame, 4) of any length as glTF writes them: xyzw, of length one."""
    turns = turns[:, [1, 2, 3, 0]]
    return (turns / np.linalg.norm(turns, axis=1, keepdims=True)).astype(np.float32)


def _empty_json() -> dict[str, Any]:
    from elocute._version import __version__

    lists = (
        *("scenes", "nodes", "meshes", "materials", "textures", "images", "samplers", "skins"),
        *("animations", "accessors", "bufferViews", "extensionsUsed"),
    )
    return {
        "asset": {"version": "2.0", "generator": f"Elocute {__version__}"},
        "scene": 0,
        **{name: [] for name in lists},
    }
