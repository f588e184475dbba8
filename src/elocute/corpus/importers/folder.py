"""The convention of later work on VOCASET and BIWI: one array and one sound file a sentence.

vertices_npy/SUBJECT_SENTENCE.npy  (frame, vertex, 3) or (frame, 3 · vertex)
wav/SUBJECT_SENTENCE.wav
templates.pkl                      {subject: (vertex, 3)}
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.audio.read import read_audio
from elocute.corpus.clip import Clip
from elocute.corpus.importers.common import (
    FLOATS,
    Progress,
    finish,
    metres_per_unit,
    templates_of,
)
from elocute.corpus.importers.vocaset import (
    PUBLISHED,
    read_texts,
    sentence_id,
    vocaset_split,
)
from elocute.corpus.writer import corpus_writer
from elocute.errors import AudioError, CorpusError
from elocute.files.arrays import read_npy
from elocute.files.pickles.closed_pickle import read_pickle

FPS = 30.0
ARRAY_MAX_BYTES = 8_000_000_000
FOLDERS = ("vertices_npy", "wav")


def convert_folder(
    source: Path,
    output: Path,
    *,
    fps: float = FPS,
    texts: Path | None = None,
    leave_out: frozenset[str] = frozenset(),
    progress: Progress = None,
) -> list[str]:
    """Write the corpus folder `output`; returns a line for each thing that was skipped.

    fps    of the arrays: this convention stores no rate, and keeps every second frame of VOCASET
    texts  as for `convert_vocaset`

    Lengths are made metres where the templates' size tells their unit. Raises InputError for
    missing, foreign or broken files and another topology; nothing is written then.
    """
    for name in FOLDERS:
        if not (source / name).is_dir():
            raise CorpusError.about(
                source, found=f"no folder {name}", allowed="vertices_npy, wav, templates.pkl"
            )
    path = source / "templates.pkl"
    templates = templates_of(path, read_pickle(path))
    words = {} if texts is None else read_texts(texts)
    notes: list[str] = []
    scale = metres_per_unit(next(iter(templates.values())), notes)
    arrays = sorted((source / "vertices_npy").glob("*.npy"))
    heard = {p.stem for p in (source / "wav").glob("*.wav")}
    notes += [f"{name}: no motion" for name in sorted(heard - {p.stem for p in arrays})]
    scaled = {name: template * np.float32(scale) for name, template in templates.items()}
    with corpus_writer(output, scaled, fps=fps) as writer:
        numbers: dict[str, str] = {}
        for done, array in enumerate(arrays, 1):
            if progress:
                progress(done / len(arrays))
            subject, number = _parts(array.stem, templates)
            if {array.stem, subject, f"{subject}.{number}"} & leave_out:
                continue
            if not subject or array.stem not in heard:
                notes.append(f"{array.stem}: no {'sound' if subject else 'template'}")
                continue
            vertices = _vertices(array, len(templates[subject]))
            text = words.get((subject, number), "")
            # VOCASET's numbers mean another text with each subject; others' mean the same.
            lone = text or subject in PUBLISHED
            sentence = sentence_id(subject, number, text) if lone else number
            try:
                sound = read_audio(source / "wav" / f"{array.stem}.wav")
                clip = Clip(subject, sentence, text, sound, vertices * np.float32(scale))
                writer.add(clip)
                numbers[clip.name] = number
            except (AudioError, CorpusError) as error:
                notes.append(f"{array.stem}: {error}")
        finish(writer, source, notes)
        writer.splits["default"] = vocaset_split(writer.entries, numbers, notes)
    return notes


def _parts(stem: str, templates: dict[str, Any]) -> tuple[str, str]:
    """Subject and sentence of SUBJECT_SENTENCE; subjects may hold the line themselves."""
    for subject in sorted(templates, key=len, reverse=True):
        if stem.startswith(f"{subject}_"):
            return subject, stem[len(subject) + 1 :]
    return "", stem


def _vertices(path: Path, count: int) -> NDArray[np.float32]:
    """(frame, vertex, 3) of either layout. Raises CorpusError for another topology."""
    array = read_npy(path, max_bytes=ARRAY_MAX_BYTES, allowed=FLOATS, error=CorpusError)
    if array.dtype.kind != "f":
        raise CorpusError.about(path, found=f"{array.dtype}", allowed=FLOATS)
    flat = array.ndim == 2 and array.shape[1] == 3 * count
    if not flat and (array.ndim != 3 or array.shape[1:] != (count, 3)):
        found = array.shape[1] // 3 if array.ndim == 2 else array.shape[1] if array.ndim > 1 else 0
        raise CorpusError.about(
            path, found=f"shape {array.shape}, {found} vertices",
            allowed=f"(frames, {count}, 3) or (frames, {3 * count}), {count} vertices",
        )  # fmt: skip
    return np.asarray(array, np.float32).reshape(len(array), count, 3)
