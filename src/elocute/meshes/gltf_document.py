"""Opens glTF 2.0 files undecoded: the JSON as text and as records, the binary chunk, the rest.

What a file holds is never decoded here. Lengths and indices are compared as the JSON states them,
before anything follows them; materials, textures and extensions are left to the programs that draw
them.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, TypeGuard

from elocute.errors import InputError
from elocute.files.json_records import as_record, finite_number, parse_json
from elocute.files.reading import FileKind, bytes_text, read_bytes

LISTS = (
    *("accessors", "animations", "bufferViews", "buffers", "images", "materials", "meshes"),
    *("nodes", "samplers", "scenes", "skins", "textures"),
)
RECORDS_MAX = 1_000_000
NODES_MAX, TARGETS_MAX, PRIMITIVES_MAX = 100_000, 10_000, 10_000
COUNT_MAX = 100_000_000
"""Elements of an accessor: a mesh of a hundred million corners."""
BYTES_MAX = 2**53
INLINE = "data:"
TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""Of components, as NumPy writes them; the last letter is their bytes."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
"""Extensions whose fallback buffers may hold nothing: what is in them is packed elsewhere."""
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
    """A glTF file, checked."""

    data: bytes
    text: str  # its JSON, letter by letter
    record: dict[str, Any]  # the JSON read
    binary: memoryview | None  # the binary chunk with its padding
    others: tuple[tuple[bytes, memoryview], ...] = ()  # kind and content of further chunks

    def records(self, name: str) -> list[dict[str, Any]]:
        """The records of one kind, such as "nodes"; [] where there are none."""
        return self.record.get(name, [])


def read_gltf(path: str | Path, *, error: type[InputError] = InputError) -> GltfDocument:
    """Read a glTF file: a .glb, .vrm or .gltf, or an .fbx, which Blender's module reads.

    Raises an `error` for a file that is missing, too large, damaged or no glTF 2.0, whose parts do
    not fit each other, or that keeps a part in another file, which is never opened; MachineError
    for an .fbx where Blender's module is not installed.
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
    """The parts of a glTF file's bytes. Raises as `read_gltf`."""
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


def morph_targets(mesh: dict[str, Any]) -> list[dict[str, Any]]:
    """The morph targets of a mesh: those of its first primitive that has any.

    The others have as many, or none where they stay as they are.
    """
    return next((each["targets"] for each in mesh["primitives"] if each.get("targets")), [])


def packed(
    text: str, binary: list[bytes | memoryview], others: tuple[tuple[bytes, memoryview], ...] = ()
) -> bytes:
    """A .glb of a JSON text, the parts of its binary chunk ([] for a file without one), and further
    chunks with their kinds."""
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


def check_gltf(
    record: dict[str, Any],
    binary_bytes: int | None,
    subject: str | Path,
    error: type[InputError] = InputError,
) -> None:
    """Check the records of a glTF file whose binary chunk, if any, has so many bytes.

    Raises an `error` that names the record that does not fit, or the other file that is wanted.
    """
    _Checks(record, binary_bytes, subject, error).run()


class _Checks:
    def __init__(
        self,
        record: dict[str, Any],
        binary_bytes: int | None,
        subject: str | Path,
        error: type[InputError],
    ) -> None:
        self.record, self.binary_bytes = record, binary_bytes
        self.subject, self.error = subject, error
        self.lists: dict[str, list[dict[str, Any]]] = {}

    def refuse(
        self, found: str, allowed: str = "glTF 2.0 as it is specified", remedy: str = ""
    ) -> NoReturn:
        raise self.error.about(self.subject, found=found, allowed=allowed, remedy=remedy)

    def run(self) -> None:
        asset = self.record.get("asset")
        version = asset.get("version") if isinstance(asset, dict) else None
        if not isinstance(version, str) or not version.startswith("2."):
            self.refuse(f"asset.version {str(version)[:20]!r}", "glTF 2.0")
        for name in LISTS:
            self.lists[name] = self._list(name)
        self._buffers()
        self._views()
        self._accessors()
        self._images()
        self._meshes()
        self._nodes()
        for number, skin in enumerate(self.lists["skins"]):
            self._indices(f"skins[{number}].joints", skin.get("joints"), "nodes")
        for number, scene in enumerate(self.lists["scenes"]):
            self._indices(f"scenes[{number}].nodes", scene.get("nodes", []), "nodes")

    def _list(self, name: str) -> list[dict[str, Any]]:
        values = self.record.get(name, [])
        if not isinstance(values, list) or not all(isinstance(each, dict) for each in values):
            self.refuse(f"{name} that is no list of records")
        if len(values) > RECORDS_MAX:
            self.refuse(f"{len(values)} {name}", f"up to {RECORDS_MAX}")
        return values

    def _whole(self, value: Any, what: str, top: int = BYTES_MAX, low: int = 0) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= top:
            self.refuse(f"{what} {str(value)[:30]}", f"a whole number, {low} to {top}")
        return value

    def _index(self, value: Any, what: str, kind: str) -> int:
        count = len(self.lists[kind])
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < count:
            self.refuse(f"{what} {str(value)[:30]}", f"one of {count} {kind}")
        return value

    def _indices(self, what: str, values: Any, kind: str) -> list[int]:
        if not isinstance(values, list):
            self.refuse(f"{what} that is no list")
        return [self._index(value, what, kind) for value in values]

    def _uri(self, record: dict[str, Any], what: str) -> str | None:
        """What lies in the file as text; None for nothing. Other files are refused."""
        uri = record.get("uri")
        if uri is None:
            return None
        if not isinstance(uri, str) or not uri.startswith(INLINE):
            self.refuse(
                f"{what} kept in another file ({str(uri)[:60]})",
                "everything in one file, as a .glb has it",
            )
        return uri

    def _buffers(self) -> None:
        for number, buffer in enumerate(self.lists["buffers"]):
            what = f"buffers[{number}]"
            size = self._whole(buffer.get("byteLength"), f"{what}.byteLength")
            uri = self._uri(buffer, what)
            if uri is not None:
                _, comma, content = uri.partition(",")
                there = len(content.rstrip("=")) * 3 // 4 if comma else 0
            elif number == 0 and self.binary_bytes is not None:
                there = self.binary_bytes
            else:
                extensions = buffer.get("extensions")
                known = extensions if isinstance(extensions, dict) else {}
                if not any(name in known for name in MESHOPT):
                    self.refuse(f"{what} without content")
                there = size
            if size > there:
                self.refuse(f"{what} of {size} bytes, of which {there} are there")

    def _views(self) -> None:
        for number, view in enumerate(self.lists["bufferViews"]):
            what = f"bufferViews[{number}]"
            buffer = self._index(view.get("buffer"), f"{what}.buffer", "buffers")
            start = self._whole(view.get("byteOffset", 0), f"{what}.byteOffset")
            size = self._whole(view.get("byteLength"), f"{what}.byteLength", low=1)
            stride = view.get("byteStride")
            if stride is not None:
                self._whole(stride, f"{what}.byteStride", 252, 4)
            if start + size > self.lists["buffers"][buffer]["byteLength"]:
                self.refuse(f"{what} that reaches beyond buffers[{buffer}]")

    def _accessors(self) -> None:
        for number, accessor in enumerate(self.lists["accessors"]):
            what = f"accessors[{number}]"
            kind, component = accessor.get("type"), accessor.get("componentType")
            if not isinstance(kind, str) or kind not in WIDTHS:
                self.refuse(f"{what}.type {str(kind)[:30]!r}", ", ".join(WIDTHS))
            if not isinstance(component, int) or component not in TYPES:
                self.refuse(f"{what}.componentType {str(component)[:30]}")
            count = self._whole(accessor.get("count"), f"{what}.count", COUNT_MAX, 1)
            size = WIDTHS[kind] * int(TYPES[component][-1])
            if "bufferView" in accessor:
                self._inside(what, accessor, count, size)
            sparse = accessor.get("sparse")
            if sparse is not None:
                self._sparse(f"{what}.sparse", sparse, count, size)

    def _inside(self, what: str, part: dict[str, Any], count: int, size: int) -> None:
        """Elements that lie in their view."""
        number = self._index(part.get("bufferView"), f"{what}.bufferView", "bufferViews")
        view = self.lists["bufferViews"][number]
        start = self._whole(part.get("byteOffset", 0), f"{what}.byteOffset")
        stride = view.get("byteStride") or size
        if start + (count - 1) * stride + size > view["byteLength"]:
            self.refuse(f"{what} that reaches beyond bufferViews[{number}]")

    def _sparse(self, what: str, sparse: Any, most: int, size: int) -> None:
        indices = sparse.get("indices") if _is(sparse) else None
        values = sparse.get("values") if _is(sparse) else None
        if not _is(indices) or not _is(values):
            self.refuse(f"{what} without indices or values")
        count = self._whole(sparse.get("count"), f"{what}.count", most, 1)
        component = indices.get("componentType")
        if not isinstance(component, int) or component not in TYPES:
            self.refuse(f"{what}.indices.componentType {str(component)[:30]}")
        self._inside(f"{what}.indices", indices, count, int(TYPES[component][-1]))
        self._inside(f"{what}.values", values, count, size)

    def _images(self) -> None:
        for number, image in enumerate(self.lists["images"]):
            self._uri(image, f"images[{number}]")
            if "bufferView" in image:
                self._index(image["bufferView"], f"images[{number}].bufferView", "bufferViews")

    def _meshes(self) -> None:
        for number, mesh in enumerate(self.lists["meshes"]):
            what, primitives = f"meshes[{number}]", mesh.get("primitives")
            if not isinstance(primitives, list) or not all(_is(each) for each in primitives):
                self.refuse(f"{what}.primitives that is no list of records")
            if not 0 < len(primitives) <= PRIMITIVES_MAX:
                self.refuse(f"{what} of {len(primitives)} primitives", f"1 to {PRIMITIVES_MAX}")
            counts = [len(self._targets(what, each)) for each in primitives]
            most = len(morph_targets(mesh))
            for place, count in enumerate(counts):
                if count not in (0, most):
                    self.refuse(
                        f"{what}.primitives[{place}] with {count} morph targets beside {most}",
                        "one number in all primitives of a mesh, or none",
                        "split the mesh by its materials, or export it by another program",
                    )
            self._weights(f"{what}.weights", mesh.get("weights"), most)

    def _targets(self, what: str, primitive: dict[str, Any]) -> list[Any]:
        attributes = primitive.get("attributes")
        if not _is(attributes):
            self.refuse(f"{what} without attributes")
        targets = primitive.get("targets", [])
        if not isinstance(targets, list) or not all(_is(each) for each in targets):
            self.refuse(f"{what}.targets that is no list of records")
        if len(targets) > TARGETS_MAX:
            self.refuse(f"{what} of {len(targets)} morph targets", f"up to {TARGETS_MAX}")
        for part in (attributes, *targets):
            for name, index in part.items():
                if name in ("POSITION", "NORMAL", "TANGENT"):
                    self._index(index, f"{what} {name}", "accessors")
        return targets

    def _weights(self, what: str, weights: Any, count: int) -> None:
        if weights is None:
            return
        numbers = isinstance(weights, list) and all(finite_number(w) is not None for w in weights)
        if not numbers or len(weights) != count:
            self.refuse(f"{what} that are not one number for each morph target")

    def _nodes(self) -> None:
        nodes, meshes = self.lists["nodes"], self.lists["meshes"]
        if len(nodes) > NODES_MAX:
            self.refuse(f"{len(nodes)} nodes", f"up to {NODES_MAX}")
        parents: dict[int, int] = {}
        for number, node in enumerate(nodes):
            what = f"nodes[{number}]"
            for child in self._indices(f"{what}.children", node.get("children", []), "nodes"):
                if child in parents:
                    self.refuse(f"nodes[{child}] with two parents")
                parents[child] = number
            if "skin" in node:
                self._index(node["skin"], f"{what}.skin", "skins")
            if "mesh" in node:
                mesh = meshes[self._index(node["mesh"], f"{what}.mesh", "meshes")]
                self._weights(f"{what}.weights", node.get("weights"), len(morph_targets(mesh)))
            for name, size in (("translation", 3), ("rotation", 4), ("scale", 3), ("matrix", 16)):
                self._numbers(f"{what}.{name}", node.get(name), size)
        self._no_circle(parents)

    def _numbers(self, what: str, values: Any, size: int) -> None:
        if values is None:
            return
        right = isinstance(values, list) and len(values) == size
        if not right or any(finite_number(value) is None for value in values):
            self.refuse(f"{what} that is not {size} numbers")

    def _no_circle(self, parents: dict[int, int]) -> None:
        """Every node hangs from one that nothing holds."""
        nodes = self.lists["nodes"]
        left = [number for number in range(len(nodes)) if number not in parents]
        seen = 0
        while left:
            seen += 1
            left += nodes[left.pop()].get("children", [])
        if seen != len(nodes):
            self.refuse("nodes that hold each other in a circle")


def _is(value: Any) -> TypeGuard[dict[str, Any]]:
    return isinstance(value, dict)
