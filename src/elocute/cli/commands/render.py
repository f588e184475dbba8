"""`elocute render`: a stored motion in other formats."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from elocute.cli import motion_inputs, one_file, options
from elocute.cli.format_options import FormatSettings, check_format_settings, options_of_formats
from elocute.cli.outputs import (
    nothing_to_do,
    plan_motion,
    write_motions,
)
from elocute.cli.projects import check_project_alone, render_project
from elocute.files.output_plan import OutputPlan
from elocute.studio.project_names import is_project


def render_command(
    motion: Path = typer.Argument(
        ..., help=f"{motion_inputs.HELP} Or a project of `elocute studio` (NAME.elocute.json)."
    ),
    output: list[Path] = options.OutputUnlessInto,
    into: Path | None = one_file.Into,
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
    """Convert a motion to video, glTF, HTML, meshes, curves or pictures, on any head.

    A project is animated as the studio shows it, with its sound and the options it has.
    """
    if is_project(motion):
        others = {"--audio": audio, "--head": head, "--mesh": mesh, "--flame": flame}
        check_project_alone(motion, {**others, "--input-fps": input_fps, "--into": into})
    format_settings = one_file.with_into(
        format_settings, into, output, head or str(motion), "render"
    )
    if is_project(motion):
        render_project(motion, output, fps, format_settings, (overwrite, no_clobber), as_json)
        return
    format_settings = one_file.named_take(format_settings, motion.stem)
    output = [*output, *([] if into is None else [into])]
    plan = OutputPlan([each for each in (head, flame) if each])
    check_format_settings(output, format_settings)
    for target in output:
        plan_motion(plan, target, motion, sound=audio, format_settings=format_settings)
    one_file.check_free(format_settings)
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
