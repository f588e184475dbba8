"""Gates over time: lips that must close, teeth that must meet the lip, silence that must rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]

CLOSING_S = 0.065  # lips take this long to meet, and to part again
REST_AFTER_S = 0.28  # a pause this long is a rest: the mouth closes
SPEECH_AT_LEAST_S = 0.08  # a blip shorter than this inside a rest is no speech
WAKE_S = 0.24  # the mouth prepares before the first sound
SETTLE_S = 0.22  # and settles after the last


def runs(inside: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and stop (exclusive) of every run of True."""
    edges = np.diff(np.concatenate([[0], inside.astype(np.int8), [0]]))
    starts, stops = np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist()
    return list(zip(starts, stops, strict=True))


def contact_gate(
    posterior: Array, rate: float, times_s: Array, threshold: float, hold_s: float
) -> Array:
    """(frame,) 0…1: full contact wherever `posterior` passes `threshold`, held and ramped.

    A contact begins where the posterior rises past half the threshold and ends where it falls
    below it again (hysteresis). One that peaks between half the threshold and the threshold
    comes part of the way, so nothing snaps.
    """
    gate = np.zeros(len(times_s), np.float32)
    for start, stop in runs(posterior > threshold / 2):
        peak = float(posterior[start:stop].max())
        depth = min(1.0, 2 * peak / threshold - 1)
        middle = (start + stop - 1) / 2 / rate
        half = max((stop - 1 - start) / rate, hold_s) / 2
        first, last = np.searchsorted(
            times_s, [middle - half - CLOSING_S, middle + half + CLOSING_S]
        )
        distance = np.abs(times_s[first:last] - middle) - half
        ramp = _smooth(1 - np.clip(distance / CLOSING_S, 0, 1)) * depth
        gate[first:last] = np.maximum(gate[first:last], ramp)
    return gate


def speech_gate(silence: Array, rate: float, times_s: Array) -> Array:
    """(frame,) 1 while somebody speaks, exactly 0 at rest, eased in between.

    silence (frame,) is the posterior of silence at `rate` Hz. Pauses shorter than
    REST_AFTER_S belong to the speech around them; blips in a rest do not wake the mouth.
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
        rise = _smooth(np.clip((now - begin_s + WAKE_S) / WAKE_S, 0, 1))
        fall = _smooth(np.clip((end_s + SETTLE_S - now) / SETTLE_S, 0, 1))
        gate[first:last] = np.maximum(gate[first:last], np.minimum(rise, fall))
    return gate


def _smooth(share: Array) -> Array:
    return share * share * (3 - 2 * share)
