"""The header of a .safetensors file, compared with the bytes that are there.

The first eight bytes hold the header's length; it is JSON: names to type, shape and place. Source:
the format's own description, github.com/huggingface/safetensors.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from elocute.files.json_records import as_record, parse_json
from elocute.files.reading import FileKind, open_regular

HEADER_MAX_BYTES = 4_000_000
TENSORS_MAX = 20_000
AXES_MAX = 8
ITEM_BYTES = {
    "BOOL": 1,
    "U8": 1,
    "I8": 1,
    "U16": 2,
    "I16": 2,
    "F16": 2,
    "BF16": 2,
    "U32": 4,
    "I32": 4,
    "F32": 4,
    "U64": 8,
    "I64": 8,
    "F64": 8,
}


@dataclass(frozen=True)
class TensorHeader:
    """What a .safetensors file holds."""

    shapes: dict[str, tuple[int, ...]]  # of all tensors
    metadata: dict[str, str]  # text by name


def read_tensor_header(path: str | Path, kind: FileKind) -> TensorHeader:
    """Read what a .safetensors file says that it holds, once it is known to hold it.

    Raises the kind's error for a file that is missing, larger or cut short, or whose header and
    content do not fit.
    """
    with open_regular(path, kind) as file:
        total = os.fstat(file.fileno()).st_size
        size = int.from_bytes(file.read(8), "little")
        text = file.read(size) if size <= min(HEADER_MAX_BYTES, total - 8) else b""
    if not text:
        wanted = kind.allowed.removeprefix("a ")
        raise kind.unusable(path, f"no {wanted}: its header is missing or cut off")
    header = parse_json(text, path, allowed=kind.allowed, error=kind.error)
    record = as_record(header, path, kind.allowed, kind.error)
    try:
        return _checked(record, total - 8 - size)
    except (ValueError, TypeError, KeyError) as problem:
        found = f"tensors that are not as their header says ({str(problem)[:120]})"
        raise kind.unusable(path, found) from None


def _checked(record: dict[str, Any], content_bytes: int) -> TensorHeader:
    """The header, once types, shapes and places fit the bytes of the content."""
    metadata = record.pop("__metadata__", {})
    if not isinstance(metadata, dict) or not all(isinstance(v, str) for v in metadata.values()):
        raise ValueError("metadata that is no text")
    if len(record) > TENSORS_MAX:
        raise ValueError(f"{len(record)} tensors")
    shapes = {name: _shape(entry) for name, entry in record.items()}
    places = sorted(tuple(entry["data_offsets"]) for entry in record.values())
    at = 0
    for begin, end in places:
        if begin != at:
            raise ValueError("gaps or overlaps")
        at = end
    if at != content_bytes:
        raise ValueError(f"{at} bytes told, {content_bytes} there")
    return TensorHeader(shapes, metadata)


def _shape(entry: dict[str, Any]) -> tuple[int, ...]:
    """Shape of a tensor that fits its bytes; raises ValueError for others."""
    shape, (begin, end) = entry["shape"], entry["data_offsets"]
    numbers = [*shape, begin, end]
    if len(shape) > AXES_MAX or not all(type(n) is int and n >= 0 for n in numbers):
        raise ValueError("a shape that is none")
    if math.prod(shape) * ITEM_BYTES[entry["dtype"]] != end - begin:
        raise ValueError("a shape that does not fit its bytes")
    return tuple(shape)
