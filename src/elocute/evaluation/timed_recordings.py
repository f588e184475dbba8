"""Recordings with known phone times, which alignments are compared with.

    FOLDER/WORD/NAME.wav  and  NAME.json   {"phones": [[start_s, end_s, phone], …]}

A sentence that contains a word has "word": [start_s, end_s] beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.alignment.alignment import WarpingPath
from elocute.array_types import Float32Array
from elocute.encoders.protocol import FEATURE_RATE
from elocute.errors import AlignmentError
from elocute.evaluation.path_errors import TimeSpan, true_path
from elocute.files.json_records import read_record
from elocute.files.reading import FileKind
from elocute.one_line_repr import one_line

PhoneSpan = tuple[float, float, str]
"""Start in s, end in s, phone."""
SAME_PHONES_MIN = 0.7
"""Share of two recordings' phones that must be the same for them to be a pair."""
PHONES_MAX = 1000  # the time to compare two recordings grows with its square
FILE_MAX_BYTES = 4_000_000


@dataclass(frozen=True, eq=False)
class TimedRecording:
    """One recording of a word, alone or in a sentence.

    Parameters
    ----------
    name : str
        Of the file.
    view : (frame, feature) float
        Features of the sound.
    phones : tuple of (float, float, str)
        Start in s, end in s and phone, in order.
    word : (float, float), optional
        Start and end of the word in a sentence, s.
    rate : float
        Frames of the view per second.
    """

    name: str
    view: Float32Array
    phones: tuple[PhoneSpan, ...]
    word: TimeSpan | None = None
    rate: float = FEATURE_RATE

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class RecordingPair:
    """Two recordings of which it is known what corresponds.

    Parameters
    ----------
    source, target : TimedRecording
        The recordings.
    spans : tuple of pairs of (float, float)
        Start and end in s of each phone in the source, and of the same phone in the target.
    whole : bool
        Whether the ends of both recordings correspond too.
    """

    source: TimedRecording
    target: TimedRecording
    spans: tuple[tuple[TimeSpan, TimeSpan], ...]
    whole: bool = True

    @cached_property
    def truth(self) -> WarpingPath:
        """(step, 2) frames: the true path, piecewise linear between the ends of phones."""
        edges = np.array([(s[k], t[k]) for s, t in self.spans for k in (0, 1)])
        frames = len(self.source.view), len(self.target.view)
        edges = np.maximum.accumulate(edges, axis=0)
        return true_path(edges[:, 0], edges[:, 1], self.source.rate, frames, self.whole)


def word_pair(source: TimedRecording, target: TimedRecording) -> RecordingPair | None:
    """Pair two recordings of a word.

    Parameters
    ----------
    source, target : TimedRecording
        The word alone, in both.

    Returns
    -------
    RecordingPair or None
        None where fewer than `SAME_PHONES_MIN` of the phones are the same.
    """
    matched = matched_phones([p[2] for p in source.phones], [p[2] for p in target.phones])
    longest = max(len(source.phones), len(target.phones))
    if sum(same for _, _, same in matched) < SAME_PHONES_MIN * longest:
        return None
    return RecordingPair(
        source, target, tuple((source.phones[i][:2], target.phones[j][:2]) for i, j, _ in matched)
    )


def sentence_pair(sentence: TimedRecording, word: TimedRecording) -> RecordingPair | None:
    """Pair a sentence with a recording of the word in it; only phones within the word are compared.

    Parameters
    ----------
    sentence : TimedRecording
        With the place of the word.
    word : TimedRecording
        The word alone.

    Returns
    -------
    RecordingPair or None
        None where fewer than `SAME_PHONES_MIN` of the phones are the same.

    Raises
    ------
    AlignmentError
        For a sentence without the place of its word.
    """
    if sentence.word is None:
        raise AlignmentError.about(sentence.name, found="no word in it", allowed="a sentence")
    start, end = sentence.word
    inner = tuple(p for p in sentence.phones if p[0] >= start - 1e-6 and p[1] <= end + 1e-6)
    within = TimedRecording(sentence.name, sentence.view, inner, sentence.word, sentence.rate)
    pair = word_pair(within, word)
    return pair and RecordingPair(pair.source, pair.target, pair.spans, whole=False)


def matched_phones(source: Sequence[str], target: Sequence[str]) -> list[tuple[int, int, bool]]:
    """Match the phones of two recordings with the fewest edits.

    Parameters
    ----------
    source, target : sequence of str
        Phones in order.

    Returns
    -------
    list of (int, int, bool)
        Place in the source, place in the target, and whether the phones are the same.
    """
    rows, columns = len(source), len(target)
    edits = np.zeros((rows + 1, columns + 1), np.intp)
    edits[:, 0], edits[0] = np.arange(rows + 1), np.arange(columns + 1)
    for i in range(1, rows + 1):
        for j in range(1, columns + 1):
            swap = edits[i - 1, j - 1] + (source[i - 1] != target[j - 1])
            edits[i, j] = min(swap, edits[i - 1, j] + 1, edits[i, j - 1] + 1)
    found, i, j = [], rows, columns
    while i and j:
        same = source[i - 1] == target[j - 1]
        if edits[i, j] == edits[i - 1, j - 1] + (not same):
            i, j = i - 1, j - 1
            found.append((i, j, same))
        elif edits[i, j] == edits[i - 1, j] + 1:
            i -= 1
        else:
            j -= 1
    return found[::-1]


def read_phone_times(path: Path) -> tuple[tuple[PhoneSpan, ...], TimeSpan | None]:
    """Read the phone times of a recording.

    Parameters
    ----------
    path : Path
        A `.json`, as the module describes it.

    Returns
    -------
    phones : tuple of (float, float, str)
        Start in s, end in s and phone, in order.
    word : (float, float) or None
        Start and end of the word in a sentence, s.

    Raises
    ------
    AlignmentError
        For a file that is missing or invalid.
    """
    allowed = '{"phones": [[start_s, end_s, phone], …]}'
    record = read_record(path, FileKind(allowed, FILE_MAX_BYTES, AlignmentError))
    try:
        phones = tuple((float(a), float(b), str(c)) for a, b, c in record["phones"])
        span = record.get("word")
        word = (float(span[0]), float(span[1])) if span is not None else None
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise AlignmentError.about(
            path, found=f"no list of phones ({type(error).__name__})", allowed=allowed
        ) from error
    if len(phones) > PHONES_MAX or (word is not None and not _in_order(np.array([word]))):
        raise AlignmentError.about(
            path, found="too many phones, or a word out of order", allowed=f"up to {PHONES_MAX}"
        )
    times = np.array([phone[:2] for phone in phones] or [(0.0, 0.0)])
    if not phones or not _in_order(times):
        raise AlignmentError.about(path, found="phones out of order, or none", allowed="in order")
    return phones, word


def _in_order(times: NDArray[np.float64]) -> bool:
    """Whether times are finite and never decrease."""
    return bool(np.isfinite(times).all() and (np.diff(times.ravel()) >= -1e-6).all())
