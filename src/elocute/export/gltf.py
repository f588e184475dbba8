"""glTF 2.0 (.glb): morph targets with names and weight animation, joints, the sound.

One mesh, one primitive per material, so that a single weights channel moves everything. Shapes
are sparse accessors. jawOpen is a morph target; the jaw joint is there to pose, and rests.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.export.options import GlbOptions
from elocute.export.soundtrack import Sound, pack_sound, sound_source, write_wav
from elocute.files.atomic import write_atomically
from elocute.files.output_plan import OutputPlan
from elocute.head.model import HeadModel
from elocute.head.normals import (
    linear_colors,
    morphed_normals,
    moved_vertices,
    vertex_normals,
)
from elocute.motion.motion import Motion

FLOAT, USHORT, UBYTE, UINT = 5126, 5123, 5121, 5125
ARRAY_BUFFER, ELEMENT_BUFFER = 34962, 34963
NORMAL_STEP = 0.01  # changes of a unit normal below this are not stored
ROUGHNESS = {
    "skin": 0.55,
    "lips": 0.38,
    "mouth": 0.5,
    "teeth": 0.25,
    "gums": 0.35,
    "tongue": 0.45,
    "eyeball": 0.08,
    "hair": 0.8,
}


def write_glb(
    motion: Motion,
    path: str | Path,
    *,
    sound: Sound | None = None,
    options: GlbOptions | None = None,
    overwrite: bool = False,
    progress: Any = None,
) -> None:
    """Write an animated head as .glb, its sound beside it as NAME.wav or inside.

    Parameters
    ----------
    motion : Motion
        What to write.
    path : str or Path
        The file; one of that name is replaced.
    sound : str, Path or Waveform, optional
        The sound that belongs to the motion. A file that is NAME.wav already is left alone.
    options : GlbOptions, optional
        Whether the sound goes inside.
    overwrite : bool
        Whether to replace a NAME.wav that an earlier call did not make from this very sound, or
        that was changed since.
    progress : callable, optional
        Not called: the file is written at once.

    Raises
    ------
    OutputError
        For a place that cannot be written, and a NAME.wav that would be replaced without
        `overwrite`; nothing is written then.
    """
    path, embed_audio = Path(path), (options or GlbOptions()).embed_audio
    beside = None if embed_audio or sound is None else wav_beside(path, sound)
    if beside is None or sound is None:
        with write_atomically(path) as draft:
            draft.write_bytes(glb_bytes(motion, sound if embed_audio else None))
        return
    plan = OutputPlan(remedy="overwrite=True replaces it")
    plan.add(beside, sound_source(sound), beside=path)
    plan.check(overwrite=overwrite)
    with plan.writing(beside), write_atomically(beside) as wav, write_atomically(path) as draft:
        write_wav(sound, wav)
        draft.write_bytes(glb_bytes(motion))


def wav_beside(path: Path, sound: Sound) -> Path | None:
    """Where the sound of a .glb goes, or None where it lies there already."""
    beside = path.with_suffix(".wav")
    return None if _same(sound, beside) else beside


def glb_bytes(motion: Motion, sound: Sound | None = None) -> bytes:
    """An animated head as the bytes of a .glb.

    Parameters
    ----------
    motion : Motion
        What to write.
    sound : str, Path or Waveform, optional
        Embedded, where given.

    Returns
    -------
    bytes
    """
    file = _File()
    head = motion.head
    file.json["asset"] |= {"copyright": head.notice} if head.notice else {}
    materials = [file.material(name) for name in head.material_names]
    mesh = {
        "name": "head",
        "primitives": _primitives(file, head, materials),
        "weights": [0.0] * len(motion.names),
        "extras": {"targetNames": list(motion.names)},
    }
    file.json["meshes"] = [mesh]
    nodes: list[dict[str, Any]] = [{"name": "face", "mesh": 0}]
    roots = [0]
    if head.joint_names:
        roots += _joints(file, head, nodes)
        nodes[0]["skin"] = 0
    file.json["nodes"] = nodes
    file.json["scenes"] = [{"nodes": roots}]
    _animate(file, motion)
    if sound is not None:
        _embed(file, sound)
    return file.pack()


@dataclass
class _File:
    """JSON and buffer as they grow."""

    json: dict[str, Any] = field(default_factory=lambda: _empty_json())
    chunks: list[bytes] = field(default_factory=list)
    still: dict[tuple[int, bool], int] = field(default_factory=dict)
    size: int = 0

    def view(self, data: bytes, target: int | None = None) -> int:
        """A buffer view of `data`, aligned to four bytes."""
        pad = -len(data) % 4
        view: dict[str, Any] = {"buffer": 0, "byteOffset": self.size, "byteLength": len(data)}
        if target:
            view["target"] = target
        self.json["bufferViews"].append(view)
        self.chunks.append(data + b"\0" * pad)
        self.size += len(data) + pad
        return len(self.json["bufferViews"]) - 1

    def accessor(self, **record: Any) -> int:
        self.json["accessors"].append(record)
        return len(self.json["accessors"]) - 1

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
        return self.accessor(**record)

    def sparse(
        self, rows: NDArray[np.intp], values: NDArray[np.float32], count: int, bounds: bool
    ) -> int:
        """An accessor of `count` vectors that are zero but for `rows`."""
        record: dict[str, Any] = {"componentType": FLOAT, "count": count, "type": "VEC3"}
        if not len(rows):
            return self._still(record, bounds)
        if bounds:
            low, high = values.min(axis=0), values.max(axis=0)
            if len(rows) < count:
                low, high = np.minimum(low, 0), np.maximum(high, 0)
            record |= {"min": low.tolist(), "max": high.tolist()}
        record["sparse"] = {
            "count": len(rows),
            "indices": {
                "bufferView": self.view(rows.astype(np.uint32).tobytes()),
                "componentType": UINT,
            },
            "values": {"bufferView": self.view(values.astype(np.float32).tobytes())},
        }
        return self.accessor(**record)

    def _still(self, record: dict[str, Any], bounds: bool) -> int:
        """Vectors that are all zero; every target that moves nothing shares them."""
        key = record["count"], bounds
        if key not in self.still:
            ends = {"min": [0.0] * 3, "max": [0.0] * 3} if bounds else {}
            self.still[key] = self.accessor(**record, **ends)
        return self.still[key]

    def material(self, name: str) -> int:
        self.json["materials"].append(
            {
                "name": name,
                "pbrMetallicRoughness": {
                    "metallicFactor": 0.0,
                    "roughnessFactor": ROUGHNESS.get(name, 0.5),
                },
                "doubleSided": name in ("mouth", "tongue", "hair"),
            }
        )
        return len(self.json["materials"]) - 1

    def pack(self) -> bytes:
        self.json["buffers"] = [{"byteLength": self.size}]
        record = {name: value for name, value in self.json.items() if value != []}
        text = json.dumps(record, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        binary = b"".join(self.chunks)
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

    return {
        "asset": {"version": "2.0", "generator": f"Elocute {__version__}"},
        "scene": 0,
        "scenes": [],
        "nodes": [],
        "meshes": [],
        "materials": [],
        "skins": [],
        "animations": [],
        "accessors": [],
        "bufferViews": [],
    }


def _primitives(file: _File, head: HeadModel, materials: list[int]) -> list[dict[str, Any]]:
    """One primitive per material that has faces; corners are split where texture seams need it."""
    triangles = head.triangles
    normals = vertex_normals(head.template, triangles)
    shapes = _shapes(head)
    colors = linear_colors(head)
    result = []
    for index, material in enumerate(materials):
        chosen = head.triangle_material == index
        if not chosen.any():
            continue
        keys = (
            triangles[chosen].ravel() * np.int64(len(head.uv)) + head.uv_triangles[chosen].ravel()
        )
        corners, faces = np.unique(keys, return_inverse=True)
        vertices, texels = np.divmod(corners, len(head.uv))
        attributes = _attributes(file, head, vertices, texels, normals, colors)
        targets = [
            {
                name: _target(file, vertices, *part, bounds=name == "POSITION")
                for name, part in shape.items()
            }
            for shape in shapes
        ]
        # 65535 is the restart value and may not be used as an index.
        small = len(vertices) < 65535
        indices = file.array(
            faces.ravel().astype(np.uint16 if small else np.uint32),
            "SCALAR",
            USHORT if small else UINT,
            ELEMENT_BUFFER,
        )
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        result.append(primitive | ({"targets": targets} if targets else {}))
    return result


def _attributes(
    file: _File,
    head: HeadModel,
    vertices: NDArray[Any],
    texels: NDArray[Any],
    normals: NDArray[np.float32],
    colors: NDArray[np.float32],
) -> dict[str, int]:
    uv = head.uv[texels].astype(np.float32) * [1, -1] + [0, 1]  # glTF counts from the top
    rgba = np.concatenate([colors[vertices], np.ones((len(vertices), 1))], axis=1)
    attributes = {
        "POSITION": file.array(
            head.template[vertices].astype(np.float32), "VEC3", FLOAT, ARRAY_BUFFER, bounds=True
        ),
        "NORMAL": file.array(_unit(normals[vertices]), "VEC3", FLOAT, ARRAY_BUFFER),
        "TEXCOORD_0": file.array(uv.astype(np.float32), "VEC2", FLOAT, ARRAY_BUFFER),
        "COLOR_0": file.array(
            np.round(rgba * 65535).astype(np.uint16), "VEC4", USHORT, ARRAY_BUFFER, normalized=True
        ),
    }
    if head.joint_names:
        joints, weights = _four_joints(head.skin_weights[vertices])
        attributes["JOINTS_0"] = file.array(joints, "VEC4", UBYTE, ARRAY_BUFFER)
        attributes["WEIGHTS_0"] = file.array(weights, "VEC4", FLOAT, ARRAY_BUFFER)
    return attributes


def _unit(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """A vertex of no area still needs a unit normal."""
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(lengths > 0.5, normals / np.maximum(lengths, 1e-6), [[0, 0, 1]]).astype(
        np.float32
    )


def _four_joints(weights: NDArray[np.float32]) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """The four strongest joints of each vertex; no joint twice, unused ones zero."""
    padded = np.pad(weights, ((0, 0), (0, max(0, 4 - weights.shape[1]))))
    joints = np.argsort(-padded, axis=1)[:, :4]
    kept = np.take_along_axis(padded, joints, axis=1)
    kept = kept / np.maximum(kept.sum(axis=1, keepdims=True), 1e-9)
    return np.where(kept > 0, joints, 0).astype(np.uint8), kept.astype(np.float32)


_Part = tuple[NDArray[np.bool_], NDArray[np.float32]]


def _shapes(head: HeadModel) -> list[dict[str, _Part]]:
    """Per shape: (vertex,) which vertices it moves and turns, and (vertex, 3) by how much."""
    shapes: list[dict[str, _Part]] = []
    turns = morphed_normals(head.template, head.triangles, head.expression_basis)
    for delta, (near, change) in zip(head.expression_basis, turns, strict=True):
        clear = (change * change).sum(axis=1) > NORMAL_STEP**2
        turned, turn = np.zeros(len(delta), bool), np.zeros_like(delta)
        turned[near[clear]], turn[near[clear]] = True, change[clear]
        shapes.append({"POSITION": (moved_vertices(delta), delta), "NORMAL": (turned, turn)})
    return shapes


def _target(
    file: _File,
    vertices: NDArray[Any],
    moved: NDArray[np.bool_],
    deltas: NDArray[np.float32],
    bounds: bool,
) -> int:
    """One morph target of the primitive whose corners stand on `vertices`."""
    rows = np.flatnonzero(moved[vertices])
    return file.sparse(rows, deltas[vertices[rows]], len(vertices), bounds)


def _joints(file: _File, head: HeadModel, nodes: list[dict[str, Any]]) -> list[int]:
    """Append a node per joint and the skin; returns the root joints."""
    first = len(nodes)
    positions = head.joint_positions.astype(float)
    for joint, (name, parent) in enumerate(zip(head.joint_names, head.joint_parents, strict=True)):
        offset = positions[joint] - (positions[parent] if parent >= 0 else 0)
        nodes.append({"name": name, "translation": offset.tolist()})
        if parent >= 0:
            nodes[first + parent].setdefault("children", []).append(first + joint)
    inverse = np.tile(np.eye(4, dtype=np.float32), (len(positions), 1, 1))
    inverse[:, 3, :3] = -positions  # columns first, as glTF wants
    bind = file.array(inverse.reshape(-1, 16), "MAT4", FLOAT)
    joints = list(range(first, first + len(positions)))
    roots = [first + joint for joint, parent in enumerate(head.joint_parents) if parent < 0]
    file.json["skins"] = [{"inverseBindMatrices": bind, "joints": joints}]
    return roots


def _animate(file: _File, motion: Motion) -> None:
    times = motion.times_s.astype(np.float32)
    clock = file.array(times, "SCALAR", FLOAT, bounds=True)
    samplers, channels = [], []

    def add(output: int, node: int, path: str) -> None:
        samplers.append({"input": clock, "output": output, "interpolation": "LINEAR"})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})

    if motion.names:
        add(file.array(motion.weights.ravel(), "SCALAR", FLOAT), 0, "weights")
    if motion.rotations is not None:
        for joint in range(motion.rotations.shape[1]):
            turns = motion.rotations[:, joint][:, [1, 2, 3, 0]]  # glTF writes xyzw
            turns = turns / np.linalg.norm(turns, axis=1, keepdims=True)
            add(file.array(turns.astype(np.float32), "VEC4", FLOAT), 1 + joint, "rotation")
    if channels:
        file.json["animations"] = [{"name": "speech", "samplers": samplers, "channels": channels}]


def _embed(file: _File, sound: Sound) -> None:
    """The sound as KHR_audio_emitter describes it; players that do not know it go on without."""
    data, media = pack_sound(sound)
    file.json["extensionsUsed"] = ["KHR_audio_emitter"]
    file.json["extensions"] = {
        "KHR_audio_emitter": {
            "audio": [{"bufferView": file.view(data), "mimeType": media}],
            "sources": [{"audio": 0, "autoPlay": True, "loop": False}],
            "emitters": [{"type": "global", "sources": [0]}],
        }
    }
    file.json["scenes"][0]["extensions"] = {"KHR_audio_emitter": {"emitters": [0]}}


def _same(sound: Sound, beside: Path) -> bool:
    if not isinstance(sound, str | Path):
        return False
    try:
        return Path(sound).samefile(beside)
    except (OSError, ValueError):  # one of them is not there, or cannot be
        return False
