"""Reads phones with their times off the encoder's posteriors, where no text is known."""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array
from elocute.encoders.phones_and_visemes import PHONES, SILENCE
from elocute.numerics.lasting_states import best_paths
from elocute.speech.times.labels import Label

ROWS_PER_S = 50.0
SWITCH_NATS = 1.5
"""What a change of phones costs; of 1 to 4, fewest errors on a reader whom the encoder never heard:
docs/measurements/text.md."""


def heard_phones(log_posteriors: Float32Array, duration_s: float) -> list[Label]:
    """The most likely sequence of phones that last 0.04 s at least (Viterbi), pauses left out.

    They are start in s, end in s and ARPAbet phone, in order; none passes the sound's duration.

    Parameters
    ----------
    log_posteriors : (row, 40) float32
        Of the phone encoder, 50 rows a second.
    duration_s : float
        Of the sound.
    """
    if not len(log_posteriors):
        return []
    path = best_paths(log_posteriors[None].astype(np.float32), SWITCH_NATS)[0]
    edges = np.flatnonzero(np.diff(path)) + 1
    starts, ends = np.r_[0, edges], np.r_[edges, len(path)]
    return [
        (float(start / ROWS_PER_S), float(min(end / ROWS_PER_S, duration_s)), PHONES[path[start]])
        for start, end in zip(starts, ends, strict=True)
        if path[start] != SILENCE and start / ROWS_PER_S < duration_s
    ]
