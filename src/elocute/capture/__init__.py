"""Capture: scans or video of a person in, motion of one topology out.

Scans, in the order in which a recording goes through them:

scans               files of scans and landmarks; a landmark detector for scans without them
registration        the head's topology laid onto one scan
sequence_tracking   frame after frame, each from the one before
registered_frames   those frames on disk, so that an interrupted sequence resumes
motion_cleaning     neck, ears and eyes of the registered motion
sequence_report     an HTML page per sequence: errors, worst frames, flagged frames
scans_to_corpus     all of it in one call: folders of scans to a corpus
settings            of `scans_to_corpus` and of the simulated scanner
simulation          scans taken in software, whose truth is known

Video:

video               one face in a video to a Motion of the built-in head (`capture_video`)
video_to_corpus     videos to a corpus

Either way to shapes: `blendshapes` learns a basis of speech from a corpus.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.capture.registration.register import (
        Registration,
        register_neutral,
        register_nonrigid,
        register_scan,
    )
    from elocute.capture.registration.template import Template
    from elocute.capture.scans.landmark_detection import mediapipe_landmarks
    from elocute.capture.scans.landmarks import (
        Landmarks,
        no_landmarks,
        read_landmarks,
        write_landmarks,
    )
    from elocute.capture.scans.scan import Scan
    from elocute.capture.scans.scan_checks import check_scans
    from elocute.capture.scans.scan_file import read_scan, write_scan
    from elocute.capture.scans.scan_sequence import (
        ScanSequence,
        SequenceMetadata,
        find_sequences,
        open_sequence,
    )
    from elocute.capture.scans_to_corpus import capture_scans
    from elocute.capture.sequence_tracking import SequenceResult
    from elocute.capture.settings import BatchSettings, FaceRichness, Scanner
    from elocute.capture.simulation.rich_faces.rich_face import (
        RichFace,
        RichTake,
        take_from_sound,
    )
    from elocute.capture.simulation.scan_simulator import simulate_scans
    from elocute.capture.video_to_corpus import write_video_corpus

__all__ = [
    "BatchSettings",
    "FaceRichness",
    "Landmarks",
    "Registration",
    "RichFace",
    "RichTake",
    "Scan",
    "ScanSequence",
    "Scanner",
    "SequenceMetadata",
    "SequenceResult",
    "Template",
    "capture_scans",
    "check_scans",
    "find_sequences",
    "mediapipe_landmarks",
    "no_landmarks",
    "open_sequence",
    "read_landmarks",
    "read_scan",
    "register_neutral",
    "register_nonrigid",
    "register_scan",
    "simulate_scans",
    "take_from_sound",
    "write_landmarks",
    "write_scan",
    "write_video_corpus",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "registration.register": (
            "Registration",
            "register_neutral",
            "register_nonrigid",
            "register_scan",
        ),
        "registration.template": ("Template",),
        "scans.landmark_detection": ("mediapipe_landmarks",),
        "scans.landmarks": ("Landmarks", "no_landmarks", "read_landmarks", "write_landmarks"),
        "scans.scan": ("Scan",),
        "scans.scan_checks": ("check_scans",),
        "scans.scan_file": ("read_scan", "write_scan"),
        "scans.scan_sequence": (
            "ScanSequence",
            "SequenceMetadata",
            "find_sequences",
            "open_sequence",
        ),
        "scans_to_corpus": ("capture_scans",),
        "sequence_tracking": ("SequenceResult",),
        "settings": ("BatchSettings", "FaceRichness", "Scanner"),
        "simulation.rich_faces.rich_face": ("RichFace", "RichTake", "take_from_sound"),
        "simulation.scan_simulator": ("simulate_scans",),
        "video_to_corpus": ("write_video_corpus",),
    },
)
