"""A .glb made small for the net: numbers packed by meshopt, images as WebP.

What loaders see is laid out as before (EXT_meshopt_compression, EXT_texture_webp); numbers are
coarser. Places and shapes keep about a hundredth of a millimetre, texture coordinates 1/4096.
"""

from __future__ import annotations

import copy
import io
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import MachineError
from elocute.export.gltf_file import COMPONENTS, GltfFile, index_type
from elocute.meshes.gltf_arrays import GltfArrays
from elocute.meshes.gltf_document import gltf_document

MESHOPT, WEBP = "EXT_meshopt_compression", "EXT_texture_webp"
# Bits of the numbers that an accessor has, by what it is for; of each column by its largest.
BITS = {"POSITION": 15, "NORMAL": 8, "_STRAND": 8, "_OCCLUSION": 8, "rotation": 16, "weights": 13}
SHAPE_BITS = {"POSITION": 13, "NORMAL": 6}
LEAST_TURN = 0.04  # changes of a unit normal below this are left out
UV_STEPS, WHOLE_16 = 4095, 65535
BYTES = ("COLOR_0", "WEIGHTS_0", "JOINTS_0")
ELEMENT_MAX_BYTES = 256
SIDE_MAX = 1024
SIDES = {"clothes_normal": 512, "tongue_normal": 256, "skin_roughness": 512}
QUALITY, CLEAR_QUALITY = 82, 70  # of WebP, and of its alpha


def web_glb(data: bytes) -> bytes:
    """The bytes of a .glb that was written here, made small.

    Raises MachineError where the package `meshopt` is not installed.
    """
    try:
        import meshopt  # noqa: F401
    except ImportError as problem:
        raise MachineError(
            "files for the web are packed by the package meshopt; install it: "
            'pip install "elocute[web]"'
        ) from problem
    return _WebFile(data).pack()


class _WebFile:
    """The same records, whose accessors and images lie in other bytes."""

    def __init__(self, data: bytes) -> None:
        self._document = gltf_document(data, "head")
        self._arrays = GltfArrays(self._document)
        self._file = GltfFile()
        self._json = copy.deepcopy(self._document.record)
        self._file.json |= self._json | {"bufferViews": []}
        self._json = self._file.json
        self._unpacked = 0  # bytes of a buffer that is nowhere
        self._done: set[int] = set()

    def pack(self) -> bytes:
        """The file."""
        for mesh in self._json["meshes"]:
            for primitive in mesh["primitives"]:
                self._triangles(primitive["indices"], primitive["attributes"]["POSITION"])
                for name, number in primitive["attributes"].items():
                    self._numbers(number, name)
                self._shapes(primitive.get("targets", ()))
        for skin in self._json.get("skins", ()):
            self._numbers(skin["inverseBindMatrices"], "")
        for animation in self._json.get("animations", ()):
            for channel in animation["channels"]:
                sampler = animation["samplers"][channel["sampler"]]
                self._numbers(sampler["input"], "")
                self._numbers(sampler["output"], channel["target"]["path"])
        for number, image in enumerate(self._json.get("images", ())):
            self._json["images"][number] = self._image(image)
        for texture in self._json.get("textures", ()):
            texture["extensions"] = {WEBP: {"source": texture.pop("source")}}
        emitters = self._json.get("extensions", {}).get("KHR_audio_emitter", {})
        for sound in emitters.get("audio", ()):
            sound["bufferView"] = self._file.view(self._bytes(sound["bufferView"]))
        for extension in (MESHOPT, *([WEBP] if self._json.get("images") else [])):
            self._file.uses(extension)
        self._json["extensionsRequired"] = [
            each for each in (MESHOPT, WEBP) if each in self._json["extensionsUsed"]
        ]
        nowhere = {"byteLength": self._unpacked, "extensions": {MESHOPT: {"fallback": True}}}
        return self._file.pack(nowhere)

    def _first(self, number: int) -> bool:
        """Whether an accessor is met for the first time."""
        first = number not in self._done
        self._done.add(number)
        return first

    def _triangles(self, number: int, places: int) -> None:
        import meshopt

        if not self._first(number):
            return
        record = self._json["accessors"][number]
        corners = self._arrays.values(number).astype(np.uint32).ravel()
        # In the order that packs well; the vertices stay where they are.
        ordered, places_of, used = meshopt.reorder_mesh(corners, triangles=True, optsize=True)
        corners = np.argsort(places_of)[:used].astype(np.uint32)[ordered]
        kind = index_type(self._json["accessors"][places]["count"])
        view = self._view(
            meshopt.encode_gltf_buffer(corners, "TRIANGLES"),
            len(corners),
            np.dtype(kind).itemsize,
            "TRIANGLES",
        )
        record |= {"bufferView": view, "componentType": COMPONENTS[np.dtype(kind).name]}

    def _numbers(self, number: int, name: str) -> None:
        """A dense accessor, with the bits that its use needs."""
        record = self._json["accessors"][number]
        if not self._first(number) or "bufferView" not in record:
            return
        values = self._arrays.values(number)
        if name == "TEXCOORD_0" and values.min() >= 0 and values.max() <= 1:
            whole = np.round(np.round(values * UV_STEPS) * (WHOLE_16 / UV_STEPS)).astype(np.uint16)
            self._packed(record, whole, normalized=True)
        elif name in BYTES or name.startswith("_FOLDS"):
            normal = name != "JOINTS_0"
            whole = values * 255 if normal else values
            if name == "WEIGHTS_0":
                whole = _whole_shares(whole)
            self._packed(record, np.round(whole).astype(np.uint8), normalized=normal)
        elif name in BITS:
            rows = values.astype(np.float32)
            if name == "weights":  # a row for each frame, where one element holds it
                frames = self._frames(number)
                wide = rows.reshape(frames, -1)
                rows = wide if 4 * wide.shape[1] <= ELEMENT_MAX_BYTES else rows
            self._packed(record, rows, bits=BITS[name])
        else:
            record["bufferView"] = self._file.view(values.astype("<f4").tobytes())

    def _frames(self, number: int) -> int:
        for animation in self._json["animations"]:
            for sampler in animation["samplers"]:
                if sampler["output"] == number:
                    return self._json["accessors"][sampler["input"]]["count"]
        raise KeyError(number)

    def _shapes(self, targets: Sequence[dict[str, int]]) -> None:
        """All shapes of a primitive: each one's places and normals over the same vertices, what is
        alike of all in one view."""
        import meshopt

        targets = [each for each in targets if self._first(each["POSITION"])]
        moved = [self._moved(target) for target in targets]
        starts = np.cumsum([0, *(len(rows) for rows, _ in moved)])
        if not starts[-1]:
            return
        count = self._json["accessors"][targets[0]["POSITION"]]["count"]
        kind = np.dtype(index_type(count))
        rows = np.concatenate([each for each, _ in moved]).astype(np.uint32)
        packed = meshopt.encode_gltf_buffer(rows, "INDICES")
        places = self._view(packed, len(rows), kind.itemsize, "INDICES")
        for name in targets[0]:
            values: dict[str, Any] = {}
            changes = np.concatenate([each[name] for _, each in moved]).astype(np.float32)
            seen = self._packed(values, changes, SHAPE_BITS[name])
            for target, start, end in zip(targets, starts, starts[1:], strict=False):
                record = self._json["accessors"][target[name]]
                record.pop("sparse", None)
                if start < end:
                    record["sparse"] = {
                        "count": int(end - start),
                        "indices": {
                            "bufferView": places,
                            "byteOffset": int(start) * kind.itemsize,
                            "componentType": COMPONENTS[kind.name],
                        },
                        "values": {
                            "bufferView": values["bufferView"],
                            "byteOffset": int(start) * changes.itemsize * 3,
                        },
                    }
                if "min" in record:
                    still = np.zeros((int(end - start < count), 3), np.float32)
                    record |= _ends(np.concatenate([seen[start:end], still]))

    def _moved(self, target: dict[str, int]) -> tuple[NDArray[np.intp], dict[str, NDArray[Any]]]:
        """The vertices that a shape moves or turns, and by how much."""
        full = {name: self._arrays.values(number) for name, number in target.items()}
        if "NORMAL" in full:
            clear = np.abs(full["NORMAL"]).max(axis=1, keepdims=True) >= LEAST_TURN
            full["NORMAL"] = np.where(clear, full["NORMAL"], 0)
        rows = np.flatnonzero(np.any([each.any(axis=1) for each in full.values()], axis=0))
        return rows, {name: each[rows] for name, each in full.items()}

    def _packed(
        self,
        record: dict[str, Any],
        rows: NDArray[Any],
        bits: int | None = None,
        normalized: bool = False,
    ) -> NDArray[Any]:
        """Pack rows as what an accessor has; the numbers that come out again."""
        import meshopt

        stored, how = rows, "NONE"
        if bits is not None:
            stored, how = meshopt.encode_filter_exp(rows, bits, "SharedComponent"), "EXPONENTIAL"
        size = stored.nbytes // len(stored)
        data = meshopt.encode_gltf_buffer(stored, "ATTRIBUTES")
        record["bufferView"] = self._view(data, len(stored), size, "ATTRIBUTES", how)
        record["componentType"] = COMPONENTS[rows.dtype.name]
        if normalized:
            record["normalized"] = True
        unpacked = meshopt.decode_gltf_buffer(data, len(stored), size, "ATTRIBUTES", how)
        seen = np.ascontiguousarray(unpacked).view(rows.dtype).reshape(rows.shape)
        if "min" in record and bits is not None:
            record |= _ends(seen)
        return seen

    def _view(self, data: bytes, count: int, size: int, mode: str, how: str = "NONE") -> int:
        number = self._file.view(data)
        view = self._json["bufferViews"][number]
        packed = {"buffer": 0, "byteOffset": view["byteOffset"], "byteLength": len(data)}
        packed |= {"byteStride": size, "count": count, "mode": mode}
        packed |= {"filter": how} if how != "NONE" else {}
        view |= {"buffer": 1, "byteOffset": self._unpacked, "byteLength": count * size}
        view["extensions"] = {MESHOPT: packed}
        self._unpacked += count * size + -(count * size) % 4
        return number

    def _bytes(self, view: int) -> bytes:
        place = self._document.records("bufferViews")[view]
        assert self._document.binary is not None
        start = place.get("byteOffset", 0)
        return bytes(self._document.binary[start : start + place["byteLength"]])

    def _image(self, image: dict[str, Any]) -> dict[str, Any]:
        from PIL import Image

        side, file = SIDES.get(image.get("name", ""), SIDE_MAX), io.BytesIO()
        with Image.open(io.BytesIO(self._bytes(image["bufferView"]))) as picture:
            clear = "A" in picture.getbands()
            small = picture.convert("RGBA" if clear else "RGB")
            small.thumbnail((side, side))
            small.save(file, "WEBP", quality=QUALITY, alpha_quality=CLEAR_QUALITY, method=4)
        view = self._file.view(file.getvalue())
        return image | {"bufferView": view, "mimeType": "image/webp"}


def _whole_shares(weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows (vertex, 4) of shares of 255 as whole numbers that add up to it: the first has what
    rounding leaves."""
    whole = np.round(weights)
    whole[:, 0] += 255 - whole.sum(axis=1)
    return whole


def _ends(values: NDArray[Any]) -> dict[str, list[float]]:
    low, high = values.min(axis=0), values.max(axis=0)
    return {"min": np.atleast_1d(low).tolist(), "max": np.atleast_1d(high).tolist()}
