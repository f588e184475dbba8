"""ARKit's 52 curves with timecode, laid out as Live Link Face records them.

Columns are in the order of its recordings, which is not quite that of ARKit's documentation: some
readers go by place. Unreal's importer takes the last part of a timecode as sixtieths of a second,
whatever the frame rate of the take.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import MotionError
from elocute.export.shape_profiles import NEAREST
from elocute.files.atomic import write_atomically
from elocute.motion.curves import ARKIT_NAMES, Curves, curves_from_motion
from elocute.motion.motion import Motion
from elocute.numerics.quaternions import multiply, no_turn, to_axis_angle

POSE_COLUMNS = tuple(
    f"{part}{turn}" for part in ("Head", "LeftEye", "RightEye") for turn in ("Yaw", "Pitch", "Roll")
)
SIXTIETHS = 60
"""Frames that a second of a timecode has."""
_ASIDE = {
    "jawLeft": "jawRight",
    "jawRight": "jawLeft",
    "mouthLeft": "mouthRight",
    "mouthRight": "mouthLeft",
}
COLUMNS = tuple(_ASIDE.get(name, name) for name in ARKIT_NAMES)
"""ARKit's names in the order of recordings: what goes to the right comes first."""


def arkit_curves(motion: Motion) -> Curves:
    """ARKit's 52 curves of a motion, with the speech shapes beyond them folded in.

    Parameters
    ----------
    motion : Motion
        On a head with ARKit's shapes.

    Returns
    -------
    Curves
        0 to 1, in the order of `ARKIT_NAMES`.

    Raises
    ------
    MotionError
        For a head without any of them.
    """
    curves = curves_from_motion(motion)
    unknown = [n for n in curves.names if n not in ARKIT_NAMES and n not in NEAREST]
    if not set(curves.names) & set(ARKIT_NAMES):
        raise MotionError(
            f"this motion has no ARKit curves (it has {', '.join(unknown[:5])}, …); "
            "allowed for .csv: motions of a head with ARKit shapes"
        )
    result = curves.select(ARKIT_NAMES)
    values = result.values.copy()
    for name, parts in NEAREST.items():
        if name in curves.names:
            for part, share in parts.items():
                values[:, ARKIT_NAMES.index(part)] += share * curves[name]
    return Curves(np.clip(values, 0, 1), ARKIT_NAMES, motion.fps)


def write_csv(
    motion: Motion, path: str | Path, *, sound: object = None, progress: Any = None
) -> None:
    """Timecode, BlendShapeCount and 61 columns, as Unreal, Blender and Maya importers take them.

    Yaw, pitch and roll of the head are turns to its own left, of the chin down and to its own
    right, in half turns (degrees / 180, as Unreal has them); eyes turn by curves alone. Raises
    OutputError, and MotionError for other shapes.
    """
    curves = arkit_curves(motion)
    names = [name[0].upper() + name[1:] for name in COLUMNS]
    poses = head_poses(motion)
    still = ["0"] * len(POSE_COLUMNS)
    with write_atomically(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["Timecode", "BlendShapeCount", *names, *POSE_COLUMNS])
        for frame, values in enumerate(curves.select(COLUMNS).values):
            shown = [f"{value:.6f}" for value in values]
            pose = still
            if poses is not None:
                pose = [*(f"{turn:.6f}" for turn in poses[frame]), *still[3:]]
            rows.writerow([timecode(frame, curves.fps), "61", *shown, *pose])


def head_poses(motion: Motion) -> NDArray[np.float64] | None:
    """How far the head is turned, neck and head together; None where no joint turns.

    Returns
    -------
    (frame, 3) float64 or None
        Yaw, pitch and roll in half turns.
    """
    if motion.rotations is None:
        return None
    names = motion.head.joint_names
    whole = no_turn(motion.frame_count).astype(np.float64)
    for name in ("neck", "head"):
        if name in names:
            whole = multiply(whole, motion.rotations[:, names.index(name)])
    return to_axis_angle(whole)[:, [1, 0, 2]] / np.pi


def timecode(frame: int, fps: float) -> str:
    """HH:MM:SS:FF.fff of a frame, in sixtieths of a second at any frame rate."""
    seconds, within = divmod(round(1000 * SIXTIETHS * frame / fps), 1000 * SIXTIETHS)
    hours, rest = divmod(seconds, 3600)
    minutes, whole = divmod(rest, 60)
    return f"{hours:02d}:{minutes:02d}:{whole:02d}:{within / 1000:06.3f}"
