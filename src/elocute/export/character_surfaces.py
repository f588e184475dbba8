"""The materials of a character's file, as surfaces that our own light meets."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.files.reading import bytes_text
from elocute.files.unpacked_size import unpacked_limit
from elocute.head.surface import Surface
from elocute.meshes.gltf_arrays import GltfArrays
from elocute.meshes.gltf_document import GltfDocument
from elocute.meshes.gltf_materials import GltfMaterial, Texture, picture_of, read_material
from elocute.meshes.mesh_file import check_picture, opened_picture, picture_bytes
from elocute.meshes.parts import UNPACKED_MIN_BYTES

MATERIALS_MAX = 200
FINISH, SKIN = "plain", "skin"
SKIN_WORDS = {"skin", "face", "head", "body"}
"""In the names of materials that light scatters in."""
SOLID_ALPHA, SOLID_SHARE = 0.8, 0.15
"""Of a material that blends: the alpha that hides what lies behind, and the share of its picture
that has it where it is hair, cloth or lashes; glass and tears have none."""
CLEAR = 0.98
"""Alpha from which on a material is solid."""


@dataclass(frozen=True, eq=False)
class _Picture:
    image: Any  # in RGB or RGBA
    packed: bytes  # the same as a file


@dataclass(eq=False)
class CharacterSurfaces:
    """Reads the materials of one file; pictures are decoded to look at, and kept packed."""

    name: str  # of the file, for messages
    document: GltfDocument
    arrays: GltfArrays
    told: list[str] = field(default_factory=list)
    """What was left out."""

    def __post_init__(self) -> None:
        self._left = unpacked_limit(len(self.document.data), UNPACKED_MIN_BYTES)
        self._pictures: dict[int, _Picture | None] = {}

    @cached_property
    def materials(self) -> dict[int | None, GltfMaterial]:
        """By number; None is what a primitive without a material has."""
        count = len(self.document.records("materials"))
        if count > MATERIALS_MAX:
            found, allowed = f"{count} materials", f"up to {MATERIALS_MAX}"
            raise HeadError.about(self.name, found=found, allowed=allowed)
        return {number: read_material(self.document, number) for number in (None, *range(count))}

    def places(self, material: GltfMaterial) -> Texture | None:
        """The texture whose places are those of all pictures of a material."""
        textures = (material.color, material.normal, material.rough)
        return next((each for each in textures if each is not None and self._opened(each)), None)

    def surface(self, material: GltfMaterial) -> Surface:
        """A material as a surface. Raises HeadError for damaged and too large pictures."""
        color, normal = (self._of(material, each) for each in (material.color, material.normal))
        opacity, alpha = self._opacity(material, color)
        if color is None and opacity != "opaque":
            color = _white()
        return Surface(
            color=b"" if color is None else color.packed,
            normal=b"" if normal is None else normal.packed,
            roughness=self._packed(material),
            tint=material.factor,
            roughness_factor=material.roughness,
            normal_scale=material.normal_scale,
            opacity=opacity,
            both_sides=material.both_sides,
            finish=_finish(material),
            metal=material.metal,
            alpha=alpha,
            shade=material.shade,
        )

    @staticmethod
    def _opacity(material: GltfMaterial, color: _Picture | None) -> tuple[str, float]:
        """How its alpha is meant, and the factor that takes it there."""
        shares = np.array([1.0])
        if color is not None and "A" in color.image.getbands():
            shares = np.asarray(color.image.getchannel("A")) / 255
        shares = shares * material.alpha
        if material.mode == "OPAQUE" or shares.min() >= CLEAR:
            return "opaque", 1.0
        if material.mode == "MASK":
            if shares.min() >= material.cutoff:
                return "opaque", 1.0
            return "cutout", material.alpha * 0.5 / max(material.cutoff, 1e-3)
        seen = shares > 0.02
        solid = np.count_nonzero(shares >= SOLID_ALPHA) / max(np.count_nonzero(seen), 1)
        return "blend" if solid > SOLID_SHARE else "sheer", material.alpha

    def _packed(self, material: GltfMaterial) -> bytes:
        """One picture of occlusion, roughness and metal."""
        from PIL import Image

        rough, shut = (self._of(material, each) for each in (material.rough, material.occlusion))
        if rough is None and shut is None:
            return b""
        if rough is shut and rough is not None:
            return rough.packed
        size = (rough or shut or _white()).image.size
        white = Image.new("L", size, 255)
        bands = [white, white, white]
        if rough is not None:
            bands[1:] = rough.image.split()[1:3]
        if shut is not None:
            bands[0] = shut.image.getchannel("R").resize(size)
        return picture_bytes(Image.merge("RGB", bands))

    def _of(self, material: GltfMaterial, texture: Texture | None) -> _Picture | None:
        """The picture of a texture; None without one, and where it lies elsewhere than others."""
        picture, places = self._opened(texture), self.places(material)
        if picture is None or texture is None or places is None:
            return None
        if (texture.attribute, texture.shift) != (places.attribute, places.shift):
            self._tell("pictures with places of their own")
            return None
        return picture

    def _opened(self, texture: Texture | None) -> _Picture | None:
        """The picture of a texture, of at most 2048 pixels a side, or None."""
        if texture is None:
            return None
        if texture.image not in self._pictures:
            data, packed = picture_of(self.document, self.arrays, texture)
            if packed:
                self._tell(f"pictures packed as {packed}")
                self._pictures[texture.image] = None
                return None
            width, height = check_picture(data, self.name, HeadError)
            self._left -= 4 * width * height
            if self._left < 0:
                found = f"a picture of {width} × {height} pixels in {bytes_text(len(data))}"
                allowed = "pictures that unpack to less"
                raise HeadError.about(self.name, found=found, allowed=allowed)
            image, _ = opened_picture(data, self.name, HeadError)
            kept = data if image.size == (width, height) else picture_bytes(image)
            self._pictures[texture.image] = _Picture(image, kept)
        return self._pictures[texture.image]

    def _tell(self, what: str) -> None:
        if what not in self.told:
            self.told.append(what)


def _finish(material: GltfMaterial) -> str:
    """How light meets a material, as far as its name tells."""
    words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", material.name)
    return SKIN if SKIN_WORDS & {word.lower() for word in words} else FINISH


def places_of(
    arrays: GltfArrays, attributes: dict[str, int], texture: Texture | None
) -> Float64Array | None:
    """(vertex, 2) places in pictures, v upwards; None of a primitive that has none."""
    from elocute.meshes.gltf_meshes import transformed_uv

    if texture is None or texture.attribute not in attributes:
        return None
    uv = arrays.values(attributes[texture.attribute])[:, :2].astype(np.float64)
    uv = np.nan_to_num(transformed_uv(uv, texture.shift), posinf=0.0, neginf=0.0)
    return np.clip(uv, -1e4, 1e4) * [1, -1] + [0, 1]


def _white() -> _Picture:
    from PIL import Image

    image = Image.new("RGBA", (1, 1), (255, 255, 255, 255))
    return _Picture(image, picture_bytes(image))
