"""`elocute measure`: the mouth of a stored motion in numbers."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

import typer

from elocute.cli import options
from elocute.cli.flags import in_flags
from elocute.cli.outputs import check_file_suffix, nothing_to_do
from elocute.errors import InputError
from elocute.files.output_plan import OutputPlan


def measure_command(
    motion: Path = typer.Argument(..., help="A motion (.npz) that `animate` wrote."),
    output: Path = typer.Option(..., "-o", "--output", help="CSV file to write."),
    phones: Path | None = typer.Option(
        None,
        help="File of times of phones (TextGrid, CTM, CSV, JSON, such as `elocute phones` writes): "
        "a row for each phone, with mean and middle of each measure.",
    ),
    plot: Path | None = typer.Option(None, help="Also plot the measures over time (.png)."),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Measure the mouth in every frame, or every phone: opening, width, protrusion and jaw, in
    millimetres."""
    from elocute.motion.mouth_measures import (
        measure_mouth,
        measure_phones,
        write_measures,
        write_phone_measures,
    )
    from elocute.motion.store import load_motion

    check_file_suffix(output, ".csv")
    check_file_suffix(plot, ".png")
    plan, known = OutputPlan(), [] if phones is None else [phones]
    for path, sources in ((output, [motion, *known]), (plot, [motion])):
        if path is not None:
            plan.add(path, *sources)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    measures = measure_mouth(load_motion(motion))
    table = None if phones is None else measure_phones(measures, _phones_of(phones))
    if plan.wants(output):
        with plan.writing(output):
            if table is None:
                write_measures(measures, output)
            else:
                write_phone_measures(table, output)
    if plot is not None and plan.wants(plot):
        from elocute.plots.curves import plot_curves

        with plan.writing(plot):
            plot_curves(measures, plot, title=motion.name)
    if as_json:
        peaks = zip(measures.names, measures.values.max(axis=0).tolist(), strict=True)
        record: dict[str, float] = {"frames": len(measures.values), "fps": measures.fps}
        record |= {} if table is None else {"phones": len(table.phones)}
        print(json.dumps(record | {f"max_{name}": round(peak, 3) for name, peak in peaks}))
    else:
        print(*plan.wanted([output, *([plot] if plot else [])]), sep="\n")


def _phones_of(path: Path) -> Sequence[tuple[float, float, str]]:
    """The phones of a file of times. Raises InputError for words alone."""
    from elocute.speech.times.read import read_speech_times

    times = read_speech_times(path)
    for note in times.notes:
        print(f"elocute: {path}: {in_flags(note)}", file=sys.stderr)
    if not times.phones:
        raise InputError.about(
            path,
            found="words alone",
            allowed="times of phones",
            remedy="`elocute phones` finds them in the sound",
        )
    return times.phones
