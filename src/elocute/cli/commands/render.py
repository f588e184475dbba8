"""`elocute render`: a stored motion in other formats."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from elocute.cli import motion_inputs, options
from elocute.cli.format_options import FormatSettings, check_format_settings, options_of_formats
from elocute.cli.outputs import (
    nothing_to_do,
    plan_motion,
    write_motions,
)
from elocute.files.output_plan import OutputPlan


def render_command(
    motion: Path = typer.Argument(..., help=motion_inputs.HELP),
    output: list[Path] = options.Output,
    audio: Path | None = typer.Option(None, help="Sound that belongs to the motion."),
    fps: float | None = options.Resampled,
    head: str | None = motion_inputs.PlayedOn,
    mesh: str | None = options.Mesh,
    flame: Path | None = motion_inputs.FlameModel,
    input_fps: float | None = motion_inputs.InputFps,
    format_settings: FormatSettings = options_of_formats(),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Convert a motion to video, glTF, HTML, meshes, curves or pictures, on any head."""
    plan = OutputPlan([each for each in (head, flame) if each])
    check_format_settings(output, format_settings)
    for target in output:
        plan_motion(plan, target, motion, sound=audio, format_settings=format_settings)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    targets = plan.wanted(output)
    loaded = motion_inputs.open_given(
        motion, as_json, head=head, mesh=mesh, flame=flame, input_fps=input_fps
    )
    if fps is not None:
        loaded = loaded.at_fps(fps)
    write_motions(
        plan,
        loaded,
        targets,
        sound=audio,
        format_settings=format_settings,
        silence="--audio FILE adds it",
        quiet=as_json,
    )
    if as_json:
        record = {"input": str(motion), "outputs": [str(target) for target in targets]}
        print(json.dumps(record | {"frames": loaded.frame_count, "fps": loaded.fps}))
