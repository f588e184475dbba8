"""The commands together, and how errors leave: one line, exit 2 for bad input."""

from __future__ import annotations

import errno
import os
import sys

import typer

from elocute.cli import (
    align,
    animate,
    blendshapes,
    capture,
    capture_landmarks,
    capture_video,
    corpus,
    edit,
    evaluate,
    heads,
    inspect,
    propagate,
    render,
    solve,
    style,
    train,
    words,
)
from elocute.errors import ElocuteError, InputError

app = typer.Typer(
    help="Speech in, 3D facial animation out.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("animate")(animate.animate_command)
app.command("render")(render.render_command)
app.command("edit")(edit.edit_command)
app.command("solve")(solve.solve_command)
app.command("measure")(render.measure_command)
app.command("info")(inspect.info_command)
app.command("doctor")(inspect.doctor_command)
app.command("align")(align.align_command)
app.add_typer(evaluate.app, name="evaluate")
app.add_typer(heads.app, name="head")
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


DISK_ERRORS = {
    errno.ENOSPC, errno.EFBIG, errno.EIO, errno.EROFS, errno.EACCES, errno.EPERM, errno.EMFILE,
    errno.ENFILE, getattr(errno, "EDQUOT", errno.ENOSPC),
}  # fmt: skip


def main() -> None:
    """Run the command line; never a traceback for bad input."""
    try:
        code = app(standalone_mode=False) or 0
        if sys.stdout is not None:  # closed from the start
            sys.stdout.flush()  # what is printed may still lie in a buffer
        sys.exit(code)
    except ElocuteError as error:
        print(f"elocute: {error}", file=sys.stderr)
        sys.exit(2 if isinstance(error, InputError) else 1)
    except KeyboardInterrupt:
        print("elocute: interrupted; nothing was left half-written", file=sys.stderr)
        sys.exit(130)
    except BrokenPipeError:
        _forget_stdout()  # who read it has seen enough
        sys.exit(1)
    except OSError as error:
        if error.errno not in DISK_ERRORS:
            raise
        where = error.filename or "standard output"
        _forget_stdout()
        print(f"elocute: {where}: cannot be written ({error.strerror})", file=sys.stderr)
        sys.exit(2)
    except Exception as error:
        # Usage errors and aborts of the option parser carry their own exit code and message.
        if not hasattr(error, "exit_code"):
            raise
        explain = getattr(error, "format_message", None)
        message = explain() if explain else str(error)
        if message:
            print(f"elocute: {' '.join(message.split())}", file=sys.stderr)
        sys.exit(error.exit_code)  # pyright: ignore[reportAttributeAccessIssue]


def _forget_stdout() -> None:
    """What could not be printed is not tried again when Python ends."""
    if sys.stdout is not None and sys.stdout is sys.__stdout__:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
