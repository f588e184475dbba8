"""Faces from scans: registered, tracked and written as a corpus. Videos and learned shapes lie in
`capture.video` and `capture.blendshapes`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy import lazy

if TYPE_CHECKING:
    from elocute.capture.registration.register import (
        Registration,
        register_neutral,
        register_nonrigid,
        register_scan,
    )
    from elocute.capture.registration.template import Template
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
        SequenceFacts,
        find_sequences,
        open_sequence,
    )
    from elocute.capture.scans_to_corpus import capture_scans
    from elocute.capture.sequence_result import SequenceResult
    from elocute.capture.settings import BatchSettings, Scanner
    from elocute.capture.simulation.scan_simulator import simulate_scans

__all__ = [
    "BatchSettings",
    "Landmarks",
    "Registration",
    "Scan",
    "ScanSequence",
    "Scanner",
    "SequenceFacts",
    "SequenceResult",
    "Template",
    "capture_scans",
    "check_scans",
    "find_sequences",
    "no_landmarks",
    "open_sequence",
    "read_landmarks",
    "read_scan",
    "register_neutral",
    "register_nonrigid",
    "register_scan",
    "simulate_scans",
    "write_landmarks",
    "write_scan",
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
        "scans.landmarks": ("Landmarks", "no_landmarks", "read_landmarks", "write_landmarks"),
        "scans.scan": ("Scan",),
        "scans.scan_checks": ("check_scans",),
        "scans.scan_file": ("read_scan", "write_scan"),
        "scans.scan_sequence": ("ScanSequence", "SequenceFacts", "find_sequences", "open_sequence"),
        "scans_to_corpus": ("capture_scans",),
        "sequence_result": ("SequenceResult",),
        "settings": ("BatchSettings", "Scanner"),
        "simulation.scan_simulator": ("simulate_scans",),
    },
)
