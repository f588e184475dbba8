"""What importers share: templates, splits where none is published, foreign arrays."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_writing import CorpusWriter
from elocute.corpus.length_units import (
    TYPICAL_HEIGHT_M,
    UNITS,
    fitting_unit,
    is_head_sized,
    longest_side,
)
from elocute.corpus.split import ClipEntry, Split, split_by_subject
from elocute.corpus.topologies import BIWI, topology_of
from elocute.errors import AudioError, CorpusError
from elocute.files.array_file import ArrayFile
from elocute.files.json_records import finite_number

FLOATS = "a .npy of floats, row after row, no Python objects"

Progress = Callable[[float], None] | None
Array = NDArray[np.float32]
UNIT_AREA_HEIGHTS = (0.6, 2.0)
"""Longest side of a face whose surface is 1, generously."""
BOX_TOLERANCE = 0.01
METRES_RANGE = (1e-6, 1e3)
NAMED_AT_MOST = 3
NAME_MAX = 120
RATE_MAX = 1_000_000


def metres_per_unit(template: NDArray[np.floating], notes: list[str], units: str | None) -> float:
    """What to multiply lengths by: as `units` says, else from the size of a head.

    units  a name in units.UNITS, `m`, or metres as a number

    A note says what was assumed where that is not 1. BIWI as FaceFormer's and CodeTalker's
    preparation leaves it has been scaled to a surface of 1 (FaceXHuBERT's and FaceDiffuser's:
    each axis to 1), which no unit undoes: a head of TYPICAL_HEIGHT_M is assumed. Raises CorpusError
    for `units` that are none.
    """
    if units is not None:
        return parse_length_unit(units)
    size = longest_side(template)
    if topology_of(len(template)) is BIWI and UNIT_AREA_HEIGHTS[0] <= size <= UNIT_AREA_HEIGHTS[1]:
        scale = TYPICAL_HEIGHT_M / size
        boxed = bool(np.abs(np.ptp(template, axis=0) - 1).max() < BOX_TOLERANCE)
        what = "each axis scaled to 1" if boxed else "scaled to a surface of 1"
        lost = "its true size and proportions are" if boxed else "its true size is"
        notes.append(
            f"lengths: {BIWI.title} {what} ({size:.3g} units high): {lost} lost; taken as "
            f"{TYPICAL_HEIGHT_M:g} m high, {scale:.3g} m a unit; `units` sets another (1 keeps "
            "the papers' unit)"
        )
        return scale
    unit = "" if is_head_sized(size) else fitting_unit(size)
    if unit:
        notes.append(
            f"lengths: a head is {size:.4g} units high; taken as {unit}, now metres; "
            "`units` sets another"
        )
    elif not is_head_sized(size):
        notes.append(
            f"lengths: a head is {size:.4g} units high; no unit fits, left as it is; "
            "`units` sets one, in metres"
        )
    return UNITS.get(unit, 1.0)


def parse_length_unit(units: str) -> float:
    """Metres of a unit by name, or given as a number. Raises CorpusError."""
    known = {"m": 1.0, **UNITS}
    try:
        metres = known[units] if units in known else float(units)
    except ValueError:
        metres = float("nan")
    if not METRES_RANGE[0] <= metres <= METRES_RANGE[1]:
        raise CorpusError.about(
            f"`units` {units}",
            found="no unit of length",
            allowed=f"{', '.join(known)}, or metres a unit, {METRES_RANGE[0]:g} to "
            f"{METRES_RANGE[1]:g}",
        )
    return metres


def checked_template(source: Path, name: str, value: Any, vertices: int | None) -> Array:
    """(vertex, 3). Raises CorpusError for another shape or count, and for what is not an array."""
    template: NDArray[Any] = value if isinstance(value, np.ndarray) else np.zeros(0)
    fits = template.dtype.kind in "fiu" and template.ndim == 2 and template.shape[1] == 3
    if not fits or not len(template):
        raise CorpusError.about(
            source,
            found=f"the template of {name} is of shape {template.shape}",
            allowed="(vertices, 3) numbers",
        )
    if vertices is not None and len(template) != vertices:
        raise CorpusError.about(
            source,
            found=f"{len(template)} vertices in the template of {name}",
            allowed=f"{vertices}, as the others have",
        )
    with np.errstate(over="ignore"):
        single = template.astype(np.float32)
    if not np.isfinite(single).all():
        raise CorpusError.about(source, found=f"the template of {name} is not finite")
    return single


def one_line_name(name: Any) -> str:
    """A key of a foreign file as it may stand in a line: text, short, no line ends."""
    return " ".join(str(name).split())[:NAME_MAX]


def checked_templates(source: Path, given: Any, vertices: int | None = None) -> dict[str, Array]:
    """Subject to (vertex, 3) of a pickle of templates. Raises CorpusError."""
    if not isinstance(given, dict) or not given:
        raise CorpusError.about(source, found="no templates", allowed="{subject: (vertices, 3)}")
    templates: dict[str, Array] = {}
    for key, value in given.items():
        name = one_line_name(key)
        templates[name] = checked_template(source, name, value, vertices)
        vertices = len(templates[name])
    return templates


def open_float_array(path: Path) -> ArrayFile:
    """A .npy left on disk. Raises CorpusError for object arrays, damage and what is missing."""
    array = ArrayFile(path, allowed=FLOATS, error=CorpusError)
    if array.dtype.kind != "f":
        raise CorpusError.about(path, found=f"{array.dtype}", allowed=FLOATS)
    return array


def checked_waveform(audio: Any, sample_rate: Any) -> Waveform:
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


class SkippedClips:
    """Clips left out, by reason: told one by one while they are few, summed where many."""

    def __init__(self) -> None:
        self._clips: dict[str, list[str]] = {}

    def add(self, reason: str, clip: str) -> None:
        self._clips.setdefault(reason, []).append(clip)

    def notes(self) -> list[str]:
        """`CLIP: REASON` each, or `REASON: N clips (…)` for more than NAMED_AT_MOST of one."""
        lines = []
        for reason, clips in self._clips.items():
            if len(clips) <= NAMED_AT_MOST:
                lines += [f"{clip}: {reason}" for clip in clips]
                continue
            first = ", ".join(clips[:NAMED_AT_MOST])
            lines.append(
                f"{reason}: {len(clips)} clips ({first} and {len(clips) - NAMED_AT_MOST} more)"
            )
        return lines


def require_clips(
    writer: CorpusWriter, source: Path, skipped: Sequence[str], remedy: str = ""
) -> None:
    """Raises CorpusError, with the first reason of `skipped`, where no clip is left."""
    if not writer.entries:
        why = f" ({skipped[0]})" if skipped else ""
        raise CorpusError.about(source, found=f"no clip that can be used{why}", remedy=remedy)


def even_split(entries: Sequence[ClipEntry], notes: list[str]) -> Split:
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
            notes.append(f"split: even, validation {', '.join(validation)}, test {', '.join(test)}")
            return split
        except CorpusError:
            notes.append("split: even, by subjects and sentences; clips between them are unused")
            return split_by_subject_and_sentence(entries, set(validation), set(test))
    notes.append("split: by sentences only, since subjects are fewer than three")
    return split_by_sentence(entries)


def split_by_sentence(entries: Sequence[ClipEntry]) -> Split:
    """Sentences 80:10:10, whoever speaks them."""
    return split_by_subject_and_sentence(entries, None, None)


def split_by_subject_and_sentence(
    entries: Sequence[ClipEntry], validation: set[str] | None, test: set[str] | None
) -> Split:
    """Sentences 70:15:15 (80:10:10 without subjects), and subjects where they are given."""
    sentences = sorted({entry.sentence for entry in entries})
    held = len(sentences) * (10 if validation is None else 15) // 100 or int(len(sentences) > 2)
    last = set(sentences[len(sentences) - held :])
    middle = set(sentences[len(sentences) - 2 * held : len(sentences) - held])

    def part(entry: ClipEntry) -> str:
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
