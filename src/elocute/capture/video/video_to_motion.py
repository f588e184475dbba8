"""A video of somebody talking as Motion of the built-in head: the whole path in one call."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.capture.video.face_detector import FACES_MAX, FaceDetector, mediapipe_detector
from elocute.capture.video.face_mesh_points import builtin_face_points
from elocute.capture.video.face_tracking import FaceTrack, track_face
from elocute.capture.video.frame_fit import FittedFrames, fit_frames
from elocute.capture.video.person_fit import Person, fit_person
from elocute.head.builtin import load_builtin_head
from elocute.head.looks.people import face_look
from elocute.motion.motion import Motion
from elocute.numerics.monotone_cubic import monotone_cubic
from elocute.numerics.quaternions import from_axis_angle, no_turn, to_axis_angle
from elocute.numerics.resampling import interpolate
from elocute.one_line_repr import one_line

Progress = Callable[[float], None]

OUTLIER = 3.0  # times the median miss
OUTLIER_MIN = 0.06  # eye distances: below it nothing is an outlier
TRACKING = 0.8  # share of the time that finding the face takes
JOINTS = ("neck", "head")
"""These share the rotation of the head evenly."""


@dataclass(frozen=True, eq=False)
class VideoCapture:
    """A captured video.

    Attributes
    ----------
    motion
        The person's face on the built-in head, turned as in the picture; frame f is at f / fps
        seconds after the start of the file, where its sound starts too.
    person
        Whose face it is.
    track
        The points as seen.
    fitted
        How the model lies on them.
    flagged
        (frame,) where no face was found, or points that fit no face: bridged from the frames
        around.
    """

    motion: Motion
    person: Person
    track: FaceTrack
    fitted: FittedFrames
    flagged: NDArray[np.bool_]

    __repr__ = one_line

    @property
    def notes(self) -> tuple[str, ...]:
        """Messages for the user, a line each."""
        strange = int((self.flagged & self.track.seen).sum())
        more = (f"{strange} frames in which the points fit no face: bridged",) if strange else ()
        return (*self.track.notes, *more)

    @property
    def lip_miss(self) -> float:
        """Mean distance of the model's lip points from those seen, in eye distances."""
        return float(self.fitted.lip_miss[~self.flagged].mean())


def capture_video(
    path: str | Path,
    *,
    detector: FaceDetector | None = None,
    face: str | int | None = None,
    fps: float | None = None,
    progress: Progress | None = None,
) -> VideoCapture:
    """Find a face in a video and move the built-in head as it moves.

    Parameters
    ----------
    path
        A video file that FFmpeg reads.
    detector
        Takes a picture, gives the 478 points of each face; None for MediaPipe's (extra `video`).
    face
        Which face, where there are several: "left", "right" or a number from the left.
    fps
        Frames per second of the motion; None for the video's own.
    progress
        Called with the share of the work that is done, 0 to 1.

    Returns
    -------
    The motion with all that it was fitted from.

    Raises
    ------
    CaptureError
        For a file that is no video, no face in it, or several faces where none is chosen.
    MachineError
        Where the extra `video` is missing.
    """

    def tracking(share: float) -> None:
        if progress:
            progress(TRACKING * share)

    if detector is None:
        with mediapipe_detector(faces=FACES_MAX) as mediapipe:
            track = track_face(path, mediapipe, face=face, progress=tracking)
    else:
        track = track_face(path, detector, face=face, progress=tracking)
    captured = fit_track(track, lambda share: tracking(1 + share * (1 / TRACKING - 1)))
    if fps is not None:
        captured = replace(captured, motion=resample_motion(captured.motion, fps))
    return captured


def fit_track(track: FaceTrack, progress: Progress | None = None) -> VideoCapture:
    """Fit the person, then every frame, to a tracked face.

    The motion is at the track's frame rate; frames whose points fit no face are bridged. progress:
    called with the share of the work that is done, 0 to 1.
    """
    table = builtin_face_points()
    person = fit_person(load_builtin_head(), table, track)
    fitted = fit_frames(person, table, track, progress)
    miss = fitted.miss.mean(axis=1)
    usual = float(np.median(miss[track.seen]))
    flagged = ~track.seen | (miss > max(OUTLIER * usual, OUTLIER_MIN))
    if flagged.all():
        flagged[:] = False
    weights = _bridged(fitted.weights, flagged)
    turns = from_axis_angle(_bridged(to_axis_angle(fitted.poses.turns), flagged))
    motion = Motion(
        replace(person.head, look=face_look(person.identity)),
        weights.astype(np.float32),
        track.fps,
        _joint_rotations(person, turns),
    )
    return VideoCapture(motion, person, track, fitted, flagged)


def _joint_rotations(person: Person, turns: Float64Array) -> NDArray[np.float32]:
    """(frame, joint, 4) of the head's turns (frame, 4): half by the neck, half by the head."""
    names = person.head.joint_names
    rotations = no_turn(len(turns), len(names))
    half = from_axis_angle(to_axis_angle(turns) / len(JOINTS))
    for joint in JOINTS:
        rotations[:, names.index(joint)] = half
    return rotations


def _bridged(values: Float64Array, flagged: NDArray[np.bool_]) -> Float64Array:
    """(frame, …) with flagged frames interpolated linearly from their neighbours; ends held."""
    good = np.flatnonzero(~flagged)
    return interpolate(good, values[good], np.arange(len(values)))


def resample_motion(motion: Motion, fps: float) -> Motion:
    """A motion at another frame rate: cubic without overshoot, so closed lips stay closed.

    Its weights are 0 to 1. Raises MotionError for a frame rate that is not allowed.
    """
    other = motion.at_fps(fps)  # turns, and the number of frames
    weights = monotone_cubic(motion.times_s, motion.weights.astype(np.float64), other.times_s)
    return replace(other, weights=np.clip(weights, 0, 1).astype(np.float32))
