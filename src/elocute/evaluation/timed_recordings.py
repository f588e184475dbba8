"""Recordings with known phone times, and how far the path of an alignment is from the true one.

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

from elocute.alignment.alignment import WarpingPath, check_path
from elocute.array_types import Float32Array
from elocute.encoders.protocol import FEATURE_RATE
from elocute.errors import AlignmentError
from elocute.files.json_records import read_record
from elocute.files.reading import FileKind
from elocute.numerics.resampling import interpolate
from elocute.one_line_repr import one_line

TimeSpan = tuple[float, float]
"""Start and end, s."""
PhoneSpan = tuple[float, float, str]
"""Start in s, end in s, phone."""
SAME_PHONES_MIN = 0.7
"""Share of two recordings' phones that must be the same for them to be a pair."""
PHONES_MAX = 1000  # the time to compare two recordings grows with its square
FILE_MAX_BYTES = 4_000_000
POINTS_PER_FRAME = 20  # points per frame on a true curve, before it becomes cells


@dataclass(frozen=True, eq=False)
class TimedRecording:
    """One recording of a word, alone or in a sentence.

    view: (frame, feature) of the sound, `rate` frames per second. phones: in order. word: where the
    word lies in a sentence, s.
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

    spans: start and end in s of each phone in the source, and of the same phone in the target.
    whole: whether the ends of both recordings correspond too.
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
    """Pair two recordings of a word; None where too few of their phones are the same."""
    matched = matched_phones([p[2] for p in source.phones], [p[2] for p in target.phones])
    longest = max(len(source.phones), len(target.phones))
    if sum(same for _, _, same in matched) < SAME_PHONES_MIN * longest:
        return None
    return RecordingPair(
        source, target, tuple((source.phones[i][:2], target.phones[j][:2]) for i, j, _ in matched)
    )


def sentence_pair(sentence: TimedRecording, word: TimedRecording) -> RecordingPair | None:
    """Pair a sentence with a recording of its word, as `word_pair`, by the phones within the word.

    Raises AlignmentError for a sentence without the place of its word.
    """
    if sentence.word is None:
        raise AlignmentError.about(sentence.name, found="no word in it", allowed="a sentence")
    start, end = sentence.word
    inner = tuple(p for p in sentence.phones if p[0] >= start - 1e-6 and p[1] <= end + 1e-6)
    within = TimedRecording(sentence.name, sentence.view, inner, sentence.word, sentence.rate)
    pair = word_pair(within, word)
    return pair and RecordingPair(pair.source, pair.target, pair.spans, whole=False)


def matched_phones(source: Sequence[str], target: Sequence[str]) -> list[tuple[int, int, bool]]:
    """Places of the phones matched with the fewest edits, and whether the two are the same."""
    rows, columns = len(source), len(target)
    edits = np.zeros((rows + 1, columns + 1), np.intp)
    edits[:, 0], edits[0] = np.arange(rows + 1), np.arange(columns + 1)
    for i in range(1, rows + 1):
        for j in range(1, columns + 1):
            swap = edits[i - 1, j - 1] + (source[i - 1] != target[j - 1])
            edits[i, j] = min(swap, edits[i - 1, j] + 1, edits[i, j - 1] + 1)
    matches, i, j = [], rows, columns
    while i and j:
        same = source[i - 1] == target[j - 1]
        if edits[i, j] == edits[i - 1, j - 1] + (not same):
            i, j = i - 1, j - 1
            matches.append((i, j, same))
        elif edits[i, j] == edits[i - 1, j] + 1:
            i -= 1
        else:
            j -= 1
    return matches[::-1]


def read_phone_times(path: Path) -> tuple[tuple[PhoneSpan, ...], TimeSpan | None]:
    """Read the phones of a recording, and where the word lies in a sentence, from its .json.

    Raises AlignmentError for a file that is missing or invalid.
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


def path_error(path: WarpingPath, true: WarpingPath) -> float:
    """Mean distance in frames of each path's points from the nearest point of the other path.

    Both (step, view) frames; 0 is the true path (Eq. 11 of Tzirakis et al. 2019). Raises
    AlignmentError for paths of other shapes.
    """
    from scipy.spatial import KDTree

    if path.ndim != 2 or true.ndim != 2 or path.shape[1] != true.shape[1]:
        raise AlignmentError.about(
            "paths", found=f"shapes {path.shape} and {true.shape}", allowed="(step, view) alike"
        )
    there, back = KDTree(true).query(path)[0], KDTree(path).query(true)[0]
    return float((there.sum() + back.sum()) / (len(path) + len(true)))


def intersection_over_union(first: TimeSpan, second: TimeSpan) -> float:
    """Of two spans of time: 1 where they are the same, 0 where they do not meet."""
    common = min(first[1], second[1]) - max(first[0], second[0])
    union = max(first[1], second[1]) - min(first[0], second[0])
    return max(0.0, common) / union if union > 0 else 1.0


def carried_overlap(
    path: WarpingPath, source: Sequence[TimeSpan], target: Sequence[TimeSpan], rate: float
) -> float:
    """Mean intersection over union, 0 to 1, of spans that a path carries from target to source.

    found: (step, 2) frames of source and target, frame k standing for the time around k / rate.
    source, target: the same spans in s (phones, or a word) in each. Raises AlignmentError for no
    span, or other numbers of them.
    """
    if not source or len(source) != len(target):
        raise AlignmentError.about(
            "parts", found=f"{len(source)} and {len(target)}", allowed="equally many, one at least"
        )
    overlaps = [
        intersection_over_union(_carried(path, part, rate), true)
        for part, true in zip(target, source, strict=True)
    ]
    return float(np.mean(overlaps))


def _carried(path: WarpingPath, part: TimeSpan, rate: float) -> TimeSpan:
    """Where a span of the target lies in the source, interpolated along the path."""
    places = np.array(part) * rate
    targets, first = np.unique(path[:, 1], return_index=True)
    means = np.add.reduceat(path[:, 0], first) / np.diff([*first, len(path)])
    start, end = np.interp(places, targets, means)
    return float(start / rate), float(end / rate)


def true_path(
    source: NDArray[np.floating],
    target: NDArray[np.floating],
    rate: float,
    frames: tuple[int, int],
    whole: bool = True,
) -> WarpingPath:
    """The path whose curve is piecewise linear between corresponding times.

    source, target: (boundary,) times in s that never decrease and mean the same in both recordings.
    rate: frames per second of both views, `frames` long. whole: whether the ends of both views
    correspond too. Raises AlignmentError for fewer than two boundaries, other numbers of them, or
    times that decrease.

    Returns
    -------
    (step, 2) int
        Frames of source and target.
    """
    if len(source) != len(target) or len(source) < 2 or rate <= 0:
        raise AlignmentError.about(
            "boundaries",
            found=f"{len(source)} and {len(target)}",
            allowed="equally many, two at least, at a rate above 0 Hz",
        )
    knots = np.stack([source, target], axis=1) * rate
    if (np.diff(knots, axis=0) < 0).any() or not np.isfinite(knots).all():
        raise AlignmentError.about("boundaries", found="times that go back", allowed="in order")
    ends = np.array(frames) - 1.0
    knots = np.clip(knots, 0, ends)
    if whole:
        knots = np.concatenate([[[0.0, 0.0]], knots, [ends]])
    lengths = np.abs(np.diff(knots, axis=0)).max(axis=1)
    along = np.concatenate([[0], np.cumsum(np.maximum(lengths, 1e-9))])
    fine = np.linspace(0, along[-1], max(2, int(along[-1] * POINTS_PER_FRAME)))
    curve = interpolate(along, knots, fine)
    cells = np.unique(np.floor(curve + 0.5).astype(np.intp), axis=0)
    # Cells of a curve that rises in both come out in order; sorting by the sum keeps ties so.
    cells = cells[np.argsort(cells.sum(axis=1), kind="stable")]
    check_path(cells, frames) if whole else None
    return cells
