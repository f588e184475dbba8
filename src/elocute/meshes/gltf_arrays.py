"""Reads the arrays of a glTF file: accessors over its buffers, unpacked where meshopt packed."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.meshes import meshopt
from elocute.meshes.gltf_checks import WIDTHS
from elocute.meshes.gltf_document import GltfDocument

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
MOST_BYTES = 1_000_000_000
"""What all that is read of a file, and built of it, may take beside `FOR_EACH_BYTE`."""
FOR_EACH_BYTE = 16
"""What may be built of a byte that is there: a triangle of corners of 4 bytes takes 48."""


class TooMuchError(ValueError):
    """What a file says would take more memory than is allowed to it."""


class GltfArrays:
    """The accessors of a file.

    Parameters
    ----------
    document : GltfDocument
        Checked; what it holds is decoded when it is asked for.
    known : dict of (count, width) arrays, optional
        Accessors that are stored elsewhere, as they would be stored.
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

        Parameters
        ----------
        accessor : int
            Its number.

        Returns
        -------
        (count, width) array
            Float64 where they are floats or normalized, whole numbers as they are stored.

        Raises
        ------
        ValueError
            For content that is damaged, absent or more than may be read.
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
