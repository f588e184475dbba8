"""`elocute animate`: one recording, many, or a folder of them."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import typer

from elocute.cli import options
from elocute.cli.progress import progress_bar
from elocute.errors import ElocuteError, InputError, OutputError

SOUND_SUFFIXES = (
    ".wav", ".flac", ".mp3", ".ogg", ".oga", ".opus", ".m4a", ".aac", ".mp4", ".mov", ".mkv",
    ".webm", ".aif", ".aiff",
)  # fmt: skip


def animate_command(
    speech: list[Path] = typer.Argument(..., help="Sound or video files, or folders of them."),
    output: list[Path] = options.Output,
    format: list[str] = typer.Option(
        [], "--format", help="With a folder as output: the formats to write (npz, glb, mp4, …)."
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
    """Animate the built-in head with speech."""
    files, single = _files(speech)
    jobs = [(file, _outputs(file, output, format, single)) for file in files]
    for file, targets in jobs:
        for target in targets:
            _check_output(file, target)
            options.writer_options(target, size, backend, embed_audio)
    settings: dict[str, Any] = {
        "fps": fps, "identity": identity, "head": head, "style": style, "strength": strength,
        "model": model, "channel": channel, "phones": _read_phones(phones),
    }  # fmt: skip
    failures = 0
    for file, targets in jobs:
        try:
            record = _animate_one(file, targets, settings, size, backend, embed_audio, as_json)
        except ElocuteError as error:
            if single:
                raise
            failures += 1
            print(f"elocute: {error}", file=sys.stderr)
            record = {"input": str(file), "error": str(error)}
        if as_json:
            print(json.dumps(record), flush=True)
    if failures:
        print(f"elocute: {failures} of {len(jobs)} failed", file=sys.stderr)
        raise typer.Exit(1)


def _animate_one(
    file: Path, targets: list[Path], settings: dict[str, Any], size: str, backend: str,
    embed_audio: bool, quiet: bool,
) -> dict[str, Any]:  # fmt: skip
    from elocute.animation import animate

    started = time.perf_counter()
    with progress_bar(f"listening to {file.name}", quiet) as progress:
        animation = animate(file, progress=progress, **settings)
    listened = time.perf_counter()
    for target in targets:
        extra = options.writer_options(target, size, backend, embed_audio)
        with progress_bar(f"writing {target.name}", quiet) as progress:
            animation.write(target, progress=progress, **extra)
        if not quiet:
            print(target)
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
        if output.is_dir() or (not single and not output.suffix):
            if not output.is_dir():
                raise OutputError.about(
                    output, found="no such folder", remedy=f"create it first: mkdir -p {output}"
                )
            targets += [output / f"{file.stem}.{kind.lstrip('.')}" for kind in formats or ["npz"]]
        elif single:
            targets.append(output)
        else:
            raise OutputError.about(
                output, found="one file for several recordings", allowed="an existing folder",
                remedy="use -o FOLDER --format glb",
            )  # fmt: skip
    for target in targets:
        check_suffix(target)
    return targets


def _check_output(file: Path, target: Path) -> None:
    from elocute.files.atomic import check_output

    check_output(target)
    if target.exists() and file.exists() and target.samefile(file):
        raise OutputError.about(
            target, found="the recording itself", remedy="choose another output name"
        )


def _read_phones(path: Path | None) -> list[tuple[float, float, str]] | None:
    if path is None:
        return None
    from elocute.articulation.phone_times import read_phone_times

    return read_phone_times(path)
