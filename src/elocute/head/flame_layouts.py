"""FLAME's parameters as different programs store them.

`elocute solve` writes shape, expression, pose, translation and fps. VHAP has expr,
rotation, neck_pose, jaw_pose, eyes_pose; EMOCA and DECA have exp or expcode, and a pose of six:
root and jaw; some store a file for each frame.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.files.array_reading import read_npy, read_npz

FILE_MAX_BYTES = 2_000_000_000
FRAMES_MAX = 200_000
KEYS = ("shape", "expression", "pose", "translation", "fps")
ALLOWED = f"FLAME parameters (.npz of {', '.join(KEYS)}, or as VHAP and EMOCA have them)"
SHAPE = ("shape", "shapecode", "shape_params", "betas")
EXPRESSION = ("expression", "expr", "exp", "expcode", "expression_params", "expressions")
TRANSLATION = ("translation", "transl", "trans")
RATE = ("fps", "framerate", "mocap_frame_rate", "mocap_framerate")
POSES: dict[tuple[str, ...], dict[int, tuple[tuple[int, int], ...]]] = {
    ("pose", "posecode", "poses"): {
        15: ((0, 0), (3, 3), (6, 6), (9, 9), (12, 12)),
        6: ((0, 0), (3, 6)),
        3: ((0, 6),),
    },
    ("rotation", "global_pose", "global_orient", "pose_params"): {3: ((0, 0),)},
    ("neck_pose", "neck"): {3: ((0, 3),)},
    ("jaw_pose", "jaw", "jaw_params"): {3: ((0, 6),)},
    ("eyes_pose", "eyes", "eye_pose"): {6: ((0, 9), (3, 12))},
    ("leye_pose",): {3: ((0, 9),)},
    ("reye_pose",): {3: ((0, 12),)},
}
"""By its names and width: which of its columns are which of the pose's, three at a time."""
ASIDE = (
    "timestep_id",
    "n_processed_frames",
    "cam",
    "tex",
    "texcode",
    "light",
    "lightcode",
    "detail",
)
ASIDE += ("detailcode", "focal_length", "lights", "tex_extra", "images")


def is_flame(names: Sequence[str]) -> bool:
    """Whether names of arrays are FLAME's parameters.

    Parameters
    ----------
    names : sequence of str
        Of an .npz.

    Returns
    -------
    bool
    """
    return any(name in EXPRESSION for name in names)


def read_layout(path: str | Path) -> tuple[dict[str, Float64Array], float | None, list[str]]:
    """Read parameters in any layout.

    Parameters
    ----------
    path : str or Path
        An .npz; a folder with one for each frame, or with folders of exp.npy, pose.npy and so on.

    Returns
    -------
    parts : dict of str to array
        shape (identity,), expression (frame, expression), pose (frame, 15), translation (frame, 3).
    fps : float or None
        Where it is said.
    left_out : list of str
        Names of arrays that FLAME has no use for.

    Raises
    ------
    HeadError
        For a file that is missing, damaged or something else.
    """
    path = Path(path)
    frames = [_stored(each) for each in _frame_paths(path)]
    stored: dict[str, NDArray[Any]] = frames[0]
    if len(frames) > 1:
        if any(set(each) != set(stored) for each in frames):
            raise HeadError.about(path, found="frames that hold different arrays", allowed=ALLOWED)
        try:
            stored = {n: np.concatenate([np.atleast_2d(f[n]) for f in frames]) for n in stored}
        except ValueError as error:
            raise HeadError.about(
                path, found="frames of different sizes", allowed=ALLOWED
            ) from error
    return _parts(path, stored)


def _frame_paths(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    found = [each for each in path.iterdir() if each.suffix.lower() == ".npz"]
    found = found or [each for each in path.iterdir() if (each / "exp.npy").is_file()]
    if not found and (path / "exp.npy").is_file():
        return [path]
    if not 0 < len(found) <= FRAMES_MAX:
        raise HeadError.about(path, found=f"{len(found)} frames", allowed=ALLOWED)
    return sorted(found, key=lambda each: [int(n) for n in re.findall(r"\d+", each.name)])


def _stored(path: Path) -> dict[str, NDArray[Any]]:
    def read(file: Path) -> NDArray[Any]:
        return read_npy(file, max_bytes=FILE_MAX_BYTES, allowed=ALLOWED, error=HeadError)

    if path.is_dir():
        names = {*SHAPE, *EXPRESSION, *TRANSLATION, *(name for each in POSES for name in each)}
        return {n: read(path / f"{n}.npy") for n in sorted(names) if (path / f"{n}.npy").is_file()}
    return read_npz(path, max_bytes=FILE_MAX_BYTES, allowed=ALLOWED, error=HeadError)


def _parts(
    path: Path, stored: dict[str, NDArray[Any]]
) -> tuple[dict[str, Float64Array], float | None, list[str]]:
    def one(names: Sequence[str]) -> str | None:
        return next((name for name in names if name in stored), None)

    def rows(name: str) -> Float64Array:
        values = stored[name]
        if values.dtype.kind not in "fiu" or not 1 <= values.ndim <= 3:
            raise HeadError.about(path, found=f"no usable {name}", allowed=ALLOWED)
        if not np.isfinite(values).all():
            raise HeadError.about(path, found=f"no usable {name}: NaN or infinity", allowed=ALLOWED)
        return np.asarray(values, np.float64).reshape(-1, values.shape[-1])

    expression = one(EXPRESSION)
    if expression is None:
        raise HeadError.about(path, found="no usable expression", allowed=ALLOWED)
    parts = {"expression": rows(expression)}
    count = len(parts["expression"])
    shape, shift = one(SHAPE), one(TRANSLATION)
    parts["shape"] = np.zeros(1) if shape is None else rows(shape).mean(axis=0)
    parts["pose"], used = np.zeros((count, 15)), {expression, shape, shift}
    for names, widths in POSES.items():
        name = one(names)
        if name is None:
            continue
        used.add(name)
        given = rows(name)
        if given.shape[1] not in widths or len(given) not in (1, count):
            found = f"{name} of {given.shape[0]} by {given.shape[1]}"
            raise HeadError.about(path, found=f"no usable {found}", allowed=ALLOWED)
        for start, place in widths[given.shape[1]]:
            parts["pose"][:, place : place + 3] = given[:, start : start + 3]
    parts["translation"] = np.zeros((count, 3)) if shift is None else rows(shift)
    if parts["translation"].shape not in ((count, 3), (1, 3)):
        raise HeadError.about(path, found="parts that do not fit each other", allowed=ALLOWED)
    parts["translation"] = np.broadcast_to(parts["translation"], (count, 3)).copy()
    rate = one(RATE)
    fps = None if rate is None else float(np.asarray(stored[rate], np.float64).reshape(-1)[0])
    if fps is not None and not 0 < fps < 1e4:
        raise HeadError.about(path, found="parts that do not fit each other", allowed=ALLOWED)
    return parts, fps, [n for n in stored if n not in {*used, *ASIDE, *RATE}]
