"""What the writers of some formats may be told. Nothing here needs what writers need."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import OutputError
from elocute.export.background import TRANSPARENT, check_background
from elocute.export.render.backends_and_views import BACKENDS, FRAMINGS, QUALITIES, VIEWS
from elocute.export.render.lights import RIGS
from elocute.settings import check_settings, described, setting

PROFILES = ("arkit", "elocute")


@described
@dataclass(frozen=True)
class PictureOptions:
    """Options of .mp4, .webm, .mov and .png.

    Raises
    ------
    OutputError
        For a value of another type or outside its range.
    """

    size: tuple[int, int] = setting(
        (800, 800),
        unit="pixels",
        low=64,
        high=4096,
        help="Width and height of the picture; a .png sheet is twice as wide.",
    )
    backend: str = setting("auto", choices=BACKENDS, help="Renderer.")
    view: str = setting("front", choices=tuple(VIEWS), help="Where the camera stands.")
    framing: str = setting("head", choices=FRAMINGS, help="How much of somebody fills the picture.")
    background: str = setting(
        "studio",
        help="What lies behind the head: studio, transparent (.webm, .mov and .png), a colour such "
        "as #1e2a38 or white, or a picture file, which fills the frame.",
    )
    light: str = setting("studio", choices=tuple(RIGS), help="What lights the head.")
    quality: str = setting(
        "auto",
        choices=QUALITIES,
        help="How finely pictures are drawn; auto is high on a graphics card, else fast.",
    )

    def __post_init__(self) -> None:
        check_settings(self, OutputError)
        check_background(self.background)

    @property
    def transparent(self) -> bool:
        """Whether nothing lies behind the head."""
        return self.background == TRANSPARENT


@described
@dataclass(frozen=True)
class GlbOptions:
    """Options of .glb.

    Raises
    ------
    OutputError
        For a value of another type or outside its range.
    """

    embed_audio: bool = setting(False, help="Put the sound into the .glb, not beside it as a .wav.")
    profile: str = setting(
        "arkit",
        choices=PROFILES,
        help="Shapes of a .glb: arkit (ARKit's names, the speech shapes folded into them) or "
        "elocute (all that move the head).",
    )
    visemes: bool = setting(
        False, help="Add the fifteen visemes to a .glb, as shapes that rest (viseme_PP, …)."
    )

    def __post_init__(self) -> None:
        check_settings(self, OutputError)


@described
@dataclass(frozen=True)
class HtmlOptions:
    """Options of .html.

    Raises
    ------
    OutputError
        For a value of another type or outside its range.
    """

    title: str | None = setting(None, help="Title of the page; by default the name of the file.")
    light: str = setting("studio", choices=tuple(RIGS), help="What lights the head.")

    def __post_init__(self) -> None:
        check_settings(self, OutputError)
