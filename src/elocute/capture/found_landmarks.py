"""Landmarks of a scan that comes with none: however it lies, and whatever its colours are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from elocute.array_types import Float64Array
from elocute.capture.scans.landmark_detection import LandmarkDetector, detect_landmarks
from elocute.errors import CaptureError
from elocute.head.model import HeadModel
from elocute.numerics.quaternions import to_matrices
from elocute.registration.landmarks import Landmarks, no_landmarks
from elocute.registration.register import locate_head
from elocute.registration.scan import Scan, checked_scan


def find_landmarks(head: HeadModel, scan: Scan, detector: LandmarkDetector) -> Landmarks:
    """The 68 landmarks of a scan, as a detector sees them in pictures of it.

    The scan is pictured as it stands; then without its colours, which may be wrong or blurred; then
    turned to where the search for a face sees it from the front.

    Parameters
    ----------
    head
        Whose face is searched for.
    scan
        In metres.
    detector
        Takes a picture, gives 68 points and their confidence, or None.

    Returns
    -------
    The landmarks of the first pictures that show enough of them, in the scan's frame; else the
    most that were seen: ask `enough`.

    Raises
    ------
    CaptureError
        For a scan that cannot be used, and a detector that gives anything else.
    """
    best = no_landmarks()
    scan, _ = checked_scan(scan)
    for rotation in _rotations(head, scan):
        turned = replace(scan, points=scan.points @ rotation)
        for pictured in _with_and_without_colours(turned):
            found = detect_landmarks(pictured, detector)
            if found.good.sum() > best.good.sum():
                best = Landmarks(found.points @ rotation.T, found.confidence)
            if best.enough:
                return best
    return best


def _with_and_without_colours(scan: Scan) -> Iterator[Scan]:
    yield scan
    if scan.colors is not None:
        yield replace(scan, colors=None)


def _rotations(head: HeadModel, scan: Scan) -> Iterator[Float64Array]:
    """(3, 3) as the scan stands; then the head's own, where a head is found."""
    yield np.eye(3)
    try:
        pose = locate_head(head, scan)
    except CaptureError:
        return
    yield np.asarray(to_matrices(pose.turns[:1])[0], np.float64)
