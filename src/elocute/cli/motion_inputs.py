"""What `render`, `edit` and `convert` take: a motion, curves of any program, FLAME's parameters."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli.flags import in_flags
from elocute.cli.progress import progress_bar
from elocute.errors import printable
from elocute.numerics.frame_rates import frame_rate

if TYPE_CHECKING:
    from elocute.motion.motion import Motion

HELP = (
    "A motion (.npz), curves (.csv of Live Link Face or ours; .json of Audio2Face, Azure, ARKit "
    "weights or ours; .npy), or FLAME's parameters (.npz, or a folder of frames)."
)
PlayedOn = typer.Option(
    None,
    "--head",
    help="Head that moves: a motion's own by default, of curves the built-in one; a character "
    "(.glb, .gltf, .vrm, .fbx), a FLAME model (.pkl), or a head or mesh file.",
)
FlameModel = typer.Option(None, "--flame", help="The FLAME model (.pkl) of FLAME's parameters.")
InputFps = typer.Option(
    None,
    "--input-fps",
    help="Frames per second of curves or parameters that do not say it, such as 25 or 30000/1001.",
    parser=frame_rate,
    metavar="RATE",
)


def are_flame(path: Path) -> bool:
    """Whether a file, or a folder of frames, holds FLAME's parameters."""
    from elocute.adoption.motion_files import holds_flame

    return holds_flame(path)


def open_given(
    path: Path,
    quiet: bool,
    *,
    head: str | Path | None = None,
    mesh: str | None = None,
    flame: Path | None = None,
    input_fps: float | None = None,
) -> Motion:
    """The motion of a file on a head; what to know about it is told.

    Raises MotionError, HeadError and InputError as `open_motion` does.
    """
    from elocute.adoption.motion_files import open_motion

    with progress_bar(f"reading {path.name}", quiet) as progress:
        opened = open_motion(
            path, head=head, mesh=mesh, flame=flame, input_fps=input_fps, progress=progress
        )
    for note in opened.notes:
        print(f"elocute: {printable(in_flags(note))}", file=sys.stderr)
    return opened.motion
