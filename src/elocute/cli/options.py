"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import typer

from elocute.articulation.settings import AnimationSettings
from elocute.cli.settings_options import option
from elocute.errors import InputError
from elocute.life.moods import MOODS
from elocute.models.registry import model_names
from elocute.models.take_settings import TakeSettings
from elocute.numerics.frame_rates import frame_rate
from elocute.settings import SEED_MAX, setting_of


def take_option(name: str, default: Any = ...) -> Any:
    """The option of one setting of a take; what it names is completed by the shell."""
    flag = f"--{name}"
    return option(TakeSettings, name, flag, default=default, completed=_NAMES.get(name))


def contacts_measured(choice: str) -> tuple[str, ...]:
    """Which of off and auto are measured, in this order. Raises InputError."""
    known = setting_of(AnimationSettings, "contacts").choices
    if choice == "both":
        return "off", "auto"
    if choice not in known:
        raise InputError.about(
            f"--contacts {choice}", found="unknown", allowed=", ".join((*known, "both"))
        )
    return (choice,)


def _people() -> Iterable[str]:
    from elocute.head.identity import identity_names

    return identity_names()


def _styles() -> Iterable[str]:
    from elocute.articulation.style import STYLES

    return STYLES


def _looks() -> Iterable[str]:
    from elocute.head.looks.people import PEOPLE

    return ("auto", "none", *PEOPLE)


_NAMES: dict[str, Callable[[], Iterable[str]]] = {
    "model": model_names,
    "identity": _people,
    "style": _styles,
    "mood": lambda: (*MOODS, "auto"),
    "look": _looks,
}
Contacts, ContactsOff = take_option("contacts"), take_option("contacts", default="off")
_MEASURED = (
    "What is measured: auto, with lip contacts and rests laid over by rule, as `animate` does; "
    "off, the model's own output; or both."
)
ContactsMeasured = typer.Option("auto", "--contacts", help=_MEASURED)
ContactsMeasuredOff = typer.Option("off", "--contacts", help=_MEASURED)
Edits = take_option("edits")
Identity = take_option("identity")
Mesh = take_option("mesh")
Mix = take_option("mix")
Model = take_option("model")
Strength = take_option("strength")
StyleName = take_option("style")
LearningSeed = typer.Option(0, min=0, max=SEED_MAX, help="Seed of the learned methods.")
Output = typer.Option(
    ...,
    "-o",
    "--output",
    help="File or folder to write; the suffix chooses the format. Can be repeated.",
)
OutputUnlessInto = typer.Option([], *Output.param_decls, help=Output.help)
Corpus = typer.Argument(..., help="A corpus folder.")
Sound = typer.Argument(..., help="Sound or video file.")
SoundsOfShards = typer.Argument(..., help="Folder to which the paths of their sounds are relative.")
JsonReport = typer.Option(None, "-o", "--output", help="Also write the report (.json).")
AlignmentEncoder = typer.Option(
    "fbank", help="Speech encoder: fbank, phones and the like; windows for 41 x 128 x 3."
)
Channel = typer.Option(
    None,
    "--channel",
    help="Use this channel, counted from 0, instead of the mix of all channels.",
)
Resampled = typer.Option(
    None, "--fps", help="Resample to this frame rate.", parser=frame_rate, metavar="RATE"
)
Track = typer.Option(
    None,
    "--track",
    help="Use this audio track of a file with several, counted from 0; `elocute info` lists them.",
)
Partial = typer.Option(False, "--partial", help="Take a sound that was cut off as far as it goes.")
Overwrite = typer.Option(False, "--overwrite", help="Replace files that exist already.")
NoClobber = typer.Option(False, "--no-clobber", help="Keep files that exist already, and say so.")
Listen = typer.Option(
    False,
    "--listen",
    help="The sound is a partner's: the face listens (looks at them, nods where their phrases end) "
    "and its lips rest.",
)
Jobs = typer.Option(
    1, help="Number of processes for a table or many recordings; 0 takes all processors."
)
Ray = typer.Option(
    None,
    "--ray",
    help="Run on a Ray cluster at HOST:PORT, or on a node of its own (local); --jobs is then the "
    "number of workers, 1 for all.",
)
Landmarks = typer.Option(
    None,
    help="The 68 landmarks of a scan or mesh (.json, .ljson, .pts, .pp, .npy or .txt), in its "
    "unit. Without them they are detected, if the extra `video` is installed; otherwise only the "
    "surface is used.",
)
Split = typer.Option("default", help="Name of the split of the corpus.")
Table = typer.Option(
    None, "--table", help="Also write the table to this file (.csv or .tex). Can be repeated."
)
OverwriteTable = typer.Option(False, "--overwrite", help="Replace existing tables.")
KeepTable = typer.Option(
    False, "--no-clobber", help="Leave existing tables as they are, and say so."
)
Json = typer.Option(False, "--json", help="Print the result as one JSON record.")
