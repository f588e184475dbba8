"""What `animate` and `say` share: the settings of a take, and how its outputs are written."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.flags import in_flags
from elocute.cli.format_options import FormatSettings, settings_for_format
from elocute.cli.outputs import write_motion
from elocute.cli.pipes import PIPE, STDOUT, to_stdout
from elocute.cli.progress import counted, progress_bar
from elocute.errors import printable
from elocute.export.registry import WRITERS, check_character, check_suffix
from elocute.files.output_plan import OutputPlan
from elocute.meshes.gltf_document import SUFFIXES as CHARACTER_SUFFIXES
from elocute.models.take_settings import TakeSettings
from elocute.settings import settings_of

if TYPE_CHECKING:
    from elocute.animation import Animation

TakeChoices = dict[str, Any]
"""Settings of a take by name, as `animate` and `say` take them."""
_PARTS_OF_LOOK = {
    "hair": "Hair of the look: swept, crop, long, ponytail, …, none.",
    "hair_colour": "Its colour: black, brown, blond, grey, …",
    "eyes": "Irises of the look: brown, blue, green, grey, …",
    "brows": "Brows of the look: soft, straight, full, …, none.",
    "clothes": "Clothes of the look: crew, roll, collar, none.",
    "clothes_colour": "Their colour: white, grey, black, navy, teal, rust, …",
}


def options_of_takes() -> Any:
    """The default of a parameter that stands for the settings of a take."""
    return _TakeGroup()


@dataclass(frozen=True)
class _TakeGroup:
    def options(self) -> dict[str, tuple[Any, Any]]:
        settings = {
            each.name: (_kind_of(str(each.type)), options.take_option(each.name))
            for each, _ in settings_of(TakeSettings)
        }
        parts = {
            name: (str | None, typer.Option(None, help=text))
            for name, text in _PARTS_OF_LOOK.items()
        }
        return settings | parts

    def build(self, given: dict[str, Any]) -> TakeChoices:
        parts = {name: given.pop(name) for name in _PARTS_OF_LOOK}
        changed = [f"{name}={value}" for name, value in parts.items() if value is not None]
        return {**given, "look": ",".join([given["look"], *changed])}


def _kind_of(annotation: str) -> Any:
    """How a command takes what Python takes as one of several types."""
    kinds = annotation.split(" | ")
    if "EditList" in kinds:
        return Path | None
    if "str" in kinds:
        return str | None if kinds[-1] == "None" and len(kinds) == 2 else str
    return {"float": float, "int": int}[kinds[0]]


def named_inputs(settings: TakeChoices) -> list[Any]:
    """Settings that may name files, which no output may replace."""
    return [
        settings[name] for name in ("head", "identity", "style", "model", "edits") if settings[name]
    ]


def check_edits(settings: TakeChoices) -> None:
    """Raise MotionError for a malformed edit list, before anything is computed."""
    if settings["edits"] is not None:
        from elocute.motion.edits import read_edits

        read_edits(settings["edits"])


def check_character_formats(
    settings: TakeChoices, targets: Iterable[Path], format_settings: FormatSettings
) -> None:
    """Raise OutputError for a format that cannot hold the head, before anything is computed.

    HeadError for a character that is to be drawn and cannot be.
    """
    head = Path(settings["head"])
    if head.suffix.lower() in CHARACTER_SUFFIXES:
        from elocute.adoption.registry import open_speaking_head

        opened = open_speaking_head(head, settings["mesh"])
    elif head.suffix.lower() == ".npz":
        from elocute.head.registry import open_head

        opened = open_head(head)
    else:
        return
    for target in targets:
        check_character(opened, target, settings_for_format(target, format_settings))
    if opened.character is not None and any(WRITERS[check_suffix(each)].draws for each in targets):
        from elocute.export.drawn_character import placement

        placement(opened.character)


def named_target(target: Path, formats: Sequence[str]) -> Path:
    """A target with a suffix, which standard output has not."""
    return Path(f"{STDOUT}.{formats[0].lstrip('.')}") if target == PIPE else target


@dataclass(frozen=True)
class TakeOutputs:
    """Where the outputs of a command go, and what is told of them."""

    plan: OutputPlan
    formats: Sequence[str]
    format_settings: FormatSettings
    as_json: bool


def make_outputs(
    make: Callable[..., Animation],
    targets: Sequence[Path],
    outputs: TakeOutputs,
    *,
    label: str,
    about: str = "",
) -> dict[str, Any]:
    """Make an animation, write it, and name each output; what took how long, for a record.

    make: takes `progress`. label: what the bar says. about: begins the notes on it.
    """
    quiet = outputs.as_json or PIPE in targets
    started = time.perf_counter()
    with progress_bar(label, quiet) as progress:
        animation = make(progress=progress)
    for note in animation.notes:
        print(f"elocute: {printable(about + in_flags(note))}", file=sys.stderr)
    animated = time.perf_counter()
    with counted(len(targets), "outputs written") as one_written:
        for target in targets:
            with progress_bar(f"writing {target.name}", quiet) as progress:
                _write(animation, target, outputs, progress)
            if not quiet:
                print(printable(target))
            one_written()
    motion = animation.motion
    return {
        "frames": motion.frame_count,
        "fps": motion.fps,
        "duration_s": round(motion.duration_s, 4),
        "animate_s": round(animated - started, 4),
        "write_s": round(time.perf_counter() - animated, 4),
    }


def _write(
    animation: Animation, target: Path, outputs: TakeOutputs, progress: Callable[[float], None]
) -> None:
    """Write one output; standard output has no place beside it for the sound, so it goes inside."""
    if target != PIPE:
        write_motion(
            outputs.plan,
            animation.motion,
            target,
            sound=animation.sound,
            words=animation.words,
            progress=progress,
            format_settings=outputs.format_settings,
        )
        return
    with to_stdout(outputs.formats[0]) as place:
        extra = settings_for_format(place, {**outputs.format_settings, "embed_audio": True})
        animation.write(place, progress=progress, **extra)
