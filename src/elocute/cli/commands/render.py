"""`elocute render`: a stored motion in other formats."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.format_options import FormatSettings, check_format_settings, options_of_formats
from elocute.cli.outputs import (
    nothing_to_do,
    plan_motion,
    write_motions,
)
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    from elocute.motion.motion import Motion


def render_command(
    motion: Path = typer.Argument(
        ..., help="A motion (.npz) or curves (.json) that `animate` wrote."
    ),
    output: list[Path] = options.Output,
    audio: Path | None = typer.Option(None, help="Sound that belongs to the motion."),
    fps: float | None = typer.Option(None, help="Resample to this frame rate."),
    format_settings: FormatSettings = options_of_formats(),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Convert a stored motion to video, glTF, HTML, meshes, curves or pictures."""
    plan = OutputPlan()
    check_format_settings(output, format_settings)
    for target in output:
        plan_motion(plan, target, motion, sound=audio, format_settings=format_settings)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    targets = plan.wanted(output)
    loaded = _load(motion)
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


def _load(path: Path) -> Motion:
    """A motion; curves move the built-in head in its look. Raises MotionError."""
    from dataclasses import replace

    from elocute.export.curves_json import read_json_curves, read_json_rotations
    from elocute.head.looks import person
    from elocute.motion.curves import motion_from_curves
    from elocute.motion.store import load_motion

    if path.suffix.lower() != ".json":
        return load_motion(path)
    head = person("mean")
    turns = read_json_rotations(path, head.joint_names)
    return replace(motion_from_curves(head, read_json_curves(path)), rotations=turns)
