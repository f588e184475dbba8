"""`elocute animate`: one recording, many, or a folder of them."""

from __future__ import annotations

import contextlib
import json
import sys
import time
from pathlib import Path
from typing import Any

import typer

from elocute.cli import options
from elocute.cli.pipes import PIPE, STDIN, check_pipes, piped_sound, to_stdout
from elocute.cli.progress import counted, progress_bar
from elocute.errors import ElocuteError, InputError, OutputError, printable

SOUND_SUFFIXES = (
    ".wav", ".flac", ".mp3", ".ogg", ".oga", ".opus", ".m4a", ".aac", ".mp4", ".mov", ".mkv",
    ".webm", ".aif", ".aiff",
)  # fmt: skip


def animate_command(
    speech: list[Path] = typer.Argument(
        ..., help="Sound or video files, or folders of them; - reads standard input."
    ),
    output: list[Path] = options.Output,
    format: list[str] = typer.Option(
        [],
        "--format",
        help="With a folder or - (standard output) as output: what to write (npz, glb, csv, …).",
    ),
    fps: float = typer.Option(60.0, help="Frames per second, 1 to 240."),
    identity: str = typer.Option("mean", help="Whose face: a name, a seed, or a .json file."),
    head: str = options.Head,
    style: str = options.StyleName,
    strength: float = typer.Option(1.0, help="How far the mouth moves, 0 to 2."),
    model: str = options.Model,
    channel: int | None = typer.Option(None, help="Hear one channel (from 0) instead of the mix."),
    phones: Path | None = typer.Option(
        None, help="Known phone times: CSV of start_s,end_s,phone; the encoder is not asked."
    ),
    size: str = options.Size,
    backend: str = options.Backend,
    embed_audio: bool = options.EmbedAudio,
    as_json: bool = options.Json,
) -> None:
    """Animate the built-in head with speech.

    An output folder that does not exist is made.
    """
    check_pipes(speech, output, format, as_json)
    files, single = _files(speech)
    jobs = [(file, _outputs(file, output, format, single)) for file in files]
    for file, targets in jobs:
        for target in targets:
            if target != PIPE:
                _check_output(file, target, target.parent in output)
            options.writer_options(target, size, backend, embed_audio)
    settings: dict[str, Any] = {
        "fps": fps, "identity": identity, "head": head, "style": style, "strength": strength,
        "model": model, "channel": channel, "phones": _read_phones(phones),
    }  # fmt: skip
    quiet = as_json or PIPE in output
    failures = 0
    with counted(len(jobs)) as one_done:
        for file, targets in jobs:
            try:
                record = _animate_one(
                    file, targets, settings, size, backend, embed_audio, quiet, format
                )
            except ElocuteError as error:
                if single:
                    raise
                failures += 1
                print(f"elocute: {error}", file=sys.stderr)
                record = {"input": str(file), "error": str(error)}
            one_done()
            if as_json:
                print(json.dumps(record), flush=True)
    if failures:
        print(f"elocute: {failures} of {len(jobs)} failed", file=sys.stderr)
        raise typer.Exit(1)


def _animate_one(
    file: Path, targets: list[Path], settings: dict[str, Any], size: str, backend: str,
    embed_audio: bool, quiet: bool, formats: list[str],
) -> dict[str, Any]:  # fmt: skip
    from elocute.synthesis.animate import animate

    started = time.perf_counter()
    with progress_bar(f"listening to {STDIN if file == PIPE else file.name}", quiet) as progress:
        heard = piped_sound() if file == PIPE else file
        animation = animate(heard, progress=progress, **settings)
    listened = time.perf_counter()
    with counted(len(targets), "outputs written") as one_written:
        for target in targets:
            with contextlib.ExitStack() as stack:
                place, inside = target, embed_audio
                if target == PIPE:  # there is no place beside it
                    place, inside = stack.enter_context(to_stdout(formats[0].lstrip("."))), True
                else:
                    _make_folder(target.parent)
                extra = options.writer_options(place, size, backend, inside)
                progress = stack.enter_context(progress_bar(f"writing {target.name}", quiet))
                animation.write(place, progress=progress, **extra)
            if not quiet:
                print(printable(target))
            one_written()
    motion = animation.motion
    return {
        "input": str(file),
        "outputs": [str(target) for target in targets],
        "frames": motion.frame_count,
        "fps": motion.fps,
        "duration_s": round(motion.duration_s, 4),
        "animate_s": round(listened - started, 4),
        "write_s": round(time.perf_counter() - listened, 4),
    }


def _files(given: list[Path]) -> tuple[list[Path], bool]:
    """Every sound file meant, and whether it was just one named file."""
    files: list[Path] = []
    for path in given:
        if path.is_dir():
            found = sorted(p for p in path.iterdir() if p.suffix.lower() in SOUND_SUFFIXES)
            if not found:
                raise InputError.about(
                    path, found="no sound in this folder", allowed=" ".join(SOUND_SUFFIXES)
                )
            files += found
        else:
            files.append(path)
    return files, len(given) == 1 and not given[0].is_dir()


def _outputs(file: Path, outputs: list[Path], formats: list[str], single: bool) -> list[Path]:
    from elocute.export.registry import check_suffix

    targets = []
    for output in outputs:
        if output == PIPE:
            targets.append(output)
        elif output.is_dir() or (not output.suffix and (formats or not single)):
            targets += [output / f"{file.stem}.{kind.lstrip('.')}" for kind in formats or ["npz"]]
        elif single:
            targets.append(output)
        else:
            raise OutputError.about(
                output, found="one file for several recordings", allowed="a folder",
                remedy="use -o FOLDER --format glb",
            )  # fmt: skip
    for target in targets:
        check_suffix(f"-.{formats[0].lstrip('.')}" if target == PIPE else target)
    return targets


def _make_folder(path: Path) -> None:
    """Only once there is something to be put into it."""
    try:
        path.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError.about(path, found=f"cannot be made ({error.strerror})") from error


def _check_output(file: Path, target: Path, in_folder: bool) -> None:
    from elocute.files.atomic import check_output

    check_output(target.parent if in_folder and not target.parent.exists() else target)
    if target.exists() and file.exists() and target.samefile(file):
        raise OutputError.about(
            target, found="the recording itself", remedy="choose another output name"
        )


def _read_phones(path: Path | None) -> list[tuple[float, float, str]] | None:
    if path is None:
        return None
    from elocute.articulation.phone_times import read_phone_times

    return read_phone_times(path)
