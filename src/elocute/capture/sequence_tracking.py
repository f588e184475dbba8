"""Frames of a sequence, one after another: bad ones are flagged, never fatal."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elocute.capture.frame_store import (
    FrameRecord,
    read_frame_record,
    read_registration,
    write_frame,
)
from elocute.capture.registration.register import Registration, register_scan
from elocute.capture.registration.template import Template
from elocute.capture.scans.landmarks import GOOD_MIN, Landmarks, no_landmarks, read_landmarks
from elocute.capture.scans.scan_file import unit_m
from elocute.capture.scans.scan_sequence import ScanSequence
from elocute.errors import CaptureError, ElocuteError
from elocute.head.model import HeadModel

SETTINGS_VERSION = 3
"""To be raised where registration itself changes: frames made before are then made again."""


@dataclass(frozen=True, eq=False)
class Track:
    """A sequence and where its registered frames go.

    head    its template is the person's neutral face
    folder  of 00000.npz, …, one for each scan
    """

    sequence: ScanSequence
    head: HeadModel
    folder: Path

    @property
    def key(self) -> str:
        """Frames of another face or of older settings are not resumed."""
        text = f"{SETTINGS_VERSION} {self.sequence.facts.unit} ".encode()
        return hashlib.sha256(text + self.head.template.tobytes()).hexdigest()[:16]

    def path(self, number: int) -> Path:
        return self.folder / f"{number:06d}.npz"

    def records(self) -> dict[int, FrameRecord]:
        """Number to record of the frames that are done."""
        key = self.key
        found = {number: read_frame_record(self.path(number), key) for number in self.numbers}
        return {number: record for number, record in found.items() if record is not None}

    @property
    def numbers(self) -> tuple[int, ...]:
        return self.sequence.numbers


def track_frames(
    track: Track, numbers: Sequence[int], done: Callable[[FrameRecord], None] | None = None
) -> list[FrameRecord]:
    """Register frames in their order, each from the one before; those done already are kept."""
    template, key = Template(track.head), track.key
    before: Registration | None = None
    records = []
    for number in numbers:
        record = read_frame_record(track.path(number), key)
        if record is None:
            record = _track_one(track, template, key, number, before)
        # As a later run would find it: a run that was interrupted comes to the very same.
        before = read_registration(track.path(number), record)
        records.append(record)
        if done:
            done(record)
    return records


def _track_one(
    track: Track, template: Template, key: str, number: int, before: Registration | None
) -> FrameRecord:
    landmarks = no_landmarks()
    try:
        landmarks = frame_landmarks(track.sequence, number)
        found = register_scan(template, track.sequence.scan(number), landmarks, before)
        flag = found.lost
    except (
        ElocuteError,
        MemoryError,
        np.linalg.LinAlgError,
        RuntimeError,
        ArithmeticError,
    ) as error:
        # RuntimeError: a sparse system that SuperLU finds singular.
        found, flag = None, str(error) or type(error).__name__
    record = FrameRecord(number, flag, landmarks=int(landmarks.good.sum()))
    if found is not None:
        record = FrameRecord(
            number,
            flag,
            found.surface,
            found.landmark_mm,
            record.landmarks,
            found.seconds,
            found.notes,
        )
    write_frame(track.path(number), key, record, found)
    return record


def frame_landmarks(sequence: ScanSequence, number: int) -> Landmarks:
    """The landmarks of a frame; none where there is no file of them.

    Raises CaptureError for a file that cannot be read and for one with too few good points: such
    a scan is flagged and its frame interpolated, never silently used.
    """
    path = sequence.landmark_file(number)
    if path is None:
        return no_landmarks()
    landmarks = read_landmarks(path, unit_m(sequence.facts.unit))
    if not landmarks.enough:
        raise CaptureError.about(
            path, found=f"{int(landmarks.good.sum())} good landmarks", allowed=f"{GOOD_MIN} or more"
        )
    return landmarks
