"""Options of the writers, in a module that needs nothing of what writers need."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import OutputError
from elocute.one_line_repr import brief
from elocute.render.backends_and_views import BACKENDS, FRAMINGS, QUALITIES, VIEWS
from elocute.render.background import TRANSPARENT, check_background
from elocute.render.lights import RIGS
from elocute.settings import check_settings, described, setting

PROFILES = ("arkit", "elocute", "oculus", "vrm")
ACTION = "speech"
ACTION_MAX_BYTES = 200
WEB = (
    "Make a .glb or .html of our own heads small for the net: numbers packed by meshopt, images as "
    "WebP, the sound of a page as MP3; needs pip install 'elocute[web]'."
)
ANIMATION_ONLY = (
    "Leave the head or character out of a .glb or .npz: what moves it, under the names that it has."
)
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
    backend: str = setting("auto", choices=BACKENDS, help="Renderer of the pictures.")
    view: str = setting("front", choices=tuple(VIEWS), help="Camera position.")
    framing: str = setting("head", choices=FRAMINGS, help="Part of the person in the picture.")
    background: str = setting(
        "studio",
        help="Background: studio, transparent (.webm, .mov and .png), a colour such "
        "as #1e2a38 or white, or a picture file, which fills the frame.",
    )
    light: str = setting("studio", choices=tuple(RIGS), help="Light on the head.")
    quality: str = setting(
        "auto",
        choices=QUALITIES,
        help="Quality of the drawing; auto is high on a graphics card, else fast.",
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
        help="Shapes of a .glb, .fbx or .usdz: arkit (ARKit's names, the speech shapes folded into "
        "them), elocute (all that move the head), oculus (the fifteen visemes move the mouth) or "
        "vrm (VRM's expressions).",
    )
    visemes: bool = setting(
        False,
        help="Add the fifteen visemes to a .glb, .fbx or .usdz, as shapes that rest "
        "(viseme_PP, …).",
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
class ActionOptions(ShapeOptions):
    """Options of .fbx. Raises OutputError for values that are not allowed."""

    action: str | None = setting(
        None,
        help="Name of the animation in a .glb or .fbx, such as the id of a line; by default "
        "speech.",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        named = self.action is None or (
            self.action.strip() == self.action != "" and self.action.isprintable()
        )
        if not named or len((self.action or "").encode()) > ACTION_MAX_BYTES:
            raise OutputError.about(
                "`action`",
                found=brief(self.action),
                allowed=f"a name of up to {ACTION_MAX_BYTES} bytes without spaces at its ends",
            )

    @property
    def action_name(self) -> str:
        """What the animation is called in a file of its own."""
        return self.action or ACTION


@described
@dataclass(frozen=True)
class GlbOptions(ActionOptions):
    """Options of .glb.

    Raises
    ------
    OutputError
        For a value of another type or outside its range.
    """

    embed_audio: bool = setting(False, help="Put the sound into the .glb, not beside it as a .wav.")
    web: bool = setting(False, help=WEB)
    animation_only: bool = setting(False, help=ANIMATION_ONLY)
    add: bool = setting(
        False,
        help="Add the take to those that a character's .glb has already; the rest of the file "
        "stays as it is.",
    )
    replace_action: bool = setting(
        False, help="Replace the animation of a character's .glb that has the name of the action."
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for one, other in (
            ("add", "animation_only"),
            ("add", "embed_audio"),
            ("web", "animation_only"),
            ("web", "add"),
        ):
            if getattr(self, one) and getattr(self, other):
                raise OutputError.about(f"`{one}`", found=f"`{other}` too", allowed="one of them")


@described
@dataclass(frozen=True)
class NpzOptions:
    """Options of .npz. Raises OutputError for values that are not allowed."""

    animation_only: bool = setting(False, help=ANIMATION_ONLY)

    def __post_init__(self) -> None:
        check_settings(self, OutputError)


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

    web: bool = setting(False, help=WEB)
    title: str | None = setting(None, help="Title of the page; by default the name of the file.")
    light: str = setting("studio", choices=tuple(RIGS), help="Light on the head.")

    def __post_init__(self) -> None:
        check_settings(self, OutputError)
