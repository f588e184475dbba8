"""`elocute measure`: the mouth of a stored motion in numbers."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from elocute.cli import options
from elocute.cli.outputs import check_file_suffix, nothing_to_do
from elocute.files.output_plan import OutputPlan


def measure_command(
    motion: Path = typer.Argument(..., help="A motion (.npz) that `animate` wrote."),
    output: Path = typer.Option(..., "-o", "--output", help="CSV file to write."),
    plot: Path | None = typer.Option(None, help="Also plot the measures over time (.png)."),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Measure the mouth in every frame: opening, width, protrusion and jaw, in millimetres."""
    from elocute.motion.mouth_measures import measure_mouth, write_measures
    from elocute.motion.store import load_motion

    check_file_suffix(output, ".csv")
    check_file_suffix(plot, ".png")
    plan = OutputPlan()
    for path in (output, plot):
        if path is not None:
            plan.add(path, motion)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    measures = measure_mouth(load_motion(motion))
    if plan.wants(output):
        with plan.writing(output):
            write_measures(measures, output)
    if plot is not None and plan.wants(plot):
        from elocute.plots.curves import plot_curves

        with plan.writing(plot):
            plot_curves(measures, plot, title=motion.name)
    if as_json:
        peaks = zip(measures.names, measures.values.max(axis=0).tolist(), strict=True)
        record = {"frames": len(measures.values), "fps": measures.fps}
        print(json.dumps(record | {f"max_{name}": round(peak, 3) for name, peak in peaks}))
    else:
        print(*plan.wanted([output, *([plot] if plot else [])]), sep="\n")
