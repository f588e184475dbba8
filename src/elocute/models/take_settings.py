"""Settings of a take, spelled once: for `animate`, `say`, `stream`, commands and tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

from elocute.articulation.settings import AnimationSettings
from elocute.life.moods import MOODS
from elocute.life.settings import PARTS
from elocute.models.registry import DEFAULT_MODEL, MODELS
from elocute.settings import described, setting

if TYPE_CHECKING:
    from elocute.articulation.style import Style
    from elocute.head.looks.look import Look
    from elocute.life.moods import Mood
    from elocute.life.settings import Life
    from elocute.motion.edits.edit_list import EditList


class StreamOptions(TypedDict, total=False):
    """The settings that `stream` takes by name alone, for type checkers."""

    strength: float
    contacts: str
    mix: str
    seed: int
    style: str | Style
    identity: str | int | Path
    life: float | str | Life
    mood: str | Mood


class TakeOptions(StreamOptions, total=False):
    """The settings of `TakeSettings`, for type checkers."""

    fps: float
    model: str | Path
    head: str | Path
    mesh: str | None
    look: str | Look | None
    edits: EditList | str | Path | Mapping[str, Any] | None


@described
@dataclass(frozen=True, kw_only=True)
class StreamSettings(AnimationSettings):
    """How a live stream of speech becomes curves."""

    model: str | Path = setting(
        DEFAULT_MODEL,
        help="Speech model: "
        + ", ".join(f"{name} ({model.about})" for name, model in MODELS.items())
        + ", or a trained model (.onnx).",
    )
    style: str | Style = setting(
        "plain", help="Speaking style: a name, a mix (calm:0.7,broad:0.3), or a .json file."
    )
    identity: str | int | Path = setting(
        "mean", help="Face of the head, and who speaks: a name, a seed, or a .json file."
    )
    life: float | str | Life = setting(
        1.0,
        help="How much moves beside the mouth, made from the sound: 0 to 1, or parts of it "
        f"({', '.join(PARTS)}), as in 0.6 or head=0.5,blinks=0.",
    )
    mood: str | Mood = setting(
        "neutral",
        help=f"How the person feels: {', '.join(MOODS)}, with an intensity or without (happy:0.6); "
        "auto: calm, lively or forceful, as the voice is.",
    )


@described
@dataclass(frozen=True, kw_only=True)
class TakeSettings(StreamSettings):
    """How a speech becomes an animated head."""

    head: str | Path = setting(
        "builtin",
        help="Head to animate: builtin, a character with shapes of its own (.glb, .gltf, .vrm, "
        ".fbx), a FLAME model (.pkl), or a head or mesh file in the topology of the model.",
    )
    mesh: str | None = setting(
        None, help="Name of a mesh of the head, where a character's file has several heads."
    )
    look: str | Look | None = setting(
        "auto",
        help="Look of the head in pictures, pages and .glb: auto (the look of the identity), "
        "none, a person's name, a seed; with parts changed, as in otto,age=50,tone=0.6.",
    )
    edits: EditList | str | Path | Mapping[str, Any] | None = setting(
        None,
        help="Edit list (.json): amplitudes, styles, moods, keys, closed lips and more over time, "
        "applied after the model.",
    )
