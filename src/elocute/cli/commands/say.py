"""`elocute say`: a text, spoken by espeak-ng, or a table of lines."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from functools import partial
from pathlib import Path

import typer

from elocute.cli import options
from elocute.cli.format_options import (
    FormatSettings,
    check_format_settings,
    options_of_formats,
)
from elocute.cli.outputs import nothing_to_do
from elocute.cli.pipes import PIPE, STDIN, check_pipes
from elocute.cli.settings_options import options_of
from elocute.cli.spoken_takes import TableRun, check_one_worker, plan_take, spoken_source
from elocute.cli.table_runs import chosen_pool, one_folder, run_lines
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
from elocute.errors import InputError, printable
from elocute.files.output_plan import OutputPlan
from elocute.speech.voices.settings import TEXT_MAX, VoiceSettings

TEXT_MAX_BYTES = 4 * TEXT_MAX


def say_command(
    text: str | None = typer.Argument(None, help="The text; - reads standard input."),
    file: Path | None = typer.Option(None, help="Text file that holds what is said, in UTF-8."),
    table: Path | None = typer.Option(
        None,
        help="CSV of lines, a take for each: id, text or audio (a recording, with its text or "
        "without), and any of language, voice, rate, pitch and the settings of a take (style, "
        "mood, look, edits, …).",
    ),
    output: list[Path] = options.Output,
    format: list[str] = typer.Option(
        [],
        "--format",
        help="Format to write (npz, glb, csv, …) where the output is the folder of a table or - "
        "(standard output). Can be repeated.",
    ),
    voice: VoiceSettings = options_of(VoiceSettings, flags={"words_per_minute": "--rate"}),
    settings: TakeChoices = options_of_takes(),
    jobs: int = options.Jobs,
    ray: str | None = options.Ray,
    format_settings: FormatSettings = options_of_formats(),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Speak a text with espeak-ng and animate a head with it.

    The sound is written beside or inside the output, as `animate` writes it. A table gives a folder
    of takes; run again, it makes those that are missing.
    """
    check_pipes([], output, format, as_json)
    check_edits(settings)
    pool = chosen_pool(jobs, ray)
    if table is not None:
        from elocute.cli.line_table import read_lines

        if text is not None or file is not None:
            found = "a text" if text is not None else "--file"
            raise InputError.about("--table", found=f"{found} too", allowed="one of them")
        run = TableRun(
            one_folder(output),
            table,
            tuple(dict.fromkeys(format or ["npz"])),
            settings,
            format_settings,
            overwrite,
            no_clobber,
        )
        lines = read_lines(table, voice)
        check_one_worker(run, lines, pool)
        run_lines(lines, run, pool, label=f"speaking {table.name}", as_json=as_json)
        return
    said = _text(text, file)
    plan = OutputPlan([*named_inputs(settings), *([file] if file else [])])
    source = spoken_source(said, voice, settings)
    named = [named_target(t, format) for t in output]
    check_format_settings(named, format_settings)
    check_character_formats(settings, named, format_settings)
    for target in output:
        if target != PIPE:
            plan_take(plan, target, source, sound=None, format_settings=format_settings)
    if nothing_to_do(plan, overwrite, no_clobber, as_json) and PIPE not in output:
        return
    from elocute.speaking import say

    wanted = plan.wanted(output)
    record = make_outputs(
        partial(say, said, **asdict(voice), **settings),
        wanted,
        TakeOutputs(plan, format, format_settings, as_json),
        label="speaking",
    )
    if as_json:
        print(json.dumps({"outputs": [str(target) for target in wanted], **record}))


def _text(text: str | None, file: Path | None) -> str:
    """What is said, from the one place that was given."""
    if (text is None) == (file is None):
        raise InputError.about(
            "say",
            found="no text" if text is None else "a text and --file",
            allowed="a text, - (standard input), --file or --table",
        )
    if file is not None:
        from elocute.speech.text.script_text import read_transcript

        return _said(read_transcript(file, max_bytes=TEXT_MAX_BYTES), str(file))
    if text != "-":
        return str(text)
    if sys.stdin.isatty():
        raise InputError.about(STDIN, found="a terminal", allowed="a text, from a pipe or a file")
    data = sys.stdin.buffer.read(TEXT_MAX_BYTES + 1)
    if len(data) > TEXT_MAX_BYTES:
        raise InputError.about(
            STDIN, found=f"more than {TEXT_MAX_BYTES} bytes", allowed=f"up to {TEXT_MAX} letters"
        )
    from elocute.files.reading import FileKind, decoded_text

    kind = FileKind("a text in UTF-8 or UTF-16", TEXT_MAX_BYTES)
    return _said(decoded_text(data, STDIN, kind), STDIN)


def _said(text: str, source: str) -> str:
    """What is said of a text; what is left out goes to standard error."""
    from elocute.speech.times.captions import said_text

    said, notes = said_text(text)
    for note in notes:
        print(f"elocute: {printable(f'{source}: {note}')}", file=sys.stderr)
    return said
