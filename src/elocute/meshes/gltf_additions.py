"""Adds records to the lists of a glTF file and bytes to the end of its buffer.

Every other letter of the JSON and every byte of the buffer stays where it was.
"""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.meshes.gltf_document import GltfDocument, packed
from elocute.meshes.json_splices import with_items, with_value

FLOAT, UINT = 5126, 5125


class GltfAdditions:
    """Accessors, their views, and bytes after those of a file's buffer.

    Parameters
    ----------
    document : GltfDocument
        The file.
    """

    def __init__(self, document: GltfDocument) -> None:
        self.document = document
        buffers = document.records("buffers")
        # The binary chunk is the first buffer, which then has no uri, or there is none yet.
        self._in_chunk = not buffers or (document.binary is not None and "uri" not in buffers[0])
        there = document.binary if buffers and self._in_chunk else None
        self._parts: list[bytes | memoryview] = [] if there is None else [there]
        self._size = 0 if there is None else len(there)
        self._pad()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._known: dict[bytes, int] = {}
        self._still: dict[tuple[int, bool], int] = {}

    def view(self, data: bytes) -> int:
        """A buffer view of these bytes."""
        buffer = 0 if self._in_chunk else len(self.document.records("buffers"))
        self._views.append({"buffer": buffer, "byteOffset": self._size, "byteLength": len(data)})
        self._parts.append(data)
        self._size += len(data)
        self._pad()
        return len(self.document.records("bufferViews")) + len(self._views) - 1

    def accessor(self, values: NDArray[np.float32], kind: str, bounds: bool = False) -> int:
        """An accessor of these numbers; equal ones are stored once."""
        data = np.ascontiguousarray(values, "<f4").tobytes()
        if data in self._known:
            return self._known[data]
        record: dict[str, Any] = {
            "bufferView": self.view(data),
            "componentType": FLOAT,
            "count": len(values),
            "type": kind,
        }
        self._known[data] = self.record(record | (_ends(values) if bounds else {}))
        return self._known[data]

    def sparse(
        self, rows: NDArray[np.intp], values: NDArray[np.float32], count: int, bounds: bool
    ) -> int:
        """An accessor of `count` vectors that are zero but for `rows`."""
        record: dict[str, Any] = {"componentType": FLOAT, "count": count, "type": "VEC3"}
        if not len(rows):
            if (count, bounds) not in self._still:
                ends = _ends(np.zeros((1, 3), np.float32)) if bounds else {}
                self._still[count, bounds] = self.record(record | ends)
            return self._still[count, bounds]
        indices = {"bufferView": self.view(rows.astype("<u4").tobytes()), "componentType": UINT}
        deltas = {"bufferView": self.view(np.ascontiguousarray(values, "<f4").tobytes())}
        record["sparse"] = {"count": len(rows), "indices": indices, "values": deltas}
        if bounds:
            still = np.zeros((int(len(rows) < count), 3), np.float32)
            record |= _ends(np.concatenate([np.asarray(values, np.float32), still]))
        return self.record(record)

    def pack(self, text: str) -> bytes:
        """The file as a .glb: a JSON text, with what was added named in it."""
        document = self.document
        text = with_items(text, ["accessors"], self._accessors)
        text = with_items(text, ["bufferViews"], self._views)
        if not self._in_chunk:
            content = base64.b64encode(b"".join(self._parts)).decode()
            uri = f"data:application/octet-stream;base64,{content}"
            text = with_items(text, ["buffers"], [{"byteLength": self._size, "uri": uri}])
            binary: list[bytes | memoryview] = [document.binary] if document.binary else []
            return packed(text, binary, document.others)
        if document.records("buffers"):
            text = with_value(text, ["buffers", 0, "byteLength"], self._size)
        else:
            text = with_items(text, ["buffers"], [{"byteLength": self._size}])
        return packed(text, self._parts, document.others)

    def record(self, record: dict[str, Any]) -> int:
        """An accessor as it is told."""
        self._accessors.append(record)
        return len(self.document.records("accessors")) + len(self._accessors) - 1

    def _pad(self) -> None:
        rest = -self._size % 4
        if rest:
            self._parts.append(b"\0" * rest)
            self._size += rest


def _ends(values: NDArray[np.float32]) -> dict[str, list[float]]:
    """The bounds of an accessor, as it states them."""
    low, high = np.atleast_1d(values.min(axis=0)), np.atleast_1d(values.max(axis=0))
    return {"min": low.astype(float).tolist(), "max": high.astype(float).tolist()}
