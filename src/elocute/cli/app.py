"""The commands together."""

from __future__ import annotations

import typer

from elocute.cli.command_group import CommandGroup
from elocute.cli.commands import (
    align,
    animate,
    blendshapes,
    capture,
    capture_landmarks,
    capture_video,
    corpus,
    doctor,
    edit,
    evaluate,
    head,
    info,
    measure,
    propagate,
    render,
    solve,
    style,
    train,
    words,
)

app = CommandGroup(
    "Speech in, 3D facial animation out.",
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("animate")(animate.animate_command)
app.command("render")(render.render_command)
app.command("edit")(edit.edit_command)
app.command("solve")(solve.solve_command)
app.command("measure")(measure.measure_command)
app.command("info")(info.info_command)
app.command("doctor")(doctor.doctor_command)
app.command("align")(align.align_command)
app.add_typer(evaluate.app, name="evaluate")
app.add_typer(head.app, name="head")
app.add_typer(corpus.app, name="corpus")
capture.app.command("landmarks")(capture_landmarks.landmarks_command)
capture.app.command("video")(capture_video.video_command)
app.add_typer(capture.app, name="capture")
app.add_typer(blendshapes.app, name="blendshapes")
app.add_typer(style.app, name="style")
app.add_typer(train.app, name="train")
app.command("propagate")(propagate.propagate_command)
app.add_typer(words.app, name="words")


def _version(wanted: bool) -> None:
    if wanted:
        from elocute._version import __version__

        print(f"elocute {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: bool = typer.Option(
        False, "--version", callback=_version, is_eager=True, help="Print the version."
    ),
) -> None:
    """Speech in, 3D facial animation out."""
