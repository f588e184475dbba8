"""One self-contained page: the head, its sound and a viewer; works from file:// offline.

It is told light, finishes and views, so that it draws heads as pictures do.
"""

from __future__ import annotations

import base64
import html
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from elocute.errors import ElocuteError, MachineError, printable
from elocute.export.drawn_character import drawn
from elocute.export.gltf import corners_of, glb_bytes
from elocute.export.options import GlbOptions, HtmlOptions
from elocute.export.soundtrack import Sound, pack_sound, sound_duration_s
from elocute.files.atomic import write_atomically
from elocute.files.html_page import filled_page, script_bytes, script_json
from elocute.head.looks.folds import folds_of
from elocute.head.model import HeadModel
from elocute.head.mouth_opening import ENDS, LEAST_REACH_M, LIT_FROM, REACH
from elocute.head.surface import EYE, Surface
from elocute.motion.motion import Motion
from elocute.render import shading
from elocute.render.backends_and_views import VIEWS
from elocute.render.camera import FIELD_DEG, portrait, shadow_view
from elocute.render.lights import RIGS, Triple
from elocute.render.parts import Part, Parts
from elocute.speech.cues.files import caption_text, space_between
from elocute.speech.times.labels import Label

BYTES_MAX = 25_000_000
"""Of a page that is put into the notebook's own file."""
HEIGHT_PX = 480
SHADOW_SIDE = 192
"""Pixels of the viewer's shadow: those of the fast profile."""
LIGHT_GROUNDS = {"studio": ((0.88, 0.89, 0.90), (0.72, 0.735, 0.75))}
"""By the light, the ground's colours beside light controls; other lights keep their own ground."""
ASSETS = Path(__file__).parent / "assets"


def write_html(
    motion: Motion,
    path: str | Path,
    *,
    sound: Sound | None = None,
    words: Sequence[Label] = (),
    options: HtmlOptions | None = None,
    progress: Any = None,
) -> None:
    """Write the page. Raises OutputError; MachineError where the viewer was not built.

    words: start in s, end in s and word of each, where they are known: its captions.
    """
    path = Path(path)
    options = options or HtmlOptions()
    title = options.title or path.stem
    pieces = page_pieces(motion, sound, title, words, options.light, web=options.web)
    with write_atomically(path) as draft, draft.open("w", encoding="utf-8") as file:
        for piece in pieces:
            file.write(piece)


def page_pieces(
    motion: Motion,
    sound: Sound | None,
    title: str,
    words: Sequence[Label] = (),
    light: str = "studio",
    *,
    web: bool = False,
) -> list[str]:
    """The page, to be joined; web: whether it is made small.

    Raises MachineError where the viewer was not built, and where a small page is wanted and
    `meshopt` is not installed.
    """
    motion = drawn(motion)
    packed, media = pack_sound(sound, small=web) if sound is not None else (b"", None)
    take = {"duration": motion.duration_s, "sound": media, "words": list(_captions(words))}
    sound_part = {"@SOUND@": base64.b64encode(packed).decode()}
    return head_page(*_page("viewer", packed=web), motion, title, light, take, sound_part, web=web)


def live_page(motion: Motion, title: str, light: str = "studio") -> list[str]:
    """The page that shows what `elocute live` sends, on the head of a motion of one frame.

    Raises MachineError where the viewer was not built.
    """
    motion = motion.dressed()
    told = {"joints": motion.head.joint_names}
    return head_page(*_page("live"), motion, title, light, told, {})


def head_page(
    page: str,
    script: str,
    motion: Motion,
    title: str,
    light: str,
    take: Mapping[str, Any],
    parts: Mapping[str, str],
    *,
    web: bool = False,
) -> list[str]:
    """A page with its script and a head as it is drawn, to be joined.

    take: what the script is told beside the stage and the views; parts: what stands in the page
    besides, by its mark; web: whether the head is made small.
    """
    shapes = GlbOptions(profile="elocute", web=web)  # the page shows the motion as it is
    head = motion.head
    told = {"fps": motion.fps, **take, "stage": viewer_stage(head, light), **viewer_views(head)}
    own = {
        "@TITLE@": html.escape(printable(title)),
        "@TAKE@": script_json(told),
        "@HEAD@": script_bytes(glb_bytes(motion, options=shapes, for_viewer=True)),
        "@VIEWER@": script,
    }
    return filled_page(page, {**own, **parts})


def _page(name: str, *, packed: bool = False) -> tuple[str, str]:
    """A page that was built with its script."""
    return page_asset(f"{name}.html"), page_script(f"{name}.js", packed=packed)


def _captions(words: Sequence[Label]) -> Iterator[tuple[float, float, str, str]]:
    """Start, end, word, and what stands before it."""
    before = ""
    for start, end, word in words:
        shown = caption_text(word)
        yield float(start), float(end), shown, space_between(before, shown)
        before = shown


def page_asset(name: str) -> str:
    """A bundled text, such as "viewer.html". Raises MachineError where it was not built."""
    try:
        return (ASSETS / name).read_text(encoding="utf-8")
    except OSError as error:
        raise MachineError(
            f"the viewer ({ASSETS / name}) was not built; install Elocute again with pip, "
            "with Node or a network at hand"
        ) from error


def page_script(name: str, *, packed: bool = False) -> str:
    """A bundle with the notices of what is in it, which its copies carry: every page is one.

    packed: whether it comes compressed, and unpacks itself.
    """
    script = page_asset(name)
    if packed:
        script = UNPACKS.replace("@SCRIPT@", script_bytes(script.encode()))
    return f"/*\n{page_asset('THIRD_PARTY_NOTICES.txt')}*/\n{script}"


UNPACKS = """(async () => {
  const bytes = Uint8Array.from(atob("@SCRIPT@"), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(stream).text();
  document.body.append(script);
})();
"""


def viewer_stage(head: HeadModel, light: str = "studio") -> dict[str, Any]:
    """The light of a rig that falls on a head as it is drawn, in the words of `web/src/shading.js`.

    Plain values: `glsl` (`shading.glsl`), `exposure`, `key_view` (16, by columns), `taps`,
    `shadow_side`, `shadow_bias`, `ground` (two sRGB colours of 0 to 255), `light_ground` (the same
    beside light controls, or None where it stays), and `parts`, by the name of the material;
    `folds` where a material has them, `mouth` where one has the lips, and `openness_glsl`, what
    lips leave of the light on what is in it.
    """
    rig, parts = RIGS[light], Parts(head)
    key = shadow_view(head, rig)
    folds = [index for index, name in enumerate(head.material_names) if _folds(head, name)]
    return {
        "glsl": shading.glsl(rig),
        "exposure": parts.exposure(rig),
        "key_view": key.matrix.T.ravel().tolist(),
        "taps": key.taps(SHADOW_SIDE),
        "shadow_side": SHADOW_SIDE,
        "shadow_bias": shading.SHADOW_BIAS,
        "ground": _bytes(rig.middle, rig.margin),
        "light_ground": _bytes(*LIGHT_GROUNDS[light]) if light in LIGHT_GROUNDS else None,
        "parts": {part.name: _part(part) for part in parts.parts},
        "folds": _fold_zones(head, folds[0]) if folds else None,
        "mouth": _mouth(head),
        "openness_glsl": shading.OPENNESS_GLSL,
    }


def _bytes(*colors: Triple) -> list[list[float]]:
    return [np.round(255 * np.array(each)).tolist() for each in colors]


def _folds(head: HeadModel, name: str) -> bool:
    return bool(head.surfaces.get(name, Surface()).folds) and folds_of(head) is not None


def _fold_zones(head: HeadModel, material: int) -> dict[str, Any]:
    """What strengths are computed from; pairs are corners of the material's part of the .glb."""
    folds, surface = folds_of(head), head.surfaces[head.material_names[material]]
    assert folds is not None
    vertices, _, _ = corners_of(head, material)
    # Vertices are sorted, so the first corner of each is found by halving.
    pairs = np.searchsorted(vertices, folds.pairs)
    return {
        "material": head.material_names[material],
        "pairs": pairs.tolist(),
        "zone": folds.zone.tolist(),
        "weight": np.round(folds.weight.astype(float), 5).tolist(),
        "reach": np.round(folds.reach.astype(float), 5).tolist(),
        "depth": surface.fold_depth,
        "lines": surface.fold_lines,
        "step": shading.FOLD_STEP,
    }


def _mouth(head: HeadModel) -> dict[str, Any] | None:
    """What `mouth_opening` reads off a pose; corners of the .glb's part of the first material that
    has all of the lips' line, None where none has."""
    lips = head.inner_lip_upper, head.inner_lip_lower, head.inner_corners
    places = np.concatenate(lips)
    if not len(places) or not len(head.inner_corners):
        return None
    for index, name in enumerate(head.material_names):
        vertices, _, _ = corners_of(head, index)
        if np.isin(places, vertices).all():
            upper, lower, ends = (np.searchsorted(vertices, each).tolist() for each in lips)
            return {
                "material": name,
                "upper": upper,
                "lower": lower,
                "corners": ends,
                "ends": ENDS,
                "lit_from": LIT_FROM,
                "reach": REACH,
                "least_reach": LEAST_REACH_M,
            }
    return None


def _part(part: Part) -> dict[str, Any]:
    return {
        "finish": asdict(part.finish),
        "rough": float(part.rough),
        "tint": list(map(float, part.surface.tint)),
        "normal_scale": float(part.surface.normal_scale),
        "eye": [getattr(part.surface, name) for name in EYE],
        "both_sides": part.surface.both_sides,
        "turns": part.turns,
        "rounded": part.rounded,
        "casts": part.casts,
        "inside": part.inside,
        "core": part.core,
        "fringe_gain": part.fringe_gain,
        "fades": part.fades,
        "metal": float(part.surface.metal),
        "alpha": float(part.surface.alpha),
        "shade": part.surface.shade,
    }


def viewer_views(head: HeadModel) -> dict[str, Any]:
    """Where the camera of a picture stands in each view of a square one.

    `field_deg`, and `views`: by name, `position` and `target` (3,) in m.
    """
    cameras = {name: portrait(head, name) for name in VIEWS}
    return {
        "field_deg": FIELD_DEG,
        "views": {
            name: {"position": one.position.tolist(), "target": one.target.tolist()}
            for name, one in cameras.items()
        },
    }


def viewer_frame(
    motion: Motion, sound: Sound | None, title: str, words: Sequence[Label] = ()
) -> str:
    """HTML that shows a motion with its sound in a notebook, in a frame of this title.

    words: start in s, end in s and word, where they are known: captions. A sentence where the page
    would be too large, or cannot be made.
    """
    try:
        if _least_bytes(motion, sound) > BYTES_MAX:
            return _sentence(title, "too long to be shown here")
        page = "".join(page_pieces(motion, sound, title, words))
    except ElocuteError as error:  # the sound's file is gone, or the viewer was not built
        return _sentence(title, str(error))
    if len(page) > BYTES_MAX:
        return _sentence(title, "too large to be shown here")
    return (
        f'<iframe srcdoc="{html.escape(page)}" title="{html.escape(title)}" '
        f'sandbox="allow-scripts" style="width: 100%; height: {HEIGHT_PX}px; border: 0">'
        "</iframe>"
    )


def _least_bytes(motion: Motion, sound: Sound | None) -> float:
    """What motion and sound alone need, in base64."""
    seconds = 0.0 if sound is None else sound_duration_s(sound) or 0.0
    return (motion.weights.nbytes + 8000 * seconds) * 4 / 3


def _sentence(title: str, why: str) -> str:
    return (
        f"<p>{html.escape(title)}: {html.escape(why)}; "
        "<code>write('talk.html')</code> gives a page for a browser.</p>"
    )
