"""What importers share: templates, splits where none is published, foreign arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.audio.waveform import Waveform
from elocute.corpus.split import Entry, Split, split_by_subject
from elocute.corpus.units import UNITS, fitting_unit, height, is_head_sized
from elocute.corpus.writer import CorpusWriter
from elocute.errors import AudioError, CorpusError
from elocute.files.arrays import ArrayFile
from elocute.files.records import finite_number

FLOATS = "a .npy of floats, row after row, no Python objects"

Progress = Callable[[float], None] | None
Array = NDArray[np.float32]
NAME_MAX = 120
RATE_MAX = 1_000_000


def metres_per_unit(template: NDArray[np.floating], notes: list[str]) -> float:
    """What to multiply lengths by, judged by the size of a head; a note where it is not 1."""
    size = height(template)
    unit = "" if is_head_sized(size) else fitting_unit(size)
    if unit:
        notes.append(f"lengths: a head is {size:.4g} units high; taken as {unit}, now metres")
    elif not is_head_sized(size):
        notes.append(f"lengths: a head is {size:.4g} units high; no unit fits, left as it is")
    return UNITS.get(unit, 1.0)


def template_of(source: Path, name: str, value: Any, vertices: int | None) -> Array:
    """(vertex, 3). Raises CorpusError for another shape or count, and what is no array."""
    template: NDArray[Any] = value if isinstance(value, np.ndarray) else np.zeros(0)
    fits = template.dtype.kind in "fiu" and template.ndim == 2 and template.shape[1] == 3
    if not fits or not len(template):
        raise CorpusError.about(
            source, found=f"the template of {name} is of shape {template.shape}",
            allowed="(vertices, 3) numbers",
        )  # fmt: skip
    if vertices is not None and len(template) != vertices:
        raise CorpusError.about(
            source, found=f"{len(template)} vertices in the template of {name}",
            allowed=f"{vertices}, as the others have",
        )  # fmt: skip
    with np.errstate(over="ignore"):
        single = template.astype(np.float32)
    if not np.isfinite(single).all():
        raise CorpusError.about(source, found=f"the template of {name} is not finite")
    return single


def plain(name: Any) -> str:
    """A key of a foreign file as it may stand in a line: text, short, no line ends."""
    return " ".join(str(name).split())[:NAME_MAX]


def templates_of(source: Path, given: Any, vertices: int | None = None) -> dict[str, Array]:
    """Subject to (vertex, 3) of a pickle of templates. Raises CorpusError."""
    if not isinstance(given, dict) or not given:
        raise CorpusError.about(source, found="no templates", allowed="{subject: (vertices, 3)}")
    templates: dict[str, Array] = {}
    for key, value in given.items():
        name = plain(key)
        templates[name] = template_of(source, name, value, vertices)
        vertices = len(templates[name])
    return templates


def mapped(path: Path) -> ArrayFile:
    """A .npy left on disk. Raises CorpusError for object arrays, damage and what is missing."""
    array = ArrayFile(path, allowed=FLOATS, error=CorpusError)
    if array.dtype.kind != "f":
        raise CorpusError.about(path, found=f"{array.dtype}", allowed=FLOATS)
    return array


def waveform_of(audio: Any, sample_rate: Any) -> Waveform:
    """Sound of samples (sample,) or (sample, channel), integers scaled. Raises AudioError."""
    rate = finite_number(sample_rate.item() if isinstance(sample_rate, np.generic) else sample_rate)
    if (
        not isinstance(audio, np.ndarray)
        or audio.dtype.kind not in "fiu"
        or audio.ndim not in (1, 2)
    ):
        raise AudioError("sound: found no samples; allowed: (samples,) integers or floats")
    if rate is None or not 1 <= rate <= RATE_MAX:
        raise AudioError(f"sound: found no sample rate; allowed: 1 to {RATE_MAX} Hz")
    scale = float(np.iinfo(audio.dtype).max) + 1 if audio.dtype.kind == "i" else 1.0
    with np.errstate(over="ignore"):
        values = audio.astype(np.float32) / np.float32(scale)
    return Waveform(
        values.mean(axis=1) if values.ndim == 2 and values.shape[1] else values, int(rate)
    )


def finish(writer: CorpusWriter, source: Path, notes: Sequence[str]) -> None:
    """Raises CorpusError, with the first reason, where every clip was skipped."""
    if not writer.entries:
        why = f" ({notes[0]})" if notes else ""
        raise CorpusError.about(source, found=f"no clip that can be used{why}")


def even_split(entries: Sequence[Entry], notes: list[str]) -> Split:
    """A split for a corpus without a published one: no subject or sentence in two parts.

    About a sixth of the subjects each for validation and test. Where they have no sentences of
    their own, sentences are divided too, and clips that belong to no part are left out; fewer
    than three subjects are told apart by sentences alone. Says in `notes` what was done.
    """
    subjects = list(dict.fromkeys(entry.subject for entry in entries))
    if len(subjects) >= 3:
        share = max(1, len(subjects) // 6)
        test, validation = subjects[-share:], subjects[-2 * share : -share]
        try:
            split = split_by_subject(entries, validation, test)
            notes.append(f"split: even, {', '.join(validation)} choose, {', '.join(test)} judge")
            return split
        except CorpusError:
            notes.append("split: even, by subjects and sentences; clips between them are unused")
            return _by_both(entries, set(validation), set(test))
    notes.append("split: by sentences only, since subjects are fewer than three")
    return _by_both(entries, None, None)


def _by_both(entries: Sequence[Entry], validation: set[str] | None, test: set[str] | None) -> Split:
    """Sentences 70:15:15 (80:10:10 without subjects), and subjects where they are given."""
    sentences = sorted({entry.sentence for entry in entries})
    held = len(sentences) * (10 if validation is None else 15) // 100 or int(len(sentences) > 2)
    last = set(sentences[len(sentences) - held :])
    middle = set(sentences[len(sentences) - 2 * held : len(sentences) - held])

    def part(entry: Entry) -> str:
        text = "test" if entry.sentence in last else ""
        text = text or ("validation" if entry.sentence in middle else "train")
        if validation is None or test is None:
            return text
        who = "test" if entry.subject in test else ""
        who = who or ("validation" if entry.subject in validation else "train")
        return text if text == who else ""

    return _parted((entry.name, part(entry)) for entry in entries)


def _parted(pairs: Iterable[tuple[str, str]]) -> Split:
    listed = list(pairs)
    train, validation, test = (
        tuple(name for name, part in listed if part == wanted)
        for wanted in ("train", "validation", "test")
    )
    return Split(train, validation, test)
