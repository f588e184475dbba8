"""Every frame as a mesh file, or all of them as one array."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.files.array_writing import RowWriter
from elocute.files.atomic import write_atomically, write_folder_atomically
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion

BLOCK = 120

MeshBytes = Callable[[NDArray[np.float32]], bytes]


def write_obj(
    motion: Motion, path: str | Path, *, sound: object = None, progress: Any = None
) -> None:
    """A folder `path` (say `talk.obj`) of 00000.obj, 00001.obj, … in metres.

    Raises OutputError where the folder is there already.
    """
    _write_sequence(motion, Path(path), ".obj", obj_of(motion.head), progress)


def write_ply(
    motion: Motion, path: str | Path, *, sound: object = None, progress: Any = None
) -> None:
    """A folder `path` (say `talk.ply`) of binary 00000.ply, … with vertex colours, in metres.

    Raises OutputError where the folder is there already.
    """
    _write_sequence(motion, Path(path), ".ply", ply_of(motion.head), progress)


def obj_of(head: HeadModel) -> MeshBytes:
    """What makes an .obj file of vertices (vertex, 3) m of this head."""
    faces = _obj_faces(head)

    def mesh(points: NDArray[np.float32]) -> bytes:
        lines = ("v %.6f %.6f %.6f\n" * len(points)) % tuple(points.ravel().tolist())
        return lines.encode() + faces

    return mesh


def ply_of(head: HeadModel) -> MeshBytes:
    """What makes a binary .ply file of vertices (vertex, 3) m of this head, with its colours."""
    triangles = head.triangles
    record = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])
    faces = np.zeros(len(triangles), np.dtype([("n", "u1"), ("abc", "<i4", 3)]))
    faces["n"], faces["abc"] = 3, triangles
    opening = (
        "ply\nformat binary_little_endian 1.0\ncomment Elocute, metres\n"
        f"element vertex {head.vertex_count}\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()

    def mesh(points: NDArray[np.float32]) -> bytes:
        vertices = np.empty(len(points), record)
        vertices["xyz"], vertices["rgb"] = points, head.vertex_color
        return opening + vertices.tobytes() + faces.tobytes()

    return mesh


MESH_FORMATS: dict[str, Callable[[HeadModel], MeshBytes]] = {".obj": obj_of, ".ply": ply_of}
"""What writes the mesh files of a head, by suffix."""


def write_npy(
    motion: Motion, path: str | Path, *, sound: object = None, progress: Any = None
) -> None:
    """Vertices (frame, vertex, 3) float32 m, written block by block. Raises OutputError."""
    with (
        write_atomically(path) as draft,
        RowWriter(draft, (motion.head.vertex_count, 3)) as rows,
    ):
        for block in motion.blocks(BLOCK):
            rows.add(block)
            if progress:
                progress(rows.count / motion.frame_count)


def _write_sequence(
    motion: Motion, path: Path, suffix: str, mesh: MeshBytes, progress: Any
) -> None:
    digits = max(5, len(str(motion.frame_count - 1)))
    number = 0
    with write_folder_atomically(path) as folder:
        for block in motion.blocks(BLOCK):
            for points in block:
                (folder / f"{number:0{digits}d}{suffix}").write_bytes(mesh(points))
                number += 1
                if progress:
                    progress(number / motion.frame_count)


def _obj_faces(head: HeadModel) -> bytes:
    lines = []
    for quad in (head.quads + 1).tolist():
        corners = quad[:3] if quad[2] == quad[3] else quad
        lines.append("f " + " ".join(map(str, corners)))
    return ("\n".join(lines) + "\n").encode()
