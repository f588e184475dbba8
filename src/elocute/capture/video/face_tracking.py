"""Follows one face through a video, on a constant clock; gaps are bridged and flagged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.capture.video.face_detector import FaceDetector
from elocute.capture.video.video_frames import Video
from elocute.errors import CaptureError
from elocute.head.mediapipe_face_mesh import EYE_CORNERS, GAP_PAIRS, POINT_COUNT
from elocute.one_line_repr import one_line

SIDES = ("left", "right")
NEAR = 0.8  # share of its size that a face moves between two pictures at most
PRESENT = 0.25  # share of the pictures in which somebody must be seen to count
SMALL = 0.4  # a face this much smaller than the largest is somebody in the background
CONFIDENT = 0.3  # a face found with less is not used
SEEN_MIN = 0.3  # share of the pictures with a face below which nothing is fitted
STALL_S = 0.25  # a gap between pictures too long to bridge a talking face
FPS_RANGE = (5.0, 240.0)
RATES = (23.976, 24, 25, 29.97, 30, 48, 50, 59.94, 60, 90, 100, 119.88, 120, 240)


@dataclass(frozen=True, eq=False)
class FaceTrack:
    """478 points of one face on a constant clock.

    Attributes
    ----------
    points : (frame, 478, 3)
        Pixels, as detectors give them; frame f is at f / fps seconds.
    seen : (frame,)
        False where no face was found: points are bridged from the frames around.
    size : (int, int)
        Width and height of the pictures, pixels.
    notes
        Messages for the user, a line each.

    Raises
    ------
    CaptureError
        For other shapes, no frame, and points that are not finite.
    """

    points: Float64Array
    seen: NDArray[np.bool_]
    fps: float
    size: tuple[int, int]
    has_sound: bool = True
    notes: tuple[str, ...] = ()

    __repr__ = one_line

    def __post_init__(self) -> None:
        shape = self.points.shape
        if shape[1:] != (POINT_COUNT, 3) or self.seen.shape != shape[:1] or not shape[0]:
            raise CaptureError(
                f"face track: found points {shape}, seen {self.seen.shape}; "
                f"allowed: (frames, {POINT_COUNT}, 3) and (frames,), one frame or more"
            )
        if not np.isfinite(self.points).all():
            raise CaptureError("face track: found NaN or infinity; allowed: _bridged points")

    @property
    def frame_count(self) -> int:
        return len(self.points)

    @property
    def eye_distance_px(self) -> float:
        """Median distance of the outer eye corners over the frames, in 3D: a turned head's too."""
        right, left = (self.points[:, corner] for corner in EYE_CORNERS)
        return float(np.median(np.linalg.norm(right - left, axis=1)))

    @property
    def lip_gap(self) -> Float64Array:
        """(frame,) distance of the inner lips, mean of the middle pairs, in eye distances."""
        right, left = (self.points[:, corner] for corner in EYE_CORNERS)
        pairs = np.array(GAP_PAIRS)
        apart = np.linalg.norm(self.points[:, pairs[:, 0]] - self.points[:, pairs[:, 1]], axis=2)
        return apart.mean(axis=1) / np.linalg.norm(right - left, axis=1)


@dataclass(eq=False)
class _Trajectory:
    """One person through the pictures."""

    numbers: list[int] = field(default_factory=list)
    points: list[NDArray[np.float32]] = field(default_factory=list)

    def apart(self, face: NDArray[np.float32]) -> float:
        """Distance of the centres, in sizes of the face."""
        last = self.points[-1]
        size = max(_size(last), _size(face), 1e-6)
        return float(np.linalg.norm((face - last)[:, :2].mean(axis=0))) / size

    @property
    def middle_x(self) -> float:
        return float(np.median([points[:, 0].mean() for points in self.points]))

    @property
    def size(self) -> float:
        return float(np.median([_size(points) for points in self.points]))


def track_face(
    path: str | Path,
    detect: FaceDetector,
    *,
    face: str | int | None = None,
    fps: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> FaceTrack:
    """Follow one face through a video file.

    face: which, where there are several: "left" or "right" in the picture, or a number, 1 for the
    leftmost. None takes the only one; people far behind do not count. fps: of the track; None for
    the video's own. progress: called with the share of the pictures that are done, 0 to 1. Raises
    CaptureError for a file that is no video, no face, and several faces where none is chosen.
    """
    times: list[float] = []
    trajectories: list[_Trajectory] = []
    size = (0, 0)
    with Video(path) as video:
        for time_s, picture in video.pictures():
            size = (picture.shape[1], picture.shape[0])
            faces = detect(picture)
            _assign_faces(trajectories, len(times), faces.points[faces.confidence >= CONFIDENT])
            times.append(time_s)
            if progress and video.expected_pictures:
                progress(min(1.0, len(times) / video.expected_pictures))
    if not times:
        raise CaptureError.about(path, found="no pictures in it", allowed="a video of a face")
    trajectory = _choose_face(Path(path), trajectories, len(times), face)
    notes = [video.note] if video.note else []
    rate = _rate(times, video.rate) if fps is None else fps
    track = _on_constant_clock(np.array(times), trajectory, size, rate, notes)
    if not video.has_sound:
        notes.append("no sound in it: motion only")
    lost = int((~track.seen).sum())
    if lost:
        notes.append(f"{lost} of {track.frame_count} frames without a face: bridged")
    return replace(track, has_sound=video.has_sound, notes=tuple(notes))


def _size(points: NDArray[np.float32]) -> float:
    return float(np.ptp(points[:, :2], axis=0).max())


def _assign_faces(trajectories: list[_Trajectory], number: int, faces: NDArray[np.float32]) -> None:
    """Give each face of a picture to the nearest trajectory, or to a new one."""
    pairs = sorted(
        (trajectory.apart(one), t, f)
        for t, trajectory in enumerate(trajectories)
        for f, one in enumerate(faces)
    )
    free_trails, free_faces = set(range(len(trajectories))), set(range(len(faces)))
    for apart, t, f in pairs:
        if apart < NEAR and t in free_trails and f in free_faces:
            free_trails.remove(t)
            free_faces.remove(f)
            trajectories[t].numbers.append(number)
            trajectories[t].points.append(faces[f])
    for f in sorted(free_faces):
        trajectories.append(_Trajectory([number], [faces[f]]))


def _choose_face(
    path: Path, trajectories: list[_Trajectory], count: int, face: str | int | None
) -> _Trajectory:
    if not trajectories:
        raise CaptureError.about(
            path,
            found=f"no face in {count} pictures",
            allowed="a face seen from the front",
            remedy="more light, nearer, or less turned away",
        )
    people = [
        trajectory for trajectory in trajectories if len(trajectory.numbers) >= PRESENT * count
    ]
    people = people or [max(trajectories, key=lambda trajectory: len(trajectory.numbers))]
    people.sort(key=lambda trajectory: trajectory.middle_x)
    choice = "left, right" + "".join(f", {n + 1}" for n in range(len(people)))
    if face is None:
        largest = max(trajectory.size for trajectory in people)
        people = [trajectory for trajectory in people if trajectory.size > SMALL * largest]
        if len(people) > 1:
            raise CaptureError.about(
                path,
                found=f"{len(people)} faces",
                allowed=f"`face` {choice} (from the left)",
                remedy="say which",
            )
        chosen = people[0]
    else:
        named = {"left": 1, "right": len(people)}.get(str(face), 0)
        number = named or (int(face) if str(face).isdecimal() else 0)
        if not 1 <= number <= len(people):
            raise CaptureError.about(
                f"`face` {face}", found=f"{len(people)} face(s) in {path.name}", allowed=choice
            )
        chosen = people[number - 1]
    if len(chosen.numbers) < max(2, SEEN_MIN * count):
        raise CaptureError.about(
            path,
            found=f"a face in only {len(chosen.numbers)} of {count} pictures",
            allowed=f"in {SEEN_MIN:.0%} of them at least, in two or more",
        )
    return chosen


def _rate(times: list[float], said: float | None) -> float:
    """Frames per second: the usual step between pictures, as a common frame rate."""
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1 / (said or 25.0)
    rate = 1 / step
    if said and abs(said - rate) < 0.02 * rate:
        return said
    nearest = min(RATES, key=lambda known: abs(known - rate))
    return nearest if abs(nearest - rate) < 0.03 * rate else float(np.clip(rate, *FPS_RANGE))


def _on_constant_clock(
    times: Float64Array,
    trajectory: _Trajectory,
    size: tuple[int, int],
    fps: float,
    notes: list[str],
) -> FaceTrack:
    """Points at times f / fps, linear between pictures; before the first and after the last held.

    A frame counts as seen where the pictures on both sides of it show the face, follow one
    another and lie less than STALL_S apart.
    """
    if not FPS_RANGE[0] <= fps <= FPS_RANGE[1]:
        raise CaptureError.about(
            "fps", found=f"{fps:g}", allowed=f"{FPS_RANGE[0]:g} to {FPS_RANGE[1]:g}"
        )
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1 / fps
    if len(times) > 2 and np.abs(np.diff(times) - step).max() > 0.2 * step:
        notes.append(f"variable frame rate: laid on a constant clock of {fps:g} Hz")
    count = max(1, round((times[-1] + step) * fps))
    clock = np.arange(count) / fps
    known_s, known = times[trajectory.numbers], np.array(trajectory.points, np.float64)
    after = np.clip(np.searchsorted(known_s, clock - 1e-6), 0, len(known) - 1)
    exact = np.abs(known_s[after] - clock) < 1e-3 / fps
    before = np.where(exact, after, np.maximum(after - 1, 0))
    span = known_s[after] - known_s[before]
    share = np.clip((clock - known_s[before]) / np.maximum(span, 1e-9), 0, 1)
    share[before == after] = 0
    points = known[before] + share[:, None, None] * (known[after] - known[before])
    outside = np.maximum(known_s[0] - clock, clock - known_s[-1])
    numbers = np.array(trajectory.numbers)
    seen = (numbers[after] - numbers[before] <= 1) & (span <= STALL_S)
    seen &= outside <= max(step, 1 / fps) * 0.6
    return FaceTrack(points, seen, fps, size)
