"""Adds records to the lists of a glTF file and bytes to the end of its buffer.

Every other letter of the JSON and every byte of the buffer stays where it was. A path names a
value: keys of objects and places in lists, from the outermost inwards. The text has been read
before by `json_records`, so that it is known to be JSON.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.meshes.gltf_document import GltfDocument, packed

Steps = Sequence[str | int]
_READER = json.JSONDecoder()
_BLANKS = " \t\r\n"
FLOAT, UINT = 5126, 5125


class GltfAdditions:
    """Accessors, their views, and bytes after those of a file's buffer."""

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


def find(text: str, path: Steps) -> tuple[int, int] | None:
    """Where a value stands: its first letter, and the one after its last; None where there is
    none."""
    at = _skipped(text, 0)
    place = (at, _READER.raw_decode(text, at)[1])
    for step in path:
        parts = _members(text, place[0]) if isinstance(step, str) else _items(text, place[0])
        # Of a key that occurs twice the last one counts, as for Python's reader.
        matches = [(start, end) for name, start, end in parts if name == step]
        if not matches:
            return None
        place = matches[-1]
    return place


def with_value(text: str, path: Steps, value: Any) -> str:
    """The text with a value set: one that is there, or another key of an object that is.

    Raises KeyError where nothing is there to hold it.
    """
    new = _written(value)
    place = find(text, path)
    if place is not None:
        return text[: place[0]] + new + text[place[1] :]
    holder = find(text, path[:-1])
    if holder is None or text[holder[0]] != "{" or not isinstance(path[-1], str):
        raise KeyError(path)
    return _inserted(text, holder, f"{json.dumps(path[-1])}:{new}")


def with_items(text: str, path: Steps, values: Sequence[Any]) -> str:
    """The text with items at the end of a list; one that is missing is made.

    Raises KeyError where nothing is there to hold the list.
    """
    place = find(text, path)
    if place is None:
        return with_value(text, path, list(values))
    return _inserted(text, place, ",".join(map(_written, values))) if values else text


def _before(text: str, at: int) -> int:
    """One past the last letter before `at` that is no blank."""
    while text[at - 1] in _BLANKS:
        at -= 1
    return at


def _inserted(text: str, holder: tuple[int, int], new: str) -> str:
    """The text with something last inside brackets."""
    last = holder[1] - 1
    end = _before(text, last)
    comma = "" if text[end - 1] in "[{" else ","
    return text[:end] + comma + new + text[end:]


def _written(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), allow_nan=False)


def _skipped(text: str, at: int) -> int:
    while text[at] in _BLANKS:
        at += 1
    return at


def _members(text: str, at: int) -> Iterator[tuple[str, int, int]]:
    """Keys of the object that begins at `at`, and where their values stand."""
    if text[at] != "{":
        return
    at = _skipped(text, at + 1)
    while text[at] != "}":
        name, at = _READER.raw_decode(text, at)
        start = _skipped(text, _skipped(text, at) + 1)
        end = _READER.raw_decode(text, start)[1]
        yield name, start, end
        at = _skipped(text, end)
        if text[at] == ",":
            at = _skipped(text, at + 1)


def _items(text: str, at: int) -> Iterator[tuple[int, int, int]]:
    """Places of the list that begins at `at`, and where their values stand."""
    if text[at] != "[":
        return
    at, place = _skipped(text, at + 1), 0
    while text[at] != "]":
        end = _READER.raw_decode(text, at)[1]
        yield place, at, end
        at, place = _skipped(text, end), place + 1
        if text[at] == ",":
            at = _skipped(text, at + 1)
