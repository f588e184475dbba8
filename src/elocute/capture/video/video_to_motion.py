"""A video of somebody talking as Motion of the built-in head."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.capture.video.face_detector import FACES_MAX, Detector, mediapipe_detector
from elocute.capture.video.face_mesh_points import builtin_face_points
from elocute.capture.video.face_tracking import FaceTrack, track_face
from elocute.capture.video.frame_fit import Fitted, fit_frames
from elocute.capture.video.person_fit import Person, fit_person
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion
from elocute.numerics.monotone_cubic import monotone_cubic
from elocute.numerics.quaternions import from_axis_angle, no_turn, to_axis_angle
from elocute.numerics.resampling import interpolate
from elocute.one_line_repr import one_line

Floats = NDArray[np.float64]
Progress = Callable[[float], None]

STRANGE = 3.0  # times the usual miss
STRANGE_MIN = 0.06  # eye distances: less is never strange
TRACKING = 0.8  # share of the time that finding the face takes
JOINTS = ("neck", "head")
"""The turn of the head is shared by these evenly."""


@dataclass(frozen=True, eq=False)
class VideoCapture:
    """What a video became.

    motion   the person's face on the built-in head, turned as in the picture; frame f is at time
             f / fps after the start of the file, where its sound starts too
    person   whose face it is
    track    the points seen
    fitted   how the model lies on them
    flagged  (frame,) no face there, or one that no face can make: bridged from those around
    """

    motion: Motion
    person: Person
    track: FaceTrack
    fitted: Fitted
    flagged: NDArray[np.bool_]

    __repr__ = one_line

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know, a line each."""
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
    detector: Detector | None = None,
    face: str | int | None = None,
    fps: float | None = None,
    progress: Progress | None = None,
) -> VideoCapture:
    """Find a face in a video and move the built-in head as it moves.

    detector  a picture to the 478 points of each face; None: MediaPipe's (extra `video`)
    face      which face, where there are several: "left", "right" or a number from the left
    fps       frames per second of the motion; None: the video's own

    Raises CaptureError for what is no video, no face and several faces; MachineError where the
    extra is missing.
    """

    def tracking(share: float) -> None:
        if progress:
            progress(TRACKING * share)

    if detector is None:
        with mediapipe_detector(faces=FACES_MAX) as found:
            track = track_face(path, found, face=face, progress=tracking)
    else:
        track = track_face(path, detector, face=face, progress=tracking)
    captured = fit_track(track, lambda share: tracking(1 + share * (1 / TRACKING - 1)))
    if fps is not None:
        captured = replace(captured, motion=resampled(captured.motion, fps))
    return captured


def fit_track(track: FaceTrack, progress: Progress | None = None) -> VideoCapture:
    """From points to motion: whose face, then every frame."""
    table = builtin_face_points()
    person = fit_person(load_builtin_head(), table, track)
    fitted = fit_frames(person, table, track, progress)
    miss = fitted.miss.mean(axis=1)
    usual = float(np.median(miss[track.seen]))
    flagged = ~track.seen | (miss > max(STRANGE * usual, STRANGE_MIN))
    if flagged.all():
        flagged[:] = False
    weights = bridged(fitted.weights, flagged)
    turns = from_axis_angle(bridged(to_axis_angle(fitted.poses.turns), flagged))
    motion = Motion(person.head, weights.astype(np.float32), track.fps, rotations_of(person, turns))
    return VideoCapture(motion, person, track, fitted, flagged)


def rotations_of(person: Person, turns: Floats) -> NDArray[np.float32]:
    """(frame, joint, 4) of the head's turns (frame, 4): half by the neck, half by the head."""
    names = person.head.joint_names
    rotations = no_turn(len(turns), len(names))
    half = from_axis_angle(to_axis_angle(turns) / len(JOINTS))
    for joint in JOINTS:
        rotations[:, names.index(joint)] = half
    return rotations


def bridged(values: Floats, flagged: NDArray[np.bool_]) -> Floats:
    """(frame, …) with flagged frames taken from those around them, linear; ends held."""
    good = np.flatnonzero(~flagged)
    return interpolate(good, values[good], np.arange(len(values)))


def resampled(motion: Motion, fps: float) -> Motion:
    """The same at another frame rate: cubic without overshoot, so closed lips stay closed."""
    other = motion.at_fps(fps)  # turns, and the number of frames
    weights = monotone_cubic(motion.times_s, motion.weights.astype(np.float64), other.times_s)
    return replace(other, weights=np.clip(weights, 0, 1).astype(np.float32))
