"""The lighting of a point on a head, once in GLSL and once in NumPy; all its numbers stand here.

Light adds up in linear space. Diffuse light reaches round edges, red further than blue, and sees
blunter normals, as if it had scattered in skin; highlights are GGX, widened by the size of each
lamp; a sky and a ground surround the head. A clear coat over eyes mirrors the soft boxes, strands
of hair shine across their direction. Then a tone curve that keeps the hue of skin, and sRGB.

`glsl` is written in what GLSL 3.30 and GLSL ES 3.00 share: the viewer embeds the same text.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass, replace

import numpy as np

from elocute.array_types import FloatArray
from elocute.render.lights import Lamp, Rig


@dataclass(frozen=True)
class Finish:
    """How a material meets light, beside its colour."""

    reflectance: float  # of a mirror-like face seen straight on
    roughness: float  # where no image says it: 0 smooth to 1 rough
    softness: float  # how much light scatters inside, 0 to 1 (skin)
    ambient: float  # share of the surrounding light that comes to it
    coat: float  # strength of a clear, wet coat, 0 to 1 (eyes)
    strand: float  # strength of a highlight across strands, 0 to 1 (hair)


FINISHES: dict[str, Finish] = {
    "skin": Finish(0.028, 0.50, 1.0, 1.0, 0.0, 0.0),
    "lips": Finish(0.038, 0.36, 0.9, 1.0, 0.0, 0.0),
    "mouth": Finish(0.010, 0.75, 0.5, 0.35, 0.0, 0.0),
    "teeth": Finish(0.035, 0.30, 0.3, 0.35, 0.0, 0.0),
    "gums": Finish(0.030, 0.35, 0.6, 0.4, 0.0, 0.0),
    "tongue": Finish(0.028, 0.45, 0.8, 0.4, 0.0, 0.0),
    "eyeball": Finish(0.010, 0.60, 0.3, 0.6, 1.0, 0.0),
    "hair": Finish(0.010, 0.60, 0.2, 0.9, 0.0, 1.0),
    "brows": Finish(0.010, 0.60, 0.2, 0.8, 0.0, 0.35),
    "cloth": Finish(0.020, 0.85, 0.2, 1.0, 0.0, 0.0),
    "plain": Finish(0.040, 1.00, 0.0, 1.0, 0.0, 0.0),
}
"""By the name of a material; `finish_of` finds the one for any name. "plain" is what glTF calls a
dielectric, for materials of other hands."""

ALIASES = {"lashes": "hair", "beard": "hair", "clothes": "cloth"}
WRAP = (0.27, 0.13, 0.08)  # how far red, green and blue reach round on skin
BLUNT = (0.70, 0.55, 0.30)  # how much of the smooth normal diffuse light takes
PENUMBRA = (0.75, 0.93, 1.0)  # exponent of the key's visibility on skin: red bleeds into shadow
GRAZING = 0.4  # of the surroundings at a grazing angle, as the whole lobe gives it (Karis 2014)
CREVICE, ENCLOSED = 0.35, 0.7  # how much occlusion keeps from the key, and from other lamps
STRAND_POWER = (60.0, 12.0)  # of what the surface of hair mirrors, and of what passes through it
STRAND_TINT = (0.12, 0.75)  # strength: white of the former, of the hair's own colour of the latter
STRAND_GAP = 0.02  # linear green of hair at which half of the former is left: gaps are in shade
STRAND_TILT = (-0.10, 0.14)  # along the hair: the former lies nearer its root, the latter its tip
# Hair that is seen from within: cosine between the view and where it faces, and how much darker.
WITHIN_HAIR, DARK_WITHIN = (-0.9, -0.4), 0.6
LID_UPPER, LID_LOWER, LID_CORNER = (0.0, 0.50), (-0.7, -0.3), (0.40, 0.88)  # of an eye's normals
# Behind lips, whose flesh reddens light: least of it, powers of red, green and blue, shine left.
DIM_LEAST, DIM_POWERS, DIM_SHINE = 0.25, (0.5, 0.78, 0.86), 0.40
BALL = 0.74  # the white of an eye is darker than it is painted
LID_ARCH = 0.45  # how far the upper lid's edge comes down towards the corners
LID_WARMTH = (0.86, 1.06, 1.12)  # powers of a lid's shade: flesh round an eye reddens it
COAT_REFLECTANCE = 0.04
BOX_HALF, BOX_EDGE = (0.16, 0.19), (0.70, 1.15)  # a soft box in an eye: tangents; where it fades
BOX_ROUND = 2.1  # power of its outline: 2 an ellipse, more a window with rounded corners
BOX_LOWER = 0.32  # of the height of its lamp: what stands higher is behind the lid
BOX_RADIANCE = (17.0, 1.2)  # of key and fill
SRGB = (0.662002687, 0.684122060, -0.323583601, -0.0225411470)  # of x^1/2, x^1/4, x^1/8, x
TONE_START, TONE_BLEACH = 0.72, 0.15  # where the shoulder begins; how fast it turns white
SHADOW_SPREAD, SHADOW_CUT = 2e-5, 0.25  # least variance; share of the key that counts as none
EDGE_ON = (0.02, 0.2)  # cosines between which cards fade away
FOLD_STEP = 1 / 1024  # part of the image between the points that folds are measured at
FOLD_SLOPE = 2.2  # of a fold from smooth skin to the deepest crease within that distance
FOLD_TINT, FOLD_SHADE = (0.16, 0.28, 0.31), 0.45  # what a crease keeps of colour, of light
CORNEA_INDEX = 1.336  # refraction, of the aqueous humour behind it (Gullstrand)
CORNEA_ASLANT = 0.25  # least cosine of a view that is followed through the cornea
SHADOW_BIAS = 0.006  # of the radius of the key's view
CEL_EDGE = (-0.25, 0.15)  # cosines to the key between which a painted surface falls into its shade
GROUND_MIDDLE, GROUND_SHAPE = (0.5, 0.62), (1.0, 1.15)  # the bright spot behind the head


@dataclass(frozen=True)
class Point:
    """Points to be lit, as `lit` takes them; (point, 3) or (point, 1) float32 each.

    Parameters
    ----------
    albedo : (point, 3)
        Linear colour.
    normal, blunt : (point, 3)
        Unit normals with and without the normal map.
    view : (point, 3)
        Unit directions to the eye.
    strand : (point, 3)
        Unit directions of hair; of no use elsewhere.
    occlusion : (point, 1)
        1 = open to the light.
    roughness : (point, 1)
        0 smooth to 1 rough.
    shadow : (point, 1)
        Share of the key that arrives.
    metal : (point, 1) or float
        How much of a metal it is, 0 to 1: it mirrors in its colour, and scatters nothing.
    """

    albedo: FloatArray
    normal: FloatArray
    blunt: FloatArray
    view: FloatArray
    strand: FloatArray
    occlusion: FloatArray
    roughness: FloatArray
    shadow: FloatArray
    metal: FloatArray | float = 0.0


def finish_of(material: str) -> Finish:
    """The finish of a material by its name; that of skin for a name that says nothing."""
    for part in (material, material.split("_")[0], material.split(".")[0]):
        name = ALIASES.get(part, part)
        if name in FINISHES:
            return FINISHES[name]
    return FINISHES["skin"]


def lit(p: Point, f: Finish, rig: Rig) -> FloatArray:
    """Linear light (point, 3) that points send to the eye."""
    if f.coat:
        shade = socket_shade(p.blunt) ** _f32(LID_WARMTH)
        p = replace(p, albedo=p.albedo * (shade * np.float32(BALL)))
    facing = np.maximum(_dot(p.normal, p.view), np.float32(0.02))
    up = _mix(p.normal[:, 1:2], p.blunt[:, 1:2], 0.5 * f.softness)
    light = _around(up, rig) * _bounced(p.occlusion, p.albedo) * f.ambient
    edge = (1 - facing) ** 5
    grazing = GRAZING * (1 - p.roughness) ** 2
    mirror = _mix(f.reflectance, 1.0, p.metal)
    glance = mirror + np.maximum(grazing - mirror, 0) * edge
    mirrored = 2 * facing * p.normal[:, 1:2] - p.view[:, 1:2]
    shine = _around(mirrored, rig) * (glance * p.occlusion * f.ambient * (1 - f.strand))
    for index, lamp in enumerate(rig.lamps):
        kept = 1 - f.ambient * (1 - (CREVICE if index == 0 else ENCLOSED))
        through = _mix(1.0, p.occlusion, kept)
        bled = through
        if index == 0:
            through = through * (1 - (1 - p.shadow) * rig.shadow)
            bled = through ** _mix(np.ones(3, np.float32), _f32(PENUMBRA), f.softness)
        light = light + _reached(p, f, lamp) * bled
        if lamp.shine:
            shine = shine + _glint(p, f, lamp, facing, mirror) * through
    if f.coat:
        shine = shine + _coat(p, f, rig)
    turned = 1 - _step(*WITHIN_HAIR, _dot(p.blunt, p.view))
    kept = 1 - np.float32(f.strand * DARK_WITHIN) * turned
    if isinstance(p.metal, np.ndarray):
        light, shine = light * (1 - p.metal), shine * _mix(1.0, p.albedo, p.metal)
    return ((p.albedo * light + shine) * kept).astype(np.float32)


def painted(p: Point, shade: Iterable[float], rig: Rig) -> FloatArray:
    """sRGB (point, 3) 0…1 of points whose colour is shown as it is, in their shade (3,) where they
    are turned away from the key."""
    lit_share = _step(*CEL_EDGE, (p.normal @ _unit(rig.lamps[0].towards))[:, None])
    return to_srgb(np.clip(p.albedo * _mix(_f32(shade), 1.0, lit_share), 0, 1))


def socket_shade(normal: FloatArray) -> FloatArray:
    """How open (point, 1) a ball in its socket is, from its normals (point, 3): lids and brow are
    above, cheek and corners round it."""
    upper = 1 - _step(*LID_UPPER, normal[:, 1:2] + LID_ARCH * normal[:, :1] ** 2)
    lower = _step(*LID_LOWER, normal[:, 1:2])
    middle = _step(*LID_CORNER, normal[:, 2:])
    return (0.24 + 0.76 * upper) * (0.6 + 0.4 * lower) * (0.62 + 0.38 * middle)


def _step(low: float, high: float, value: FloatArray) -> FloatArray:
    t = np.clip((value - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def _around(up: FloatArray, rig: Rig) -> FloatArray:
    """Light of the surroundings from a direction whose y is `up`."""
    return _mix(_f32(rig.ground), _f32(rig.sky), up * 0.5 + 0.5)


def _bounced(occlusion: FloatArray, albedo: FloatArray) -> FloatArray:
    """Occlusion with the light that neighbours send on (Jimenez 2016), coloured by them."""
    a, b, c = 2.0404 * albedo - 0.3324, 0.6417 - 4.7951 * albedo, 2.7552 * albedo + 0.6903
    return np.maximum(occlusion, ((occlusion * a + b) * occlusion + c) * occlusion)


def _reached(p: Point, f: Finish, lamp: Lamp) -> FloatArray:
    """Light of a lamp on the points."""
    towards = _unit(lamp.towards)
    bare, blunt = (p.normal @ towards)[:, None], (p.blunt @ towards)[:, None]
    wrap = lamp.wrap + f.softness * _f32(WRAP)
    fall = (_mix(bare, blunt, f.softness * _f32(BLUNT)) + wrap) / (1 + wrap) ** 2
    return _f32(lamp.color) * np.clip(fall, 0, 1)


def _glint(p: Point, f: Finish, lamp: Lamp, facing: FloatArray, mirror: FloatArray) -> FloatArray:
    """Highlight of a lamp: GGX, or across the strands of hair; mirror: its reflectance."""
    towards = _unit(lamp.towards)
    half = p.view + towards
    half = half / np.sqrt(_dot(half, half))
    meets = np.clip((p.normal @ towards)[:, None], 0, 1)
    color = _f32(lamp.color) * lamp.shine
    if f.strand:
        along, away = _dot(p.strand, half), _dot(p.normal, half)
        mirrored, passed = (
            np.maximum(1 - (along + tilt * away) ** 2, 0) ** power
            for tilt, power in zip(STRAND_TILT, STRAND_POWER, strict=True)
        )
        strands = p.albedo[:, 1:2] / (p.albedo[:, 1:2] + np.float32(STRAND_GAP))
        bright = STRAND_TINT[0] * mirrored * strands + STRAND_TINT[1] * passed * p.albedo
        return color * bright * (f.strand * p.occlusion * _mix(meets, 1, 0.25))
    aligned, seen = np.clip(_dot(p.normal, half), 0, 1), np.clip(_dot(p.view, half), 0, 1)
    wide = np.minimum(p.roughness * p.roughness + lamp.size * 0.5, 1)
    narrow = wide * wide
    lobe = narrow / (aligned * aligned * (narrow - 1) + 1) ** 2
    masked = 0.5 / _mix(2 * meets * facing, meets + facing, wide)
    fresnel = mirror + (1 - mirror) * (1 - seen) ** 5
    return color * (lobe * masked * fresnel * meets)


def _coat(p: Point, f: Finish, rig: Rig) -> FloatArray:
    """What a wet eye mirrors: the boxes of key and fill, the sky."""
    facing = np.clip(_dot(p.blunt, p.view), 0, 1)
    mirrored = 2 * facing * p.blunt - p.view
    shine = _around(mirrored[:, 1:2], rig) * 0.5
    for lamp, radiance in zip(rig.lamps, BOX_RADIANCE, strict=False):
        towards, right, above = box(_lowered(lamp))
        depth = np.maximum((mirrored @ towards)[:, None], np.float32(1e-3))
        x = np.abs((mirrored @ right)[:, None]) / depth / BOX_HALF[0]
        y = np.abs((mirrored @ above)[:, None]) / depth / BOX_HALF[1]
        away = np.minimum(x**BOX_ROUND + y**BOX_ROUND, np.float32(9)) ** (1 / BOX_ROUND)
        inside = 1 - _step(*BOX_EDGE, away)
        shine = shine + _f32(lamp.color) * radiance * inside
    glance = COAT_REFLECTANCE + (1 - COAT_REFLECTANCE) * (1 - facing) ** 5
    return shine * glance * (f.coat * p.occlusion)


def box(lamp: Lamp) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Unit directions of a lamp's soft box: to it, to its right and to its top."""
    towards = _unit(lamp.towards)
    right = np.cross(_f32((0, 1, 0)), towards)
    right = right / np.linalg.norm(right)
    return towards, right.astype(np.float32), np.cross(towards, right).astype(np.float32)


def _lowered(lamp: Lamp) -> Lamp:
    """A lamp where eyes mirror it: below the edge of the upper lid."""
    x, y, z = lamp.towards
    return replace(lamp, towards=(x, BOX_LOWER * y, z))


def shown(light: FloatArray, exposure: float) -> FloatArray:
    """sRGB (point, 3) 0…1 of linear light: linear up to a shoulder that keeps the hue."""
    color = light * np.float32(exposure)
    peak = np.maximum(color.max(axis=1, keepdims=True), np.float32(1e-6))
    room = np.float32(1 - TONE_START)
    over = np.maximum(peak - TONE_START, 0)
    lower = np.where(over > 0, 1 - room * room / (over + room), peak)
    bleached = 1 - 1 / (TONE_BLEACH * (peak - lower) + 1)
    return to_srgb(_mix(color * (lower / peak), lower, bleached))


def to_srgb(color: FloatArray) -> FloatArray:
    """Linear 0…1 to sRGB 0…1, by square roots: half a byte's step off at most, and fast."""
    one = np.sqrt(color)
    two = np.sqrt(one)
    root = SRGB[0] * one + SRGB[1] * two + SRGB[2] * np.sqrt(two) + SRGB[3] * color
    return np.where(color <= 0.0031308, 12.92 * color, root).astype(np.float32)


def to_linear(color: FloatArray) -> FloatArray:
    """sRGB 0…1 to linear 0…1."""
    return np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4).astype(
        np.float32
    )


def ground(at: FloatArray, rig: Rig) -> FloatArray:
    """sRGB (point, 3) of what lies behind the head, at (point, 2) 0…1 from the lower left."""
    away = (at - _f32(GROUND_MIDDLE)) * _f32(GROUND_SHAPE)
    share = np.clip(np.sqrt((away * away).sum(axis=1, keepdims=True)), 0, 1)
    return _mix(_f32(rig.middle), _f32(rig.margin), share * share * (3 - 2 * share))


def open_to_key(moments: FloatArray, depth: FloatArray) -> FloatArray:
    """Share of the key (point, 1) that arrives at a depth, from blurred moments (point, 2).

    Chebyshev's bound (variance shadow maps); what it lets through wrongly is cut off.
    """
    mean = moments[:, :1]
    behind = depth - mean
    spread = np.maximum(moments[:, 1:] - mean * mean, np.float32(SHADOW_SPREAD))
    share = np.clip((spread / (spread + behind * behind) - SHADOW_CUT) / (1 - SHADOW_CUT), 0, 1)
    return np.where(behind <= 0, np.float32(1), share).astype(np.float32)


def tangents(
    edge: FloatArray,
    other: FloatArray,
    change: FloatArray,
    other_change: FloatArray,
    normal: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Directions (point, 3) across the normals in which either texture coordinate grows.

    From two edges (point, 3) of each triangle and the changes (point, 2) of texture coordinates
    along them. Longer where the coordinate grows faster.
    """
    across, down = np.cross(other, normal), np.cross(normal, edge)
    side = np.sign(_dot(np.cross(edge, other), normal))
    right = side * (across * change[:, :1] + down * other_change[:, :1])
    return right, side * (across * change[:, 1:] + down * other_change[:, 1:])


def bumped(
    texel: FloatArray,
    scale: float,
    tangent: FloatArray,
    bitangent: FloatArray,
    normal: FloatArray,
) -> FloatArray:
    """Unit normals (point, 3) with a normal map, by `tangents`; texel (point, 3) 0…1."""
    largest = np.maximum(_dot(tangent, tangent), _dot(bitangent, bitangent))
    unit = scale / np.sqrt(np.maximum(largest, 1e-30))
    slope = (texel[:, :2] * 2 - 1) * unit
    out = tangent * slope[:, :1] + bitangent * slope[:, 1:] + normal * (texel[:, 2:] * 2 - 1)
    return (out / np.sqrt(np.maximum(_dot(out, out), 1e-12))).astype(np.float32)


def refracted(
    at: FloatArray,
    eye: tuple[float, float, float],
    view: FloatArray,
    tangent: FloatArray,
    bitangent: FloatArray,
    normal: FloatArray,
) -> FloatArray:
    """Where (point, 2) on an eye's image views meet the iris, by `tangents`: the cornea bends them.
    Seen from ahead, all is where it is drawn.

    eye: the three of `elocute.head.surface.EYE`.
    """
    edge_rad, iris_rad, depth = eye
    facing = np.maximum(_dot(view, normal), np.float32(CORNEA_ASLANT))
    inside = np.sqrt(1 - (1 - facing * facing) / np.float32(CORNEA_INDEX**2))
    slant = np.hstack(
        [
            _dot(view, way) / np.sqrt(np.maximum(_dot(way, way), 1e-30))
            for way in (tangent, bitangent)
        ]
    )
    angle = (at - 0.5) * np.float32(2 * edge_rad)
    below = depth / CORNEA_INDEX * np.maximum(1 - _dot(angle, angle) / iris_rad**2, 0)
    shift = below * (slant / inside + angle)
    return (at - shift / (2 * edge_rad)).astype(np.float32)


def folded(point: Point, texel: FloatArray, heights: FloatArray) -> tuple[Point, FloatArray]:
    """Points in the creases of folds: darker, and the texels (point, 3) of their normals turned.

    heights (point, 3) are those here, `FOLD_STEP` to the right, and as much above.
    """
    sunk = np.maximum(-heights[:, :1], 0)
    turned = texel.copy()
    turned[:, :2] -= (heights[:, 1:] - heights[:, :1]) * np.float32(0.5 * FOLD_SLOPE)
    shaded = replace(
        point,
        albedo=point.albedo * (1 - sunk * _f32(FOLD_TINT)),
        occlusion=point.occlusion * (1 - sunk * np.float32(FOLD_SHADE)),
    )
    return shaded, turned


def enclosed(point: Point, openness: FloatArray) -> Point:
    """Points in a mouth whose lips let some light in (point, 1): darker, lit by red flesh."""
    return replace(
        point,
        albedo=point.albedo * np.maximum(openness, np.float32(DIM_LEAST)) ** _f32(DIM_POWERS),
        occlusion=point.occlusion * _mix(DIM_SHINE, 1.0, openness),
    )


def edge_on(slant: FloatArray) -> FloatArray:
    """Factor of a card's alpha: what is seen edge-on would only be a dashed line.

    slant is the cosine between the view and the face.
    """
    return _step(*EDGE_ON, np.abs(slant))


def glsl(rig: Rig) -> str:
    """The same in GLSL, the numbers written in; docs/design.md says what it offers.

    It reads no texture and keeps to what GLSL 3.30 and GLSL ES 3.00 share.
    """
    lamps = []
    for index, lamp in enumerate(rig.lamps):
        kept = f"mix(1.0, {CREVICE if index == 0 else ENCLOSED:f}, f.ambient)"
        through = f"mix(1.0, p.occlusion, {kept})"
        bled = "vec3(through)"
        if index == 0:
            through += f" * (1.0 - (1.0 - p.shadow) * {rig.shadow:f})"
            bled = f"pow(vec3(through), mix(vec3(1.0), {vec(PENUMBRA)}, f.softness))"
        lamps.append(f"    through = {through};")
        towards, color = vec(_unit(lamp.towards)), vec(lamp.color)
        soft = f"{lamp.size * 0.5:f}, {lamp.wrap:f}, {lamp.shine:f}"
        lamps.append(
            f"    lamp(p, f, {towards}, {color}, {soft}, through, {bled}, facing, light, shine);"
        )
    boxes = []
    for lamp, radiance in zip(rig.lamps, BOX_RADIANCE, strict=False):
        sides = ", ".join(map(vec, box(_lowered(lamp))))
        boxes.append(f"    shine += {vec(lamp.color)} * {radiance:f} * boxed(mirrored, {sides});")
    return f"""
struct Point {{
    vec3 albedo; vec3 normal; vec3 blunt; vec3 view; vec3 strand;
    float occlusion; float roughness; float shadow; float metal;
}};
struct Finish {{
    float reflectance; float roughness; float softness; float ambient; float coat; float strand;
}};
vec3 around(float up) {{
    return mix({vec(rig.ground)}, {vec(rig.sky)}, up * 0.5 + 0.5);
}}
vec3 bounced(float occlusion, vec3 albedo) {{
    vec3 a = 2.0404 * albedo - 0.3324, b = 0.6417 - 4.7951 * albedo, c = 2.7552 * albedo + 0.6903;
    return max(vec3(occlusion), ((occlusion * a + b) * occlusion + c) * occlusion);
}}
float socket(vec3 normal) {{
    float arched = normal.y + {LID_ARCH:f} * normal.x * normal.x;
    float upper = 1.0 - smoothstep({LID_UPPER[0]:f}, {LID_UPPER[1]:f}, arched);
    float lower = smoothstep({LID_LOWER[0]:f}, {LID_LOWER[1]:f}, normal.y);
    float middle = smoothstep({LID_CORNER[0]:f}, {LID_CORNER[1]:f}, normal.z);
    return (0.24 + 0.76 * upper) * (0.6 + 0.4 * lower) * (0.62 + 0.38 * middle);
}}
float fifth(float x) {{ return x * x * x * x * x; }}
float gapped(float green) {{ return green / (green + {STRAND_GAP:f}); }}
void lamp(Point p, Finish f, vec3 towards, vec3 color, float size, float wrap, float gain,
          float through, vec3 bled, float facing, inout vec3 light, inout vec3 shine) {{
    float bare = dot(p.normal, towards), blunt = dot(p.blunt, towards);
    vec3 reach = wrap + f.softness * {vec(WRAP)};
    vec3 fall = (mix(vec3(bare), vec3(blunt), f.softness * {vec(BLUNT)}) + reach)
        / ((1.0 + reach) * (1.0 + reach));
    light += color * clamp(fall, 0.0, 1.0) * bled;
    if (gain == 0.0) return;
    vec3 between = normalize(p.view + towards);
    float meets = clamp(bare, 0.0, 1.0);
    if (f.strand > 0.0) {{
        float along = dot(p.strand, between), away = dot(p.normal, between);
        float first = along + away * {STRAND_TILT[0]:f}, second = along + away * {STRAND_TILT[1]:f};
        float mirrored = pow(max(1.0 - first * first, 0.0), {STRAND_POWER[0]:f});
        float passed = pow(max(1.0 - second * second, 0.0), {STRAND_POWER[1]:f});
        mirrored *= gapped(p.albedo.g);
        vec3 open = color * (gain * through * f.strand * p.occlusion * mix(meets, 1.0, 0.25));
        shine += open * ({STRAND_TINT[0]:f} * mirrored);
        light += open * ({STRAND_TINT[1]:f} * passed);
        return;
    }}
    float aligned = clamp(dot(p.normal, between), 0.0, 1.0);
    float wide = min(p.roughness * p.roughness + size, 1.0);
    float narrow = wide * wide;
    float lobe = aligned * aligned * (narrow - 1.0) + 1.0;
    float masked = 0.5 / mix(2.0 * meets * facing, meets + facing, wide);
    float fresnel = f.reflectance
        + (1.0 - f.reflectance) * fifth(1.0 - clamp(dot(p.view, between), 0.0, 1.0));
    shine += color * (narrow / (lobe * lobe) * masked * fresnel * meets * gain * through);
}}
float boxed(vec3 mirrored, vec3 towards, vec3 right, vec3 above) {{
    float depth = max(dot(mirrored, towards), 0.001);
    float x = pow(abs(dot(mirrored, right)) / depth / {BOX_HALF[0]:f}, {BOX_ROUND:f});
    float y = pow(abs(dot(mirrored, above)) / depth / {BOX_HALF[1]:f}, {BOX_ROUND:f});
    float away = pow(min(x + y, 9.0), {1 / BOX_ROUND:f});
    return 1.0 - smoothstep({BOX_EDGE[0]:f}, {BOX_EDGE[1]:f}, away);
}}
vec3 coated(Point p, Finish f) {{
    float facing = clamp(dot(p.blunt, p.view), 0.0, 1.0);
    vec3 mirrored = 2.0 * facing * p.blunt - p.view;
    vec3 shine = around(mirrored.y) * 0.5;
{chr(10).join(boxes)}
    float glance = {COAT_REFLECTANCE:f} + {1 - COAT_REFLECTANCE:f} * fifth(1.0 - facing);
    return shine * (glance * f.coat * p.occlusion);
}}
void lighted(inout Point p, Finish f, out vec3 light, out vec3 shine) {{
    if (f.coat > 0.0) p.albedo *= pow(vec3(socket(p.blunt)), {vec(LID_WARMTH)}) * {BALL:f};
    f.reflectance = mix(f.reflectance, 1.0, p.metal);
    float facing = max(dot(p.normal, p.view), 0.02);
    light = around(mix(p.normal.y, p.blunt.y, 0.5 * f.softness))
        * bounced(p.occlusion, p.albedo) * f.ambient;
    float grazing = {GRAZING:f} * (1.0 - p.roughness) * (1.0 - p.roughness);
    float glance = f.reflectance + max(grazing - f.reflectance, 0.0) * fifth(1.0 - facing);
    shine = around(2.0 * facing * p.normal.y - p.view.y)
        * (glance * p.occlusion * f.ambient * (1.0 - f.strand));
    float through;
{chr(10).join(lamps)}
    if (f.coat > 0.0) shine += coated(p, f);
    float turned = 1.0 - smoothstep({WITHIN_HAIR[0]:f}, {WITHIN_HAIR[1]:f}, dot(p.blunt, p.view));
    float kept = 1.0 - f.strand * {DARK_WITHIN:f} * turned;
    light *= kept * (1.0 - p.metal);
    shine *= kept * mix(vec3(1.0), p.albedo, p.metal);
}}
vec3 lit(Point p, Finish f) {{
    vec3 light, shine;
    lighted(p, f, light, shine);
    return p.albedo * light + shine;
}}
vec3 to_srgb(vec3 color) {{
    vec3 one = sqrt(color), two = sqrt(one);
    vec3 root = {SRGB[0]} * one + {SRGB[1]} * two + {SRGB[2]} * sqrt(two) + {SRGB[3]} * color;
    return mix(12.92 * color, root, step(0.0031308, color));
}}
vec3 shown(vec3 light, float exposure) {{
    vec3 color = light * exposure;
    float peak = max(max(color.r, color.g), max(color.b, 0.000001));
    float lower = peak;
    if (peak > {TONE_START:f})
        lower = 1.0 - {(1 - TONE_START) ** 2:f} / (peak - {TONE_START:f} + {1 - TONE_START:f});
    return to_srgb(mix(color * (lower / peak), vec3(lower),
        1.0 - 1.0 / ({TONE_BLEACH:f} * (peak - lower) + 1.0)));
}}
vec3 painted(Point p, vec3 shade) {{
    float share = smoothstep({CEL_EDGE[0]:f}, {CEL_EDGE[1]:f},
        dot(p.normal, {vec(_unit(rig.lamps[0].towards))}));
    return to_srgb(clamp(p.albedo * mix(shade, vec3(1.0), share), 0.0, 1.0));
}}
vec3 ground(vec2 at) {{
    float share = clamp(length((at - {vec(GROUND_MIDDLE)}) * {vec(GROUND_SHAPE)}), 0.0, 1.0);
    return mix({vec(rig.middle)}, {vec(rig.margin)}, share * share * (3.0 - 2.0 * share));
}}
float open_to_key(vec2 moments, float depth) {{
    float behind = depth - moments.x;
    float spread = max(moments.y - moments.x * moments.x, {SHADOW_SPREAD:.9f});
    float share = (spread / (spread + behind * behind) - {SHADOW_CUT:f}) / {1 - SHADOW_CUT:f};
    return behind <= 0.0 ? 1.0 : clamp(share, 0.0, 1.0);
}}
float edge_on(vec3 place, vec3 view) {{
    vec3 face = cross(dFdx(place), dFdy(place));
    float slant = abs(dot(face, view)) * inversesqrt(max(dot(face, face), 1e-30));
    return smoothstep({EDGE_ON[0]:f}, {EDGE_ON[1]:f}, slant);
}}
vec3 folded(inout Point p, vec3 texel, vec3 heights) {{
    float sunk = max(-heights.x, 0.0);
    p.albedo *= 1.0 - sunk * {vec(FOLD_TINT)};
    p.occlusion *= 1.0 - sunk * {FOLD_SHADE:f};
    return texel - vec3((heights.yz - heights.x) * {0.5 * FOLD_SLOPE:f}, 0.0);
}}
void enclosed(inout Point p, float openness) {{
    p.albedo *= pow(vec3(max(openness, {DIM_LEAST:f})), {vec(DIM_POWERS)});
    p.occlusion *= mix({DIM_SHINE:f}, 1.0, openness);
}}
void tangents(vec3 place, vec2 at, vec3 normal, out vec3 right, out vec3 up) {{
    vec2 a0 = dFdx(at), a1 = dFdy(at);
    vec3 across = cross(dFdy(place), normal), down = cross(normal, dFdx(place));
    right = across * a0.x + down * a1.x;
    up = across * a0.y + down * a1.y;
}}
vec2 refracted(vec2 at, vec3 eye, vec3 view, vec3 place, vec3 normal) {{
    vec3 right, up;
    tangents(place, at, normal, right, up);
    float facing = max(dot(view, normal), {CORNEA_ASLANT:f});
    float inside = sqrt(1.0 - (1.0 - facing * facing) / {CORNEA_INDEX**2:f});
    vec2 slant = vec2(dot(view, right) * inversesqrt(max(dot(right, right), 1e-30)),
        dot(view, up) * inversesqrt(max(dot(up, up), 1e-30)));
    vec2 angle = (at - 0.5) * (2.0 * eye.x);
    float below = eye.z / {CORNEA_INDEX:f} * max(1.0 - dot(angle, angle) / (eye.y * eye.y), 0.0);
    return at - (slant / inside + angle) * (below / (2.0 * eye.x));
}}
vec3 bumped(vec3 texel, float scale, vec3 place, vec2 at, vec3 normal) {{
    vec3 tangent, bitangent;
    tangents(place, at, normal, tangent, bitangent);
    float largest = max(dot(tangent, tangent), dot(bitangent, bitangent));
    float unit = largest > 0.0 ? inversesqrt(largest) : 0.0;
    vec2 slope = (texel.xy * 2.0 - 1.0) * (scale * unit);
    return normalize(tangent * slope.x + bitangent * slope.y + normal * (texel.z * 2.0 - 1.0));
}}
"""


OPENNESS_GLSL = """
float squares(vec3 place, vec3 start, vec3 end) {
    vec3 way = end - start, from = place - start;
    vec3 off = from - clamp(dot(from, way) / max(dot(way, way), 1e-12), 0.0, 1.0) * way;
    return dot(off, off);
}
float openness(vec4 opening[3], vec3 place) {
    float away = min(squares(place, opening[0].xyz, opening[1].xyz),
        squares(place, opening[1].xyz, opening[2].xyz));
    return 1.0 / (1.0 + away / (opening[0].w * opening[0].w));
}
"""
"""`elocute.head.mouth_opening.openness` for the stages of vertices, kept apart from `glsl`."""


def finish_glsl(finish: Finish) -> str:
    """A Finish as a GLSL expression."""
    return "Finish(" + ", ".join(f"{value:f}" for value in astuple(finish)) + ")"


def _f32(values: Iterable[float]) -> FloatArray:
    return np.array(tuple(values), np.float32)


def _unit(values: Iterable[float]) -> FloatArray:
    vector = _f32(values)
    return (vector / np.linalg.norm(vector)).astype(np.float32)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.einsum("ij,ij->i", a, b)[:, None]


def _mix(a: FloatArray | float, b: FloatArray | float, share: FloatArray | float) -> FloatArray:
    return np.asarray(a + (b - a) * share, np.float32)


def vec(values: Iterable[float]) -> str:
    """Numbers as a GLSL vector."""
    parts = [f"{float(value):f}" for value in values]
    return f"vec{len(parts)}(" + ", ".join(parts) + ")"
