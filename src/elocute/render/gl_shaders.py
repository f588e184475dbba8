"""The programs of the OpenGL engine, put together round `shading.glsl`."""

from __future__ import annotations

from elocute.render import shading
from elocute.render.lights import Rig
from elocute.render.parts import Part
from elocute.render.stage import Stage

_VERTEX = """#version 330
invariant gl_Position;
uniform mat4 projection; uniform mat4 key_view;
in vec3 position; in vec3 normal; in vec2 texcoord;
in vec3 color; in float occlusion; in vec3 strand;
out vec3 place; out vec3 smooth_normal; out vec2 at; out vec4 paint;
out vec3 from_key; out vec3 along;
ZONES
OPENNESS
GLOW
void main() {
    SET_CREASE
    SET_OPEN
    gl_Position = projection * vec4(position, 1.0);
    place = position; smooth_normal = normal; at = texcoord; paint = vec4(color, occlusion);
    along = strand;
    from_key = (key_view * vec4(position, 1.0)).xyz;
    SET_GLOW
}
"""
_ZONES = """
uniform vec4 fold_strengths[4];
in vec4 folds_0; in vec4 folds_1; in vec4 folds_2; in vec4 folds_3;
out vec2 crease;
"""
_CREASE = """
    crease = vec2(dot(folds_0, fold_strengths[0]) + dot(folds_1, fold_strengths[1]),
        dot(folds_2, fold_strengths[2]) + dot(folds_3, fold_strengths[3]));
"""
_OPENING = """
uniform vec4 opening[3];
out float open;
"""
# Nothing is known here of neighbours: what asks how places differ from theirs is not called.
_GLOW = """
uniform vec3 eye; uniform sampler2D shadow_map;
out vec3 glow; out vec4 gleam;
#define dFdx(value) (value)
#define dFdy(value) (value)
SHADING
"""
_SET_GLOW = """
    vec3 upright = normalize(normal);
    float open_to = open_to_key(textureLod(shadow_map, from_key.xy * 0.5 + 0.5, 0.0).xy,
        from_key.z - SHADOW_BIAS);
    Point p = Point(color * TINT, upright, upright, normalize(eye - position), STRAND, occlusion,
        clamp(ROUGHNESS, 0.05, 1.0), open_to, 0.0);
    vec3 shine;
    lighted(p, FINISH, glow, shine);
    glow *= p.albedo;
    gleam = vec4(shine / gapped(p.albedo.g), p.albedo.g);
"""
_HEIGHT = """
in vec2 crease;
float height(vec2 spot) {
    return dot(texture(folds_map, spot).rgb * 2.0 - 1.0, vec3(crease, crease.x * FINER));
}
"""
_FOLD = """
    vec2 off = vec2(FOLD_STEP, 0.0);
    relief = folded(p, relief, vec3(height(at), height(at + off), height(at + off.yx)));
"""
VERTEX_OF_KEY = """#version 330
uniform mat4 key_view;
in vec3 position; in vec2 texcoord;
out vec2 at; out float depth;
void main() {
    gl_Position = key_view * vec4(position, 1.0);
    at = texcoord; depth = gl_Position.z;
}
"""
VERTEX_AT = """#version 330
invariant gl_Position;
uniform mat4 projection;
in vec3 position; in vec2 texcoord;
out vec2 at; out vec3 place;
void main() { gl_Position = projection * vec4(position, 1.0); at = texcoord; place = position; }
"""
HIDING = """#version 330
out vec4 pixel;
void main() { pixel = vec4(0.0); }
"""
_COVER = """#version 330
uniform sampler2D color_map; uniform vec3 eye;
in vec2 at; in vec3 place; out vec4 pixel;
SHADING
void main() {
    float alpha = texture(color_map, at).a * GAIN;
    if (alpha * FADE < CORE) discard;
    pixel = vec4(0.0);
}
"""
OVERLAY = """#version 330
in vec2 corner; out vec2 at;
void main() { gl_Position = vec4(corner, 0.0, 1.0); at = corner * 0.5 + 0.5; }
"""
# Pictures are read from their upper row on, targets from their lowest.
TURNED_OVERLAY = """#version 330
in vec2 corner; out vec2 at;
void main() {
    gl_Position = vec4(corner, 0.0, 1.0); at = vec2(corner.x, -corner.y) * 0.5 + 0.5;
}
"""
_SURFACE = """#version 330
uniform vec3 eye; uniform float exposure;
uniform sampler2D color_map; uniform sampler2D normal_map; uniform sampler2D roughness_map;
uniform sampler2D shadow_map; uniform sampler2D folds_map;
in vec3 place; in vec3 smooth_normal; in vec2 at; in vec4 paint; in vec3 from_key; in vec3 along;
HEIGHT
OPEN
out vec4 pixel;
SHADING
void main() {
    vec4 texel = TEXEL;
    CUT
    Point p;
    p.albedo = paint.rgb * texel.rgb * TINT;
    p.view = normalize(eye - place);
    p.blunt = normalize(smooth_normal) * FACING;
    p.strand = STRAND;
    p.occlusion = paint.a; p.roughness = ROUGHNESS; p.metal = METAL;
    ROUGH
    ENCLOSE
    vec3 relief = RELIEF;
    TURN_RELIEF
    p.normal = NORMAL;
    p.roughness = clamp(p.roughness, 0.05, 1.0);
    p.shadow = open_to_key(texture(shadow_map, from_key.xy * 0.5 + 0.5).xy,
        from_key.z - SHADOW_BIAS);
    float alpha = ALPHA;
    pixel = vec4(COLOR * alpha, alpha);
}
"""
# Of a part that was lit at its vertices.
_GLOWING = """#version 330
uniform vec3 eye; uniform float exposure; uniform sampler2D color_map;
in vec3 place; in vec2 at; in vec3 glow; in vec4 gleam;
out vec4 pixel;
SHADING
void main() {
    vec4 texel = texture(color_map, at);
    CUT
    float alpha = ALPHA;
    vec3 shine = gleam.rgb * gapped(gleam.a * texel.g);
    pixel = vec4(shown(glow * texel.rgb + shine, exposure) * alpha, alpha);
}
"""
_DEPTHS = """#version 330
uniform sampler2D color_map;
in vec2 at; in float depth;
out vec2 moments;
void main() {
    CUT
    moments = vec2(depth, depth * depth);
}
"""
_BLUR = """#version 330
uniform sampler2D drawn; in vec2 at; out vec2 moments;
void main() {
    moments = SUM;
}
"""


def vertex(part: Part, rig: Rig, glows: bool) -> str:
    """The vertices of a part; those of a surface with folds know how strong they are, those in the
    mouth how open to the room, those of one that glows how much light they send to the eye."""
    folds, inside = part.folds is not None, part.inside
    parts = {
        "SET_GLOW": _SET_GLOW if glows else "",
        "GLOW": _GLOW if glows else "",
        "ZONES": _ZONES if folds else "",
        "SET_CREASE": _CREASE if folds else "",
        "OPENNESS": shading.OPENNESS_GLSL + _OPENING if inside else "",
        "SET_OPEN": "open = openness(opening, position);" if inside else "",
    }
    return _filled(_VERTEX, parts | _of_finish(part, rig))


def surface(part: Part, rig: Rig, glows: bool, *, fringe: bool = False) -> str:
    """The fragments of a part: what of it is solid, or the fringe laid over what lies behind."""
    look = part.surface
    cut, alpha = "", "1.0"
    if fringe:
        cut = f"texel.a *= {_fade(part)} * {look.alpha:f}; "
        cut += f"if (texel.a >= {part.core:f} || texel.a < 0.01) discard;"
        alpha = f"min(texel.a * {part.fringe_gain:f}, 1.0)"
    where = "at"
    if look.iris_depth > 0:
        where = f"refracted(at, vec3({look.eye_rad:f}, {look.iris_rad:f}, {look.iris_depth:f}), "
        where += "normalize(eye - place), place, normalize(smooth_normal))"
    scale = look.normal_scale
    bumped = f"bumped(relief, {scale:f}, place, at, p.blunt)"
    rough = (
        "vec3 rough = texture(roughness_map, at).rgb; p.metal *= rough.b;"
        " p.occlusion = min(p.occlusion, rough.r); p.roughness *= rough.g;"
    )
    shown = "shown(lit(p, FINISH), exposure)"
    if look.shade is not None:
        shown = f"painted(p, {shading.vec(look.shade)})"
    parts = {
        "METAL": f"{look.metal:f}",
        "TEXEL": "vec4(1.0)" if part.color is None else f"texture(color_map, {where})",
        "CUT": cut,
        "FACING": "(gl_FrontFacing ? 1.0 : -1.0)" if part.turns else "1.0",
        "OPEN": "in float open;" if part.inside else "",
        "ENCLOSE": "enclosed(p, open);" if part.inside else "",
        "HEIGHT": "" if part.folds is None else _HEIGHT,
        "TURN_RELIEF": "" if part.folds is None else _FOLD,
        "RELIEF": "texture(normal_map, at).xyz" if part.normal else "vec3(0.5, 0.5, 1.0)",
        "NORMAL": bumped if part.normal or part.folds else "p.blunt",
        "FINER": f"{look.fold_lines:f}",
        "FOLD_STEP": f"{shading.FOLD_STEP:.9f}",
        "ROUGH": "" if part.roughness is None else rough,
        "ALPHA": alpha,
    }
    parts = {"COLOR": shown} | _of_finish(part, rig) | parts
    return _filled(_GLOWING if glows else _SURFACE, parts)


def _of_finish(part: Part, rig: Rig) -> dict[str, str]:
    """What says how light meets a part, at its vertices or in its fragments."""
    return {
        "SHADING": shading.glsl(rig),
        "TINT": "vec3(" + ", ".join(f"{value:f}" for value in part.surface.tint) + ")",
        "STRAND": "normalize(along)" if part.finish.strand else "vec3(0.0)",
        "ROUGHNESS": f"{part.rough:f}",
        "SHADOW_BIAS": f"{shading.SHADOW_BIAS:f}",
        "FINISH": shading.finish_glsl(part.finish),
    }


def _fade(part: Part) -> str:
    """What is left of a card's alpha, from where it is seen."""
    return "edge_on(place, normalize(eye - place))" if part.fades else "1.0"


def cover(part: Part, rig: Rig) -> str:
    """Where cards are solid: of it only the depth is kept."""
    parts = {"SHADING": shading.glsl(rig), "CORE": f"{part.core:f}", "FADE": _fade(part)}
    parts["GAIN"] = f"{part.surface.alpha:f}"
    return _filled(_COVER, parts)


def depths(part: Part) -> str:
    """The fragments of a part as the key sees it."""
    cut = f"if (texture(color_map, at).a * {part.surface.alpha:f} < 0.5) discard;"
    cut = "" if part.solid else cut
    return _filled(_DEPTHS, {"CUT": cut})


def blur(taps: list[tuple[float, float]], step: tuple[float, float]) -> str:
    """One direction of the blur of a shadow map."""
    terms = [
        f"texture(drawn, at + vec2({offset * step[0]:.9f}, {offset * step[1]:.9f})).xy"
        f" * {weight:.9f}"
        for offset, weight in taps
    ]
    return _filled(_BLUR, {"SUM": "\n        + ".join(terms)})


_FINISHING = """#version 330
uniform sampler2D drawn; uniform sampler2D backdrop; uniform vec2 step_size; uniform float high;
in vec2 at; out vec4 pixel;
vec2 spot;
SHADING
float noise(vec2 place) {
    return fract(52.9829189 * fract(dot(place, vec2(0.06711056, 0.00583715)))) - 0.5;
}
SMOOTHED
void main() {
    spot = vec2(gl_FragCoord.x, high - gl_FragCoord.y);
    vec4 head = smoothed();
    GROUND
}
"""
_OPAQUE = """
    vec3 color = head.rgb + noise(spot) / 255.0;
    if (head.a < 1.0) color += (1.0 - head.a) * BEHIND;
    pixel = vec4(color, 1.0);
"""
_CLEAR = """
    pixel = head.a > 0.0 ? vec4(head.rgb / head.a, head.a) : vec4(0.0);
"""
_REDUCED = """
vec4 smoothed() { return texture(drawn, at); }
"""
_WHOLE = """
vec4 beside(int x, int y) {
    ivec2 last = textureSize(drawn, 0) - 1;
    return texelFetch(drawn, clamp(ivec2(spot) + ivec2(x, y), ivec2(0), last), 0);
}
"""
# Where less was drawn than is shown.
_BETWEEN = """
vec4 beside(int x, int y) { return texture(drawn, at + vec2(x, y) * step_size); }
"""
# Fast approximate antialiasing (after Lottes 2009): blend along the edge that luma shows.
_EDGES = """
float luma(vec4 c) { return dot(c.rgb, vec3(0.30, 0.59, 0.11)) + (1.0 - c.a) * 0.35; }
vec4 smoothed() {
    vec4 middle = beside(0, 0);
    float m = luma(middle);
    float nw = luma(beside(-1, 1)), ne = luma(beside(1, 1));
    float sw = luma(beside(-1, -1)), se = luma(beside(1, -1));
    float least = min(m, min(min(nw, ne), min(sw, se)));
    float most = max(m, max(max(nw, ne), max(sw, se)));
    if (most - least < max(0.03, 0.10 * most)) return middle;
    vec2 along = vec2(sw + se - nw - ne, nw + sw - ne - se);
    float damp = max((nw + ne + sw + se) * 0.03125, 0.0078125);
    along = clamp(along / (min(abs(along.x), abs(along.y)) + damp), -8.0, 8.0) * step_size;
    vec4 near = 0.5 * (texture(drawn, at - along / 6.0) + texture(drawn, at + along / 6.0));
    vec4 far = 0.5 * near
        + 0.25 * (texture(drawn, at - along * 0.5) + texture(drawn, at + along * 0.5));
    float f = luma(far);
    return f < least || f > most ? near : far;
}
"""


def finishing(stage: Stage) -> str:
    """From what was drawn to the picture: edges smoothed, the ground laid behind."""
    behind = "ground(at)" if stage.backdrop is None else "texture(backdrop, at).rgb"
    ground = _CLEAR if stage.transparent else _OPAQUE.replace("BEHIND", behind)
    parts = {
        "SHADING": shading.glsl(stage.rig),
        "SMOOTHED": _smoothing(stage.profile.oversampling),
        "GROUND": ground,
    }
    return _filled(_FINISHING, parts)


def _smoothing(oversampling: float) -> str:
    """How what was drawn becomes pixels: reduced, or its edges smoothed."""
    if oversampling > 1:
        return _REDUCED
    return (_WHOLE if oversampling == 1 else _BETWEEN) + _EDGES


def _filled(text: str, parts: dict[str, str]) -> str:
    for name, value in parts.items():
        text = text.replace(name, value)
    return text
