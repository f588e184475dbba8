"""Capture: scans or video of a person in, motion of one topology out.

Scans, in the order in which a recording goes through them:

scans               files of scans and landmarks; a landmark detector for scans without them
registration        the head's topology laid onto one scan
sequence_tracking   frame after frame, each from the one before, on disk to be resumed
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
    from elocute.capture.scans.landmark_detection import mediapipe_landmarks as mediapipe_landmarks
    from elocute.capture.scans.scan_checks import check_scans as check_scans
    from elocute.capture.scans.scan_sequence import (
        ScanSequence as ScanSequence,
        SequenceMetadata as SequenceMetadata,
        find_sequences as find_sequences,
        open_sequence as open_sequence,
    )
    from elocute.capture.scans_to_corpus import capture_scans as capture_scans
    from elocute.capture.sequence_tracking import SequenceResult as SequenceResult
    from elocute.capture.settings import BatchSettings as BatchSettings, Scanner as Scanner
    from elocute.capture.simulation.scan_simulator import simulate_scans as simulate_scans
    from elocute.capture.video_to_corpus import write_video_corpus as write_video_corpus
    from elocute.registration.landmarks import (
        Landmarks as Landmarks,
        no_landmarks as no_landmarks,
        read_landmarks as read_landmarks,
        write_landmarks as write_landmarks,
    )
    from elocute.registration.register import (
        Registration as Registration,
        register_neutral as register_neutral,
        register_nonrigid as register_nonrigid,
        register_scan as register_scan,
    )
    from elocute.registration.scan import Scan as Scan
    from elocute.registration.scan_file import read_scan as read_scan, write_scan as write_scan
    from elocute.registration.template import Template as Template

__getattr__, __dir__ = lazy(__name__, __file__)
