"""`elocute solve`: from vertices back to the weights and joint rotations behind them."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.commands.solve_flame import FlameSettings, Replacing, solve_flame_command
from elocute.cli.outputs import nothing_to_do, warn_of_silence
from elocute.cli.progress import progress_bar
from elocute.errors import ElocuteWarning, InputError, MotionError
from elocute.files.output_plan import OutputPlan
from elocute.files.reading import ANY_BYTES, FileKind
from elocute.numerics.frame_rates import frame_rate

if TYPE_CHECKING:
    from elocute.files.array_file import ArrayFile
    from elocute.head.model import HeadModel
    from elocute.motion.motion import Motion


HEAD_FILE = FileKind("a head (.npz)", 2_000_000_000)
STRANGE_MM = 10.0
"""Vertices that the head stays so far from are those of something else."""
VERTEX_FILE = FileKind("a .npy of (frame, vertex, 3) metres", ANY_BYTES, MotionError)


def solve_command(
    vertices: Path = typer.Argument(
        ...,
        help="Vertices (frame, vertex, 3) in metres (.npy), or a motion (.npz); with --flame also "
        "a corpus.",
    ),
    output: Path = typer.Option(
        ...,
        "-o",
        "--output",
        help="Motion to write (.npz, …); with --flame the parameters (.npz, or a folder "
        "for a corpus).",
    ),
    flame: Path | None = typer.Option(
        None,
        help="A FLAME model (.pkl): find its parameters (shape, expression, pose, translation) "
        "instead of a motion.",
    ),
    head: Path | None = typer.Option(
        None, help="Head to solve for: a head (.npz), or a motion whose head is used."
    ),
    identity: str | None = typer.Option(
        None, help="Identity of the built-in head to solve for: a name, a seed, or a .json file."
    ),
    fps: float = typer.Option(
        60.0, help="Frames per second of a .npy.", parser=frame_rate, metavar="RATE"
    ),
    bounded: bool = typer.Option(False, help="Keep weights between 0 and 1."),
    zero_pose: bool = typer.Option(False, help="Solve for shapes alone, without joint rotations."),
    regularisation: float = typer.Option(
        1e-6, min=0.0, max=1e6, help="Penalty on squared weights, mm²."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Solve for the blendshape weights and joint rotations behind moving vertices."""
    import numpy as np

    from elocute.export.registry import check_suffix, write
    from elocute.motion.blendshape_solver import solve_weights

    if flame is not None:
        _refuse_with_flame(head=head, identity=identity, bounded=bounded)
        solve_flame_command(
            vertices,
            output,
            flame,
            FlameSettings(fps, zero_pose, regularisation),
            Replacing(overwrite, no_clobber, as_json),
        )
        return
    check_suffix(output)
    plan = OutputPlan([given for given in (head, identity) if given is not None])
    plan.add(output, vertices)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    if head is not None and identity is not None:
        raise InputError.about("--head", found="--identity too", allowed="one of them")
    motion = None if vertices.suffix.lower() == ".npy" else _motion(vertices)
    target = _chosen_head(head, identity, motion)
    points = _read_vertices(vertices) if motion is None else motion.vertices()
    with progress_bar(f"solving {vertices.name}", as_json) as progress:
        solved, residual_mm = solve_weights(
            target,
            points,
            fps=fps if motion is None else motion.fps,
            regularisation=regularisation,
            bounds=(0.0, 1.0) if bounded else None,
            joints=() if zero_pose else None,
            progress=progress,
        )
    with plan.writing(output):
        write(solved, output)
    warn_of_silence([output], "elocute render MOTION.npz --audio FILE adds it")
    mean, p95 = float(residual_mm.mean()), float(np.percentile(residual_mm, 95))
    if mean > STRANGE_MM:
        warnings.warn(
            f"{vertices}: {mean:.0f} mm from the nearest that the head comes to; allowed: vertices "
            "of this head, not displacements, in metres, +Y up and +Z out of the face",
            ElocuteWarning,
            stacklevel=2,
        )
    if as_json:
        record = {"input": str(vertices), "output": str(output), "frames": solved.frame_count}
        record |= {"residual_mean_mm": round(mean, 6), "residual_p95_mm": round(p95, 6)}
        print(json.dumps(record | {"rotations": solved.rotations is not None}))
    else:
        print(output)
        print(f"residual {mean:.4f} mm on average, {p95:.4f} mm at the 95th percentile")


def _refuse_with_flame(**given: object) -> None:
    """Raises InputError for options that FLAME's parameters have no use for."""
    for name, value in given.items():
        if value:
            raise InputError.about(f"--{name}", found="--flame too", allowed="one of them")


def _motion(path: Path) -> Motion:
    from elocute.motion.store import load_motion

    return load_motion(path)


def _chosen_head(path: Path | None, identity: str | None, motion: Motion | None) -> HeadModel:
    """The head asked for; else a motion's own; else the built-in one."""
    from elocute.head.looks import person

    if path is not None:
        return _read_head(path)
    if identity is not None:
        return person(identity)
    return person("mean") if motion is None else motion.head


def _read_head(path: Path) -> HeadModel:
    """A head on its own, or the one that travels with a motion. Raises InputError."""
    from elocute.files.array_reading import npz_names
    from elocute.head.store import load_head

    try:
        names = npz_names(path, HEAD_FILE)
        is_motion = "weights" in names
    except InputError:
        is_motion = False  # what reads it says what is wrong
    return _motion(path).head if is_motion else load_head(path)


def _read_vertices(path: Path) -> ArrayFile:
    """(frame, vertex, 3) as `-o talk.npy` writes them, left on disk. Raises MotionError."""
    from elocute.files.array_file import ArrayFile

    return ArrayFile(path, VERTEX_FILE)
