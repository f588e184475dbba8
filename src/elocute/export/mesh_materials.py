"""Materials of mesh files: the images of a head as files, and an .mtl that names them."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.head.model import HeadModel
from elocute.head.surface import Surface
from elocute.render.portable_pictures import PortablePicture, portable_picture


@dataclass(frozen=True, eq=False)
class MeshMaterials:
    """The materials of a head that has images.

    Parameters
    ----------
    head : HeadModel
        Whose they are.
    tag : str
        Begins the name of each file.
    colors, normals : dict of str to PortablePicture
        By material; only of those that have one.
    """

    head: HeadModel
    tag: str
    colors: dict[str, PortablePicture]
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
    """The materials of a head for mesh files.

    Parameters
    ----------
    head : HeadModel
        With images or without.
    tag : str
        Begins the name of each file.

    Returns
    -------
    MeshMaterials or None
        None for a head without images.

    Raises
    ------
    HeadError
        For an image that is none.
    """
    if not any(surface.color for surface in head.surfaces.values()):
        return None
    colors, normals = {}, {}
    for name in head.material_names:
        surface = head.surfaces.get(name, Surface())
        if surface.color:
            clear = surface.opacity != "opaque"
            colors[name] = portable_picture(surface.color, f"color of the material {name!r}", clear)
        if surface.normal:
            normals[name] = portable_picture(surface.normal, f"normal of the material {name!r}")
    return MeshMaterials(head, tag, colors, normals)


def _alpha(picture: PortablePicture) -> bytes:
    """The alpha of a picture as a grey one: an .mtl has it apart."""
    from PIL import Image

    file = io.BytesIO()
    with Image.open(io.BytesIO(picture.data)) as opened:
        opened.convert("RGBA").getchannel("A").save(file, "PNG")
    return file.getvalue()
