"""Pictures of a take: a renderer from picture options, and a contact sheet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.export.drawn_character import drawn
from elocute.export.options import PictureOptions
from elocute.files.atomic import write_atomically
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion
from elocute.render import Renderer, Stage, open_renderer, portrait
from elocute.render.background import read_backdrop
from elocute.render.lights import RIGS

TILES = 20
COLUMNS = 5


def write_png(
    motion: Motion,
    path: str | Path,
    *,
    sound: object = None,
    options: PictureOptions | None = None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Evenly spaced frames with their times, five in a row.

    The sheet is twice as wide as `options.size`; its height follows. Raises OutputError.
    """
    motion = drawn(motion)
    frames = np.unique(np.linspace(0, motion.frame_count - 1, TILES).round().astype(int))
    options = options or PictureOptions()
    side = max(32, 2 * options.size[0] // COLUMNS)
    pictures = []
    with (
        write_atomically(path) as draft,
        open_pictures(motion.head, (side, side), options) as renderer,
    ):
        for done, frame in enumerate(frames, 1):
            pictures.append(renderer.frame(motion.vertices(frame, frame + 1)[0]))
            if progress:
                progress(done / len(frames))
        labels = [f"{frame / motion.fps:.2f} s" for frame in frames]
        contact_sheet(pictures, labels, COLUMNS).save(draft)


def contact_sheet(
    pictures: Sequence[NDArray[np.uint8]], labels: Sequence[str], columns: int
) -> Any:
    """Pictures (height, width, 3 or 4) uint8 of one size in rows, each with its label: a PIL image,
    transparent where they have a fourth channel."""
    from PIL import Image, ImageDraw, ImageFont

    height, width, channels = pictures[0].shape
    rows = -(-len(pictures) // columns)
    clear = channels == 4
    mode, ground = ("RGBA", (0, 0, 0, 0)) if clear else ("RGB", (24, 26, 30))
    sheet = Image.new(mode, (columns * width, rows * height), ground)
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(max(11, width // 22))
    for index, (picture, label) in enumerate(zip(pictures, labels, strict=True)):
        x, y = index % columns * width, index // columns * height
        sheet.paste(Image.fromarray(picture), (x, y))
        place = (x + width // 40, y + width // 60)
        # What lies under a transparent sheet may be light or dark: its labels have an outline.
        outline = {"stroke_width": 1, "stroke_fill": (24, 26, 30)} if clear else {}
        draw.text(place, label, fill=(235, 235, 235), font=font, **outline)
    return sheet


def open_pictures(head: HeadModel, size: tuple[int, int], options: PictureOptions) -> Renderer:
    """A renderer of one head: camera, lights and ground as the options say.

    size: width and height of a picture, pixels; that of the options is a sheet's or a video's.
    Pictures have a fourth channel, straight alpha, where the background is transparent. Raises
    OutputError for a background that cannot be read, and MachineError where no renderer works.
    """
    camera = portrait(head, options.view, framing=options.framing, aspect=size[0] / size[1])
    stage = Stage(
        RIGS[options.light],
        quality=options.quality,
        backdrop=read_backdrop(options.background),
        transparent=options.transparent,
    )
    return open_renderer(head, size, backend=options.backend, camera=camera, stage=stage)
