"""The 68 landmarks from MediaPipe's 478 points: a detector for pictures of scans."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from elocute.capture.scans.landmark_detection import Detector
from elocute.capture.video.face_detector import mediapipe_detector
from elocute.capture.video.face_mesh_points import builtin_face_points
from elocute.capture.video.face_mesh_topology import IRIS
from elocute.head.builtin import load_builtin_head

Floats = NDArray[np.float64]
NEIGHBOURS = 6
DOUBT_M = 0.008
"""From its nearest point to a landmark: at this distance confidence has fallen to 0.37."""

BROWS = range(17, 27)
BROW_SHARE = 0.3  # measured 11 mm off on scans whose brows have no hair; told, but not used


@contextlib.contextmanager
def mediapipe_landmarks() -> Iterator[Detector]:
    """A detector of 68 landmarks in single pictures, for `detect_landmarks`.

    Raises MachineError where the extra `video` is missing.
    """
    shares, confidence = _shares()
    with mediapipe_detector(still=True) as see:

        def detect(picture: NDArray[np.uint8]) -> tuple[Floats, Floats] | None:
            faces = see(picture)
            if not len(faces):
                return None
            return shares @ faces.points[0, :, :2].astype(np.float64), confidence.copy()

        yield detect


@cache
def _shares() -> tuple[Floats, Floats]:
    """(68, 478) shares of points in each landmark, summing to one, and confidence (68,).

    On the built-in head both are known; the shares reproduce a landmark's place there from its
    nearest points, preferring the nearer ones.
    """
    head = load_builtin_head()
    points = builtin_face_points().on(head.template)[:IRIS]
    marks = head.template[head.landmarks].astype(np.float64)
    shares, confidence = np.zeros((len(marks), IRIS + 10)), np.zeros(len(marks))
    for row, mark in enumerate(marks):
        away = np.linalg.norm(points - mark, axis=1)
        near = np.argsort(away)[:NEIGHBOURS]
        cost = np.square(away[near]) + 1e-8
        # Least Σ cost·share² with Σ share = 1 and Σ share·point = mark, as seen from the front.
        rules = np.vstack([np.ones(NEIGHBOURS), 1000 * (points[near, :2] - mark[:2]).T])
        across = (rules / cost) @ rules.T + 1e-6 * np.eye(3)
        shares[row, near] = (rules / cost).T @ np.linalg.solve(across, [1.0, 0.0, 0.0])
        shares[row] /= shares[row].sum()
        confidence[row] = np.exp(-away[near[0]] / DOUBT_M)
    confidence[list(BROWS)] *= BROW_SHARE
    return shares, confidence
