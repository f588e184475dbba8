"""Options of the writers, in a module that needs nothing of what writers need."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import OutputError
from elocute.render.backends_and_views import BACKENDS, FRAMINGS, QUALITIES, VIEWS
from elocute.render.background import TRANSPARENT, check_background
from elocute.render.lights import RIGS
from elocute.settings import check_settings, described, setting

PROFILES = ("arkit", "elocute", "oculus", "vrm")
VISEMES_WITHOUT = ("oculus", "vrm")
"""Profiles beside which visemes that rest would be moved twice, or by nobody."""


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
class ShapeOptions:
    """Which shapes a .usdz has. Raises OutputError for values that are not allowed."""

    profile: str = setting(
        "arkit",
        choices=PROFILES,
        help="Shapes of a .glb or .usdz: arkit (ARKit's names, the speech shapes folded into "
        "them), elocute (all that move the head), oculus (the fifteen visemes move the mouth) or "
        "vrm (VRM's expressions).",
    )
    visemes: bool = setting(
        False,
        help="Add the fifteen visemes to a .glb or .usdz, as shapes that rest (viseme_PP, …).",
    )

    def __post_init__(self) -> None:
        check_settings(self, OutputError)
        if self.visemes and self.profile in VISEMES_WITHOUT:
            raise OutputError.about(
                "`visemes`",
                found=f"profile {self.profile}, which has mouth shapes of its own",
                allowed="with the profile arkit or elocute",
                remedy="leave it out",
            )


@described
@dataclass(frozen=True)
class GlbOptions(ShapeOptions):
    """Options of .glb.

    Raises
    ------
    OutputError
        For a value of another type or outside its range.
    """

    embed_audio: bool = setting(False, help="Put the sound into the .glb, not beside it as a .wav.")


@described
@dataclass(frozen=True)
class VrmaOptions:
    """Options of .vrma. Raises OutputError for values that are not allowed."""

    perfect_sync: bool = setting(
        False,
        help="Move ARKit's 52 shapes as expressions of a .vrma, for avatars that have them "
        "(“perfect sync”), in place of vowels, lids and gaze, which every VRM has.",
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
