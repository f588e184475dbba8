"""Templates, motion and sound out of files that others wrote, checked before they are used."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.audio.waveform import Waveform
from elocute.errors import AudioError, CorpusError
from elocute.files.array_file import ArrayFile
from elocute.files.json_records import finite_number
from elocute.files.reading import ANY_BYTES, FileKind

FLOATS_FILE = FileKind("a .npy of floats, no Python objects", ANY_BYTES, CorpusError)
NAME_MAX = 120
RATE_MAX = 1_000_000


def checked_template(source: Path, name: str, value: Any, vertices: int | None) -> Float32Array:
    """Check a neutral face.

    Parameters
    ----------
    source : Path
        The file that it came from, named in the message.
    name : str
        The subject.
    value : object
        What the file holds.
    vertices : int or None
        How many there must be; None takes any number.

    Returns
    -------
    (vertex, 3) float32
        The vertices, in the file's unit.

    Raises
    ------
    CorpusError
        For anything but finite numbers of this shape.
    """
    template = _as_array(value)
    fits = template is not None and template.dtype.kind in "fiu" and template.ndim == 2
    if template is None or not fits or template.shape[1] != 3 or not len(template):
        kind = f"a {type(value).__name__}" if template is None else f"of shape {template.shape}"
        raise CorpusError.about(
            source, found=f"the template of {name} is {kind}", allowed="(vertices, 3) numbers"
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


def _as_array(value: Any) -> NDArray[Any] | None:
    """An array, or lists of numbers of one length as one; None for anything else."""
    if isinstance(value, list | tuple):
        try:
            return np.array([list(row) for row in value])
        except (ValueError, TypeError):
            return None
    return value if isinstance(value, np.ndarray) else None


def checked_templates(
    source: Path, stored: Any, vertices: int | None = None
) -> dict[str, Float32Array]:
    """Check the neutral faces of all subjects, which must have equally many vertices.

    Parameters
    ----------
    source : Path
        The file that they came from, named in the message.
    stored : object
        What the file holds: a dict of subject to vertices.
    vertices : int or None
        How many each must have; None takes as many as the first.

    Returns
    -------
    dict of str to (vertex, 3) float32
        Vertices by subject, in the file's unit.

    Raises
    ------
    CorpusError
        For anything else.
    """
    if not isinstance(stored, dict) or not stored:
        raise CorpusError.about(source, found="no templates", allowed="{subject: (vertices, 3)}")
    templates: dict[str, Float32Array] = {}
    for key, value in stored.items():
        name = one_line_name(key)
        templates[name] = checked_template(source, name, value, vertices)
        vertices = len(templates[name])
    return templates


def one_line_name(name: Any) -> str:
    """A key of a foreign file as short text without line ends."""
    return " ".join(str(name).split())[:NAME_MAX]


def open_float_array(path: Path) -> ArrayFile:
    """Open a .npy of floats whose rows stay on disk.

    Raises CorpusError for objects or other numbers, and for a file that is damaged or missing.
    """
    array = ArrayFile(path, FLOATS_FILE)
    if array.dtype.kind != "f":
        raise FLOATS_FILE.unusable(path, f"{array.dtype}")
    return array


def checked_waveform(audio: Any, sample_rate: Any) -> Waveform:
    """Make a Waveform of samples (sample,) or (sample, channel), whose channels are averaged.

    They are floats within ±1 or integers of full scale. Raises AudioError for anything else.
    """
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
