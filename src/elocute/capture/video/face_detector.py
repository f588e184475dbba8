"""Face detectors: a picture in, 478 points of each face in it out.

A detector is a plain callable, so anybody can bring their own; `mediapipe_detector` is the one
that comes with the extra `video`.
"""

from __future__ import annotations

import contextlib
import importlib
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import CaptureError, MachineError
from elocute.head.mediapipe_face_mesh import POINT_COUNT
from elocute.one_line_repr import one_line

FACES_MAX = 4
INSTALL = (
    "pip install 'elocute[video]' with Python 3.11 or 3.12 (MediaPipe for newer ones comes without "
    "the face models)"
)


@dataclass(frozen=True, eq=False)
class DetectedFaces:
    """The faces of one picture.

    Attributes
    ----------
    points
        (face, 478, 3) pixels: x to the right, y down, from the picture's upper left corner; depth
        away from the camera in about the same unit, and unreliable.
    confidence
        (face,) 0 to 1.

    Raises
    ------
    CaptureError
        For other shapes.
    """

    points: NDArray[np.float32]
    confidence: NDArray[np.float32]

    __repr__ = one_line

    def __post_init__(self) -> None:
        points = np.asarray(self.points, np.float32)
        confidence = np.asarray(self.confidence, np.float32)
        if points.shape[1:] != (POINT_COUNT, 3) or confidence.shape != (len(points),):
            raise CaptureError.about(
                "face detector",
                found=f"points {points.shape}, confidence {confidence.shape}",
                allowed=f"(faces, {POINT_COUNT}, 3) and (faces,)",
            )
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "confidence", confidence)

    def __len__(self) -> int:
        return len(self.points)


FaceDetector = Callable[[NDArray[np.uint8]], DetectedFaces]
"""(height, width, 3) sRGB to DetectedFaces. Pictures of a video come in their order."""


def no_faces() -> DetectedFaces:
    """The faces of a picture without any."""
    return DetectedFaces(np.zeros((0, POINT_COUNT, 3), np.float32), np.zeros(0, np.float32))


@contextlib.contextmanager
def mediapipe_detector(*, faces: int = 1, still: bool = False) -> Iterator[FaceDetector]:
    """MediaPipe's face mesh with irises. Its models come in its wheel; nothing is downloaded.

    Parameters
    ----------
    faces
        The most faces that are looked for.
    still
        True where pictures are unrelated; otherwise each picture helps with the next.

    Yields
    ------
    A detector. MediaPipe gives no confidence: a face that is found counts as 1.

    Raises
    ------
    MachineError
        Where the extra `video` or a system library is missing.
    """
    solution = _face_mesh()
    with _quiet():
        mesh = solution(
            static_image_mode=still,
            refine_landmarks=True,
            max_num_faces=faces,
            min_detection_confidence=0.5,
            min_tracking_confidence=0.5,
        )
        # Its threads write notes while they start; the first picture waits for them.
        mesh.process(np.zeros((64, 64, 3), np.uint8))
    met = False

    def detect(picture: NDArray[np.uint8]) -> DetectedFaces:
        nonlocal met
        height, width = picture.shape[:2]
        with contextlib.nullcontext() if met else _quiet():  # the first face writes notes too
            meshes = mesh.process(np.ascontiguousarray(picture)).multi_face_landmarks or []
        met = met or bool(meshes)
        if not meshes:
            return no_faces()
        points = [[(p.x, p.y, p.z) for p in face.landmark] for face in meshes]
        # Depth comes in the unit of x.
        scale = np.array([width, height, width], np.float32)
        return DetectedFaces(np.array(points, np.float32) * scale, np.ones(len(points), np.float32))

    try:
        yield detect
    finally:
        mesh.close()


def _face_mesh() -> Any:
    os.environ.setdefault("GLOG_minloglevel", "2")
    try:
        return importlib.import_module("mediapipe.python.solutions.face_mesh").FaceMesh
    except ModuleNotFoundError as error:
        raise MachineError(f"face detector: {error.name} is missing; {INSTALL}") from error
    except ImportError as error:  # OpenCV inside MediaPipe wants libGL, though nothing is shown
        raise MachineError(
            f"face detector: MediaPipe does not load ({' '.join(str(error).split())}); "
            "apt-get install libgl1 libglib2.0-0"
        ) from error


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Silence notes that MediaPipe's C++ code writes to the error stream."""
    saved = os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(nowhere)
