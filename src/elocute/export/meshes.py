"""Every frame as a mesh file, or all of them as one array."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.files.array_writing import RowWriter
from elocute.files.atomic import write_atomically, write_folder_atomically
from elocute.head.model import HeadModel
from elocute.head.surface import Surface
from elocute.motion.motion import Motion
from elocute.render.portable_pictures import PortablePicture, material_picture

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


@dataclass(frozen=True, eq=False)
class MeshMaterials:
    """The materials of a head that has images."""

    head: HeadModel  # whose they are
    tag: str  # begins the name of each file
    colors: dict[str, PortablePicture]  # by material; only of those that have one
    normals: dict[str, PortablePicture]

    @property
    def library(self) -> str:
        """The name of the .mtl."""
        return f"{self.tag}materials.mtl"

    def color_names(self) -> list[str]:
        """The names of the images of colour, in the order of `color_numbers`."""
        return [self._name(name, "", picture) for name, picture in self.colors.items()]

    def color_numbers(self) -> NDArray[np.int32]:
        """(material,) which of `color_names` each material shows; -1: none."""
        shown = list(self.colors)
        numbers = [shown.index(n) if n in shown else -1 for n in self.head.material_names]
        return np.array(numbers, np.int32)

    def color_files(self) -> dict[str, bytes]:
        """The images of colour, by file name."""
        pictures = self.colors.values()
        return {n: p.data for n, p in zip(self.color_names(), pictures, strict=True)}

    def obj_files(self) -> dict[str, bytes]:
        """All that an .obj needs beside it, by file name."""
        files = self.color_files()
        for name, picture in self.normals.items():
            files[self._name(name, "_normal", picture)] = picture.data
        for name in self._clear():
            files[self._alpha_name(name)] = _alpha(self.colors[name])
        return {self.library: self._library_text().encode(), **files}

    def _clear(self) -> list[str]:
        """Materials that are not solid everywhere."""
        surfaces = self.head.surfaces
        return [name for name in self.colors if surfaces[name].opacity != "opaque"]

    def _name(self, material: str, kind: str, picture: PortablePicture) -> str:
        return f"{self.tag}{material}{kind}{picture.suffix}"

    def _alpha_name(self, material: str) -> str:
        return f"{self.tag}{material}_alpha.png"

    def _library_text(self) -> str:
        return "\n".join(map(self._entry, self.head.material_names))

    def _entry(self, name: str) -> str:
        surface = self.head.surfaces.get(name, Surface())
        red, green, blue = surface.tint if name in self.colors else self._mean_color(name)
        lines = [
            f"newmtl {name}",
            f"Kd {red:.4f} {green:.4f} {blue:.4f}",
            "Ks 0.0400 0.0400 0.0400",
            f"Pr {surface.roughness_factor:.4f}",
            "illum 2",
        ]
        if name in self.colors:
            lines.append(f"map_Kd {self._name(name, '', self.colors[name])}")
        if name in self._clear():
            lines.append(f"map_d {self._alpha_name(name)}")
        if name in self.normals:
            lines.append(f"norm {self._name(name, '_normal', self.normals[name])}")
        return "\n".join(lines) + "\n"

    def _mean_color(self, name: str) -> tuple[float, ...]:
        head = self.head
        faces = head.quads[head.material == head.material_names.index(name)]
        if not len(faces):
            return (1.0, 1.0, 1.0)
        return tuple((head.vertex_color[np.unique(faces)].mean(axis=0) / 255).tolist())


def mesh_materials(head: HeadModel, tag: str = "") -> MeshMaterials | None:
    """The materials of a head for mesh files; None for a head without images.

    tag: begins the name of each file. Raises HeadError for an image that is none.
    """
    if not any(surface.color for surface in head.surfaces.values()):
        return None
    colors, normals = (
        {
            name: picture
            for name in head.material_names
            if (picture := material_picture(head.surfaces.get(name, Surface()), kind, name))
        }
        for kind in ("color", "normal")
    )
    return MeshMaterials(head, tag, colors, normals)


def _alpha(picture: PortablePicture) -> bytes:
    """The alpha of a picture as a grey one: an .mtl has it apart."""
    from PIL import Image

    file = io.BytesIO()
    with Image.open(io.BytesIO(picture.data)) as opened:
        opened.convert("RGBA").getchannel("A").save(file, "PNG")
    return file.getvalue()
