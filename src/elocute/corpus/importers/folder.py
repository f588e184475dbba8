"""The layout of later work on VOCASET and BIWI: one array and one sound file for each sentence.

vertices_npy/SUBJECT_SENTENCE.npy  (frame, vertex, 3) or (frame, 3 · vertex)
wav/SUBJECT_SENTENCE.wav
templates.pkl                      {subject: (vertex, 3)}
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.audio.read import probe_audio, read_audio
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.frame_rates import choose_frame_rate
from elocute.corpus.importers.foreign_arrays import FLOATS_FILE, checked_templates, open_float_array
from elocute.corpus.importers.frame_gaps import check_frames
from elocute.corpus.importers.import_report import Progress, SkippedClips, require_clips
from elocute.corpus.importers.split_choice import VOCASET_SUBJECTS, choose_splits
from elocute.corpus.importers.vocaset import read_texts, sentence_id
from elocute.corpus.length_units import metres_per_unit
from elocute.corpus.topologies import topology_of
from elocute.errors import AudioError, CorpusError
from elocute.files.array_reading import read_npy
from elocute.files.pickles.closed_pickle import read_pickle

ARRAY_FILE = replace(FLOATS_FILE, max_bytes=8_000_000_000)
FOLDERS = ("vertices_npy", "wav")
PROBED = 24
"""Most clips whose lengths are compared to find the frame rate."""


def convert_folder(
    source: Path,
    output: Path,
    *,
    fps: float | None = None,
    texts: Path | None = None,
    leave_out: frozenset[str] = frozenset(),
    units: str | None = None,
    split: str | None = None,
    progress: Progress = None,
) -> list[str]:
    """Convert such a folder into a corpus, as `registry.convert` does; a line for each assumption.

    The arrays do not say their frame rate: without `fps` it follows from the lengths of the sounds
    and the mesh (BIWI has 25; VOCASET 60, or 30 where every second frame was kept). Raises
    InputError for missing, foreign or damaged files and another topology; nothing is written then.
    """
    _check_folders(source)
    path = source / "templates.pkl"
    templates = checked_templates(path, read_pickle(path))
    words = {} if texts is None else read_texts(texts)
    notes, skipped = list[str](), SkippedClips()
    first = next(iter(templates.values()))
    known = topology_of(len(first))
    if known:
        notes.append(f"mesh: {known.title}, by its {known.vertices} vertices")
    scale = metres_per_unit(first, notes, units)
    arrays = sorted((source / "vertices_npy").glob("*.npy"))
    sounds = {p.stem for p in (source / "wav").glob("*.wav")}
    rate = choose_frame_rate(_lengths(source, arrays, sounds), known, fps, notes)
    for name in sorted(sounds - {p.stem for p in arrays}):
        skipped.add("no motion", name)
    scaled = {name: template * np.float32(scale) for name, template in templates.items()}
    topology = known.name if known else ""
    with corpus_writer(output, scaled, fps=rate, topology=topology) as writer:
        numbers: dict[str, str] = {}
        for array, subject, number in _usable(
            arrays, templates, sounds, leave_out, skipped, progress
        ):
            vertices = read_vertices(array, len(templates[subject]))
            text = words.get((subject, number), "")
            try:
                check_frames(vertices, array, templates[subject])
                sound = read_audio(source / "wav" / f"{array.stem}.wav")
                vertices *= np.float32(scale)
                clip = Clip(subject, _sentence(subject, number, text), text, sound, vertices)
                writer.add(clip)
                numbers[clip.name] = number
            except (AudioError, CorpusError) as error:
                skipped.add(str(error), array.stem)
        require_clips(
            writer,
            source,
            skipped.notes(),
            "vertices_npy/SUBJECT_SENTENCE.npy, wav/SUBJECT_SENTENCE.wav, SUBJECT in templates.pkl",
        )
        writer.splits |= choose_splits(writer.entries, numbers, split, notes)
    return [*notes, *skipped.notes()]


def _check_folders(source: Path) -> None:
    """Raise CorpusError where a folder is missing."""
    for name in FOLDERS:
        if not (source / name).is_dir():
            raise CorpusError.about(
                source, found=f"no folder {name}", allowed="vertices_npy, wav, templates.pkl"
            )


def _lengths(source: Path, arrays: list[Path], sounds: set[str]) -> list[tuple[int, float]]:
    """Frames and seconds of sound of some clips, evenly spaced; unreadable ones come up later."""
    paired = [path for path in arrays if path.stem in sounds]
    lengths = []
    for path in paired[:: max(1, len(paired) // PROBED)][:PROBED]:
        try:
            seconds = probe_audio(source / "wav" / f"{path.stem}.wav").duration_s
            if seconds:
                lengths.append((len(open_float_array(path)), seconds))
        except (AudioError, CorpusError):
            continue
    return lengths


def _usable(
    arrays: list[Path],
    templates: dict[str, Any],
    sounds: set[str],
    leave_out: frozenset[str],
    skipped: SkippedClips,
    progress: Progress,
) -> Iterator[tuple[Path, str, str]]:
    """Each array that has a template and a sound, with its subject and sentence."""
    for done, array in enumerate(arrays, 1):
        if progress:
            progress(done / len(arrays))
        subject, number = subject_and_sentence(array.stem, templates)
        if {array.stem, subject, f"{subject}.{number}"} & leave_out:
            continue
        if not subject or array.stem not in sounds:
            skipped.add("no sound" if subject else "no template", array.stem)
            continue
        yield array, subject, number


def _sentence(subject: str, number: str, text: str) -> str:
    """VOCASET's numbers mean another text with each subject; those of others mean the same."""
    if text or subject in VOCASET_SUBJECTS:
        return sentence_id(subject, number, text)
    return number


def subject_and_sentence(stem: str, templates: dict[str, Any]) -> tuple[str, str]:
    """Subject and sentence of a file called SUBJECT_SENTENCE, without its suffix.

    Known subjects may contain `_`; for an unknown one they are "" and the whole name.
    """
    for subject in sorted(templates, key=len, reverse=True):
        if stem.startswith(f"{subject}_"):
            return subject, stem[len(subject) + 1 :]
    return "", stem


def read_vertices(path: Path, count: int) -> NDArray[np.float32]:
    """Vertices over time from a .npy of either layout, in the file's unit.

    Parameters
    ----------
    path : Path
        (frame, vertex, 3) or (frame, 3 · vertex) floats.
    count : int
        Vertices of the topology.

    Returns
    -------
    (frame, vertex, 3) float32

    Raises
    ------
    CorpusError
        For anything else, another topology included.
    """
    array = read_npy(path, ARRAY_FILE)
    if array.dtype.kind != "f":
        raise ARRAY_FILE.unusable(path, f"{array.dtype}")
    flat = array.ndim == 2 and array.shape[1] == 3 * count
    if not flat and (array.ndim != 3 or array.shape[1:] != (count, 3)):
        vertex_count = (
            array.shape[1] // 3 if array.ndim == 2 else array.shape[1] if array.ndim > 1 else 0
        )
        raise CorpusError.about(
            path,
            found=f"shape {array.shape}, {vertex_count} vertices",
            allowed=f"(frames, {count}, 3) or (frames, {3 * count}), {count} vertices",
        )
    with np.errstate(over="ignore"):  # what is then infinite is told
        return np.array(array, np.float32).reshape(len(array), count, 3)
