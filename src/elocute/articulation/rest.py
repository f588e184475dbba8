"""Where a mouth rests: a matter of how long a pause has lasted and how soon speech comes.

A pause under 0.4 s belongs to the speech around it: people keep their lips parted there. In a
longer one the mouth settles after the last sound and wakes before the next; what lies between is
rest, and of a pause of half a second there is little. Nothing is looked at further than REACH_S.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray
from elocute.articulation.contacts_and_rest import SPEECH_AT_LEAST_S, runs
from elocute.numerics.smoothing import smoothstep

PAUSE_S = 0.40  # a shorter pause is speech; so is one at the edge of a take cut within speech
SETTLE_S = 0.25  # from the last sound until the mouth rests
WAKE_S = 0.60  # from rest until the next sound
REACH_S = WAKE_S + PAUSE_S + SPEECH_AT_LEAST_S


def rest_share(silence: FloatArray, rate: float, *, starts: bool = True) -> NDArray[np.float64]:
    """How far a mouth is at rest.

    Parameters
    ----------
    silence : (row,)
        Posterior of silence.
    rate : float
        Rows per second.
    starts : bool
        Whether the first row is the first of the take.

    Returns
    -------
    (row,) float64
        0 in speech, 1 at rest, eased in between.
    """
    speaking = _speaking(silence, rate, starts)
    count = len(speaking)
    places = np.arange(count)
    last = np.maximum.accumulate(np.where(speaking, places, -(10**6)))
    coming = np.minimum.accumulate(np.where(speaking, places, 10**6)[::-1])[::-1]
    settled = smoothstep(np.clip((places - last) / rate / SETTLE_S, 0, 1))
    asleep = smoothstep(np.clip((coming - places) / rate / WAKE_S, 0, 1))
    return settled * asleep


def _speaking(silence: FloatArray, rate: float, starts: bool) -> NDArray[np.bool_]:
    """(row,) speech without noises that are too short, and with pauses that are."""
    speaking = silence < 0.5
    for start, stop in runs(speaking):
        if (stop - start) / rate < SPEECH_AT_LEAST_S:
            speaking[start:stop] = False
    for start, stop in runs(~speaking):
        alone = start == 0 and (stop == len(silence) or not starts)
        if (stop - start) / rate < PAUSE_S and not alone:
            speaking[start:stop] = True
    return speaking
