"""Backgrounds: the studio's own ground, nothing, a colour, or a picture.

Names and files are checked without NumPy, for the command line; a picture is read when it is
drawn.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elocute.errors import OutputError
from elocute.one_line_repr import brief

if TYPE_CHECKING:
    from numpy.typing import NDArray

STUDIO, TRANSPARENT = "studio", "transparent"
COLOURS = {
    "black": "#000000",
    "white": "#ffffff",
    "grey": "#808080",
    "green": "#00b140",  # what keyers call chroma green
    "blue": "#0047bb",
}
PICTURES = (".png", ".jpg", ".jpeg", ".webp")
_CODE = re.compile(r"#[0-9a-fA-F]{6}")
PIXELS_MAX = 64_000_000
ALLOWED = f"{STUDIO}, {TRANSPARENT}, {', '.join(COLOURS)}, #rrggbb, or a file {' '.join(PICTURES)}"


def check_background(background: str) -> None:
    """Refuse what is no background: "studio", "transparent", a colour's name, "#rrggbb", or a
    picture.

    Raises OutputError for any other text, and for a file that is missing.
    """
    if background in (STUDIO, TRANSPARENT) or _colour(background) is not None:
        return
    path = Path(background)
    if path.suffix.lower() not in PICTURES:
        raise OutputError.about(f"background {brief(background)}", found="unknown", allowed=ALLOWED)
    try:
        there = path.is_file()
    except (OSError, ValueError):
        there = False
    if not there:
        raise OutputError.about(path, found="no such file", allowed="a picture for the background")


def background_file(background: str | None) -> Path | None:
    """The file that a checked background is read from; None where it is not a picture."""
    if not background or background in (STUDIO, TRANSPARENT) or _colour(background) is not None:
        return None
    return Path(background)


def read_backdrop(background: str) -> NDArray[Any] | None:
    """The pixels of a background.

    Returns
    -------
    (height, width, 3) uint8 or None
        A single pixel for a colour; None where a studio, or nothing, lies behind.

    Raises
    ------
    OutputError
        For a file that is not a picture, or one of more than 64 million pixels.
    """
    import numpy as np

    colour = _colour(background)
    if colour is not None:
        return np.array([[colour]], np.uint8)
    path = background_file(background)
    if path is None:
        return None
    return _read_picture(path)


def _read_picture(path: Path) -> NDArray[Any]:
    import warnings

    import numpy as np
    from PIL import Image, ImageOps

    most = f"{PIXELS_MAX // 1_000_000} million pixels"
    allowed = f"a picture ({' '.join(PICTURES)}) of at most {most}"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(path, formats=("PNG", "JPEG", "WEBP")) as image:
                if image.width * image.height > PIXELS_MAX:
                    size = f"{image.width} x {image.height} pixels"
                    raise OutputError.about(path, found=size, allowed=allowed)
                return np.asarray(ImageOps.exif_transpose(image).convert("RGB"))
    except OutputError:
        raise
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        found = "a file that cannot be read"
        raise OutputError.about(path, found=found, allowed=allowed) from error


def _colour(text: str) -> tuple[int, int, int] | None:
    """Red, green and blue, 0 to 255; None for what is no colour."""
    code = COLOURS.get(text.lower(), text)
    if not _CODE.fullmatch(code):
        return None
    red, green, blue = bytes.fromhex(code[1:])
    return red, green, blue
