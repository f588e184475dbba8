"""Builds a .glb: JSON records and one buffer."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

FLOAT, USHORT, UBYTE, UINT = 5126, 5123, 5121, 5125
ARRAY_BUFFER, ELEMENT_BUFFER = 34962, 34963
INDEX_MAX = 65534
"""The largest index of 16 bits: 65535 restarts a strip and may not be one."""


@dataclass
class GltfFile:
    """JSON and buffer of a glTF 2.0 file.

    Attributes
    ----------
    json : dict
        The records, by the names of the specification; empty lists are left out of the file.
    """

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
        self,
        values: NDArray[Any],
        kind: str,
        component: int,
        target: int | None = None,
        bounds: bool = False,
        **extra: Any,
    ) -> int:
        """An accessor over a dense array."""
        record: dict[str, Any] = {
            "bufferView": self.view(np.ascontiguousarray(values).tobytes(), target),
            "componentType": component,
            "count": len(values),
            "type": kind,
            **extra,
        }
        if bounds:
            low, high = values.min(axis=0), values.max(axis=0)
            record |= {"min": np.atleast_1d(low).tolist(), "max": np.atleast_1d(high).tolist()}
        return self.add("accessors", record)

    def sparse(
        self, rows: NDArray[np.intp], values: NDArray[np.float32], count: int, bounds: bool
    ) -> int:
        """An accessor of `count` vectors that are zero but for `rows`."""
        record: dict[str, Any] = {"componentType": FLOAT, "count": count, "type": "VEC3"}
        if not len(rows):
            return self._unmoved(record, bounds)
        if bounds:
            low, high = values.min(axis=0), values.max(axis=0)
            if len(rows) < count:
                low, high = np.minimum(low, 0), np.maximum(high, 0)
            record |= {"min": low.tolist(), "max": high.tolist()}
        small = count - 1 <= INDEX_MAX
        record["sparse"] = {
            "count": len(rows),
            "indices": {
                "bufferView": self.shared(rows.astype(np.uint16 if small else np.uint32).tobytes()),
                "componentType": USHORT if small else UINT,
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

    def pack(self) -> bytes:
        """The file."""
        self.json["buffers"] = [{"byteLength": self._size}]
        record = {name: value for name, value in self.json.items() if value != []}
        text = json.dumps(record, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        binary = b"".join(self._chunks)
        total = 12 + 8 + len(text) + 8 + len(binary)
        return b"".join(
            [
                struct.pack("<4sII", b"glTF", 2, total),
                struct.pack("<I4s", len(text), b"JSON"),
                text,
                struct.pack("<I4s", len(binary), b"BIN\0"),
                binary,
            ]
        )


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
