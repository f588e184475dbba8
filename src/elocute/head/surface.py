"""The surface of a material of a head: images, and how light meets it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError
from elocute.files.json_records import as_record, finite_number, parse_json

OPACITIES = ("opaque", "cutout", "blend", "sheer")


@dataclass(frozen=True)
class Surface:
    """Images of one material. Each is an encoded file (PNG, JPEG or WebP) as bytes; empty: none.

    The colour of a point is its vertex colour times `tint` times `color`, in linear light.

    Parameters
    ----------
    color : bytes
        sRGB, with alpha where `opacity` is not "opaque".
    normal : bytes
        Tangent-space normals, x to the right, y up, z out (as glTF has them).
    roughness : bytes
        Linear; red: occlusion, green: roughness (glTF's packing).
    tint : (3,) tuple of float
        Linear factor of the colour.
    roughness_factor : float
        Factor of the roughness, the roughness itself without an image; 0 smooth to 1 rough.
    normal_scale : float
        Factor of the normals' x and y.
    opacity : str
        "opaque"; "cutout": alpha of one half or more is solid, the rest is not there; "blend":
        solid where alpha is near one, the fringe laid over what lies behind; "sheer": all of it
        laid over what lies behind, for single cards close to a surface.
    both_sides : bool
        Whether the far side of its faces is seen.
    folds : bytes
        Heights of the folds that come with expressions, 128 for smooth skin; red and green: the
        two sets of zones (`elocute.head.folds`), blue: finer lines of the first.
    fold_depth, fold_lines : float
        Factors of their depth, and of that of the finer lines.
    finish : str
        The finish of `elocute.render.shading` that light meets it with; "": the one that the name
        of its material says. This and the next three are of characters that are drawn, and are
        not stored.
    metal : float
        How much of a metal it is, 0 to 1; times the blue of `roughness` where there is one.
    alpha : float
        Factor of the alpha of `color`.
    shade : (3,) tuple of float, optional
        Of a surface that light does not meet: its colour is shown as it is, times this where it is
        turned away from the key; all ones, the same everywhere.
    eye_rad, iris_rad, iris_depth : float
        Of an eye, in whose image the angle from its axis grows evenly from the middle: the angle
        at the image's edge and at that of the iris, and how many radii of the eye the iris lies
        behind the top of the cornea; 0: no such image, or an iris on the surface.
    """

    color: bytes = field(default=b"", repr=False)
    normal: bytes = field(default=b"", repr=False)
    roughness: bytes = field(default=b"", repr=False)
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    roughness_factor: float = 0.5
    normal_scale: float = 1.0
    opacity: str = "opaque"
    both_sides: bool = False
    folds: bytes = field(default=b"", repr=False)
    fold_depth: float = 0.0
    fold_lines: float = 0.0
    eye_rad: float = 0.0
    iris_rad: float = 0.0
    iris_depth: float = 0.0
    finish: str = ""
    metal: float = 0.0
    alpha: float = 1.0
    shade: tuple[float, float, float] | None = None

    @property
    def fringed(self) -> bool:
        """Whether some of it is laid over what lies behind."""
        return self.opacity in ("blend", "sheer")


IMAGES = ("color", "normal", "roughness", "folds")
FACTORS = ("roughness_factor", "normal_scale")
EYE = ("eye_rad", "iris_rad", "iris_depth")
LATER = ("fold_depth", "fold_lines", *EYE)
"""Numbers that files of earlier versions do not have."""
FINISH = ("tint", *FACTORS, "opacity", "both_sides", *LATER)
MOST, FINISH_MAX_BYTES = 64, 10_000


def surface_arrays(surfaces: Mapping[str, Surface]) -> dict[str, NDArray[Any]]:
    """Surfaces as arrays of bytes that an .npz holds; `surfaces_of_arrays` reads them back."""
    arrays: dict[str, NDArray[Any]] = {}
    for number, (name, surface) in enumerate(surfaces.items()):
        texts = {"name": name} | {each: getattr(surface, each) for each in FINISH}
        arrays[f"surface/{number}"] = np.frombuffer(json.dumps(texts).encode(), np.uint8)
        for image in IMAGES:
            data = getattr(surface, image)
            if data:
                arrays[f"surface/{number}/{image}"] = np.frombuffer(data, np.uint8)
    return arrays


def surfaces_of_arrays(stored: Mapping[str, NDArray[Any]]) -> dict[str, Surface]:
    """The surfaces among stored arrays. Raises HeadError."""
    surfaces: dict[str, Surface] = {}
    for number in range(MOST):
        if f"surface/{number}" not in stored:
            break
        raw = stored[f"surface/{number}"]
        if raw.nbytes > FINISH_MAX_BYTES:
            raise HeadError(f"a surface of {raw.nbytes} bytes; allowed: {FINISH_MAX_BYTES}")
        parsed = parse_json(raw.tobytes(), "surface", allowed="a surface", error=HeadError)
        record = as_record(parsed, "surface", "a surface", HeadError)
        images = {
            image: stored[f"surface/{number}/{image}"].tobytes()
            for image in IMAGES
            if f"surface/{number}/{image}" in stored
        }
        surfaces[str(record.get("name"))] = _surface(record, images)
    return surfaces


def _surface(record: Mapping[str, Any], images: dict[str, bytes]) -> Surface:
    tint = record.get("tint")
    parts = [finite_number(part) for part in tint] if isinstance(tint, list) else []
    rough, scale = (finite_number(record.get(name)) for name in FACTORS)
    later = {name: finite_number(record.get(name, 0.0)) for name in LATER}
    if len(parts) != 3 or None in parts or rough is None or scale is None:
        raise HeadError("a surface without its numbers; allowed: tint, roughness, normal scale")
    numbers = {name: number for name, number in later.items() if number is not None}
    if len(numbers) < len(LATER) or (numbers["iris_depth"] and not _is_eye(numbers)):
        raise HeadError(f"a surface whose folds or iris are wrong; allowed: {', '.join(LATER)}")
    if record.get("opacity") not in OPACITIES:
        raise HeadError(f"a surface that is {str(record.get('opacity'))[:40]!r}; allowed: opaque")
    red, green, blue = (float(part or 0.0) for part in parts)
    surface = Surface(
        tint=(red, green, blue),
        roughness_factor=rough,
        normal_scale=scale,
        opacity=str(record["opacity"]),
        both_sides=bool(record.get("both_sides")),
    )
    return replace(surface, **images, **numbers)


def _is_eye(numbers: Mapping[str, float]) -> bool:
    return all(0 < numbers[name] <= np.pi for name in EYE)
