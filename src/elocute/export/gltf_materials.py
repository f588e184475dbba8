"""Materials of a head in glTF: images of its surfaces, and how light meets each material."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from elocute.export.gltf_file import GltfFile
from elocute.head.model import HeadModel
from elocute.head.surface import Surface
from elocute.render.parts import CORES
from elocute.render.portable_pictures import material_picture

SAMPLER = {"magFilter": 9729, "minFilter": 9987}  # linear; linear between mipmaps
CLAMP = {"wrapS": 33071, "wrapT": 33071}  # or roots of strands show behind their tips


@dataclass(frozen=True)
class Finish:
    """How light meets a material, beside its images."""

    roughness: float = 0.5  # where no surface says it
    # strength of the reflection at right angles; 1 is that of glass, a twenty-fifth of the light.
    # Inside the mouth it is low: image-based light shines there as if nothing were in its way, and
    # teeth turn to chrome.
    specular: float = 0.7
    clearcoat: float = 0.0  # strength of a smooth layer above, 0 to 1: the tears on an eye
    both_sides: bool = False  # whether the far side of its faces is seen, where no surface says it
    # share of its red, green and blue. Lids and lips shade eyes and teeth from light of all sides,
    # which other programs do not draw: they glow; teeth, lit by flesh, would be blue.
    kept: tuple[float, float, float] = (1.0, 1.0, 1.0)
    # share of the slope of its normal map. Light that scatters in skin sees blunter normals than
    # what it mirrors; other programs have one normal for both, and skin turns to leather.
    relief: float = 1.0
    # of its surface too. Strands shine across their direction, which other programs do not draw:
    # with the round shine that these have, smooth hair is plastic.
    least_roughness: float = 0.0
    # the power of its surface's colour; less than 1 lightens what is dark, and only that. Curls
    # that only their shine tells apart are a black helmet without it.
    lifted: float = 1.0


FINISHES = {
    "skin": Finish(0.55, 0.45, relief=0.6),
    "lips": Finish(0.38, 0.8, kept=(0.94, 0.98, 1.0)),
    "mouth": Finish(0.5, 0.15, both_sides=True),
    "teeth": Finish(0.25, 0.35, kept=(0.80, 0.755, 0.665)),
    "gums": Finish(0.35, 0.25),
    "tongue": Finish(0.45, 0.25, both_sides=True),
    "eyeball": Finish(0.25, 0.5, clearcoat=1.0, kept=(0.55, 0.55, 0.55)),
    "hair": Finish(0.8, 0.2, both_sides=True, least_roughness=0.75, lifted=0.85),
    # Of all light that skin beside them mirrors too: black brows turn blue under a bright sky.
    "brows": Finish(0.8, 0.06, both_sides=True),
    "lashes": Finish(0.8, 0.06, both_sides=True),
    "clothes": Finish(0.85, 0.3, both_sides=True),
}
CLEARCOAT_ROUGHNESS = 0.03


@dataclass(frozen=True)
class MaterialIndices:
    """The records of one material: its faces are drawn once with each."""

    indices: tuple[int, ...]  # into the file's materials
    images: dict[str, dict[str, Any]]  # what became of its images, for the report


def add_materials(file: GltfFile, head: HeadModel, *, folds: bool = False) -> list[MaterialIndices]:
    """Add the materials of a head with their images; returns one `MaterialIndices` for each.

    A surface that blends becomes two records over the same faces: what is solid, which hides what
    lies behind, and the fringe, laid over it. No program then needs to sort faces.

    folds: whether the images of folds come along, which no other program knows: their textures are
    named in the materials' extras. Raises HeadError for an image that is none.
    """
    return [
        _add_material(file, name, head.surfaces.get(name), folds) for name in head.material_names
    ]


def _add_material(
    file: GltfFile, name: str, surface: Surface | None, folds: bool
) -> MaterialIndices:
    finish = FINISHES.get(name, Finish())
    images: dict[str, dict[str, Any]] = {}
    record: dict[str, Any] = {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*finish.kept, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": finish.roughness,
        },
        "doubleSided": finish.both_sides,
    }
    if surface is not None:
        record["doubleSided"] = surface.both_sides
        record["pbrMetallicRoughness"] |= {
            "roughnessFactor": max(surface.roughness_factor, finish.least_roughness),
            "baseColorFactor": [
                *(
                    kept * float(c) ** finish.lifted
                    for kept, c in zip(finish.kept, surface.tint, strict=True)
                ),
                1.0,
            ],
        }
        _add_images(file, record, surface, finish.relief, images, folds)
    extensions: dict[str, Any] = {"KHR_materials_specular": {"specularFactor": finish.specular}}
    if finish.clearcoat:
        extensions["KHR_materials_clearcoat"] = {
            "clearcoatFactor": finish.clearcoat,
            "clearcoatRoughnessFactor": CLEARCOAT_ROUGHNESS,
        }
    for extension in extensions:
        file.uses(extension)
    record["extensions"] = extensions
    opacity = surface.opacity if surface is not None else "opaque"
    return MaterialIndices(
        tuple(file.add("materials", each) for each in _layers(record, opacity)), images
    )


def _layers(record: dict[str, Any], opacity: str) -> list[dict[str, Any]]:
    """The record once for each time that its faces are drawn."""
    if opacity == "opaque":
        return [record]
    if opacity == "sheer":
        return [record | {"alphaMode": "BLEND"}]
    solid = record | {"alphaMode": "MASK", "alphaCutoff": CORES[opacity]}
    if opacity == "cutout":
        return [solid]
    return [solid, record | {"name": f"{record['name']}_fringe", "alphaMode": "BLEND"}]


def _add_images(
    file: GltfFile,
    record: dict[str, Any],
    surface: Surface,
    relief: float,
    images: dict[str, dict[str, Any]],
    folds: bool,
) -> None:
    def texture(kind: str) -> dict[str, Any] | None:
        picture = material_picture(surface, kind, record["name"], grey=True)
        if picture is None:
            return None
        images[kind] = {"pixels": list(picture.size), "media": picture.media}
        if picture.made_from:
            images[kind]["made_from"] = picture.made_from
        sampler = SAMPLER if surface.finish or not surface.fringed else SAMPLER | CLAMP
        name = f"{record['name']}_{kind}"
        return {"index": _texture(file, picture.data, picture.media, name, sampler)}

    shaded = record["pbrMetallicRoughness"]
    if color := texture("color"):
        shaded["baseColorTexture"] = color
    if normal := texture("normal"):
        record["normalTexture"] = normal | {"scale": float(relief * surface.normal_scale)}
    if roughness := texture("roughness"):
        # One image: occlusion is read from its red, roughness from green.
        shaded["metallicRoughnessTexture"] = roughness
        record["occlusionTexture"] = dict(roughness)
    if folds and (folded := texture("folds")):
        record["extras"] = {"folds": folded["index"]}


def _texture(file: GltfFile, data: bytes, media: str, name: str, sampler: dict[str, int]) -> int:
    """A texture of an image; an image that several materials have is stored once."""
    samplers = file.json["samplers"]
    number = samplers.index(sampler) if sampler in samplers else file.add("samplers", sampler)
    stored = file.json["images"]
    view = file.shared(data)
    source = next((i for i, image in enumerate(stored) if image["bufferView"] == view), None)
    if source is None:
        source = file.add("images", {"name": name, "bufferView": view, "mimeType": media})
        return file.add("textures", {"sampler": number, "source": source})
    return source  # each image has one texture, added with it
