"""Contacts and rest over time: closed lips, teeth on the lip, and a mouth at rest in silence."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray
from elocute.numerics.smoothing import smoothstep

HYSTERESIS = 0.7
SPEECH_FLOOR = 0.15
WAIT_S = 0.16  # lips are shut this long before a first burst at most
CLOSING_S = 0.050  # lips take this long to meet, and to part again
CONTACT_S = 0.5  # of a longer contact, evidence no further than this away counts
HOLD_MAX_S = 0.3  # the longest that a style holds a contact at least
REST_AFTER_S = 0.28  # a pause this long is a rest: the mouth closes
SPEECH_AT_LEAST_S = 0.08  # anything shorter than this inside a rest is not speech
WAKE_S = 0.32  # the mouth opens to breathe and prepares before the first sound
SETTLE_S = 0.16  # and settles after the last


def runs(inside: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and stop (exclusive) of every run of True."""
    edges = np.diff(np.concatenate([[0], inside.astype(np.int8), [0]]))
    starts, stops = np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist()
    return list(zip(starts, stops, strict=True))


def waiting_from(silence: FloatArray, start: int, most: int) -> int:
    """The row from which lips wait in a silence for a contact at `start`, `most` rows before it."""
    first = start
    while first > max(0, start - most) and silence[first - 1] > 0.5:
        first -= 1
    return first


def contact_evidence(posterior: FloatArray, silence: FloatArray) -> FloatArray:
    """(frame,) how likely a contact is, given that there is speech.

    The closure of a first p or b is silent, so its posterior alone stays low until the burst;
    relative to what is not silence it does not. Three frames are averaged: a contact lasts.
    """
    window = np.ones(3) / 3
    return np.convolve(posterior, window, "same") / (
        np.convolve(1 - silence, window, "same") + SPEECH_FLOOR
    )


def contact_gate(
    evidence: FloatArray,
    silence: FloatArray,
    rate: float,
    times_s: FloatArray,
    threshold: float,
    hold_s: float,
) -> FloatArray:
    """(frame,) 0…1: full contact wherever `evidence` passes `threshold`, held and ramped.

    A contact lasts while the evidence stays above HYSTERESIS of the threshold, and reaches back
    into a silence before it, where the lips wait. One that peaks below the threshold comes part
    of the way, so nothing snaps; of one that is held for long, the peak nearby decides.
    """
    gate = np.zeros(len(times_s), np.float32)
    back, reach = round(WAIT_S * rate), round(CONTACT_S * rate)
    for start, stop in runs(evidence > HYSTERESIS * threshold):
        waiting = waiting_from(silence, start, back)
        middle, half = (waiting + stop - 1) / 2 / rate, (stop - 1 - waiting) / rate / 2
        half = max(half, hold_s / 2)
        first, last = np.searchsorted(
            times_s, [middle - half - CLOSING_S, middle + half + CLOSING_S]
        )
        now = times_s[first:last]
        distance = np.abs(now - middle) - half
        depth = _depth(evidence[start:stop] / threshold, reach, now * rate - start)
        ramp = smoothstep(1 - np.clip(distance / CLOSING_S, 0, 1)) * depth
        gate[first:last] = np.maximum(gate[first:last], ramp)
    return gate


def _depth(peaks: FloatArray, reach: int, places: FloatArray) -> FloatArray | float:
    """How far the lips come, 0…1: at `places` (rows of a run, fractions between) or throughout.

    peaks (row,) evidence as multiples of the threshold.
    """
    if len(peaks) <= reach:
        return min(1.0, (float(peaks.max()) - HYSTERESIS) / (1 - HYSTERESIS))
    padded = np.pad(peaks, reach, constant_values=0)
    nearby = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
    depths = np.minimum(1.0, (nearby - HYSTERESIS) / (1 - HYSTERESIS))
    return np.interp(places, np.arange(len(depths)), depths)


def speech_gate(silence: FloatArray, rate: float, times_s: FloatArray) -> FloatArray:
    """(frame,) 1 in speech, exactly 0 at rest, eased in between.

    silence (frame,) is the posterior of silence at `rate` Hz. Pauses shorter than
    REST_AFTER_S belong to the speech around them; short noises in a rest do not open the mouth.
    """
    speaking = silence < 0.5
    for start, stop in runs(~speaking):
        inner = start > 0 and stop < len(silence)
        if inner and (stop - start) / rate < REST_AFTER_S:
            speaking[start:stop] = True
    gate = np.zeros(len(times_s), np.float32)
    for start, stop in runs(speaking):
        if (stop - start) / rate < SPEECH_AT_LEAST_S:
            continue
        begin_s, end_s = start / rate, (stop - 1) / rate
        first, last = np.searchsorted(times_s, [begin_s - WAKE_S, end_s + SETTLE_S])
        now = times_s[first:last]
        rise = smoothstep(np.clip((now - begin_s + WAKE_S) / WAKE_S, 0, 1))
        fall = smoothstep(np.clip((end_s + SETTLE_S - now) / SETTLE_S, 0, 1))
        gate[first:last] = np.maximum(gate[first:last], np.minimum(rise, fall))
    return gate
