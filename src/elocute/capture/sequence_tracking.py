"""Registers a sequence frame by frame: bad frames are flagged and interpolated, never fatal.

Each frame is a file, so that a sequence of thousands can be resumed.
"""

from __future__ import annotations

import hashlib
import json
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.capture.scans.scan_sequence import ScanSequence
from elocute.capture.settings import BatchSettings
from elocute.errors import CaptureError, ElocuteError, InputError
from elocute.files.array_reading import read_npz
from elocute.files.array_writing import write_npz
from elocute.files.json_records import finite_number, parse_json
from elocute.files.reading import FileKind
from elocute.head.model import HeadModel
from elocute.registration.accuracy import SurfaceError
from elocute.registration.landmarks import no_landmarks
from elocute.registration.model_fit import ModelParameters
from elocute.registration.register import (
    Registration,
    register_nonrigid,
    register_scan,
)
from elocute.registration.template import Template
from elocute.registration.zero_pose import HeadPose

VERSION = 1
ALLOWED = "a registered frame (.npz)"
FRAME_FILE = FileKind(ALLOWED, 500_000_000, CaptureError)
ARRAYS = {"zero": 2, "offsets": 2, "identity": 1, "expression": 1, "translation": 1, "turns": 2}
"""Arrays of a good frame, and how many axes each has."""


@dataclass(frozen=True)
class FrameRecord:
    """How the registration of a frame went.

    flag: why the frame is not used, or "" for a good one. surface: distance of the scan from the
    surface. landmark_mm: mean distance from the landmarks, of which so many were good. seconds:
    processor time. notes: what had to be removed from the scan.
    """

    number: int
    flag: str
    surface: SurfaceError | None = None
    landmark_mm: float | None = None
    landmarks: int = 0
    seconds: float = 0.0
    notes: tuple[str, ...] = ()


def write_frame(
    path: Path, key: str, record: FrameRecord, registration: Registration | None
) -> None:
    """One .npz; key says which template and settings it belongs to. Raises OutputError."""
    texts = {"version": VERSION, "key": key, **asdict(record)}
    arrays: dict[str, NDArray[Any]] = {
        "record": np.frombuffer(json.dumps(texts).encode(), np.uint8)
    }
    if registration is not None:
        arrays |= {
            "zero": registration.zero.astype(np.float32),
            "offsets": registration.offsets.astype(np.float32),
            "identity": registration.parameters.identity,
            "expression": registration.parameters.expression,
            "translation": registration.parameters.pose.translation,
            "turns": registration.parameters.pose.turns,
        }
    write_npz(path, arrays)


def read_frame_record(path: Path, key: str) -> FrameRecord | None:
    """The record of a frame; None for no file, a broken one, or one made with another key."""
    try:
        stored = _read(path)
        texts = parse_json(stored["record"].tobytes(), path, allowed=ALLOWED, error=CaptureError)
        if texts.pop("version") != VERSION or texts.pop("key") != key:
            return None
        surface = texts["surface"]
        record = FrameRecord(**texts)
        record = replace(
            record,
            notes=tuple(map(str, record.notes)),
            surface=None if surface is None else SurfaceError(**surface),
        )
        if not _is_sound(record):
            return None
        if not record.flag:
            _good(path, stored)
        return record
    except (InputError, KeyError, TypeError, AttributeError):
        return None


def read_zero(path: Path) -> NDArray[np.float32]:
    """(vertex, 3) m in zero pose, of a frame that was registered. Raises CaptureError."""
    return _good(path, _read(path))["zero"]


def read_pose(path: Path) -> HeadPose:
    """Where the head stood in a frame that was registered. Raises CaptureError."""
    stored = _good(path, _read(path))
    return HeadPose(stored["translation"], stored["turns"])


def read_registration(path: Path, record: FrameRecord) -> Registration | None:
    """A good frame as the start of the next one; None for a flagged one. Raises CaptureError."""
    if record.flag or record.surface is None:
        return None
    stored = _good(path, _read(path))
    parameters = ModelParameters(
        stored["identity"], stored["expression"], HeadPose(stored["translation"], stored["turns"])
    )
    zero, added = stored["zero"].astype(np.float64), stored["offsets"].astype(np.float64)
    # Vertices as posed are not kept: the next frame starts from shape and offsets.
    return Registration(
        zero,
        zero,
        parameters,
        added,
        record.surface,
        record.landmark_mm,
        record.seconds,
        record.notes,
    )


def _read(path: Path) -> dict[str, NDArray[Any]]:
    return read_npz(path, FRAME_FILE)


def _is_sound(record: FrameRecord) -> bool:
    numbers = [record.number, record.landmarks, record.seconds]
    numbers += [] if record.landmark_mm is None else [record.landmark_mm]
    numbers += [] if record.surface is None else list(asdict(record.surface).values())
    return isinstance(record.flag, str) and all(finite_number(n) is not None for n in numbers)


def _good(path: Path, stored: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """The arrays of a good frame, there, finite and of their shapes. Raises CaptureError."""
    for name, axes in ARRAYS.items():
        array = stored.get(name)
        fits = array is not None and array.ndim == axes and array.dtype.kind == "f"
        if not fits or array is None or not np.isfinite(array).all():
            raise CaptureError.about(path, found=f"no {name} that can be used", allowed=ALLOWED)
    zero, offsets = stored["zero"], stored["offsets"]
    if zero.shape != offsets.shape or zero.shape[1:] != (3,) or stored["translation"].shape != (3,):
        raise CaptureError.about(path, found="arrays that do not fit", allowed=ALLOWED)
    return stored


SETTINGS_VERSION = 5
"""Raise it when registration itself changes: frames made before are then made again."""
CHUNK = 30
"""Frames that one worker takes at a time; the first of them starts from scratch."""
FLAGGED_MAX = 0.5
"""Share of frames beyond which a sequence is not worth filling in."""


@dataclass(frozen=True)
class SequenceResult:
    """What became of a sequence.

    Attributes
    ----------
    name
        Subject and sentence.
    failed
        Why there is no motion of it, or "".
    frames
        Of the motion.
    flagged, missing
        Numbers of scans that were not used, and of those that were never there; all of these frames
        are interpolated.
    median_mm, p95_mm
        Distance from scan to surface, median over frames of each frame's own.
    landmark_mm
        Median over frames of the mean landmark distance.
    seconds_per_frame
        Mean processor time.
    in_corpus
        Whether it became a clip.
    """

    name: str
    failed: str = ""
    frames: int = 0
    flagged: tuple[int, ...] = ()
    missing: tuple[int, ...] = ()
    median_mm: float | None = None
    p95_mm: float | None = None
    landmark_mm: float | None = None
    seconds_per_frame: float = 0.0
    in_corpus: bool = False


@dataclass(frozen=True, eq=False)
class TrackedSequence:
    """A sequence and where its registered frames go.

    head: its template is the person's neutral face. folder: of 000000.npz, …, one for each scan.
    """

    sequence: ScanSequence
    head: HeadModel
    folder: Path
    settings: BatchSettings = field(default_factory=BatchSettings)
    _digests: dict[int, str] = field(default_factory=dict)

    @cached_property
    def key(self) -> str:
        """Identifies face and settings."""
        way = "" if self.settings.method == "model" else f"nicp {self.settings.adapted} "
        text = f"{SETTINGS_VERSION} {self.sequence.metadata.unit} {way}".encode()
        return hashlib.sha256(text + self.head.template.tobytes()).hexdigest()[:16]

    def frame_key(self, number: int) -> str:
        """Identifies all that a frame is made of: frames made with another key are not resumed.

        Those before it in its chunk are part of that, since each starts from the one before.
        """
        place = bisect_left(self.numbers, number)
        first = place if self.settings.method == "nicp" else place - place % CHUNK
        for each in self.numbers[first : place + 1]:
            if each not in self._digests:
                self._digests[each] = self.sequence.digest(each)
        text = self.key + "".join(self._digests[each] for each in self.numbers[first : place + 1])
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def path(self, number: int) -> Path:
        return self.folder / f"{number:06d}.npz"

    def records(self) -> dict[int, FrameRecord]:
        """Records by number, of the frames that are done."""
        stored = {n: read_frame_record(self.path(n), self.frame_key(n)) for n in self.numbers}
        return {number: record for number, record in stored.items() if record is not None}

    @property
    def numbers(self) -> tuple[int, ...]:
        return self.sequence.numbers


def track_frames(
    track: TrackedSequence,
    numbers: Sequence[int],
    done: Callable[[FrameRecord], None] | None = None,
) -> list[FrameRecord]:
    """Register frames in their order, each starting from the one before; bad ones are flagged.

    Frames that are done already are kept. Non-rigid ICP starts every frame from a template of its
    own, as published. done: called with the record of each frame.
    """
    template = Template(track.head)
    before: Registration | None = None
    records = []
    for number in numbers:
        key = track.frame_key(number)
        record = read_frame_record(track.path(number), key)
        if record is None:
            record = _track_one(track, template, key, number, before)
        # As a later run would find it: an interrupted run then gives the very same result.
        before = read_registration(track.path(number), record)
        records.append(record)
        if done:
            done(record)
    return records


def _track_one(
    track: TrackedSequence, template: Template, key: str, number: int, before: Registration | None
) -> FrameRecord:
    landmarks = no_landmarks()
    try:
        landmarks = track.sequence.landmarks(number)
        scan = track.sequence.scan(number)
        if track.settings.method == "nicp":
            registration, _ = register_nonrigid(
                template, scan, landmarks, adapted=track.settings.adapted
            )
        else:
            registration = register_scan(template, scan, landmarks, before)
        flag = registration.lost
    except (
        ElocuteError,
        MemoryError,
        np.linalg.LinAlgError,
        RuntimeError,
        ArithmeticError,
    ) as error:
        # RuntimeError: a sparse system that SuperLU finds singular.
        registration, flag = None, str(error) or type(error).__name__
    record = FrameRecord(number, flag, landmarks=int(landmarks.good.sum()))
    if registration is not None:
        record = FrameRecord(
            number,
            flag,
            registration.surface,
            registration.landmark_mm,
            record.landmarks,
            registration.seconds,
            registration.notes,
        )
    write_frame(track.path(number), key, record, registration)
    return record


def summarise(track: TrackedSequence, records: dict[int, FrameRecord]) -> SequenceResult:
    """The result of a sequence; failed where too many frames are flagged or missing."""
    sequence = track.sequence
    flagged = tuple(number for number, record in records.items() if record.flag)
    good = [record for record in records.values() if not record.flag]
    share = 1 - len(good) / sequence.frame_count
    result = SequenceResult(
        sequence.name, frames=sequence.frame_count, flagged=flagged, missing=sequence.missing
    )
    if not good or share > FLAGGED_MAX:
        first = next((record.flag for record in records.values() if record.flag), "missing")
        return replace(result, failed=f"{100 * share:.0f} % of the frames failed, say: {first}")
    surfaces = [record.surface for record in good if record.surface is not None]
    apart = [record.landmark_mm for record in good if record.landmark_mm is not None]
    return replace(
        result,
        median_mm=float(np.median([surface.median for surface in surfaces])),
        p95_mm=float(np.median([surface.p95 for surface in surfaces])),
        landmark_mm=float(np.median(apart)) if apart else None,
        seconds_per_frame=float(np.mean([record.seconds for record in good])),
    )


def filled_frames(track: TrackedSequence, good: list[int]) -> Iterator[NDArray[np.float32]]:
    """Frames (vertex, 3) m in zero pose; where there is no good scan, interpolated.

    Before the first good frame and after the last, that frame is held.
    """
    first = track.numbers[0]
    low = high = read_zero(track.path(good[0]))
    before = after = good[0]
    following = iter(good[1:])
    for number in range(first, first + track.sequence.frame_count):
        if number > after:
            low, before = high, after
            after = next(following, after)
            high = read_zero(track.path(after))
        if before < number < after:
            share = np.float32((number - before) / (after - before))
            yield (low * (1 - share) + high * share).astype(np.float32)
        else:
            yield high
