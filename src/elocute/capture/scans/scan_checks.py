"""Finds faults of scans before hours are spent on them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from elocute.audio.read import read_audio
from elocute.capture.scans.scan_sequence import ScanSequence, find_sequences, open_sequence
from elocute.corpus.corpus_checks import Finding
from elocute.errors import AudioError, CaptureError, ElocuteError
from elocute.registration.scan import checked_scan

LENGTH_APART_S = 0.25


def check_scans(
    folder: str | Path,
    *,
    fps: float | None = None,
    unit: str | None = None,
    every: int = 1,
    progress: Callable[[float], None] | None = None,
) -> list[Finding]:
    """Look at scans of all sequences in a folder.

    Parameters
    ----------
    folder
        Of scans, or of such folders.
    fps, unit
        Override what capture.json says.
    every
        Only every so many scans.
    progress
        Called with the share of the work that is done, 0 to 1.

    Returns
    -------
    Errors for scans and landmarks that cannot be used, warnings for what will be interpolated or
    left out.

    Raises
    ------
    CaptureError
        For a folder without scans.
    """
    findings: list[Finding] = []
    folders = find_sequences(folder)
    for place, inner in enumerate(folders):
        try:
            sequence = open_sequence(inner, fps=fps, unit=unit)
        except CaptureError as error:
            findings.append(Finding("error", inner.name, str(error)))
            continue
        findings += _of_sequence(sequence)
        chosen = sequence.numbers[::every]
        notes: Counter[str] = Counter()
        for done, number in enumerate(chosen, 1):
            findings += _of_scan(sequence, number, notes)
            if progress:
                progress((place + done / len(chosen)) / len(folders))
        for note, count in notes.items():
            message = f"{note}: in {count} of {len(chosen)} scans, left out"
            findings.append(Finding("warning", sequence.name, message))
    return findings


def _of_sequence(sequence: ScanSequence) -> Iterator[Finding]:
    if sequence.missing:
        first = ", ".join(map(str, sequence.missing[:5]))
        more = " …" if len(sequence.missing) > 5 else ""
        message = f"{len(sequence.missing)} missing numbers ({first}{more}): will be interpolated"
        yield Finding("warning", sequence.name, message)
    if sequence.sound_path is None:
        yield Finding("warning", sequence.name, "no sound: will not be in the corpus")
        return
    try:
        heard = read_audio(sequence.sound_path).duration_s
    except AudioError as error:
        yield Finding("error", sequence.name, str(error))
        return
    seen = sequence.frame_count / sequence.metadata.fps
    if abs(heard - seen) > LENGTH_APART_S:
        yield Finding("warning", sequence.name, f"{seen:.2f} s of scans, {heard:.2f} s of sound")


def _of_scan(sequence: ScanSequence, number: int, notes: Counter[str]) -> Iterator[Finding]:
    try:
        _, removed = checked_scan(sequence.scan(number))
    except ElocuteError as error:
        yield Finding("error", sequence.name, str(error), number)
        return
    notes.update(re.sub(r"^\d+ ", "", note) for note in removed)
    try:
        sequence.landmarks(number)
    except ElocuteError as error:
        yield Finding("error", sequence.name, str(error), number)
