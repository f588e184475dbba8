"""`elocute animate`: one recording, many, or a folder of them."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import one_file, options
from elocute.cli.flags import in_flags
from elocute.cli.format_options import (
    FormatSettings,
    check_format_settings,
    options_of_formats,
)
from elocute.cli.known_speech_options import KnownSpeechOptions, options_of_known_speech
from elocute.cli.one_file import check_names, leave_out_made, named_take, with_into
from elocute.cli.outputs import nothing_to_do, plan_motion
from elocute.cli.pipes import PIPE, STDIN, check_pipes, piped_sound, stdin_source
from elocute.cli.progress import counted
from elocute.cli.spoken_takes import FolderRun, TableRun, check_one_worker
from elocute.cli.table_runs import chosen_pool, one_folder, recorded_lines, run_lines
from elocute.cli.takes import (
    TakeChoices,
    TakeOutputs,
    check_character_formats,
    check_edits,
    make_outputs,
    named_inputs,
    named_target,
    options_of_takes,
)
from elocute.errors import ElocuteError, InputError, OutputError
from elocute.files.media import SOUND_SUFFIXES
from elocute.files.output_plan import OutputPlan
from elocute.speech.voices.settings import VoiceSettings

if TYPE_CHECKING:
    from elocute.cli.line_table import Line, UnusableLine


def animate_command(
    speech: list[Path] | None = typer.Argument(
        None, help="Sound or video files, or folders of them; - reads standard input."
    ),
    table: Path | None = typer.Option(
        None,
        help="CSV of recordings instead, a take for each: id, audio, and any of text, language and "
        "the settings of a take (style, mood, look, edits, …).",
    ),
    output: list[Path] = options.OutputUnlessInto,
    into: Path | None = one_file.Into,
    format: list[str] = typer.Option(
        [],
        "--format",
        help="Format to write (npz, glb, csv, …) where the output is a folder or - (standard "
        "output). Can be repeated.",
    ),
    settings: TakeChoices = options_of_takes(),
    channel: int | None = options.Channel,
    track: int | None = options.Track,
    listen: bool = options.Listen,
    partial: bool = options.Partial,
    known: KnownSpeechOptions = options_of_known_speech(),
    format_settings: FormatSettings = options_of_formats(),
    recursive: bool = typer.Option(
        False, "-r", "--recursive", help="Include subfolders, and mirror them in the output."
    ),
    jobs: int = options.Jobs,
    ray: str | None = options.Ray,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Animate a head with speech.

    An output without a suffix is a folder where --format or several recordings are given; it is
    created if need be. The folder of an output file has to exist. A table, and folders with --jobs
    or --ray, are resumed where they were cut off: takes that are made are left.
    """
    taken = {"channel": channel, "track": track, "partial": partial, "listen": listen}
    speech = speech or []
    check_pipes(speech, output, format, as_json)
    check_edits(settings)
    format_settings = with_into(format_settings, into, output, settings["head"], "animate")
    formats = tuple(dict.fromkeys(format or ([] if into and not output else ["npz"])))
    if table is not None:
        _check_table_alone(speech, known)
        pool = chosen_pool(jobs, ray)
        lines = recorded_lines(table, VoiceSettings(language=known.language))
        run = TableRun(
            one_folder(output if into is None else output or [into.parent]),
            table,
            formats,
            {**settings, **taken, **known.recognised},
            format_settings,
            overwrite,
            no_clobber,
            into,
        )
        check_one_worker(run, lines, pool)
        run_lines(lines, run, pool, label=f"animating {table.name}", as_json=as_json)
        return
    takes, single = _takes(speech, recursive)
    known.check(single)
    check_names(format_settings, len(takes) if not single else 1)
    if not single and into is None and (jobs != 1 or ray is not None):
        pool = chosen_pool(jobs, ray)
        folder = one_folder(output)
        run = FolderRun(
            folder,
            None,
            formats,
            {**settings, **taken, **known.recognised},
            format_settings,
            overwrite,
            no_clobber,
        )
        label = f"animating {len(takes)} recordings"
        run_lines(_lines(takes, known.language), run, pool, label=label, as_json=as_json)
        return
    if ray is not None or jobs != 1:
        raise InputError.about(
            "--ray" if ray is not None else "--jobs",
            found="one recording" if into is None else "--into",
            allowed="with several recordings, a folder or --table, each into a file of its own",
        )
    plan = OutputPlan([*named_inputs(settings), *known.files])
    added = [] if into is None else [into]
    work = [(take.file, [*_outputs(take, output, format, single, plan), *added]) for take in takes]
    named = [named_target(t, format) for _, targets in work for t in targets]
    check_format_settings(named, format_settings)
    check_character_formats(settings, dict.fromkeys(named), format_settings)
    if into is not None:
        leave_out_made(work, into, lambda file: named_take(format_settings, _name(file)), single)
    for file, targets in work:
        source = stdin_source() if file == PIPE else file
        for target in targets:
            if target != PIPE:
                plan_motion(plan, target, source, sound=file, format_settings=format_settings)
    settings = {**settings, **taken, **known.read(takes[0].file)}
    if nothing_to_do(plan, overwrite, no_clobber, as_json) and PIPE not in output:
        return
    outputs = TakeOutputs(plan, format, format_settings, as_json)
    failures = _animate_all(work, settings, outputs, single)
    if failures:
        print(f"elocute: {failures} of {len(work)} failed", file=sys.stderr)
        raise typer.Exit(1)


def _check_table_alone(speech: list[Path], known: KnownSpeechOptions) -> None:
    """Raise InputError for a table and something else that is said in it."""
    if speech:
        raise InputError.about("--table", found="recordings too", allowed="one of them")
    known.check(False)


def _lines(takes: list[_Take], language: str) -> list[Line | UnusableLine]:
    """Recordings as lines, called by their names. Raises InputError for two of one name."""
    from elocute.cli.line_table import Line

    lines: dict[str, Line | UnusableLine] = {}
    for take in takes:
        name = (take.below / take.file.stem).as_posix()
        voice = VoiceSettings(language=language)
        line = Line(name, "", str(take.file), voice)
        other = lines.setdefault(name.casefold(), line)
        if isinstance(other, Line) and other is not line:
            raise InputError.about(
                take.file, found=f"the same name as {other.audio}", allowed="each name once"
            )
    return list(lines.values())


def _animate_all(
    jobs: list[tuple[Path, list[Path]]], settings: TakeChoices, outputs: TakeOutputs, single: bool
) -> int:
    """Animate each recording; how many failed. Raises what a single one raises."""
    failures = 0
    with counted(len(jobs)) as one_done:
        for file, targets in jobs:
            try:
                record = _animate_one(file, targets, settings, outputs)
            except ElocuteError as error:
                if single:
                    raise
                failures += 1
                message = in_flags(str(error))
                print(f"elocute: {message}", file=sys.stderr)
                record = {"input": str(file), "error": message}
            one_done()
            if outputs.as_json:
                print(json.dumps(record), flush=True)
    return failures


def _animate_one(
    file: Path, targets: list[Path], settings: TakeChoices, outputs: TakeOutputs
) -> dict[str, Any]:
    """Animate a recording and write its outputs; a record of both."""
    from elocute.animation import animate

    formats = named_take(outputs.format_settings, _name(file))
    outputs = replace(outputs, format_settings=formats)
    wanted = outputs.plan.wanted(targets)
    kept = [str(target) for target in targets if target not in wanted]
    record: dict[str, Any] = {"input": str(file), "outputs": [str(target) for target in wanted]}
    if kept or not wanted:
        record["kept"] = kept
    if not wanted:
        return record
    heard = piped_sound() if file == PIPE else file
    label = f"animating {STDIN if file == PIPE else file.name}"
    make = partial(animate, heard, **settings)
    return record | make_outputs(make, wanted, outputs, label=label, about=f"{file}: ")


def _name(file: Path) -> str:
    """What the take of a recording is called."""
    return "stdin" if file == PIPE else file.stem


@dataclass(frozen=True)
class _Take:
    """A recording, and the folder it lies in below the one that was given."""

    file: Path
    below: Path = Path()


def _takes(paths: list[Path], recursive: bool) -> tuple[list[_Take], bool]:
    """The recordings that the arguments name, and whether they are just one file."""
    if not paths:
        raise InputError.about(
            "animate", found="no recording", allowed="sound files, folders of them, or --table"
        )
    takes: list[_Take] = []
    for path in paths:
        if not path.is_dir():
            takes.append(_Take(path))
            continue
        sounds = path.rglob("*") if recursive else path.iterdir()
        files = sorted(p for p in sounds if p.suffix.lower() in SOUND_SUFFIXES and not p.is_dir())
        skipped = [] if recursive else _folders_with_sound(path)
        remedy = "--recursive includes subfolders" if skipped else ""
        if not files:
            raise InputError.about(
                path,
                found="no sound file in this folder",
                allowed=" ".join(SOUND_SUFFIXES),
                remedy=remedy,
            )
        if skipped:
            folders = "subfolder" if len(skipped) == 1 else "subfolders"
            left_out = f"{len(skipped)} {folders} with sound left out"
            print(f"elocute: {path}: {left_out}; {remedy}", file=sys.stderr)
        takes += [_Take(p, p.parent.relative_to(path)) for p in files]
    return takes, len(paths) == 1 and not paths[0].is_dir()


def _folders_with_sound(folder: Path) -> list[Path]:
    """Subfolders that hold sound, in themselves or further below."""
    return [
        sub
        for sub in sorted(folder.iterdir())
        if sub.is_dir() and any(p.suffix.lower() in SOUND_SUFFIXES for p in sub.rglob("*"))
    ]


def _outputs(
    take: _Take, outputs: list[Path], formats: list[str], single: bool, plan: OutputPlan
) -> list[Path]:
    targets = []
    for output in outputs:
        if output == PIPE:
            targets.append(output)
        elif _is_folder(output, formats, single):
            folder = output / take.below
            plan.make_folder(folder)
            targets += [
                folder / f"{_name(take.file)}.{kind.lstrip('.')}" for kind in formats or ["npz"]
            ]
        elif single and formats and PIPE not in outputs:
            raise OutputError.about(
                output,
                found=f"a file, and --format {' '.join(formats)}",
                allowed="--format with a folder or -",
                remedy="leave --format out",
            )
        elif single:
            targets.append(output)
        else:
            raise OutputError.about(
                output,
                found="one file for several recordings",
                allowed="a folder",
                remedy="use -o FOLDER --format glb",
            )
    return targets


def _is_folder(output: Path, formats: list[str], single: bool) -> bool:
    """Whether outputs go into it: `-o take.obj` for one take is the take, also the second time."""
    from elocute.export.registry import WRITERS

    if single and not formats and output.suffix.lower() in WRITERS:
        return False
    return output.is_dir() or (not output.suffix and bool(formats or not single))
