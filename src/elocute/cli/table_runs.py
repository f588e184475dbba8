"""Many takes in one run: the lines of a table, or the recordings of folders."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli.flags import in_flags
from elocute.cli.format_options import check_format_settings
from elocute.cli.pipes import PIPE
from elocute.cli.progress import counted, progress_bar, resumable
from elocute.cli.spoken_takes import TableRun, make_take
from elocute.cli.takes import check_character_formats
from elocute.errors import OutputError, printable

if TYPE_CHECKING:
    from elocute.cli.line_table import Line, UnusableLine
    from elocute.jobs.pool import Pool
    from elocute.speech.voices.settings import VoiceSettings


def one_folder(output: list[Path]) -> Path:
    """The one folder that takes go into. Raises OutputError."""
    from elocute.export.registry import WRITERS

    if len(output) != 1 or output[0] == PIPE or output[0].suffix.lower() in WRITERS:
        raise OutputError.about(
            "-o " + " ".join(map(str, output))[:100],
            found="no single folder",
            allowed="a folder for the takes of a table",
            remedy="use -o FOLDER --format glb",
        )
    return output[0]


def chosen_pool(jobs: int, address: str | None) -> Pool:
    """The pool of --jobs and --ray. Raises InputError, and MachineError for a cluster."""
    from elocute.jobs.pool import one_after_another
    from elocute.jobs.process_pool import checked_jobs, local_pool

    checked_jobs(jobs)
    if address is not None:
        from elocute.jobs.ray_cluster import ray_pool

        return ray_pool(address, 0 if jobs == 1 else jobs)
    return one_after_another if jobs == 1 else local_pool(jobs)


def recorded_lines(table: Path, voice: VoiceSettings) -> list[Line | UnusableLine]:
    """The lines of a table of recordings; one that is to be spoken cannot be used here."""
    from elocute.cli.line_table import Line, UnusableLine, read_lines

    return [
        UnusableLine(
            line.name, "no audio; allowed: a recording; `elocute say --table` speaks texts"
        )
        if isinstance(line, Line) and not line.audio
        else line
        for line in read_lines(table, voice)
    ]


def run_lines(
    lines: Sequence[Line | UnusableLine],
    run: TableRun,
    pool: Pool,
    *,
    label: str,
    as_json: bool,
) -> None:
    """Make the takes of lines; the good ones also where others fail, which exits with 1."""
    from elocute.cli.line_table import Line, UnusableLine
    from elocute.files.work_folder import no_empty_folder, prepare_folder
    from elocute.jobs.pool import FailedTask

    named = [run.folder / f"x.{kind.lstrip('.')}" for kind in run.formats]
    named += [] if run.into is None else [run.into]
    check_format_settings(named, run.format_settings)
    check_character_formats(dict(run.settings), named, run.format_settings)
    prepare_folder(run.folder, resume=True)
    failures = 0
    out = sys.stdout  # a cluster's notices go elsewhere while its pool runs

    def fail(name: str, reason: str) -> None:
        nonlocal failures
        failures += 1
        print(f"elocute: {printable(f'{name}: {in_flags(reason)}')}", file=sys.stderr)
        if as_json:
            print(json.dumps({"id": name, "error": in_flags(reason)}), file=out, flush=True)

    for line in lines:
        if isinstance(line, UnusableLine):
            fail(line.name, line.fault)
    tasks = [(line, run) for line in lines if isinstance(line, Line)]
    kept = 0
    with (
        no_empty_folder(run.folder),
        resumable("run it again to continue"),
        counted(len(tasks)) as one_done,
        progress_bar(label, as_json) as progress,
    ):
        for done, (task, result) in enumerate(pool(make_take, tasks), 1):
            one_done()
            progress(done / len(tasks))
            if isinstance(result, FailedTask):
                fail(task[0].name, result.reason)
                continue
            kept += not result["outputs"]
            for note in result.get("notes", []):
                print(f"elocute: {printable(f'{task[0].name}: {in_flags(note)}')}", file=sys.stderr)
            if as_json:
                print(json.dumps(result), file=out, flush=True)
            else:
                for path in result["outputs"]:
                    print(printable(path), file=out)
    if kept:
        print(f"elocute: {kept} of {len(lines)} there already", file=sys.stderr)
    if failures:
        print(f"elocute: {failures} of {len(lines)} failed", file=sys.stderr)
        raise typer.Exit(1)
