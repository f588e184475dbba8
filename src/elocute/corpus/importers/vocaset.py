"""VOCASET as it is distributed (Cudeiro et al., CVPR 2019, section 6), into a corpus.

data_verts.npy       (row, 5023, 3) m in zero pose, 60 fps
raw_audio_fixed.pkl  {subject: {sentence: {"audio": int16 samples, "sample_rate": Hz}}}
templates.pkl        {subject: (5023, 3)} m
subj_seq_to_idx.pkl  {subject: {sentence: {frame number: row}}}
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float32Array
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.importers.foreign_arrays import (
    checked_templates,
    checked_waveform,
    one_line_name,
    open_float_array,
)
from elocute.corpus.importers.frame_gaps import check_frames, filled, frame_rows
from elocute.corpus.importers.import_report import Progress, require_clips
from elocute.corpus.importers.split_choice import VOCASET_SUBJECTS, choose_splits
from elocute.corpus.split import ClipEntry
from elocute.errors import AudioError, CorpusError
from elocute.files.array_file import ArrayFile
from elocute.files.json_records import parse_json
from elocute.files.pickles.closed_pickle import read_pickle
from elocute.files.reading import FileKind, read_text

FPS = 60.0
VERTICES = 5023  # FLAME's mesh
FILES = ("data_verts.npy", "raw_audio_fixed.pkl", "templates.pkl", "subj_seq_to_idx.pkl")
NOTE = "VOCASET (Cudeiro et al. 2019), under the licence of its authors; not to be passed on."
TEXTS_MAX_BYTES = 16_000_000
FRAMES_MAX = 10_000
"""Of one sentence: nearly three minutes."""

Texts = dict[tuple[str, str], str]


def convert_vocaset(
    source: Path,
    output: Path,
    *,
    texts: Path | None = None,
    leave_out: frozenset[str] = frozenset(),
    split: str | None = None,
    progress: Progress = None,
) -> list[str]:
    """Convert VOCASET into a corpus, as `registry.convert` does; a line for each assumption.

    VOCASET's sentence numbers mean another text with each subject. Without texts, as for
    `read_texts`, no two subjects share a sentence identifier; with texts, those share one that say
    the same. Raises InputError for missing, foreign or damaged files, another topology, and rows
    that do not exist; nothing is written then.
    """
    vertices = _open_vertices(source)
    path = source / "templates.pkl"
    templates = checked_templates(path, read_pickle(path), VERTICES)
    rows = _nested(source / "subj_seq_to_idx.pkl")
    sounds = _nested(source / "raw_audio_fixed.pkl")
    words = {} if texts is None else read_texts(texts)
    order = sorted(templates, key=lambda name: (_rank(name), name))
    notes = _without_template(rows, sounds, templates)
    with corpus_writer(
        output, {name: templates[name] for name in order}, fps=FPS, topology="flame", note=NOTE
    ) as writer:
        numbers: dict[str, str] = {}
        for done, subject in enumerate(order, 1):
            listed = sorted({*rows.get(subject, {}), *sounds.get(subject, {})})
            for number in (n for n in listed if not {subject, f"{subject}.{n}"} & leave_out):
                indices = rows.get(subject, {}).get(number)
                sound = sounds.get(subject, {}).get(number)
                if missing := _missing(indices, sound):
                    notes.append(f"{subject} {number}: no {missing}")
                    continue
                places = _rows(source, subject, number, indices, len(vertices))
                text = words.get((subject, number), "")
                clip = _clip(
                    *(subject, number, text, sound, vertices, templates[subject], places),
                    notes=notes,
                    there=writer.entries,
                )
                if clip is not None:
                    writer.add(clip)
                    numbers[clip.name] = number
            if progress:
                progress(done / len(order))
        require_clips(writer, source, notes)
        writer.splits |= choose_splits(writer.entries, numbers, split, notes)
    return notes


def _open_vertices(source: Path) -> ArrayFile:
    """(row, vertex, 3) of all sentences, once all files are known to be there."""
    for name in FILES:
        if not (source / name).is_file():
            raise CorpusError.about(source, found=f"no {name}", allowed=", ".join(FILES))
    vertices = open_float_array(source / "data_verts.npy")
    if vertices.ndim != 3 or vertices.shape[1:] != (VERTICES, 3):
        count = f", {vertices.shape[1]} vertices" if vertices.ndim == 3 else ""
        raise CorpusError.about(
            source / "data_verts.npy",
            found=f"shape {vertices.shape}{count}",
            allowed=f"(frames, {VERTICES}, 3), {VERTICES} vertices",
        )
    return vertices


def read_texts(path: Path) -> Texts:
    """Read what is said, by subject and sentence.

    From .json {subject: {sentence: text}}, or lines of `subject TAB sentence TAB text`. Raises
    CorpusError for anything else.
    """
    allowed = "subject TAB sentence TAB text, or .json {subject: {sentence: text}}"
    text = read_text(path, FileKind(allowed, TEXTS_MAX_BYTES, CorpusError))
    try:
        if path.suffix.lower() == ".json":
            return {
                (str(who), str(number)): _checked_text(said)
                for who, sentences in parse_json(
                    text, path, allowed=allowed, error=CorpusError
                ).items()
                for number, said in sentences.items()
            }
        lines = [line.split("\t") for line in text.splitlines() if line.strip()]
        return {(who, number): said.strip() for who, number, said in lines}
    except (ValueError, AttributeError, TypeError) as error:
        if isinstance(error, CorpusError):
            raise
        raise CorpusError.about(path, found="no list of sentences", allowed=allowed) from error


def _checked_text(text: Any) -> str:
    """A text; raises TypeError for anything else."""
    if not isinstance(text, str):
        raise TypeError("no text")
    return text


def sentence_id(subject: str, number: str, text: str) -> str:
    """An identifier, from a hash of the words, that all who say the same share.

    Without words it is one that nobody shares, from the sentence's name in the distribution.
    """
    words = " ".join("".join(c if c.isalnum() else " " for c in text.casefold()).split())
    return f"t{hashlib.sha256(words.encode()).hexdigest()[:12]}" if words else f"{subject}_{number}"


def _missing(indices: Any, sound: Any) -> str:
    """What a sentence lacks: "motion", "sound" or ""."""
    if not isinstance(indices, dict) or not indices:
        return "motion"
    return "" if isinstance(sound, dict) and sound else "sound"


def _rank(subject: str) -> int:
    """Place of a subject in the published order; others come last."""
    return VOCASET_SUBJECTS.index(subject) if subject in VOCASET_SUBJECTS else len(VOCASET_SUBJECTS)


def _nested(path: Path) -> dict[str, dict[str, Any]]:
    """{subject: {sentence: …}} of a pickle. Raises InputError."""
    stored = read_pickle(path)
    if not isinstance(stored, dict) or not all(
        isinstance(inner, dict) for inner in stored.values()
    ):
        raise CorpusError.about(path, found="something else", allowed="{subject: {sentence: …}}")
    return {
        one_line_name(who): {one_line_name(k): v for k, v in inner.items()}
        for who, inner in stored.items()
    }


def _without_template(
    rows: dict[str, Any], sounds: dict[str, Any], templates: dict[str, Any]
) -> list[str]:
    """A note for each subject without a template."""
    return [f"{name}: no template" for name in sorted({*rows, *sounds} - set(templates))]


def _rows(source: Path, subject: str, number: str, indices: Any, count: int) -> dict[int, int]:
    """Frames of one sentence, rising, and their rows. Raises CorpusError out of range."""
    about = f"{source / 'subj_seq_to_idx.pkl'} ({subject} {number})"
    try:
        pairs = sorted((_whole(frame), _whole(row)) for frame, row in indices.items())
    except (AttributeError, TypeError, ValueError) as error:
        raise CorpusError.about(about, found="no rows", allowed="{frame number: row}") from error
    if len(pairs) > FRAMES_MAX:
        raise CorpusError.about(
            about, found=f"{len(pairs)} frames", allowed=f"up to {FRAMES_MAX} in a sentence"
        )
    frames, rows = (np.array(column, np.int64) for column in zip(*pairs, strict=True))
    wrong = (rows < 0) | (rows >= count)
    if wrong.any():
        raise CorpusError.about(
            about, found=f"row {rows[wrong.argmax()]}", allowed=f"0 to {count - 1}"
        )
    return dict(zip(frames.tolist(), rows.tolist(), strict=True))


def _whole(value: Any) -> int:
    """A whole number, which releases also write as text. Raises ValueError, TypeError."""
    if not isinstance(value, int | np.integer | str) or len(str(value)) > 18:
        raise TypeError("no whole number")
    return int(value)


def _clip(
    subject: str,
    number: str,
    text: str,
    sound: Any,
    vertices: ArrayFile,
    template: Float32Array,
    rows: dict[int, int],
    notes: list[str],
    there: Sequence[ClipEntry],
) -> Clip | None:
    """One sentence as a Clip, or None with a note where its sound or frames cannot be used."""
    sentence = sentence_id(subject, number, text)
    if any(entry.name == f"{subject}.{sentence}" for entry in there):
        sentence = f"{sentence}-{number}"  # the same words said twice by one subject
    try:
        waveform = checked_waveform(sound["audio"], sound["sample_rate"])
        places, note = frame_rows(list(rows), 0, FPS, waveform.duration_s)
        frames = vertices[list(rows.values())].astype(np.float32)
        check_frames(frames, vertices.path, template)
        if note:
            notes.append(f"{subject} {number}: {note}")
        return Clip(subject, sentence, text, waveform, filled(frames, places))
    except (AudioError, CorpusError) as error:
        notes.append(f"{subject} {number}: {error}")
    except (KeyError, TypeError, IndexError):
        notes.append(f"{subject} {number}: sound without audio and sample_rate")
    return None
