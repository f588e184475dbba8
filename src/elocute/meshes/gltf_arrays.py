"""Reads the arrays of a glTF file: accessors, unpacked where meshopt or Draco packed them."""

from __future__ import annotations

import base64
import importlib.util
import json
import math
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.meshes import draco_child, meshopt
from elocute.meshes.gltf_document import MESHOPT, TYPES, WIDTHS, GltfDocument

DRACO = "KHR_draco_mesh_compression"
DRACO_TIME_MAX_S = 60.0
DRACO_COUNT_MAX = 3_000_000
DRACO_ALLOWED = "sound Draco streams of up to 3,000,000 corners"
MOST_BYTES = 1_000_000_000
"""What all that is read of a file, and built of it, may take beside `FOR_EACH_BYTE`."""
FOR_EACH_BYTE = 16
"""What may be built of a byte that is there: a triangle of corners of 4 bytes takes 48."""


class TooMuchError(ValueError):
    """What a file says would take more memory than is allowed to it."""


class GltfArrays:
    """The accessors of a checked file, whose content is decoded when it is asked for.

    known: accessors (count, width) that are stored elsewhere, as they would be stored.
    """

    def __init__(
        self, document: GltfDocument, known: Mapping[int, NDArray[Any]] | None = None
    ) -> None:
        self._document, self._known = document, known or {}
        self._buffers: dict[int, NDArray[np.uint8]] = {}
        self._unpacked: dict[int, NDArray[np.uint8]] = {}
        content = [
            document.binary or b"",
            *(each.get("uri", "") for each in document.records("buffers")),
        ]
        self._left = MOST_BYTES + FOR_EACH_BYTE * sum(map(len, content))

    def values(self, accessor: int) -> NDArray[Any]:
        """The elements of an accessor.

        Raises ValueError for content that is damaged, absent or more than may be read.

        Returns
        -------
        (count, width) array
            Float64 where they are floats or normalized, whole numbers as they are stored.
        """
        record = self._document.records("accessors")[accessor]
        kind, width = np.dtype(TYPES[record["componentType"]]), WIDTHS[record["type"]]
        count = record["count"]
        self.take(count * width * 8)
        if accessor in self._known:
            stored = self._known[accessor]
        elif "bufferView" in record:
            stored = self._elements(record, kind, (count, width))
        else:
            stored = np.zeros((count, width), kind)
        if "sparse" in record:
            sparse, stored = record["sparse"], stored.copy()
            rows = self._elements(
                sparse["indices"],
                np.dtype(TYPES[sparse["indices"]["componentType"]]),
                (sparse["count"], 1),
            )
            stored[rows[:, 0]] = self._elements(sparse["values"], kind, (sparse["count"], width))
        if kind.kind == "f":
            return stored.astype(np.float64)
        if record.get("normalized") is True:
            return np.maximum(stored / float(np.iinfo(kind).max), -1.0)
        return stored

    def view(self, number: int) -> NDArray[np.uint8]:
        """The (byte,) content of a buffer view. Raises ValueError as `values`."""
        view = self._document.records("bufferViews")[number]
        note = packing(view)
        if note is None or self._has(view["buffer"]):
            return self._piece(view)
        if number not in self._unpacked:
            count, stride = note["count"], note["byteStride"]
            size = count * stride
            if size != view["byteLength"] or min(count, stride) < 1:
                raise ValueError("a packed view of another size")
            self.take(size)
            content = meshopt.unpacked(
                self._piece(note).tobytes(),
                count=count,
                stride=stride,
                mode=note["mode"],
                filter=note.get("filter", "NONE"),
            )
            self._unpacked[number] = content.ravel()
        return self._unpacked[number]

    def _elements(
        self, record: dict[str, Any], kind: np.dtype[Any], shape: tuple[int, int]
    ) -> NDArray[Any]:
        number = record["bufferView"]
        view, content = self._document.records("bufferViews")[number], self.view(number)
        note = packing(view)
        stride = view.get("byteStride") or shape[1] * kind.itemsize
        if note is not None and not self._has(view["buffer"]):
            stride = note["byteStride"]
        start = record.get("byteOffset", 0)
        end = start + (shape[0] - 1) * stride + shape[1] * kind.itemsize
        if end > len(content):
            raise ValueError("an accessor that reaches beyond its view")
        return np.ndarray(shape, kind, content.data, start, (stride, kind.itemsize))

    def _piece(self, place: dict[str, Any]) -> NDArray[np.uint8]:
        start, size = place.get("byteOffset", 0), place["byteLength"]
        piece = self._buffer(place["buffer"])[start : start + size]
        if start < 0 or len(piece) != size:
            raise ValueError("bytes that are not there")
        return piece

    def _has(self, buffer: int) -> bool:
        """Whether a buffer holds anything; fallback buffers may not."""
        first = buffer == 0 and self._document.binary is not None
        return first or "uri" in self._document.records("buffers")[buffer]

    def _buffer(self, number: int) -> NDArray[np.uint8]:
        if number not in self._buffers:
            uri = self._document.records("buffers")[number].get("uri")
            if isinstance(uri, str):
                header, _, content = uri.partition(",")
                if not header.endswith(";base64"):
                    raise ValueError("a buffer in an unknown form")
                self.take(len(content))
                data: Any = base64.b64decode(content)
            elif number == 0 and self._document.binary is not None:
                data = self._document.binary
            else:
                raise ValueError("a buffer without content")
            self._buffers[number] = np.frombuffer(data, np.uint8)
        return self._buffers[number]

    def take(self, size: int) -> None:
        """Count what is about to be built. Raises ValueError where that is too much.

        size: bytes.
        """
        self._left -= size
        if self._left < 0:
            raise TooMuchError("more than may be read")


def packing(view: dict[str, Any]) -> dict[str, Any] | None:
    """How meshopt packed a view; None where it did not."""
    extensions = view.get("extensions")
    known = extensions if isinstance(extensions, dict) else {}
    return next((known[name] for name in MESHOPT if isinstance(known.get(name), dict)), None)


def draco_is_here() -> bool:
    """Whether the library that unpacks Draco is installed."""
    return importlib.util.find_spec("DracoPy") is not None


def has_draco(document: GltfDocument) -> bool:
    """Whether a primitive is packed by Draco."""
    return bool(_draco_packed(document))


def _draco_packed(document: GltfDocument) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """The primitives that Draco packed, and how."""
    packed = []
    for mesh in document.records("meshes"):
        for primitive in mesh["primitives"]:
            extensions = primitive.get("extensions")
            note = extensions.get(DRACO) if isinstance(extensions, dict) else None
            if isinstance(note, dict):
                packed.append((primitive, note))
    return packed


def draco_arrays(document: GltfDocument, path: Path, error: type[InputError]) -> GltfArrays:
    """The accessors of a file, with what Draco packed.

    Raises an `error` for streams that are damaged or are not what the file says.
    """
    packed, plain = _draco_packed(document), GltfArrays(document)
    accessors = document.records("accessors")
    arrays: dict[int, NDArray[Any]] = {}
    try:
        total = sum(
            accessors[place]["count"]
            for primitive, _ in packed
            for place in (primitive["indices"], primitive["attributes"]["POSITION"])
        )
        if total > DRACO_COUNT_MAX:
            raise error.about(path, found=f"{total} packed corners", allowed=DRACO_ALLOWED)
        streams = [plain.view(note["bufferView"]).tobytes() for _, note in packed]
        unpacked = _draco_unpacked(streams)
        for index, (primitive, note) in enumerate(packed):
            parts = {primitive["indices"]: unpacked[f"f{index}"]}
            for name, number in note["attributes"].items():
                parts[primitive["attributes"][name]] = unpacked[f"a{index}_{number}"]
            for place, values in parts.items():
                arrays[place] = _as_stored(accessors[place], values)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OSError) as problem:
        if isinstance(problem, InputError):
            raise
        raise error.about(
            path, found="a Draco stream that cannot be read", allowed=DRACO_ALLOWED
        ) from problem
    return GltfArrays(document, arrays)


def _draco_unpacked(streams: list[bytes]) -> dict[str, NDArray[Any]]:
    """What the child makes of the streams. Raises ValueError where it ends otherwise."""
    lengths = json.dumps([len(stream) for stream in streams]).encode()
    try:
        child = subprocess.run(
            [sys.executable, "-I", draco_child.__file__],
            input=b"".join([lengths, b"\n", *streams]),
            capture_output=True,
            timeout=DRACO_TIME_MAX_S,
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


def _as_stored(accessor: dict[str, Any], values: NDArray[Any]) -> NDArray[Any]:
    """(count, width) as an accessor stores them. Raises ValueError for another count."""
    shape = (accessor["count"], WIDTHS[accessor["type"]])
    if values.size != shape[0] * shape[1]:
        raise ValueError("a stream of another count than the accessor's")
    return values.reshape(shape).astype(TYPES[accessor["componentType"]])
