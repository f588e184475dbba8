"""Whether sound and motion are synchronous: the mouth is open where open vowels are heard.

Loudness alone misleads: syllables follow one another so evenly that the next one fits as well.
Both are brought to 100 values a second, smoothed, and correlated at each lag. One short clip says
little; the sums over a subject's clips say much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from elocute.array_types import Float64Array
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.phones_and_visemes import PHONE_TO_VISEME, PHONES
from elocute.encoders.protocol import FEATURE_RATE
from elocute.numerics.smoothing import gaussian_smoothed

RATE = 100.0
BLUR_S = 0.05  # standard deviation: about 120 ms wide
LAG_MAX_S = 0.5
LAGS = np.arange(-round(LAG_MAX_S * RATE), round(LAG_MAX_S * RATE) + 1)
OPENNESS = {
    "aa": 1.0,
    "oh": 0.7,
    "E": 0.6,
    "ih": 0.35,
    "ou": 0.3,
    "RR": 0.3,
    "kk": 0.3,
    "TH": 0.25,
    "nn": 0.25,
    "CH": 0.25,
    "DD": 0.2,
    "SS": 0.15,
    "FF": 0.05,
    "PP": 0.0,
    "sil": 0.0,
}
"""How far a mouth opens for a viseme, roughly; a correlation needs no more."""


@dataclass(frozen=True, eq=False)
class LagSums:
    """Sums from which a correlation at each lag is computed; those of several clips add up."""

    # (lag,) Σ s·m, Σ s² and Σ m² of deviations from each clip's means, at the lags of `LAGS`.
    products: Float64Array
    sound: Float64Array
    motion: Float64Array
    seconds: float  # duration that was summed, s

    def __add__(self, other: LagSums) -> LagSums:
        return LagSums(
            self.products + other.products,
            self.sound + other.sound,
            self.motion + other.motion,
            self.seconds + other.seconds,
        )


@dataclass(frozen=True)
class SyncOffset:
    """By how much motion and sound are apart."""

    seconds: float  # how much later the motion is than the sound, s; negative where it is earlier
    r: float  # correlation at that lag
    gain: float  # how much higher it is than without a lag


def expected_openness(sound: Waveform) -> Float64Array:
    """How far the mouth should be open, by the phones that the speech encoder recognises.

    Parameters
    ----------
    sound : Waveform
        Speech.

    Returns
    -------
    (value,) float64
        0 to 1, at `RATE` values a second.
    """
    encoder = builtin_encoder()
    phones = np.exp(encoder.encode(sound.resample(SPEECH_RATE).samples))
    opened = phones @ np.array([OPENNESS[PHONE_TO_VISEME[phone]] for phone in PHONES])
    times = np.arange(int(sound.duration_s * RATE)) / RATE
    return _smoothed(np.interp(times, np.arange(len(opened)) / FEATURE_RATE, opened))


def lag_sums(sound: Waveform, activity: Float64Array, fps: float) -> LagSums | None:
    """Sum up the correlation of one clip at each lag.

    Parameters
    ----------
    sound : Waveform
        The clip's sound.
    activity : (frame,) float64
        How far the mouth is from rest, in any unit.
    fps : float
        Frames per second.

    Returns
    -------
    LagSums or None
        None where the clip is too short, or its sound or motion does not change.
    """
    if min(sound.duration_s, len(activity) / fps) * RATE < 3 * LAGS[-1]:
        return None
    voice = expected_openness(sound)
    times = np.arange(int(len(activity) / fps * RATE)) / RATE
    mouth = _smoothed(np.interp(times, np.arange(len(activity)) / fps, activity))
    count = min(len(voice), len(mouth))
    voice, mouth = voice[:count] - voice[:count].mean(), mouth[:count] - mouth[:count].mean()
    if voice.std() < 1e-6 or mouth.std() < 1e-6:
        return None
    mouth /= mouth.std()  # so that each clip counts by its length
    voice /= voice.std()
    products, squares_s, squares_m = (np.zeros(len(LAGS)) for _ in range(3))
    for place, lag in enumerate(LAGS):
        late = mouth[lag:] if lag >= 0 else mouth[:lag]
        early = voice[: len(voice) - lag] if lag >= 0 else voice[-lag:]
        products[place] = early @ late
        squares_s[place], squares_m[place] = early @ early, late @ late
    return LagSums(products, squares_s, squares_m, count / RATE)


def estimate_offset(sums: LagSums) -> SyncOffset:
    """The lag of the highest correlation, by a parabola through the values around it."""
    r = sums.products / np.sqrt(sums.sound * sums.motion)
    best = int(r.argmax())
    shift = 0.0
    if 0 < best < len(r) - 1:
        low, mid, high = r[best - 1 : best + 2]
        bend = low - 2 * mid + high
        shift = 0.5 * (low - high) / bend if bend < 0 else 0.0
    zero = len(LAGS) // 2
    seconds = (float(LAGS[best]) + float(shift)) / RATE
    return SyncOffset(seconds, float(r[best]), float(r[best] - r[zero]))


def _smoothed(values: Float64Array) -> Float64Array:
    """Values at `RATE`, smoothed by a Gaussian."""
    return gaussian_smoothed(values, BLUR_S * RATE)
