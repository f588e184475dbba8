"""What a material of a head looks like: images, and how light meets it."""

from __future__ import annotations

from dataclasses import dataclass, field

OPACITIES = ("opaque", "cutout", "blend")


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
        solid where alpha is near one, the fringe laid over what lies behind.
    both_sides : bool
        Whether the far side of its faces is seen.
    """

    color: bytes = field(default=b"", repr=False)
    normal: bytes = field(default=b"", repr=False)
    roughness: bytes = field(default=b"", repr=False)
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    roughness_factor: float = 0.5
    normal_scale: float = 1.0
    opacity: str = "opaque"
    both_sides: bool = False
