"""One self-contained page: the head, its sound and a viewer; works from file:// offline."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from elocute.errors import MachineError, printable
from elocute.export.gltf import glb_bytes
from elocute.export.options import GlbOptions, HtmlOptions
from elocute.export.soundtrack import Sound, pack_sound
from elocute.export.viewer_stage import viewer_stage, viewer_views
from elocute.files.atomic import write_atomically
from elocute.files.html_page import filled_page, script_bytes, script_json
from elocute.motion.motion import Motion
from elocute.speech.cues.files import caption_text, space_between
from elocute.speech.times.labels import Label

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
    page, viewer = page_asset("viewer.html"), page_script("viewer.js")
    packed, media = pack_sound(sound) if sound is not None else (b"", None)
    head = motion.dressed().head
    take = {
        "fps": motion.fps,
        "duration": motion.duration_s,
        "sound": media,
        "words": list(_captions(words)),
        "stage": viewer_stage(head, light),
        **viewer_views(head),
    }
    parts = {
        "@TITLE@": html.escape(printable(title)),
        "@TAKE@": script_json(take),
        "@HEAD@": script_bytes(glb_bytes(motion, options=ALL_SHAPES, for_viewer=True)),
        "@SOUND@": base64.b64encode(packed).decode(),
        "@VIEWER@": viewer,
    }
    return filled_page(page, parts)


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


def page_script(name: str) -> str:
    """A bundle with the notice of three.js, which its copies carry: every page is one."""
    return f"/*\n{page_asset('THIRD_PARTY_NOTICES.txt')}*/\n{page_asset(name)}"
