"""Recordings whose parts are known in time: what alignments are judged by.

    FOLDER/WORD/NAME.wav  and  NAME.json   {"phones": [[start_s, end_s, phone], …]}

A sentence that holds a word has "word": [start_s, end_s] beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.alignment.alignment import FloatArray
from elocute.alignment.alignment import WarpingPath as Steps
from elocute.encoders.protocol import FEATURE_RATE
from elocute.errors import AlignmentError
from elocute.evaluation.path_errors import TimeSpan, true_path
from elocute.files.json_records import read_record
from elocute.one_line_repr import one_line

SAME_PHONES_MIN = 0.7  # of two recordings' phones that must be the same for a truth between them
PHONES_MAX = 1000  # comparing two takes grows with the square of it
FILE_MAX_BYTES = 4_000_000


@dataclass(frozen=True, eq=False)
class TimedRecording:
    """One recording of a word: its view, its parts (start_s, end_s, name) in order, and where the
    word stands in it where it is a sentence. rate: frames per second of the view."""

    name: str
    view: FloatArray
    parts: tuple[tuple[float, float, str], ...]
    word: TimeSpan | None = None
    rate: float = FEATURE_RATE

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class RecordingPair:
    """A source and a target of which is known what belongs together.

    spans: parts of the source and of the target (start_s, end_s) that are the same.
    """

    source: TimedRecording
    target: TimedRecording
    spans: tuple[tuple[TimeSpan, TimeSpan], ...]
    whole: bool = True

    @cached_property
    def truth(self) -> Steps:
        """The true path: piecewise linear between the ends of parts."""
        edges = np.array([(s[k], t[k]) for s, t in self.spans for k in (0, 1)])
        frames = len(self.source.view), len(self.target.view)
        edges = np.maximum.accumulate(edges, axis=0)
        return true_path(edges[:, 0], edges[:, 1], self.source.rate, frames, self.whole)


def word_pair(source: TimedRecording, target: TimedRecording) -> RecordingPair | None:
    """The same word whole against whole; None where the two say it too differently."""
    matched = matched_phones([p[2] for p in source.parts], [p[2] for p in target.parts])
    longest = max(len(source.parts), len(target.parts))
    if sum(same for _, _, same in matched) < SAME_PHONES_MIN * longest:
        return None
    return RecordingPair(
        source, target, tuple((source.parts[i][:2], target.parts[j][:2]) for i, j, _ in matched)
    )


def sentence_pair(sentence: TimedRecording, word: TimedRecording) -> RecordingPair | None:
    """A word to be found in a sentence. Only the parts within the word are compared."""
    if sentence.word is None:
        raise AlignmentError.about(sentence.name, found="no word in it", allowed="a sentence")
    start, end = sentence.word
    inner = tuple(p for p in sentence.parts if p[0] >= start - 1e-6 and p[1] <= end + 1e-6)
    within = TimedRecording(sentence.name, sentence.view, inner, sentence.word, sentence.rate)
    pair = word_pair(within, word)
    return pair and RecordingPair(pair.source, pair.target, pair.spans, whole=False)


def matched_phones(source: Sequence[str], target: Sequence[str]) -> list[tuple[int, int, bool]]:
    """Places of parts that stand for each other (fewest edits), and whether they are the same."""
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


def read_phone_times(path: Path) -> tuple[tuple[tuple[float, float, str], ...], TimeSpan | None]:
    """Parts and the word of a `.json`. Raises AlignmentError for an invalid file."""
    allowed = '{"phones": [[start_s, end_s, phone], …]}'
    record = read_record(path, max_bytes=FILE_MAX_BYTES, allowed=allowed, error=AlignmentError)
    try:
        parts = tuple((float(a), float(b), str(c)) for a, b, c in record["phones"])
        span = record.get("word")
        word = (float(span[0]), float(span[1])) if span is not None else None
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise AlignmentError.about(
            path, found=f"no list of phones ({type(error).__name__})", allowed=allowed
        ) from error
    if len(parts) > PHONES_MAX or (word is not None and not _in_order(np.array([word]))):
        raise AlignmentError.about(
            path, found="too many phones, or a word out of order", allowed=f"up to {PHONES_MAX}"
        )
    times = np.array([part[:2] for part in parts] or [(0.0, 0.0)])
    if not parts or not _in_order(times):
        raise AlignmentError.about(path, found="phones out of order, or none", allowed="in order")
    return parts, word


def _in_order(times: NDArray[np.float64]) -> bool:
    return bool(np.isfinite(times).all() and (np.diff(times.ravel()) >= -1e-6).all())
