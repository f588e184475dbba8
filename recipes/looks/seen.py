"""Which cards of a style are ever seen: long hair lies thirty deep, and all of it would be drawn.

Counted by OpenGL, from all round, on the neutral head: pixels of each quad that lie no deeper than
`SLACK_M` under what closes the style, among those that it would have alone.
"""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np
from scipy.spatial import KDTree

from recipes.looks.cards import Cards
from recipes.looks.surface import Skin

SIDE, VIEWS, RADIUS_M = 640, 96, 0.30
"""Pixels of a view's side, how many views there are, and half of what each shows at least."""
BELOW = -0.5
"""Views from below end here: the sine of their height."""
SLACK_M = 0.0015
"""So much deeper, a pixel still counts: faces differ, and hair moves with them."""
CORE, FAINT = 0.8, 0.01
"""The alpha that hides what lies behind, and the least that is drawn."""
SHOWN = 0.07
"""The share of its pixels that a quad must show to be kept, with those before and behind it in its
ribbon, or one sees where it is cut off."""
ROUND, OPEN = 40, (0.15, 0.45)
"""How many vertices lie round one; the share of pixels seen from which a card begins to lie open,
and does."""
DEEP_LIGHT = 0.35
"""What light comes to cards that hardly show, between others or behind them."""
AMONG, OPENEST, DEEP = 60, 0.75, (0.15, 0.40)
"""Among how many vertices that show one lies, which share of them is less open than what counts,
and how open that is inside the hair, and on it."""
SCALP_M = (0.003, 0.006)
"""So far off the skin hair that hardly shows begins to be dark, and is."""
_VERTEX = """#version 430
uniform mat4 view; uniform float deeper;
in vec3 place; in vec2 texcoord; out vec2 at;
void main() { gl_Position = view * vec4(place, 1.0) + vec4(0, 0, deeper, 0); at = texcoord; }
"""
_SKIN = """#version 430
in vec2 at; out vec4 pixel;
void main() { pixel = vec4(at, 0.0, 1.0); }
"""
_COVER = f"""#version 430
uniform sampler2D picture; in vec2 at; out vec4 pixel;
void main() {{ if (texture(picture, at, -1.0).a < {CORE}) discard; pixel = vec4(1.0); }}
"""
_COUNT = f"""#version 430
layout(early_fragment_tests) in;
layout(std430, binding = 0) buffer Pixels {{ uint pixels[]; }};
uniform sampler2D picture; in vec2 at; out vec4 pixel;
void main() {{
    if (texture(picture, at, -1.0).a >= {FAINT}) atomicAdd(pixels[gl_PrimitiveID / 2], 1u);
    pixel = vec4(0.0);
}}
"""


def without_hidden(cards: Cards, picture: np.ndarray, skin: Skin) -> Cards:
    """Only the quads that are seen, and the vertices that these need.

    Parameters
    ----------
    cards : Cards
        All hair.
    picture : (side, side, 4) array
        0..1; its alpha says where strands are.
    skin : Skin
        What hides hair as well.
    """
    seen, whole = _pixels(cards, picture, skin)
    share = seen / np.maximum(whole, 1)
    kept = _with_neighbours(cards, share >= SHOWN)
    cards = replace(cards, shade=_lit(cards, share, skin))
    used, quads = np.unique(cards.quads[kept], return_inverse=True)
    places, uv_quads = np.unique(cards.uv_quads[kept], return_inverse=True)
    return replace(
        cards,
        quads=quads.reshape(-1, 4),
        uv=cards.uv[places],
        uv_quads=uv_quads.reshape(-1, 4),
        **{
            name: getattr(cards, name)[used]
            for name in ("index", "weights", "offset", "shade", "points")
        },
    )


def _with_neighbours(cards: Cards, kept: np.ndarray) -> np.ndarray:
    """(quad,) those kept, and those that share an end with one of them."""
    ends = np.zeros(len(cards.points), bool)
    ends[cards.quads[kept]] = True
    return np.asarray(ends[cards.quads].any(1))


def _lit(cards: Cards, share: np.ndarray, skin: Skin) -> np.ndarray:
    """(vertex,) shade where what lies open, since it was led round ears and cheeks, is no darker
    than what lies open round it, and what hardly shows is dark, unless it lies on the scalp, as at
    a parting; `share` of each quad is seen."""
    open_ = np.zeros(len(cards.points))
    np.maximum.at(open_, cards.quads, share[:, None])
    near = KDTree(cards.points).query(cards.points, ROUND)[1]
    weight = open_[near] + 1e-3
    around = (weight * cards.shade[near]).sum(1) / weight.sum(1)
    less = np.maximum(around - cards.shade, 0)
    lit = cards.shade + less * ((open_ - OPEN[0]) / np.ptp(OPEN)).clip(0, 1)
    foot, _ = skin.nearest(cards.points)
    off = np.linalg.norm(cards.points - foot, axis=1)
    least = np.interp(off, SCALP_M, (1, DEEP_LIGHT))
    return lit * (least + (1 - least) * np.interp(_openness(cards, open_), DEEP, (0, 1)))


def _openness(cards: Cards, open_: np.ndarray) -> np.ndarray:
    """(vertex,) how open hair lies round a place, whichever card of it: alone each would be a
    flake, darker than what it lies among."""
    shown = np.flatnonzero(open_ >= SHOWN)
    near = KDTree(cards.points[shown]).query(cards.points, AMONG)[1]
    return np.quantile(open_[shown][near], OPENEST, axis=1)


def _views(points: np.ndarray) -> list[np.ndarray]:
    """(4, 4) matrices, evenly from all round but for what looks up from far below."""
    middle = (points.min(0) + points.max(0)) / 2
    radius = max(RADIUS_M, float(np.linalg.norm(points - middle, axis=1).max()))
    found = []
    for k in np.arange(VIEWS) + 0.5:
        height, turn = BELOW + (1 - BELOW) * k / VIEWS, np.pi * (1 + 5**0.5) * k
        flat = np.sqrt(1 - height**2)
        ahead = np.array([flat * np.cos(turn), height, flat * np.sin(turn)])
        right = np.cross([0, 1.0, 0], ahead) / flat
        view = np.eye(4)
        view[:3, :3] = np.stack([right, np.cross(ahead, right), -ahead]) / radius
        view[:3, 3] = -view[:3, :3] @ middle
        found.append(view)
    return found


def _pixels(cards: Cards, picture: np.ndarray, skin: Skin) -> tuple[np.ndarray, np.ndarray]:
    """(quad,) pixels that are seen, and all that it has, over all views."""
    corners = [0, 1, 2, 0, 2, 3]
    at = cards.uv[cards.uv_quads[:, corners].ravel()]
    hair = np.column_stack([cards.points[cards.quads[:, corners].ravel()], at])
    body = np.pad(skin.points[skin.quads[:, corners].ravel()], ((0, 0), (0, 2)))
    os.environ.setdefault("LP_NUM_THREADS", "0")  # software loses counts where threads share them
    settings: Any = {"backend": "egl"}  # the library's own annotation of it is wrong
    with moderngl.create_context(standalone=True, require=430, **settings) as gl:
        texels = np.round(255 * picture[::-1]).astype(np.uint8)
        texture = gl.texture(texels.shape[1::-1], 4, texels.tobytes())
        texture.build_mipmaps()
        texture.use(0)
        target = gl.simple_framebuffer((SIDE, SIDE))
        target.use()
        drawn = []
        for fragment, mesh in ((_SKIN, body), (_COVER, hair), (_COUNT, hair)):
            program, buffer = gl.program(_VERTEX, fragment), gl.buffer(mesh.astype("f4").tobytes())
            drawn.append(gl.vertex_array(program, [(buffer, "3f 2f", "place", "texcoord")]))
        none = np.zeros(len(cards.quads), np.uint32).tobytes()
        seen, whole = gl.buffer(none), gl.buffer(none)
        for view in _views(cards.points):
            for array in drawn:
                array.program["view"].write(view.T.astype("f4").tobytes())
            drawn[1].program["deeper"] = SLACK_M * float(np.linalg.norm(view[2, :3]))
            gl.enable_only(moderngl.DEPTH_TEST)
            target.depth_mask = True
            target.clear(depth=1.0)
            drawn[0].render()
            drawn[1].render()
            target.depth_mask = False
            seen.bind_to_storage_buffer(0)
            drawn[2].render()
            gl.enable_only(moderngl.NOTHING)
            whole.bind_to_storage_buffer(0)
            drawn[2].render()
        return np.frombuffer(seen.read(), np.uint32), np.frombuffer(whole.read(), np.uint32)
