"""From a video of somebody talking to Motion of the built-in head.

video_frames.py          pictures and their times out of a container
face_detector.py         a picture to 478 points: MediaPipe's, or any callable like it
face_tracking.py         one face over time, on a constant clock, gaps bridged and flagged
face_mesh_points.py      where the 478 points lie on the built-in head
camera.py                projection and head pose
person_fit.py            whose face: identity, camera and what is left between model and detector
frame_fit.py             every frame: pose, jaw, ARKit's shapes and gaze; lips that touch are closed
video_to_motion.py       all of it in one call
video_to_corpus.py       videos as clips of a corpus
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy import lazy

if TYPE_CHECKING:
    from elocute.capture.video.face_detector import Faces, mediapipe_detector
    from elocute.capture.video.landmarks_68 import mediapipe_landmarks
    from elocute.capture.video.video_to_corpus import write_corpus
    from elocute.capture.video.video_to_motion import VideoCapture, capture_video

__all__ = [
    "Faces",
    "VideoCapture",
    "capture_video",
    "mediapipe_detector",
    "mediapipe_landmarks",
    "write_corpus",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "face_detector": ("Faces", "mediapipe_detector"),
        "landmarks_68": ("mediapipe_landmarks",),
        "video_to_corpus": ("write_corpus",),
        "video_to_motion": ("VideoCapture", "capture_video"),
    },
)
