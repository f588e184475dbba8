"""Turns folders of scan sequences into a corpus: resumable, in parallel, one bad frame never fatal.

OUTPUT/subjects/NAME.npz               a person's neutral face and joints
OUTPUT/sequences/SUBJECT.SENTENCE/     frames/000000.npz …, frames.json, motion.npy
OUTPUT/corpus/                         all sequences that have sound
OUTPUT/corpus.sha256                   of its manifest: one that somebody changed is not replaced
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.audio.read import read_audio
from elocute.capture.motion_cleaning import clean_frames
from elocute.capture.scans.scan_sequence import ScanSequence, find_sequences, open_sequence
from elocute.capture.sequence_report import write_report
from elocute.capture.sequence_tracking import (
    CHUNK,
    SequenceResult,
    TrackedSequence,
    filled_frames,
    summarise,
    track_frames,
)
from elocute.capture.settings import BatchSettings
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import CorpusWriter, corpus_writer
from elocute.corpus.importers.split_choice import even_split
from elocute.errors import (
    AudioError,
    CaptureError,
    CorpusError,
    ElocuteError,
    InputError,
    OutputError,
)
from elocute.files.array_file import ArrayFile
from elocute.files.array_reading import read_npz
from elocute.files.array_writing import RowWriter
from elocute.files.atomic import moved_aside, write_atomically
from elocute.files.reading import ANY_BYTES, FileKind, file_sha256
from elocute.head.model import HeadModel
from elocute.head.registry import open_head
from elocute.jobs.pool import FailedTask
from elocute.jobs.process_pool import run_local
from elocute.registration.register import register_neutral

CORPUS, MADE = "corpus", "corpus.sha256"
FOLDERS, BEGUN = ("subjects", "sequences"), "capture.begun"
MOTION_FILE = FileKind("registered motion", ANY_BYTES)
FACE_FILE = FileKind("a neutral face", 500_000_000, CaptureError)
NEUTRAL_TRIES = 5
"""First frames of a sequence in which a neutral face is sought where none is named."""

Progress = Callable[[float], None] | None


def capture_scans(
    folder: str | Path,
    output: str | Path,
    settings: BatchSettings | None = None,
    progress: Progress = None,
) -> list[SequenceResult]:
    """Register all sequences in a folder (or the folder itself) and make a corpus of them.

    What was registered before is kept, so an interrupted run goes on. A sequence that fails is
    reported, and the others go on.

    Parameters
    ----------
    folder
        Of scans, or of such folders.
    output
        A folder; see the head of this module for what goes there.
    settings
        Topology, frame rate, unit, processes, smoothing, method.
    progress
        Called with the share of the frames that are done, 0 to 1.

    Returns
    -------
    One result per sequence, by name.

    Raises
    ------
    CaptureError
        For a folder without scans.
    OutputError
        For a place that cannot be written, or that holds something else.
    """
    settings, output = settings or BatchSettings(), Path(output)
    sequences, results = _opened(find_sequences(folder), settings)
    head = open_head(settings.head)
    _check_place(output)
    _check_corpus_place(output)
    _begin(output)
    tracks: list[TrackedSequence] = []
    for subject in dict.fromkeys(sequence.metadata.subject for sequence in sequences):
        of_subject = [one for one in sequences if one.metadata.subject == subject]
        try:
            place = output / "subjects" / f"{subject}.npz"
            own = _own_head(head, of_subject, place, settings.method)
        except OutputError:
            raise
        except ElocuteError as error:
            results += [SequenceResult(one.name, str(error)) for one in of_subject]
            continue
        for sequence in of_subject:
            frames = _make(output / "sequences" / sequence.name / "frames")
            tracks.append(TrackedSequence(sequence, own, frames, settings))
    _check_rates(tracks)
    lost = _track_all(tracks, settings, progress)
    again = "the frames that are done are kept: run it again to go on"
    results += [SequenceResult(name, f"{name}: {why}; {again}") for name, why in lost.items()]
    tracks = [track for track in tracks if track.sequence.name not in lost]
    results += _write_corpus(output, tracks, settings)
    return sorted(results, key=lambda result: result.name)


def _opened(
    folders: list[Path], settings: BatchSettings
) -> tuple[list[ScanSequence], list[SequenceResult]]:
    """The sequences that can be opened, and what is wrong with the others."""
    opened: dict[str, ScanSequence] = {}
    failed = []
    for folder in folders:
        try:
            sequence = open_sequence(folder, fps=settings.fps, unit=settings.unit)
        except ElocuteError as error:
            if len(folders) == 1:
                raise
            failed.append(SequenceResult(folder.name, str(error)))
            continue
        if sequence.name in opened:
            reason = (
                f"{folder}: another sequence {sequence.name}, as {opened[sequence.name].folder}"
            )
            failed.append(SequenceResult(folder.name, reason))
            continue
        opened[sequence.name] = sequence
    return list(opened.values()), failed


def _make(folder: Path) -> Path:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError.about(folder, found=f"cannot be made ({error.strerror})") from error
    return folder


def _own_head(head: HeadModel, sequences: list[ScanSequence], path: Path, method: str) -> HeadModel:
    """The person's neutral face, from the sequence that names a neutral frame, or the first."""
    try:
        stored = read_npz(path, FACE_FILE)
        template, joints = stored["template"], stored["joints"]
        alike = template.shape == head.template.shape and joints.shape == head.joint_positions.shape
        source = next((one for one in sequences if one.name == str(stored["sequence"])), None)
        as_then = source is None or _neutral_digest(source) == str(stored["made_of"])
        if alike and as_then and str(stored["method"]) == method:
            return _personal_head(head, template, joints)
    except (InputError, KeyError):
        pass  # not there yet, or broken: it is made (again)
    named = [one for one in sequences if one.metadata.neutral is not None]
    source = (named or sequences)[0]
    own = _registered_neutral(head, source, method)
    with write_atomically(path) as draft, draft.open("wb") as file:
        np.savez(
            file,
            template=own.template,
            joints=own.joint_positions,
            method=method,
            sequence=source.name,
            made_of=_neutral_digest(source),
        )
    # As another process or a later run reads it.
    return _personal_head(head, own.template, own.joint_positions)


def _neutral_numbers(sequence: ScanSequence) -> tuple[int, ...]:
    """The frame that is named neutral, else the first, any of which may be."""
    if sequence.metadata.neutral is not None:
        return (sequence.neutral,)
    return sequence.numbers[:NEUTRAL_TRIES]


def _neutral_digest(sequence: ScanSequence) -> str:
    """Another one where a neutral face would be sought elsewhere, or in what was edited since."""
    numbers = [number for number in _neutral_numbers(sequence) if number in sequence.numbers]
    return " ".join(f"{number} {sequence.digest(number)}" for number in numbers)


def _registered_neutral(head: HeadModel, sequence: ScanSequence, method: str) -> HeadModel:
    """From the first of its frames that can be used. Raises CaptureError where there is none."""
    problems: list[ElocuteError] = []
    for number in _neutral_numbers(sequence):
        try:
            landmarks = sequence.landmarks(number)
            scan = sequence.scan(number)
            own, registration = register_neutral(head, scan, landmarks, method=method)
            if not registration.lost:
                return own.head
            raise CaptureError.about(
                sequence.file(number),
                found=f"no neutral face: {registration.lost}",
                allowed="a scan of a resting face",
                remedy=f'name one: "neutral" in {sequence.folder}',
            )
        except ElocuteError as problem:
            problems.append(problem)
    raise CaptureError(str(problems[0])) from problems[0]


def _personal_head(
    head: HeadModel, template: NDArray[np.float32], joints: NDArray[np.float32]
) -> HeadModel:
    """The head with somebody's neutral face (vertex, 3) m and joints (joint, 3) m."""
    return replace(
        head,
        template=template,
        joint_positions=joints,
        identity_basis=head.identity_basis[:0],
        joint_identity_basis=head.joint_identity_basis[:0],
        tone_basis=head.tone_basis[:0],
        trait_basis=head.trait_basis[:0],
    )


@dataclass(frozen=True, eq=False)
class _Chunk:
    """Frames for one worker; heads are large, so only what a person has of their own is sent."""

    sequence: str
    folder: str
    settings: BatchSettings
    template: NDArray[np.float32]
    joints: NDArray[np.float32]
    frames: str
    numbers: tuple[int, ...]


def _track_all(
    tracks: list[TrackedSequence], settings: BatchSettings, progress: Progress
) -> dict[str, str]:
    """Register every frame that is not done yet, in chunks, on as many processes as asked for.

    Returns sequences of which a chunk failed, and why: its worker was killed again and again.
    """
    chunks = [
        (track, track.numbers[start : start + CHUNK])
        for track in tracks
        for start in range(0, len(track.numbers), CHUNK)
    ]
    total, done = sum(len(numbers) for _, numbers in chunks), 0

    def count(frames: int) -> None:
        nonlocal done
        done += frames
        if progress:
            progress(done / max(total, 1))

    jobs = settings.jobs or os.cpu_count() or 1
    if jobs == 1:
        for track, numbers in chunks:
            track_frames(track, numbers, lambda _: count(1))
        return {}
    tasks = (
        _Chunk(
            track.sequence.name,
            str(track.sequence.folder),
            settings,
            track.head.template,
            track.head.joint_positions,
            str(track.folder),
            numbers,
        )
        for track, numbers in chunks
    )
    lost: dict[str, str] = {}
    for chunk, outcome in run_local(_track_chunk, tasks, min(jobs, len(chunks))):
        if isinstance(outcome, FailedTask):
            lost[chunk.sequence] = outcome.reason
        count(len(chunk.numbers))
    return lost


def _track_chunk(chunk: _Chunk) -> int:
    """In a worker. Frames that another worker made before it was killed are kept."""
    settings = chunk.settings
    sequence = open_sequence(chunk.folder, fps=settings.fps, unit=settings.unit)
    head = _personal_head(open_head(settings.head), chunk.template, chunk.joints)
    track_frames(TrackedSequence(sequence, head, Path(chunk.frames), settings), chunk.numbers)
    return len(chunk.numbers)


def _check_rates(tracks: list[TrackedSequence]) -> None:
    """Raises CaptureError for sequences of different frame rates."""
    rates = {track.sequence.metadata.fps for track in tracks}
    if len(rates) > 1:
        raise CaptureError(
            f"sequences: found {sorted(rates)} frames per second; allowed: one rate in a corpus"
        )


def _finished(track: TrackedSequence, settings: BatchSettings) -> SequenceResult:
    """Interpolate, clean and write the motion of a sequence, with frames.json and its report."""
    records = track.records()
    place = track.folder.parent
    with write_atomically(place / "frames.json") as draft:
        rows = [asdict(record) for record in records.values()]
        draft.write_text(json.dumps(rows, indent=0) + "\n", encoding="utf-8")
    result = summarise(track, records)
    if not result.failed:
        good = [number for number, record in records.items() if not record.flag]
        fps, shape = track.sequence.metadata.fps, (track.head.vertex_count, 3)
        with (
            write_atomically(place / "motion.npy") as draft,
            RowWriter(draft, shape) as rows,
        ):
            # On disk from the start: an hour of frames need not fit in memory.
            for frame in clean_frames(
                track.head, lambda: filled_frames(track, good), fps, eyes_s=settings.eyes_ms / 1000
            ):
                rows.add(frame[None])
    write_report(track, result, place / "report.html")
    return result


def _check_place(output: Path) -> None:
    """Raises OutputError for a folder with something of somebody else where we would write."""
    if output.exists() and not output.is_dir():
        raise OutputError.about(output, found="a file", allowed="a folder")
    if (output / BEGUN).is_file() or (output / MADE).is_file():
        return
    for path in (output / name for name in (*FOLDERS, CORPUS) if os.path.lexists(output / name)):
        raise OutputError.about(
            path,
            found=f"nothing of Elocute made it: there is no {BEGUN} beside it",
            allowed="a new folder, or one that an earlier run filled",
            remedy="choose another folder",
        )


def _begin(output: Path) -> None:
    """The folders that are filled, and the mark by which the next run knows them."""
    _make(output)
    with write_atomically(output / BEGUN) as draft:
        draft.write_text("elocute capture scans fills this folder\n", encoding="utf-8")
    for name in FOLDERS:
        _make(output / name)


def _check_corpus_place(output: Path) -> None:
    """Raises OutputError where a corpus is that was not made here, or was changed since."""
    manifest, place = output / CORPUS / "corpus.json", output / MADE
    if not os.path.lexists(output / CORPUS):
        return
    digest = place.read_text(encoding="utf-8", errors="replace") if place.is_file() else ""
    if not manifest.is_file() or digest.strip() != file_sha256(manifest, CorpusError):
        raise OutputError.about(
            output / CORPUS,
            found="a folder that capture did not make, or that was changed since",
            remedy="move it away, or choose another output folder",
        )


def _write_corpus(
    output: Path, tracks: list[TrackedSequence], settings: BatchSettings
) -> list[SequenceResult]:
    """Finish all sequences; those with sound become one corpus, which replaces an older one."""
    results = [_finished(track, settings) for track in tracks]
    spoken: list[tuple[int, Path]] = []
    for place, track in enumerate(tracks):
        sound = track.sequence.sound_path
        if sound is not None and not results[place].failed:
            spoken.append((place, sound))
    if not spoken:
        return results
    heads = {tracks[place].sequence.metadata.subject: tracks[place].head for place, _ in spoken}
    head = tracks[0].head
    folder = output / CORPUS
    before = moved_aside(folder) if folder.exists() else nullcontext()
    with (
        before,
        corpus_writer(
            folder,
            {subject: own.template for subject, own in heads.items()},
            fps=tracks[0].sequence.metadata.fps,
            faces=head.triangles,
            topology=head.name,
            note=_note(settings),
        ) as writer,
    ):
        for place, sound in spoken:
            results[place] = _add(writer, tracks[place], results[place], sound)
        if writer.entries:
            writer.splits["default"] = even_split(writer.entries, [])
    with write_atomically(output / MADE) as draft:
        draft.write_text(file_sha256(folder / "corpus.json", CorpusError) + "\n", encoding="utf-8")
    return results


def _note(settings: BatchSettings) -> str:
    note = "registered from scans by elocute capture"
    if settings.method == "nicp":
        note += f", non-rigid ICP from the {'adaptive' if settings.adapted else 'fixed'} template"
    return note


def _add(
    writer: CorpusWriter, track: TrackedSequence, result: SequenceResult, sound: Path
) -> SequenceResult:
    """One clip, whose frames are read from the disk as they are written."""
    metadata = track.sequence.metadata
    try:
        waveform = read_audio(sound)
    except AudioError as error:
        return replace(result, failed=str(error))
    frames = ArrayFile(track.folder.parent / "motion.npy", MOTION_FILE)
    writer.add(Clip(metadata.subject, metadata.sentence, metadata.text, waveform, frames))
    return replace(result, in_corpus=True)
