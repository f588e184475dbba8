"""`elocute convert`: a stored motion in the parameters of another standard."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import motion_inputs, options
from elocute.cli.outputs import check_file_suffix, nothing_to_do
from elocute.cli.progress import progress_bar
from elocute.errors import InputError, OutputError
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    from elocute.motion.motion import Motion

STANDARDS = ("arkit", "oculus", "vrm", "flame")


def convert_command(
    motion: Path = typer.Argument(..., help=motion_inputs.HELP),
    to: str = typer.Option(
        ...,
        help="arkit (its 52 shapes), oculus (fifteen visemes), vrm (expressions of VRM 1.0), or "
        "flame (expression and jaw).",
    ),
    output: Path = typer.Option(
        ..., "-o", "--output", help="Curves (.csv, .json); FLAME's parameters (.npz)."
    ),
    flame: Path | None = typer.Option(
        None, help="The FLAME model (.pkl), for `flame` and of FLAME's parameters."
    ),
    input_fps: float | None = motion_inputs.InputFps,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Turn a motion into the curves of another standard, and tell what these leave.

    Visemes and vowels are fitted to the mouth: from 0 to 1, few at a time, and lips that meet
    weigh most. For FLAME the shapes are carried over to its mean face, and its own equations
    are solved; the head does not turn.
    """
    if to not in STANDARDS:
        raise InputError.about("--to", found=repr(to), allowed=", ".join(STANDARDS))
    parameters = motion_inputs.are_flame(motion)
    if (flame is not None) != (to == "flame" or parameters):
        raise InputError.about(
            "--flame", found=f"{'given' if flame else 'missing'} with {to}", allowed="for flame"
        )
    if to == "flame":
        check_file_suffix(output, ".npz")
    elif output.suffix.lower() not in (".csv", ".json"):
        raise OutputError.about(output, found=f"suffix {output.suffix!r}", allowed=".csv or .json")
    plan = OutputPlan([flame] if flame else [])
    plan.add(output, motion)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    opened = motion_inputs.open_given(
        motion, as_json, flame=flame if parameters else None, input_fps=input_fps
    )
    with plan.writing(output):
        frames, median, most = (
            _to_curves(opened, to, output)
            if flame is None or to != "flame"
            else _to_flame(opened, flame, output, as_json)
        )
    if as_json:
        record = {"input": str(motion), "output": str(output), "to": to, "frames": frames}
        print(json.dumps(record | {"residual_median_mm": median, "residual_max_mm": most}))
        return
    print(output)
    print(f"residual {median:.2f} mm in the median frame, {most:.2f} mm in the worst")


def _to_curves(motion: Motion, to: str, output: Path) -> tuple[int, float, float]:
    import numpy as np

    from elocute.export.curves_json import write_curves
    from elocute.export.shape_profiles import convert_curves

    conversion = convert_curves(motion, to)
    write_curves(conversion.curves, output)
    left = conversion.residual_mm
    return len(left), round(float(np.median(left)), 3), round(float(left.max(initial=0)), 3)


def _to_flame(motion: Motion, flame: Path, output: Path, quiet: bool) -> tuple[int, float, float]:
    import numpy as np

    from elocute.adoption.registry import open_speaking_head
    from elocute.head.flame import load_flame
    from elocute.head.flame_parameters import save_flame_parameters
    from elocute.head.flame_solver import solve_flame
    from elocute.motion.motion import Motion

    head = open_speaking_head(flame)
    if head.expression_names != motion.names:
        raise InputError.about(
            "motion", found="a head with other shapes", allowed="the built-in head's shapes"
        )
    carried = Motion(head, motion.weights, motion.fps)
    with progress_bar(f"solving {output.name}", quiet) as progress:
        parameters, left = solve_flame(
            load_flame(flame),
            carried.vertices(),
            fps=motion.fps,
            neutral=head.template,
            zero_pose=True,
            progress=progress,
        )
    save_flame_parameters(output, parameters)
    return len(left), round(float(np.median(left)), 3), round(float(left.max(initial=0)), 3)
