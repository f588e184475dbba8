"""Finds where a mouth rests and where it breathes in, by how long pauses last.

A pause under 0.4 s belongs to the speech around it: people keep their lips parted there. In a
longer one the mouth settles after the last sound and wakes before the next; what lies between is
rest, and of a pause of half a second there is little. A take begins and ends at rest where there
is any silence to do it in. Before people speak they open to breathe in, before a first p too.
Nothing is looked at further than REACH_S.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from elocute.array_types import Float64Array, FloatArray
from elocute.articulation.contacts_and_rest import SPEECH_AT_LEAST_S, runs
from elocute.numerics.smoothing import smoothstep

PAUSE_S = 0.40  # a shorter pause is speech
EDGE_S = 0.32  # and so is one at an edge of a recording, which may be cut within speech
KNOWN_EDGE_S = 0.08  # but not of speech that is known
SETTLE_S = 0.18  # from the last sound until the mouth rests
WAKE_S = 0.60  # from rest until the next sound
LIVE_SETTLE_S, LIVE_WAKE_S = 0.30, 0.06  # likewise, of a sound whose end is not known
LIVE_EARLY_ROWS = 3  # before a sound, in which it wakes already
BREATH_S, OPENED_S = 0.50, 0.28  # before a sound: people open for it, and are widest open
BREATH_PAUSE_S = (0.25, 0.60)  # pauses without a breath, and with a whole one
REACH_S = WAKE_S + PAUSE_S + SPEECH_AT_LEAST_S
_FAR = 10**6  # rows


def rest_share(
    silence: FloatArray, rate: float, *, starts: bool = True, edge_s: float = EDGE_S
) -> Float64Array:
    """How far a mouth is at rest, by the posterior (row,) of silence.

    `starts` says whether the first row is the first of the take; at an edge of the take a pause
    shorter than `edge_s` is speech.

    Returns
    -------
    (row,) float64
        0 in speech, 1 at rest, eased in between.
    """
    passed, coming = _sounds_beside(_speaking(silence, rate, starts, edge_s))
    wake, settle = WAKE_S * rate, SETTLE_S * rate
    if starts and len(coming):
        wake = np.where(passed > _FAR / 2, np.clip(coming[0], 1, wake), wake)
    if len(passed):
        settle = np.where(coming > _FAR / 2, np.clip(passed[-1], 1, settle), settle)
    settled = smoothstep(np.clip(passed / settle, 0, 1))
    return settled * smoothstep(np.clip(coming / wake, 0, 1))


def live_rest_share(
    silence: FloatArray, rate: float, *, pause_s: float = PAUSE_S, unheard: int = 0
) -> Float64Array:
    """How far a mouth is at rest, by the posterior (row,) of silence that was heard so far.

    Nobody knows how long a pause will be: the mouth settles once it has lasted `pause_s`, and wakes
    as soon as somebody speaks. In the first `unheard` rows there is no sound at all: it rests.

    Returns
    -------
    (row,) float64
        0 in speech, 1 at rest, eased in between.
    """
    speaking = silence < 0.5
    share, before = np.zeros(len(silence)), 0.0
    begins = np.flatnonzero(np.diff(speaking, prepend=~speaking[:1]))
    if 0 < unheard < len(silence):
        begins = np.union1d(begins, unheard)
    for start, stop in pairwise([*begins.tolist(), len(silence)]):
        lasted_s = (np.arange(stop - start) + 1) / rate
        share[start:stop] = before * (1 - smoothstep(np.clip(lasted_s / LIVE_WAKE_S, 0, 1)))
        if start < unheard:
            share[start:stop] = 1
        elif not speaking[start]:
            settled = smoothstep(np.clip((lasted_s - pause_s) / LIVE_SETTLE_S, 0, 1))
            share[start:stop] = np.maximum(share[start:stop], settled)
        before = share[stop - 1]
    # It wakes before a sound, as far as that is known.
    coming = np.append(share, np.full(LIVE_EARLY_ROWS, before))
    return sliding_window_view(coming, LIVE_EARLY_ROWS + 1).min(axis=1)


def breath_share(
    silence: FloatArray, rate: float, *, starts: bool = True, edge_s: float = EDGE_S
) -> Float64Array:
    """How far a mouth is open to breathe in before it speaks; arguments are those of `rest_share`.

    Returns
    -------
    (row,) float64
        0 to 1, by how long the pause before a sound has lasted.
    """
    passed, coming = _sounds_beside(_speaking(silence, rate, starts, edge_s))
    if starts:
        passed = np.where(passed > _FAR / 2, np.arange(len(passed)), passed)
    pause_s = np.where(coming > _FAR / 2, 0.0, (passed + coming) / rate)
    shortest, longest = BREATH_PAUSE_S
    deep = smoothstep(np.clip((pause_s - shortest) / (longest - shortest), 0, 1))
    begin_s = np.clip(pause_s, OPENED_S + 0.1, BREATH_S)
    before_s = coming / rate
    opening = smoothstep(np.clip((begin_s - before_s) / (begin_s - OPENED_S), 0, 1))
    return deep * opening * smoothstep(np.clip(before_s / OPENED_S, 0, 1))


def _sounds_beside(speaking: NDArray[np.bool_]) -> tuple[Float64Array, Float64Array]:
    """(row,) rows since the last sound and until the next; `_FAR` and more where there is none."""
    places = np.arange(len(speaking))
    last = np.maximum.accumulate(np.where(speaking, places, -_FAR))
    coming = np.minimum.accumulate(np.where(speaking, places, 2 * _FAR)[::-1])[::-1]
    return (places - last).astype(np.float64), (coming - places).astype(np.float64)


def _speaking(silence: FloatArray, rate: float, starts: bool, edge_s: float) -> NDArray[np.bool_]:
    """(row,) speech without noises that are too short, and with pauses that are."""
    speaking = silence < 0.5
    for start, stop in runs(speaking):
        if (stop - start) / rate < SPEECH_AT_LEAST_S:
            speaking[start:stop] = False
    for start, stop in runs(~speaking):
        edge = (start == 0 and starts) or stop == len(silence)
        alone = start == 0 and (stop == len(silence) or not starts)
        if (stop - start) / rate < (edge_s if edge else PAUSE_S) and not alone:
            speaking[start:stop] = True
    return speaking
