"""A motion of any head from a file: a stored motion, curves of any program, FLAME's parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from elocute.adoption.registry import FLAME_SUFFIX, open_speaking_head
from elocute.array_types import Float32Array
from elocute.errors import InputError, MotionError
from elocute.export.curve_files import SUFFIXES, joint_turns, read_curves
from elocute.files.array_reading import npz_names
from elocute.files.reading import FileKind
from elocute.head.flame import FlameModel, flame_vertices, load_flame
from elocute.head.flame_layouts import ASSUMED_FPS, is_flame, read_layout
from elocute.head.looks import person
from elocute.head.model import HeadModel
from elocute.motion.blendshape_solver import solve_weights
from elocute.motion.curves import Curves, curves_from_motion, motion_from_curves
from elocute.motion.motion import Motion, check_reach
from elocute.motion.store import load_motion
from elocute.numerics.quaternions import from_axis_angle, multiply

BLOCK = 300
"""Frames of FLAME's vertices in memory at once."""
TURNED_AWAY = 1.0
"""A root that begins with so great a turn, in radians, stands before a camera, not upright."""
MOTION_FILE = FileKind(
    f"a motion or FLAME parameters (.npz), or curves ({', '.join(SUFFIXES)})",
    2_000_000_000,
    MotionError,
)


@dataclass(frozen=True, eq=False)
class OpenedMotion:
    """A motion, and what to know about where it is from.

    Attributes
    ----------
    motion : Motion
        On the head that was asked for.
    notes : tuple of str
        What was assumed, and what was left out.
    """

    motion: Motion
    notes: tuple[str, ...] = ()


def open_motion(
    path: str | Path,
    *,
    head: str | Path | None = None,
    mesh: str | None = None,
    flame: str | Path | None = None,
    input_fps: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> OpenedMotion:
    """Open what moves a face, and play it on a head.

    Parameters
    ----------
    path : str or Path
        A stored motion (.npz); curves as `elocute.export.read_curves` takes them; FLAME's
        parameters (.npz, or a folder with a file for each frame).
    head : str or Path, optional
        The head that moves, as `open_speaking_head` takes it; a motion's own, or the built-in one.
    mesh : str, optional
        A mesh of the head, in a file with several.
    flame : str or Path, optional
        The FLAME model (.pkl) of the parameters.
    input_fps : float, optional
        Frames per second of a file that does not say it.
    progress : callable, optional
        Called with the share of the frames that is done, 0 to 1.

    Returns
    -------
    OpenedMotion

    Raises
    ------
    MotionError
        For a file that is none of these, and curves that the head has no shapes for; HeadError for
        the head; InputError for parameters of FLAME without its model.
    """
    path = Path(path)
    if holds_flame(path):
        chosen = _chosen(head, mesh)
        return _of_flame(path, flame, chosen, input_fps, progress)
    if flame is not None:
        raise InputError.about(
            "`flame`", found="given", allowed="for FLAME's parameters, which this file is not"
        )
    if path.suffix.lower() in SUFFIXES:
        stored, chosen = read_curves(path, input_fps), _chosen(head, mesh)
        motion = motion_from_curves(chosen, stored.curves)
        motion = replace(motion, rotations=stored.rotations(chosen))
        try:
            check_reach(motion)
        except MotionError as error:
            raise MotionError.about(path, found=str(error)) from error
        return _with_notes(motion, stored.notes)
    motion = load_motion(path)
    if head is None:
        return OpenedMotion(motion)
    chosen = _chosen(head, mesh)
    return _with_notes(_on(motion, chosen), ())


def holds_flame(path: Path) -> bool:
    """Whether a file, or a folder of frames, holds FLAME's parameters."""
    if path.is_dir():
        return True
    if path.suffix.lower() != ".npz":
        return False
    try:
        names = npz_names(path, MOTION_FILE)
    except MotionError:  # what reads it says what is wrong
        return False
    return is_flame(tuple(names))


def _chosen(head: str | Path | None, mesh: str | None) -> HeadModel:
    return person("mean") if head is None else open_speaking_head(head, mesh)


def _with_notes(motion: Motion, notes: tuple[str, ...]) -> OpenedMotion:
    character = motion.head.character
    return OpenedMotion(motion, (*notes, *(character.notes if character else ())))


def _on(motion: Motion, head: HeadModel) -> Motion:
    """The same curves and turns on another head."""
    moved = motion_from_curves(head, curves_from_motion(motion))
    if motion.rotations is None:
        return moved
    turns = dict(zip(motion.head.joint_names, np.moveaxis(motion.rotations, 1, 0), strict=True))
    return replace(moved, rotations=joint_turns(head, motion.frame_count, turns))


def _of_flame(
    path: Path,
    flame: str | Path | None,
    head: HeadModel,
    input_fps: float | None,
    progress: Callable[[float], None] | None,
) -> OpenedMotion:
    if flame is None:
        raise InputError.about(
            path,
            found="FLAME's parameters without its model",
            allowed=f"`flame` with the model that they are of ({FLAME_SUFFIX})",
        )
    parts, fps, left_out = read_layout(path, input_fps)
    notes = []
    if left_out:
        notes.append(f"{path.name}: left out {', '.join(left_out[:6])}")
    if (fps := input_fps or fps) is None:
        fps = ASSUMED_FPS
        said = f"{path.name}: no frame rate in it: taken as {fps:g} a second"
        notes.append(f"{said}; `input_fps` says another")
    carrier = open_speaking_head(flame)
    weights = _weights(load_flame(flame), carrier, parts, fps, progress)
    motion = motion_from_curves(head, Curves(weights, carrier.expression_names, fps))
    return _with_notes(replace(motion, rotations=_turns(parts["pose"], head)), tuple(notes))


def _weights(
    model: FlameModel,
    carrier: HeadModel,
    parts: dict[str, np.ndarray],
    fps: float,
    progress: Callable[[float], None] | None,
) -> Float32Array:
    """(frame, shape) weights of the shapes carried over to FLAME, on its mean face at rest."""
    pose = parts["pose"].copy()
    pose[:, :6] = 0  # root and neck, which turn the head
    blocks = []
    for start in range(0, len(pose), BLOCK):
        part = slice(start, start + BLOCK)
        expression = parts["expression"][part]
        vertices = flame_vertices(
            model, np.zeros(1), expression, pose[part], np.zeros((len(expression), 3))
        )
        solved, _ = solve_weights(carrier, vertices, fps=fps, bounds=(0.0, 1.0), joints=())
        blocks.append(solved.weights)
        if progress is not None:
            progress(min(1.0, (start + BLOCK) / len(pose)))
    return np.concatenate(blocks)


def _turns(pose: np.ndarray, head: HeadModel) -> Float32Array | None:
    """(frame, joint, 4) wxyz of neck and head; from the first frame on before a camera."""
    root, neck = (from_axis_angle(pose[:, start : start + 3]) for start in (0, 3))
    if np.linalg.norm(pose[0, :3]) > TURNED_AWAY:
        root = multiply(root, root[:1] * [1, -1, -1, -1])
    if not (np.abs(root[:, 1:]).any() or np.abs(neck[:, 1:]).any()):
        return None
    return joint_turns(head, len(pose), {"neck": root, "head": neck})
