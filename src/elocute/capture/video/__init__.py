"""From a video of somebody talking to Motion of the built-in head.

`video_to_motion` holds the whole path in one call; a video goes through these in turn:

video_frames          pictures and their times from a video file
face_detector         a picture to the 478 points of each face: MediaPipe's, or any callable
face_tracking         one face over time, on a constant clock, gaps bridged and flagged
face_mesh_points      where the 478 points lie on the built-in head, and how far to trust each
camera_fit            pinhole camera, head poses and the linear equations of projected points
person_fit            whose face: identity, camera, and the template refined to what is seen
frame_fit             every frame: pose, ARKit weights and gaze by least squares
lip_and_lid_contact   rows for the gaps of lips and lids; what is tracked as closed is closed
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.capture.video.face_detector import (
        DetectedFaces as DetectedFaces,
        mediapipe_detector as mediapipe_detector,
    )
    from elocute.capture.video.video_to_motion import (
        VideoCapture as VideoCapture,
        capture_video as capture_video,
    )

__getattr__, __dir__ = lazy(__name__, __file__)
