"""One self-contained page: the head, its sound and a viewer; works from file:// offline."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from elocute.audio.timed_labels import Label
from elocute.errors import MachineError, printable
from elocute.export.gltf import glb_bytes
from elocute.export.options import GlbOptions, HtmlOptions
from elocute.export.soundtrack import Sound, pack_sound
from elocute.export.viewer_stage import viewer_stage, viewer_views
from elocute.files.atomic import write_atomically
from elocute.motion.motion import Motion

ASSETS = Path(__file__).parent / "assets"
ALL_SHAPES = GlbOptions(profile="elocute")
"""The page shows the motion as it is."""


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
    pieces = page_pieces(motion, sound, options.title or path.stem, words, options.light)
    with write_atomically(path) as draft, draft.open("w", encoding="utf-8") as file:
        for piece in pieces:
            file.write(piece)


def page_pieces(
    motion: Motion,
    sound: Sound | None,
    title: str,
    words: Sequence[Label] = (),
    light: str = "studio",
) -> list[str]:
    """The page, to be joined. Raises MachineError where the viewer was not built."""
    page, viewer = _asset("viewer.html"), _asset("viewer.js")
    packed, media = pack_sound(sound) if sound is not None else (b"", None)
    head = motion.dressed().head
    take = {
        "fps": motion.fps,
        "duration": motion.duration_s,
        "sound": media,
        "words": [[float(start), float(end), printable(word)] for start, end, word in words],
        "stage": viewer_stage(head, light),
        **viewer_views(head),
    }
    parts = {
        "@TITLE@": html.escape(printable(title)),
        # No "<" leaves the JSON, so nothing in it can end its script element.
        "@TAKE@": json.dumps(take).replace("<", "\\u003c"),
        "@HEAD@": base64.b64encode(glb_bytes(motion, options=ALL_SHAPES)).decode(),
        "@SOUND@": base64.b64encode(packed).decode(),
        # Copies of three.js carry its notice, and every page is one.
        "@VIEWER@": f"/*\n{_asset('THIRD_PARTY_NOTICES.txt')}*/\n{viewer}",
    }
    return _filled(page, parts)


def _filled(page: str, parts: dict[str, str]) -> list[str]:
    """One pass over the page: what is put in is never searched for marks itself."""
    pieces, rest = [], page
    while rest:
        found = [(rest.index(mark), mark) for mark in parts if mark in rest]
        if not found:
            return [*pieces, rest]
        place, mark = min(found)
        pieces += [rest[:place], parts[mark]]
        rest = rest[place + len(mark) :]
    return pieces


def _asset(name: str) -> str:
    try:
        return (ASSETS / name).read_text(encoding="utf-8")
    except OSError as error:
        raise MachineError(
            f"the viewer ({ASSETS / name}) was not built; install Elocute again with pip, "
            "with Node or a network at hand"
        ) from error
