"""FLAME's parameters as different programs store them.

`elocute solve` writes shape, expression, pose, translation and fps. VHAP has expr,
rotation, neck_pose, jaw_pose, eyes_pose; EMOCA and DECA have exp or expcode, and a pose of six:
root and jaw; EMICA has jawpose; BEAT2 has the poses of a whole body, of which neck, head, jaw and
eyes are taken; some store a file for each frame. Short stretches that were lost are filled.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.errors import ElocuteWarning, HeadError
from elocute.files.array_reading import read_npy, read_npz
from elocute.files.reading import FileKind
from elocute.numerics.resampling import GAP_MAX_S

FRAMES_MAX = 200_000
KEYS = ("shape", "expression", "pose", "translation", "fps")
ALLOWED = f"FLAME parameters (.npz of {', '.join(KEYS)}, or as VHAP and EMOCA have them)"
PARAMETERS_FILE = FileKind(ALLOWED, 2_000_000_000, HeadError)
SHAPE = ("shape", "shapecode", "shape_params", "betas")
EXPRESSION = ("expression", "expr", "exp", "expcode", "expression_params", "expressions")
TRANSLATION = ("translation", "transl", "trans")
RATE = ("fps", "framerate", "mocap_frame_rate", "mocap_framerate")
ASSUMED_FPS, DEVIATIONS_MAX = 30.0, 100.0
TURN_MAX = 2.0
"""A jaw that opens by more radians than this is an error."""
POSES: dict[tuple[str, ...], dict[int, tuple[tuple[int, int], ...]]] = {
    ("pose", "posecode", "poses"): {
        165: ((36, 0), (45, 3), (66, 6), (69, 9), (72, 12)),  # SMPL-X's neck, head, jaw, eyes
        15: ((0, 0), (3, 3), (6, 6), (9, 9), (12, 12)),
        6: ((0, 0), (3, 6)),
        3: ((0, 6),),
    },
    ("rotation", "global_pose", "globalpose", "global_orient", "pose_params"): {3: ((0, 0),)},
    ("neck_pose", "neck"): {3: ((0, 3),)},
    ("jaw_pose", "jawpose", "jaw", "jaw_params"): {3: ((0, 6),)},
    ("eyes_pose", "eyes", "eye_pose"): {6: ((0, 9), (3, 12))},
    ("leye_pose",): {3: ((0, 9),)},
    ("reye_pose",): {3: ((0, 12),)},
}
"""Layouts of a pose by the names and the width of its array: first columns there and in our pose of
15, each of three columns."""
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
    """Whether names of an .npz's arrays are FLAME's parameters."""
    return any(name in EXPRESSION for name in names)


def read_layout(
    path: str | Path, fps: float | None = None
) -> tuple[dict[str, Float64Array], float | None, list[str]]:
    """FLAME's parameters of a file or folder in any layout, frames per second and names left out.

    The path is an .npz, a folder with one for each frame, or one with folders of exp.npy, pose.npy
    and so on. Parameters are shape (identity,), expression (frame, expression), pose (frame, 15)
    and translation (frame, 3). Frames per second are `fps` where the file does not say them. The
    names are those of arrays that FLAME has no use for.

    Raises
    ------
    HeadError
        For a file that is missing, damaged or something else, and frames that are lost for longer
        than `GAP_MAX_S`.

    Warns
    -----
    ElocuteWarning
        For frames that are lost (missing, or NaN) for a moment, and are interpolated.
    """
    path = Path(path)
    paths, places = _frame_paths(path)
    frames = [_stored(each) for each in paths]
    stored: dict[str, NDArray[Any]] = frames[0]
    if len(frames) > 1:
        if any(set(each) != set(stored) for each in frames):
            raise HeadError.about(path, found="frames that hold different arrays", allowed=ALLOWED)
        try:
            stored = {
                n: _spread(np.concatenate([np.atleast_2d(f[n]) for f in frames]), places)
                for n in stored
            }
        except ValueError as error:
            raise HeadError.about(
                path, found="frames of different sizes", allowed=ALLOWED
            ) from error
    return _parts(path, stored, fps)


def _frame_paths(path: Path) -> tuple[list[Path], NDArray[np.int64]]:
    """Files or folders of frames, and where each belongs in the recording."""
    alone = [path], np.zeros(1, np.int64)
    if not path.is_dir():
        return alone
    frames = [each for each in path.iterdir() if each.suffix.lower() == ".npz"]
    frames = frames or [each for each in path.iterdir() if (each / "exp.npy").is_file()]
    if not frames and (path / "exp.npy").is_file():
        return alone
    if not 0 < len(frames) <= FRAMES_MAX:
        raise HeadError.about(path, found=f"{len(frames)} frames", allowed=ALLOWED)

    def numbers(each: Path) -> list[int]:
        return [int(number) for number in re.findall(r"\d{1,9}", each.name)]

    frames.sort(key=lambda each: (numbers(each), each.name))
    return frames, _places(path, frames, [numbers(each) for each in frames])


def _places(path: Path, files: list[Path], numbers: list[list[int]]) -> NDArray[np.int64]:
    """Where frames belong in a recording, by the first number in their names that changes.

    Raises HeadError for two faces of a frame, as EMOCA has them: 000001_000, 000001_001.
    """
    columns = [np.array(each) for each in zip(*numbers, strict=False) if len({*each}) > 1]
    steps = np.diff(columns[0]) if columns else np.ones(len(files) - 1, np.int64)
    if len(steps) and not steps.min():
        at = int(steps.argmin())
        twice = f"{files[at].name} and {files[at + 1].name}, of one frame"
        raise HeadError.about(path, found=twice, allowed="one face in a folder")
    places = np.concatenate([[0], np.cumsum(steps // max(1, steps.min(initial=FRAMES_MAX)))])
    if places[-1] >= FRAMES_MAX:
        raise HeadError.about(path, found=f"frames to {places[-1]}", allowed=ALLOWED)
    return places.astype(np.int64)


def _spread(values: NDArray[Any], places: NDArray[np.int64]) -> NDArray[Any]:
    """(frame, …) with NaN in frames that are missing."""
    if places[-1] + 1 == len(places) or values.ndim != 2 or values.dtype.kind not in "fiu":
        return values
    every = np.full((places[-1] + 1, values.shape[1]), np.nan)
    every[places] = values
    return every


def _fill(path: Path, parts: dict[str, Float64Array], fps: float) -> None:
    """Fill frames that are not finite by straight lines. Raises HeadError where too many are."""
    lost = ~np.all([np.isfinite(values).all(axis=1) for values in parts.values()], axis=0)
    if not lost.any():
        return
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lost, [0]])))
    starts, stops = edges[::2], edges[1::2]
    longest = int((stops - starts).argmax())
    first, last = int(starts[longest]), int(stops[longest]) - 1
    if last - first + 1 > GAP_MAX_S * fps or lost.all():
        raise HeadError.about(
            path,
            found=f"frames {first} to {last} missing or NaN, counted from 0",
            allowed=f"gaps of up to {GAP_MAX_S:g} s at {fps:g} a second",
            remedy="cut the recording there",
        )
    warning = f"{path}: {lost.sum()} frames missing between others, interpolated"
    warnings.warn(warning, ElocuteWarning, stacklevel=2)
    every = np.arange(len(lost))
    for values in parts.values():
        for column in values.T:
            known = np.isfinite(column)
            column[~known] = np.interp(every[~known], every[known], column[known])


def _stored(path: Path) -> dict[str, NDArray[Any]]:
    def read(file: Path) -> NDArray[Any]:
        return read_npy(file, PARAMETERS_FILE)

    if path.is_dir():
        names = {*SHAPE, *EXPRESSION, *TRANSLATION, *(name for each in POSES for name in each)}
        return {n: read(path / f"{n}.npy") for n in sorted(names) if (path / f"{n}.npy").is_file()}
    return read_npz(path, PARAMETERS_FILE)


def _parts(
    path: Path, stored: dict[str, NDArray[Any]], fps: float | None
) -> tuple[dict[str, Float64Array], float | None, list[str]]:
    def one(names: Sequence[str]) -> str | None:
        return next((name for name in names if name in stored), None)

    def rows(name: str) -> Float64Array:
        values = np.atleast_1d(stored[name])
        if values.dtype.kind not in "fiu" or values.ndim > 3 or not values.size:
            raise HeadError.about(path, found=f"no usable {name}", allowed=ALLOWED)
        return np.array(values, np.float64).reshape(-1, values.shape[-1])

    expression = one(EXPRESSION)
    if expression is None:
        raise HeadError.about(path, found="no usable expression", allowed=ALLOWED)
    parts = {"expression": rows(expression)}
    count = len(parts["expression"])
    shape, shift = one(SHAPE), one(TRANSLATION)
    parts["pose"], used = np.zeros((count, 15)), {expression, shape, shift}
    for names, widths in POSES.items():
        name = one(names)
        if name is None:
            continue
        used.add(name)
        columns = rows(name)
        if columns.shape[1] not in widths or len(columns) not in (1, count):
            found = f"{name} of {columns.shape[0]} by {columns.shape[1]}"
            raise HeadError.about(path, found=f"no usable {found}", allowed=ALLOWED)
        for start, place in widths[columns.shape[1]]:
            parts["pose"][:, place : place + 3] = columns[:, start : start + 3]
    parts["translation"] = np.zeros((count, 3)) if shift is None else rows(shift)
    if parts["translation"].shape not in ((count, 3), (1, 3)):
        raise HeadError.about(path, found="parts that do not fit each other", allowed=ALLOWED)
    parts["translation"] = np.broadcast_to(parts["translation"], (count, 3)).copy()
    rate = one(RATE)
    stated = None if rate is None else float(rows(rate).flat[0])
    if stated is not None and not 0 < stated < 1e4:
        raise HeadError.about(path, found="parts that do not fit each other", allowed=ALLOWED)
    _fill(path, parts, fps or stated or ASSUMED_FPS)
    faces = np.zeros((1, 1)) if shape is None else rows(shape)
    faces = faces[np.isfinite(faces).all(axis=1)]
    if not len(faces):
        raise HeadError.about(path, found=f"no usable {shape}: NaN or infinity", allowed=ALLOWED)
    parts["shape"] = faces.mean(axis=0)
    if (high := np.abs(parts["expression"]).max(initial=0)) > DEVIATIONS_MAX:
        allowed = f"standard deviations, to {DEVIATIONS_MAX:g}"
        raise HeadError.about(path, found=f"an expression of {high:.3g}", allowed=allowed)
    with np.errstate(over="ignore"):
        turn = np.linalg.norm(parts["pose"][:, 6:9], axis=1).max()
    if turn > TURN_MAX:
        found = f"a jaw that turns by {turn:.3g}"
        raise HeadError.about(path, found=found, allowed=f"radians, to {TURN_MAX:g}")
    return parts, stated, [n for n in stored if n not in {*used, *ASIDE, *RATE}]
