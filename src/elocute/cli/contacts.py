"""`--contacts` of the measures that show a model bare, finished, or both."""

from __future__ import annotations

import typer

from elocute.articulation.settings import AnimationSettings
from elocute.errors import InputError
from elocute.settings import setting_of

BOTH = "both"
_HELP = (
    "What is measured: auto, with lip contacts and rests laid over by rule, as `animate` does; "
    "off, the model's own output; or both."
)
Finished = typer.Option("auto", "--contacts", help=_HELP)
Bare = typer.Option("off", "--contacts", help=_HELP)


def contacts_shown(given: str) -> tuple[str, ...]:
    """Which of off and auto are measured, in this order. Raises InputError."""
    known = setting_of(AnimationSettings, "contacts").choices
    if given != BOTH and given not in known:
        raise InputError.about(
            f"--contacts {given}", found="unknown", allowed=", ".join((*known, BOTH))
        )
    return ("off", "auto") if given == BOTH else (given,)
