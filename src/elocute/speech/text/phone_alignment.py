"""Aligns the phones of a known text with a recording, in any language with the encoder's phones.

The lattice is the words in order, a rest allowed before, between and after them. Its emissions are
the encoder's posteriors; a boundary is where the odds of being past it turn, so it falls between
rows of 20 ms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, Float64Array
from elocute.encoders.phones_and_visemes import PHONE_TO_VISEME, PHONES, SILENCE
from elocute.encoders.protocol import FEATURE_RATE
from elocute.errors import AlignmentError
from elocute.speech.spoken_text import SpokenWord

VISEME_SHARE = 0.5
"""Share of the viseme's posterior in an emission: voices differ in which of its phones they
have."""
WORST = -8.0
"""Least logarithm of a posterior, so that no single row can rule out a path."""
REST_COST = 2.0
"""Cost of entering a rest: a stop's closure belongs to the stop."""
BEAM, WIDER_BEAM = 300.0, 3000.0
BAND = 60
"""States on each side of the best path that share in it."""
OUTSIDE_COST_PER_S, OUTSIDE_COST_MAX = 100.0, 10.0
"""Cost of a phone outside the given time of its word: per second, and at most."""
NEVER = -1e30
ANYWHEN = (-np.inf, np.inf)


@dataclass(frozen=True)
class PronouncedWord:
    """A word and its phones: one or more, ARPAbet without stress.

    `span_s` is its start and end in s, where known; `sure` says that it is known to be said, and no
    guess.
    """

    text: str
    phones: tuple[str, ...]
    span_s: tuple[float, float] | None = None
    sure: bool = True


@dataclass(frozen=True)
class _Lattice:
    """States in order: the phone of each, whether it rests, and when its word lasts, s."""

    phones: NDArray[np.intp]
    is_rest: NDArray[np.bool_]
    begins: Float64Array | None = None
    ends: Float64Array | None = None

    @property
    def entry(self) -> Float64Array:
        """What it costs to enter each state."""
        return np.where(self.is_rest, -REST_COST, 0.0)

    @property
    def skips(self) -> NDArray[np.bool_]:
        """Whether each state can be entered from two before it: over a rest."""
        skippable = np.zeros(len(self.phones), bool)
        skippable[2:] = self.is_rest[1:-1] & ~self.is_rest[2:]
        return skippable


def align_phones(log_posteriors: Float32Array, words: Sequence[PronouncedWord]) -> list[SpokenWord]:
    """Find the phones of one word or more that are spoken in order; one SpokenWord for each.

    Parameters
    ----------
    log_posteriors : (row, 40) float32
        Of the phone encoder, 50 rows a second.
    words : sequence of PronouncedWord
        In the order in which they are said.

    Raises
    ------
    AlignmentError
        For no words, an unknown phone, or more phones than rows.
    """
    lattice = _lattice(words)
    rows, count = len(log_posteriors), int((~lattice.is_rest).sum())
    if count > rows:
        raise AlignmentError.about(
            "text",
            found=f"{len(words)} words of {count} phones for {rows / FEATURE_RATE:.2f} s",
            allowed="the text of this sound",
        )
    visemes = viseme_posteriors(log_posteriors)
    scores = _emissions(log_posteriors, visemes)
    path = _best_path(scores, lattice)
    starts = _boundaries(scores, lattice, path) / FEATURE_RATE
    return _aligned(words, lattice, starts, visemes)


def viseme_posteriors(log_posteriors: Float32Array) -> Float64Array:
    """The posterior of each phone's viseme.

    Parameters
    ----------
    log_posteriors : (row, 40) float32
        Of the phone encoder.

    Returns
    -------
    (row, 40) float64
        Sums over phones that look alike.
    """
    visemes = [PHONE_TO_VISEME[phone] for phone in PHONES]
    alike = np.array([[one == other for other in visemes] for one in visemes], float)
    return np.exp(log_posteriors.astype(float)) @ alike


def _lattice(words: Sequence[PronouncedWord]) -> _Lattice:
    phones, rests, spans = [SILENCE], [True], [ANYWHEN]
    for word in words:
        strange = [phone for phone in word.phones if phone not in PHONES]
        if strange or not word.phones:
            raise AlignmentError.about(
                f"word {word.text[:40]!r}",
                found=f"phone {strange[0][:20]!r}" if strange else "no phones",
                allowed=" ".join(PHONES),
            )
        count = len(word.phones)
        phones += [*map(PHONES.index, word.phones), SILENCE]
        rests += [False] * count + [True]
        spans += [word.span_s or ANYWHEN] * count + [ANYWHEN]
    if len(phones) < 3:
        raise AlignmentError.about("text", found="no words", allowed="one word or more")
    if all(word.span_s is None for word in words):
        return _Lattice(np.array(phones), np.array(rests))
    begins, ends = np.array(spans).T
    return _Lattice(np.array(phones), np.array(rests), begins, ends)


def _emissions(log_posteriors: Float32Array, visemes: Float64Array) -> Float64Array:
    """(row, 40) scores of phones."""
    mixed = (1 - VISEME_SHARE) * np.exp(log_posteriors.astype(float)) + VISEME_SHARE * visemes
    return np.maximum(np.log(np.maximum(mixed, 1e-9)), WORST)


def _scores_of(
    scores: Float64Array, lattice: _Lattice, row: int, first: int, stop: int
) -> Float64Array:
    """(state,) emissions of states first…stop in a row, less outside the time of their word."""
    state_scores = scores[row, lattice.phones[first:stop]]
    if lattice.begins is None or lattice.ends is None:
        return state_scores
    time = row / FEATURE_RATE
    away = np.maximum(lattice.begins[first:stop] - time, time - lattice.ends[first:stop])
    return state_scores - np.clip(away * OUTSIDE_COST_PER_S, 0, OUTSIDE_COST_MAX)


def _best_path(scores: Float64Array, lattice: _Lattice) -> NDArray[np.intp]:
    """(row,) states of the best path, found with a beam; the beam is widened where it was lost."""
    for beam in (BEAM, WIDER_BEAM, np.inf):
        path = _beam_path(scores, lattice, beam)
        if path is not None:
            return path
    raise AssertionError("no path without a beam")


def _beam_path(scores: Float64Array, lattice: _Lattice, beam: float) -> NDArray[np.intp] | None:
    rows, states = len(scores), len(lattice.phones)
    entry, skips = lattice.entry, lattice.skips
    first, total = 0, np.array([0.0, 0.0])
    total += _scores_of(scores, lattice, 0, 0, 2)
    came: list[tuple[int, NDArray[np.int8]]] = [(0, np.zeros(2, np.int8))]
    for row in range(1, rows):
        stop = min(first + len(total) + 2, states)
        before = np.concatenate([[NEVER, NEVER], total, [NEVER, NEVER]])[: stop - first + 2]
        options = np.stack(
            [
                before[2:],
                before[1:-1] + entry[first:stop],
                np.where(skips[first:stop], before[:-2], NEVER),
            ]
        )
        best = options.argmax(axis=0).astype(np.int8)
        total = options.max(axis=0) + _scores_of(scores, lattice, row, first, stop)
        came.append((first, best))
        alive = np.flatnonzero(total > total.max() - beam)
        begin, end = int(alive[0]), int(alive[-1]) + 1
        total, first = total[begin:end], first + begin
    ends = [state for state in (states - 1, states - 2) if first <= state < first + len(total)]
    ends = [state for state in ends if total[state - first] > NEVER / 2]
    if not ends:
        return None
    state = max(ends, key=lambda each: total[each - first])
    path = np.empty(rows, np.intp)
    for row in range(rows - 1, -1, -1):
        path[row] = state
        begin, best = came[row]
        state -= int(best[state - begin])
    return path


def _boundaries(
    scores: Float64Array,
    lattice: _Lattice,
    path: NDArray[np.intp],
) -> Float64Array:
    """(state + 1,) row, with fractions, at which each state begins; the last is the end.

    Forward and backward sums over all paths near the best one.
    """
    rows, states = len(scores), len(lattice.phones)
    width = min(2 * BAND + 1, states)
    firsts = np.clip(path - BAND, 0, states - width)
    entry, skips = lattice.entry, lattice.skips
    emitted = np.stack(
        [
            _scores_of(scores, lattice, row, first, first + width)
            for row, first in enumerate(firsts.tolist())
        ]
    )
    ahead = np.full((rows, width), NEVER)
    ahead[0, :2] = emitted[0, :2]  # the first band begins at state 0
    for row in range(1, rows):
        first = int(firsts[row])
        span = slice(first, first + width)
        before = _shifted(ahead[row - 1], first - int(firsts[row - 1]) - 2, width + 2)
        stay, step = before[2:], before[1:-1] + entry[span]
        skip = np.where(skips[span], before[:-2], NEVER)
        ahead[row] = np.logaddexp(np.logaddexp(stay, step), skip) + emitted[row]
    behind = np.full((rows, width), NEVER)
    last = np.arange(int(firsts[-1]), int(firsts[-1]) + width)
    behind[-1, last >= states - 2] = 0.0
    for row in range(rows - 2, -1, -1):
        first, following = int(firsts[row]), int(firsts[row + 1])
        after = behind[row + 1] + emitted[row + 1]
        span = slice(following, following + width)
        stay = _shifted(after, first - following, width)
        step = _shifted(after + entry[span], first - following + 1, width)
        skip = _shifted(np.where(skips[span], after, NEVER), first - following + 2, width)
        behind[row] = np.logaddexp(np.logaddexp(stay, step), skip)
    del emitted
    ahead += behind
    ahead -= np.logaddexp.reduce(ahead, axis=1, keepdims=True)
    past = np.cumsum(np.exp(ahead)[:, ::-1], axis=1)[:, ::-1]
    return _crossings(past, firsts, states)


def _shifted(values: Float64Array, offset: int, width: int) -> Float64Array:
    """`width` values from `offset` on, NEVER where there are none."""
    shifted = np.full(width, NEVER)
    begin, end = max(0, -offset), min(width, len(values) - offset)
    if end > begin:
        shifted[begin:end] = values[begin + offset : end + offset]
    return shifted


def _crossings(past: Float64Array, firsts: NDArray[np.intp], states: int) -> Float64Array:
    """Where the odds of being in each state or a later one pass one half, in rows.

    past (row, band): those odds for the states of each row's band.
    """
    rows, width = past.shape
    starts = np.zeros(states + 1)
    starts[states] = rows
    columns = np.arange(states)
    # Rows whose band holds a state are in one piece, since bands only move on.
    begins = np.searchsorted(firsts + width, columns, "right")
    ends = np.searchsorted(firsts, columns, "right")
    for state in range(1, states):
        inside = slice(int(begins[state]), int(ends[state]))
        odds = past[np.arange(inside.start, inside.stop), state - firsts[inside]]
        over = np.flatnonzero(odds >= 0.5)
        if not len(over):
            starts[state] = inside.stop
            continue
        row = int(over[0])
        under = odds[row - 1] if row else 0.0
        starts[state] = inside.start + row - 1 + (0.5 - under) / max(odds[row] - under, 1e-9)
    return np.maximum.accumulate(np.clip(starts, 0, rows))


def _aligned(
    words: Sequence[PronouncedWord],
    lattice: _Lattice,
    starts_s: Float64Array,
    visemes: Float64Array,
) -> list[SpokenWord]:
    padded = np.pad(visemes, ((1, 1), (0, 0)), "edge")
    heard = np.log(np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:]).clip(1e-4, 1))
    spoken, state = [], 1
    for word in words:
        phones, logs = [], []
        for phone in word.phones:
            start, end = float(starts_s[state]), float(starts_s[state + 1])
            first = min(round(start * FEATURE_RATE), len(heard) - 1)
            stop = max(first + 1, round(end * FEATURE_RATE))
            logs.append(heard[first:stop, PHONES.index(phone)])
            phones.append((start, end, phone))
            state += 1
        state += 1  # the rest behind the word
        sure = float(np.exp(np.concatenate(logs).mean()))
        spoken.append(SpokenWord(word.text, tuple(phones), min(sure, 1.0) if word.sure else 0.0))
    return spoken
