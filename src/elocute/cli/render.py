"""`elocute render` and `elocute measure`: what can be done with a stored motion."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.formats import Drawing, check_drawing, drawing_options
from elocute.cli.outputs import plan_motion, settled, tell_silent, write_motion
from elocute.cli.progress import progress_bar
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    from elocute.motion.motion import Motion


def render_command(
    motion: Path = typer.Argument(
        ..., help="A motion (.npz) or curves (.json) that `animate` wrote."
    ),
    output: list[Path] = options.Output,
    audio: Path | None = typer.Option(None, help="The sound it belongs to."),
    fps: float | None = typer.Option(None, help="Sample at another frame rate."),
    drawing: Drawing = drawing_options(),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Write a stored motion as video, glTF, HTML, meshes, curves or pictures."""

    plan = OutputPlan()
    check_drawing(output, drawing)
    for target in output:
        plan_motion(plan, target, motion, sound=audio, drawing=drawing)
    if settled(plan, overwrite, no_clobber, as_json):
        return
    targets = plan.wanted(output)
    loaded = _load(motion)
    if fps is not None:
        loaded = loaded.at_fps(fps)
    for target in targets:
        with progress_bar(f"writing {target.name}", as_json) as progress:
            write_motion(plan, loaded, target, sound=audio, progress=progress, drawing=drawing)
        if not as_json:
            print(target)
    if audio is None:
        tell_silent(targets, "--audio FILE adds it")
    if as_json:
        record = {"input": str(motion), "outputs": [str(target) for target in targets]}
        print(json.dumps(record | {"frames": loaded.frame_count, "fps": loaded.fps}))


def _load(path: Path) -> Motion:
    """A motion; curves move the built-in head. Raises MotionError."""
    from elocute.export.curves_json import read_json_curves
    from elocute.head.builtin import load_builtin_head
    from elocute.motion.curves import motion_from_curves
    from elocute.motion.store import load_motion

    if path.suffix.lower() != ".json":
        return load_motion(path)
    return motion_from_curves(load_builtin_head(), read_json_curves(path))


def measure_command(
    motion: Path = typer.Argument(..., help="A motion (.npz) that `animate` wrote."),
    output: Path = typer.Option(..., "-o", "--output", help="CSV to write."),
    plot: Path | None = typer.Option(None, help="Also draw the measures over time (.png)."),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Measure the mouth per frame: opening, width, protrusion and jaw, in millimetres."""
    from elocute.errors import OutputError
    from elocute.motion.mouth_measures import measure_mouth, write_measures
    from elocute.motion.store import load_motion

    for path, suffix in ((output, ".csv"), (plot, ".png")):
        if path is not None and path.suffix.lower() != suffix:
            raise OutputError.about(path, found=f"suffix {path.suffix!r}", allowed=suffix)
    plan = OutputPlan()
    for path in (output, plot):
        if path is not None:
            plan.add(path, motion)
    if settled(plan, overwrite, no_clobber, as_json):
        return
    measures = measure_mouth(load_motion(motion))
    if plan.wants(output):
        with plan.writing(output):
            write_measures(measures, output)
    if plot is not None and plan.wants(plot):
        from elocute.export.curve_plot import plot_curves

        with plan.writing(plot):
            plot_curves(measures, plot, title=motion.name)
    if as_json:
        peaks = zip(measures.names, measures.values.max(axis=0).tolist(), strict=True)
        record = {"frames": len(measures.values), "fps": measures.fps}
        print(json.dumps(record | {f"max_{name}": round(peak, 3) for name, peak in peaks}))
    else:
        print(*plan.wanted([output, *([plot] if plot else [])]), sep="\n")
