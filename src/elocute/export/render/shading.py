"""The look, once in numbers: a soft three-point studio. Both engines shade by these.

Skin is shaded at its vertices, which are dense enough for soft light, so a frame costs little
even without a graphics card; what is glossy or fine (eyes, teeth, hair) is shaded pixel by pixel.

Light adds up in linear space: wrapped diffuse with a warm terminator (light that skin scatters),
a gentle highlight, a rim where the surface turns away; then a filmic curve and sRGB.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray
from elocute.head.model import HeadModel
from elocute.head.normals import linear_colors

# direction towards the light, colour, wrap; the first GLINTS of them are seen as highlights
LIGHTS: tuple[tuple[tuple[float, float, float], tuple[float, float, float], float], ...] = (
    ((-0.55, 0.60, 0.80), (1.55, 1.42, 1.28), 0.25),  # key, high on the left of the picture
    ((0.85, 0.10, 0.60), (0.34, 0.38, 0.46), 0.45),  # fill, low and cool
    ((0.45, 0.65, -0.75), (0.85, 0.85, 0.95), 0.05),  # rim, from behind
    ((-0.80, 0.25, -0.60), (0.40, 0.42, 0.50), 0.05),  # kicker
)
GLINTS = 2
SKY, GROUND = (0.20, 0.21, 0.24), (0.10, 0.085, 0.08)
TERMINATOR = (0.09, 0.02, 0.0)  # how much further red and green wrap round on skin
RIM, RIM_POWER = 0.10, 4.0
EXPOSURE = 0.74
BACKGROUND_TOP, BACKGROUND_BOTTOM = (0.345, 0.365, 0.395), (0.175, 0.185, 0.205)  # sRGB
# material: (highlight strength, exponent, softness 0…1)
SURFACES: dict[str, tuple[float, float, float]] = {
    "skin": (0.10, 22.0, 1.0),
    "lips": (0.20, 42.0, 0.8),
    "mouth": (0.03, 20.0, 0.6),
    "teeth": (0.22, 60.0, 0.3),
    "gums": (0.12, 40.0, 0.6),
    "tongue": (0.08, 24.0, 0.8),
    "eyeball": (1.6, 420.0, 0.2),
    "hair": (0.03, 20.0, 0.3),
}


GLOSSY = ("eyeball", "teeth", "hair")


def _f32(values: tuple[float, ...]) -> NDArray[np.float32]:
    return np.array(values, np.float32)


def glossy_triangles(head: HeadModel) -> NDArray[np.bool_]:
    """(triangle,) whether it is shaded pixel by pixel, and seen from both sides."""
    names = [index for index, name in enumerate(head.material_names) if name in GLOSSY]
    return np.isin(head.triangle_material, names)


def vertex_surfaces(head: HeadModel) -> FloatArray:
    """(vertex, 7): linear colour with occlusion (3), occlusion, highlight, exponent, softness."""
    surfaces = np.tile(_f32(SURFACES["skin"]), (head.vertex_count, 1))
    for index, name in enumerate(head.material_names):
        faces = head.triangles[head.triangle_material == index]
        surfaces[np.unique(faces)] = SURFACES.get(name, SURFACES["skin"])
    return np.concatenate([linear_colors(head), head.occlusion[:, None], surfaces], axis=1).astype(
        np.float32
    )


def shade(normals: FloatArray, views: FloatArray, surfaces: FloatArray) -> FloatArray:
    """sRGB colours (point, 3) 0…1 of points with unit normals and unit directions to the eye.

    surfaces (point, 7) as `vertex_surfaces` gives them.
    """
    albedo, occlusion = surfaces[:, :3], surfaces[:, 3:4]
    strength, exponent, softness = surfaces[:, 4:5], surfaces[:, 5:6], surfaces[:, 6:7]
    up = normals[:, 1:2] * 0.5 + 0.5
    light = _f32(GROUND) * (1 - up) + _f32(SKY) * up
    shine = np.zeros_like(albedo)
    for index, (direction, color, wrap) in enumerate(LIGHTS):
        towards = _f32(direction) / np.float32(np.linalg.norm(direction))
        facing = (normals @ towards)[:, None]
        reach = wrap + softness * _f32(TERMINATOR)
        light = light + _f32(color) * np.clip((facing + reach) / (1 + reach), 0, None)
        if index >= GLINTS:
            continue
        half = views + towards
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        glint = np.clip((normals * half).sum(axis=1, keepdims=True), 0, 1) ** exponent
        shine += _f32(color) * glint * strength * (facing > 0)
    edge = 1 - np.clip((normals * views).sum(axis=1, keepdims=True), 0, 1)
    rim = RIM * edge**RIM_POWER * softness
    return to_srgb(tone(albedo * light + (shine + rim) * occlusion))


def shade_vertices(
    points: FloatArray, normals: FloatArray, surfaces: FloatArray, eye: FloatArray
) -> FloatArray:
    """sRGB colours (vertex, 3) as an eye at `eye` (3,) m sees them."""
    views = eye - points
    views /= np.linalg.norm(views, axis=1, keepdims=True)
    return shade(normals, views, surfaces)


def tone(color: FloatArray) -> FloatArray:
    """A filmic curve (Narkowicz 2016), 0…1."""
    x = color * EXPOSURE
    return np.clip(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0, 1)


def to_srgb(color: FloatArray) -> FloatArray:
    """Linear 0…1 to sRGB 0…1."""
    return np.where(
        color <= 0.0031308, 12.92 * color, 1.055 * np.maximum(color, 1e-9) ** (1 / 2.4) - 0.055
    ).astype(np.float32)


def background(height: int) -> FloatArray:
    """(height, 3) sRGB rows from top to bottom."""
    share = (np.arange(height, dtype=np.float32)[:, None] + 0.5) / height
    return _f32(BACKGROUND_TOP) * (1 - share) + _f32(BACKGROUND_BOTTOM) * share


def with_background(source: str) -> str:
    """GLSL with the ground's colours written in for TOP and BOTTOM."""
    return source.replace("TOP", _vec(BACKGROUND_TOP)).replace("BOTTOM", _vec(BACKGROUND_BOTTOM))


def glsl() -> str:
    """The same `shade` as a GLSL function, its numbers written from above."""
    lines = []
    for index, (direction, color, wrap) in enumerate(LIGHTS):
        towards = np.array(direction) / np.linalg.norm(direction)
        glint = float(index < GLINTS)
        lines.append(f"    lamp({_vec(towards)}, {_vec(color)}, {float(wrap)}, {glint});")
    return f"""
vec3 N; vec3 V; vec3 light; vec3 shine; vec3 material;
void lamp(vec3 towards, vec3 color, float wrap, float glint) {{
    float facing = dot(N, towards);
    vec3 reach = vec3(wrap) + material.z * {_vec(TERMINATOR)};
    light += color * max((facing + reach) / (1.0 + reach), 0.0);
    if (facing * glint > 0.0)
        shine += color * material.x
            * pow(clamp(dot(N, normalize(V + towards)), 0.0, 1.0), material.y);
}}
vec3 shade(vec3 albedo, float occlusion) {{
    light = mix({_vec(GROUND)}, {_vec(SKY)}, N.y * 0.5 + 0.5);
    shine = vec3(0.0);
{chr(10).join(lines)}
    float edge = 1.0 - clamp(dot(N, V), 0.0, 1.0);
    float rim = {RIM} * pow(edge, {RIM_POWER}) * material.z;
    vec3 x = (albedo * light + (shine + rim) * occlusion) * {EXPOSURE};
    x = clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
    return mix(12.92 * x, 1.055 * pow(max(x, 1e-9), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, x));
}}
"""


def _vec(values: Iterable[float]) -> str:
    return "vec3(" + ", ".join(f"{float(v):.6f}" for v in values) + ")"
