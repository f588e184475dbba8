"""Every frame as a mesh file, or all of them as one array."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.export.mesh_materials import MeshMaterials, mesh_materials
from elocute.files.array_writing import RowWriter
from elocute.files.atomic import write_atomically, write_folder_atomically
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion

BLOCK = 120


@dataclass(frozen=True, eq=False)
class MeshWriter:
    """What makes the mesh files of one head."""

    # the bytes of a file of vertices (vertex, 3) float32 m
    mesh: Callable[[NDArray[np.float32]], bytes]
    # what these files name and need beside them, by file name: materials and images
    beside: dict[str, bytes]

    def write_beside(self, folder: Path) -> None:
        """Write what stands beside the meshes, unless it is there. Raises OSError."""
        for name, data in self.beside.items():
            if not (folder / name).exists():
                (folder / name).write_bytes(data)


def write_obj(
    motion: Motion, path: str | Path, *, sound: object = None, progress: Any = None
) -> None:
    """A folder `path` (say `talk.obj`) of 00000.obj, 00001.obj, … in metres.

    Of a head with images, texture coordinates are in each, materials and images beside them.
    Raises OutputError where the folder is there already.
    """
    _write_sequence(motion, Path(path), ".obj", progress)


def write_ply(
    motion: Motion, path: str | Path, *, sound: object = None, progress: Any = None
) -> None:
    """A folder `path` (say `talk.ply`) of binary 00000.ply, … with vertex colours, in metres.

    Of a head with images, texture coordinates are in each, the images beside them. Raises
    OutputError where the folder is there already.
    """
    _write_sequence(motion, Path(path), ".ply", progress)


def obj_of(head: HeadModel, tag: str = "") -> MeshWriter:
    """What makes .obj files of this head; tag: begins the names of what stands beside them."""
    materials = mesh_materials(head, tag)
    faces = _plain_obj_faces(head) if materials is None else _obj_faces(head, materials)

    def mesh(points: NDArray[np.float32]) -> bytes:
        lines = ("v %.6f %.6f %.6f\n" * len(points)) % tuple(points.ravel().tolist())
        return lines.encode() + faces

    return MeshWriter(mesh, {} if materials is None else materials.obj_files())


def ply_of(head: HeadModel, tag: str = "") -> MeshWriter:
    """What makes binary .ply files of this head; tag: begins the names of what stands beside."""
    materials = mesh_materials(head, tag)
    record = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3)])
    faces = _ply_faces(head, materials)
    images = [] if materials is None else materials.color_names()
    opening = (
        "ply\nformat binary_little_endian 1.0\ncomment Elocute, metres\n"
        + "".join(f"comment TextureFile {name}\n" for name in images)
        + f"element vertex {head.vertex_count}\n"
        "property float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
        + ("property list uchar float texcoord\nproperty int texnumber\n" if images else "")
        + "end_header\n"
    ).encode()

    def mesh(points: NDArray[np.float32]) -> bytes:
        vertices = np.empty(len(points), record)
        vertices["xyz"], vertices["rgb"] = points, head.vertex_color
        return opening + vertices.tobytes() + faces.tobytes()

    return MeshWriter(mesh, {} if materials is None else materials.color_files())


MESH_FORMATS: dict[str, Callable[..., MeshWriter]] = {".obj": obj_of, ".ply": ply_of}
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


def _write_sequence(motion: Motion, path: Path, suffix: str, progress: Any) -> None:
    writer = MESH_FORMATS[suffix](motion.head)
    digits = max(5, len(str(motion.frame_count - 1)))
    number = 0
    with write_folder_atomically(path) as folder:
        writer.write_beside(folder)
        for block in motion.blocks(BLOCK):
            for points in block:
                (folder / f"{number:0{digits}d}{suffix}").write_bytes(writer.mesh(points))
                number += 1
                if progress:
                    progress(number / motion.frame_count)


def _plain_obj_faces(head: HeadModel) -> bytes:
    lines = []
    for quad in (head.quads + 1).tolist():
        corners = quad[:3] if quad[2] == quad[3] else quad
        lines.append("f " + " ".join(map(str, corners)))
    return ("\n".join(lines) + "\n").encode()


def _obj_faces(head: HeadModel, materials: MeshMaterials) -> bytes:
    """Texture coordinates and faces, in the head's order, each with its material."""
    lines = [f"vt {u:.6f} {v:.6f}" for u, v in head.uv.tolist()]
    lines.append(f"mtllib {materials.library}")
    used = -1
    quads, texels = (head.quads + 1).tolist(), (head.uv_quads + 1).tolist()
    for quad, texel, material in zip(quads, texels, head.material.tolist(), strict=True):
        if material != used:
            lines.append(f"usemtl {head.material_names[material]}")
            used = material
        count = 3 if quad[2] == quad[3] else 4
        corners = zip(quad[:count], texel[:count], strict=True)
        lines.append("f " + " ".join(f"{vertex}/{place}" for vertex, place in corners))
    return ("\n".join(lines) + "\n").encode()


def _ply_faces(head: HeadModel, materials: MeshMaterials | None) -> NDArray[np.void]:
    """(triangle,) records: corners, and with images their places on one of these."""
    corners = [("n", "u1"), ("abc", "<i4", 3)]
    if materials is None:
        faces = np.zeros(len(head.triangles), np.dtype(corners))
    else:
        places = [("m", "u1"), ("uv", "<f4", 6), ("image", "<i4")]
        faces = np.zeros(len(head.triangles), np.dtype([*corners, *places]))
        faces["m"], faces["uv"] = 6, head.uv[head.uv_triangles].reshape(-1, 6)
        faces["image"] = materials.color_numbers()[head.triangle_material]
    faces["n"], faces["abc"] = 3, head.triangles
    return faces
