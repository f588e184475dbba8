"""Cleaning of registered motion in zero pose (VOCA 2019, section 6).

"The neck boundary and the ears are automatically fixed, and the region around the eyes is smoothed
using Gaussian filtering to remove capture noise. Note that no smoothing is applied to the mouth
region so as to preserve subtle motions."
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.head.model import HeadModel
from elocute.numerics.smoothing import smoothstep

EYES_S = 0.02
"""Standard deviation of the smoothing around the eyes: a blink of 150 ms keeps its depth."""
RIM_M, EAR_M, EYE_M = 0.02, 0.008, 0.006
"""Over which distance a fixed or smoothed region fades into what is left alone."""
MOUTH_M = 0.015
"""Around the lips nothing is ever touched."""


def hold_weights(head: HeadModel) -> Float64Array:
    """(vertex,) 1 where a vertex is reset to the neutral face: neck boundary and ears."""
    shares = np.maximum(_faded(head, _rim(head), RIM_M), _faded(head, ear_vertices(head), EAR_M))
    return shares * (1 - _mouth(head))


def smoothing_weights(head: HeadModel) -> Float64Array:
    """(vertex,) 1 where motion is smoothed in time, around the eyes; 0 for a head without."""
    named = [where for name, where in head.regions.items() if name.startswith("eye")]
    if not named:
        return np.zeros(head.vertex_count)
    return _faded(head, np.unique(np.concatenate(named)), EYE_M) * (1 - _mouth(head))


def clean_motion(
    head: HeadModel, frames: NDArray[np.floating], fps: float, *, eyes_s: float = EYES_S
) -> NDArray[np.float32]:
    """(frame, vertex, 3) m with neck and ears fixed and the eyes smoothed (VOCA 2019, section 6).

    head: its template is the person's neutral face. frames: (frame, vertex, 3) m in zero pose;
    vertices around the mouth stay bit for bit as given. eyes_s: standard deviation of the
    smoothing, s; 0 for none.
    """
    registered = np.asarray(frames, np.float32)
    return np.stack(list(clean_frames(head, lambda: iter(registered), fps, eyes_s=eyes_s)))


def clean_frames(
    head: HeadModel,
    frames: Callable[[], Iterator[NDArray[np.float32]]],
    fps: float,
    *,
    eyes_s: float = EYES_S,
) -> Iterator[NDArray[np.float32]]:
    """`clean_motion`, frame by frame (vertex, 3).

    `frames` is called twice, for one pass each, and only what is smoothed is held in memory for all
    frames, so an hour may lie on disk.
    """
    held, smoothed = hold_weights(head), smoothing_weights(head)
    zero_pose, moving = np.flatnonzero(held), np.flatnonzero(smoothed)

    def calmed() -> Iterator[NDArray[np.float32]]:
        for frame in frames():
            result = np.array(frame, np.float32)
            apart = result[zero_pose] - head.template[zero_pose]
            result[zero_pose] -= (held[zero_pose, None] * apart).astype(np.float32)
            yield result

    around = None
    if len(moving) and eyes_s > 0:
        around = np.stack([frame[moving] for frame in calmed()])
        if len(around) > 1:
            change = smoothed[moving, None] * (_blurred(around, eyes_s * fps) - around)
            around = around + change.astype(np.float32)
    for number, frame in enumerate(calmed()):
        if around is not None:
            frame[moving] = around[number]
        yield frame


def _blurred(frames: NDArray[np.float32], width: float) -> NDArray[np.float32]:
    """Gaussian smoothing over frames (frame, vertex, 3); the ends repeat."""
    from scipy.ndimage import gaussian_filter1d

    blurred = gaussian_filter1d(frames, width, axis=0, mode="nearest")
    return np.asarray(blurred, np.float32)


def ear_vertices(head: HeadModel) -> NDArray[np.intp]:
    """Vertices of the ears: a region of that name, else what stands out sideways behind the face.

    Empty for a head without landmarks and without such a region.
    """
    if "ears" in head.regions:
        return head.regions["ears"].astype(np.intp)
    if not len(head.landmarks):
        return np.zeros(0, np.intp)
    points, marks = head.template, head.template[head.landmarks]
    side = np.abs(marks[[0, 16], 0]).mean()
    face = marks[19, 1] - marks[33, 1]  # from brow to the foot of the nose, as long as an ear
    out = np.abs(points[:, 0]) > 0.96 * side
    behind = (points[:, 2] < marks[[0, 16], 2].mean()) & (
        points[:, 2] > marks[[0, 16], 2].mean() - 0.65 * face
    )
    level = (points[:, 1] < marks[36, 1] + 0.1 * face) & (points[:, 1] > marks[33, 1] - 0.25 * face)
    return np.flatnonzero(out & behind & level)


def _rim(head: HeadModel) -> NDArray[np.intp]:
    """Vertices on the open edge at the neck: a region, else low edges with one triangle."""
    if "neck_rim" in head.regions:
        return head.regions["neck_rim"].astype(np.intp)
    triangles = head.triangles.astype(np.int64)
    start, stop = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    keys = np.minimum(start, stop) * head.vertex_count + np.maximum(start, stop)
    once, count = np.unique(keys, return_counts=True)
    once = once[count == 1]
    rim = np.unique(np.concatenate([once // head.vertex_count, once % head.vertex_count]))
    low = head.template[:, 1].min() + 0.35 * np.ptp(head.template[:, 1])
    return rim[head.template[rim, 1] < low]


def _mouth(head: HeadModel) -> Float64Array:
    """(vertex,) 1 near the lips."""
    lips = head.regions.get("lips", np.zeros(0, np.int32))
    return (_faded(head, lips.astype(np.intp), MOUTH_M) > 0).astype(np.float64)


def _faded(head: HeadModel, where: NDArray[np.integer], over_m: float) -> Float64Array:
    """(vertex,) 1 on the chosen vertices, falling smoothly to 0 at a distance."""
    if not len(where):
        return np.zeros(head.vertex_count)
    from scipy.spatial import KDTree

    far, _ = KDTree(head.template[where]).query(head.template, distance_upper_bound=over_m)
    share = np.clip(1 - far / over_m, 0, 1)
    return smoothstep(share)
