"""Opens glTF 2.0 files undecoded: the JSON as text and as records, the binary chunk, the rest.

What a file holds is never decoded here; `gltf_checks` says whether its parts fit each other.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from elocute.errors import InputError
from elocute.files.json_records import as_record, parse_json
from elocute.files.reading import FileKind, bytes_text, read_bytes
from elocute.meshes.gltf_checks import check_gltf

FBX_SUFFIX = ".fbx"
SUFFIXES = (".glb", ".gltf", ".vrm", FBX_SUFFIX)
"""Of what is read as glTF; Blender's module makes it of an FBX."""
FILE_MAX_BYTES = 400_000_000
CHUNKS_MAX = 1000
ALLOWED = "a glTF 2.0 file (.glb, .vrm, or .gltf with everything inside)"
MAGIC = b"glTF"
JSON_CHUNK, BINARY_CHUNK = b"JSON", b"BIN\0"
_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")


@dataclass(frozen=True, eq=False)
class GltfDocument:
    """A glTF file, checked.

    Attributes
    ----------
    data : bytes
        The file.
    text : str
        Its JSON, letter by letter.
    record : dict
        The JSON read.
    binary : bytes-like or None
        The binary chunk with its padding.
    others : tuple of (bytes, bytes-like)
        Kind and content of further chunks.
    """

    data: bytes
    text: str
    record: dict[str, Any]
    binary: memoryview | None
    others: tuple[tuple[bytes, memoryview], ...] = ()

    def records(self, name: str) -> list[dict[str, Any]]:
        """The records of one kind, such as "nodes"; [] where there are none."""
        return self.record.get(name, [])


def read_gltf(path: str | Path, *, error: type[InputError] = InputError) -> GltfDocument:
    """Read a glTF file.

    Parameters
    ----------
    path : str or Path
        A .glb, .vrm or .gltf, or an .fbx, which Blender's module reads.
    error : type of InputError
        The class to raise.

    Returns
    -------
    GltfDocument

    Raises
    ------
    InputError
        Of the class `error`, for a file that is missing, too large, damaged or no glTF 2.0, whose
        parts do not fit each other, or that keeps a part in another file, which is never opened.
    MachineError
        For an .fbx where Blender's module is not installed.
    """
    return gltf_document(read_gltf_bytes(path, FILE_MAX_BYTES, error), path, error=error)


def read_gltf_bytes(path: str | Path, max_bytes: int, error: type[InputError]) -> bytes:
    """The bytes of a glTF file, or those that an .fbx becomes. Raises as `read_gltf`."""
    if Path(path).suffix.lower() == FBX_SUFFIX:
        from elocute.meshes.fbx_gltf import read_fbx

        return read_fbx(path, error=error)
    return read_bytes(path, FileKind(ALLOWED, max_bytes, error))


def gltf_document(
    data: bytes, subject: str | Path, *, error: type[InputError] = InputError
) -> GltfDocument:
    """Take the bytes of a glTF file apart.

    Parameters
    ----------
    data : bytes
        The file.
    subject : str or Path
        Where it is from, for messages.
    error : type of InputError
        The class to raise.

    Returns
    -------
    GltfDocument

    Raises
    ------
    InputError
        Of the class `error`, as `read_gltf` says.
    """
    if data[:4] == MAGIC:
        first, binary, others = _chunks(data, subject, error)
    else:
        first, binary, others = memoryview(data), None, ()
    raw = bytes(first).removeprefix(b"\xef\xbb\xbf").rstrip(b" \0")  # padding, by old writers of 0
    record = as_record(
        parse_json(raw, subject, allowed=ALLOWED, error=error), subject, ALLOWED, error
    )
    check_gltf(record, None if binary is None else len(binary), subject, error)
    return GltfDocument(data, raw.decode("utf-8"), record, binary, others)


def packed(
    text: str, binary: list[bytes | memoryview], others: tuple[tuple[bytes, memoryview], ...] = ()
) -> bytes:
    """A .glb of a JSON text and the parts of its binary chunk.

    Parameters
    ----------
    text : str
        The JSON.
    binary : list of bytes-like
        One after another; [] for a file without that chunk.
    others : tuple of (bytes, bytes-like)
        Kind and content of further chunks.

    Returns
    -------
    bytes
    """
    letters = text.encode("utf-8")
    chunks = [*_padded(JSON_CHUNK, [letters], b" ")]
    if binary:
        chunks += _padded(BINARY_CHUNK, binary, b"\0")
    for kind, content in others:
        chunks += _padded(kind, [content], b"\0")
    total = _HEADER.size + sum(len(part) for part in chunks)
    return b"".join([_HEADER.pack(MAGIC, 2, total), *chunks])


def _padded(kind: bytes, parts: list[Any], filler: bytes) -> list[Any]:
    size = sum(len(part) for part in parts)
    rest = filler * (-size % 4)
    return [_CHUNK.pack(size + len(rest), kind), *parts, rest]


def _chunks(
    data: bytes, subject: str | Path, error: type[InputError]
) -> tuple[memoryview, memoryview | None, tuple[tuple[bytes, memoryview], ...]]:
    """The JSON, the binary chunk, and what follows them."""
    if len(data) < _HEADER.size + _CHUNK.size:
        raise error.about(subject, found="a .glb that ends early", allowed=ALLOWED)
    _, version, total = _HEADER.unpack_from(data)
    if version != 2:
        raise error.about(subject, found=f"glTF of version {version}", allowed=ALLOWED)
    if total > len(data):
        found = f"{bytes_text(len(data))} of a .glb of {bytes_text(total)}"
        raise error.about(subject, found=found, allowed=ALLOWED, remedy="copy it again")
    view, at, chunks = memoryview(data), _HEADER.size, []
    while at + _CHUNK.size <= total and len(chunks) < CHUNKS_MAX:
        length, kind = _CHUNK.unpack_from(data, at)
        at += _CHUNK.size
        if length > total - at:
            raise error.about(subject, found="a chunk that ends early", allowed=ALLOWED)
        chunks.append((kind, view[at : at + length]))
        at += length
    if not chunks or chunks[0][0] != JSON_CHUNK:
        raise error.about(subject, found="a .glb that does not begin with JSON", allowed=ALLOWED)
    if len(chunks) > 1 and chunks[1][0] == BINARY_CHUNK:
        return chunks[0][1], chunks[1][1], tuple(chunks[2:])
    return chunks[0][1], None, tuple(chunks[1:])
