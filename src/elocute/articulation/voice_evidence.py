"""Whether what sounds like phones is a voice, as far as the posteriors of phones tell.

A voice changes its phones ten times a second and more, and the ear is sure of some of them. Barks,
horns and sirens are heard as many phones at once, of which none is likely; chords as a vowel that
hardly changes. A vowel that is held, in a song or a shout, changes little too, but the ear is sure
of it; so may a syllable alone. Whatever is close by counts: half a second on both sides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray
from elocute.audio.phones_and_visemes import SILENCE
from elocute.numerics.smoothing import smoothstep

WINDOW_S = 0.5
LIKELIEST = (0.20, 0.25)  # mean posterior of the likeliest phone, given speech: noise, voice
CHANGES_PER_S = (6.0, 7.4)  # half the sum of differences between rows
HELD = (0.60, 0.70)  # the likeliest phone of a vowel that is held
LONG_S = (0.36, 0.48)  # of sound nearby, from which it has to change: a syllable need not
LEAST_ROWS = 3.0  # of speech that a judgement needs


def voice_share(posteriors: FloatArray, rate: float) -> NDArray[np.float64]:
    """How surely somebody speaks, or sings, where there is any sound.

    Parameters
    ----------
    posteriors : (row, 40)
        Of phones.
    rate : float
        Rows per second.

    Returns
    -------
    (row,) float64
        1 for a voice and for silence, 0 for noise.
    """
    speech = np.maximum(1 - posteriors[:, SILENCE].astype(np.float64), 0)
    phones = np.delete(posteriors, SILENCE, axis=1)
    likeliest = phones.max(axis=1, initial=0.0) / np.maximum(speech, 1e-6)
    given = phones / np.maximum(speech, 1e-6)[:, None]
    changes = np.abs(np.diff(given, axis=0, prepend=given[:1])).sum(axis=1) / 2
    # From one phone to another: that a sound begins or ends is no change.
    both = np.minimum(speech, np.concatenate([speech[:1], speech[:-1]]))
    heard = _windowed(speech, rate)
    sure = _windowed(likeliest * speech, rate) / np.maximum(heard, 1e-6)
    pace = _windowed(changes * both, rate) * rate / np.maximum(heard, 1e-6)
    changing = np.maximum(_rising(pace, CHANGES_PER_S), _rising(sure, HELD))
    voiced = _rising(sure, LIKELIEST) * (1 - _rising(heard / rate, LONG_S) * (1 - changing))
    judged = np.clip(heard / LEAST_ROWS, 0, 1)
    return 1 - judged * (1 - voiced)


def _windowed(values: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
    """(row,) sums over a window about each row."""
    half = round(WINDOW_S * rate)
    sums = np.concatenate([[0.0], np.cumsum(np.pad(values, half))])
    return np.maximum(sums[2 * half + 1 :] - sums[: -2 * half - 1], 0)


def _rising(values: NDArray[np.float64], limits: tuple[float, float]) -> NDArray[np.float64]:
    low, high = limits
    return smoothstep(np.clip((values - low) / (high - low), 0, 1))
