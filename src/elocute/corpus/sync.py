"""Whether sound and motion run together: the mouth is open where the voice is loud.

Both are brought to 100 values a second, blurred, and correlated at each lag. One short clip says
little; the sums over a subject's clips say much.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.audio.waveform import Waveform

Floats = NDArray[np.float64]

RATE = 100.0
BLUR_S = 0.05  # standard deviation: about 120 ms wide
LAG_MAX_S = 0.5
LAGS = np.arange(-round(LAG_MAX_S * RATE), round(LAG_MAX_S * RATE) + 1)
QUIETEST = 0.003  # of full scale: what counts as no voice


@dataclass(frozen=True, eq=False)
class LagSums:
    """Sums from which a correlation at each lag comes; those of several clips add up.

    products, sound, motion  (lag,): Σ s·m, Σ s², Σ m² of deviations from each clip's means
    """

    products: Floats
    sound: Floats
    motion: Floats
    seconds: float

    def __add__(self, other: LagSums) -> LagSums:
        return LagSums(
            self.products + other.products, self.sound + other.sound,
            self.motion + other.motion, self.seconds + other.seconds,
        )  # fmt: skip


@dataclass(frozen=True)
class Offset:
    """seconds that the motion comes late (negative: early); r there; gain over r at no lag."""

    seconds: float
    r: float
    gain: float


def loudness(sound: Waveform) -> Floats:
    """(value,) at RATE: log of the root mean square, in units of e, above QUIETEST."""
    hop = sound.sample_rate / RATE
    count = max(1, int(len(sound.samples) / hop))
    edges = np.minimum((np.arange(count + 1) * hop).round().astype(int), len(sound.samples))
    power = np.concatenate([[0.0], np.cumsum(np.square(sound.samples, dtype=np.float64))])
    widths = np.maximum(np.diff(edges), 1)
    energy = np.maximum(power[edges[1:]] - power[edges[:-1]], 0) / widths
    return _blurred(0.5 * np.log(energy + QUIETEST**2) - np.log(QUIETEST))


def lag_sums(sound: Waveform, activity: Floats, fps: float) -> LagSums | None:
    """Correlation sums of one clip; None where it is too short or one of both is constant."""
    voice = loudness(sound)
    times = np.arange(int(len(activity) / fps * RATE)) / RATE
    mouth = _blurred(np.interp(times, np.arange(len(activity)) / fps, activity))
    count = min(len(voice), len(mouth))
    if count < 3 * LAGS[-1]:
        return None
    voice, mouth = voice[:count] - voice[:count].mean(), mouth[:count] - mouth[:count].mean()
    if voice.std() < 1e-6 or mouth.std() < 1e-6:
        return None
    mouth /= mouth.std()  # so that each clip counts by its length
    voice /= voice.std()
    products, squares_s, squares_m = (np.zeros(len(LAGS)) for _ in range(3))
    for place, lag in enumerate(LAGS):
        late = mouth[lag:] if lag >= 0 else mouth[:lag]
        heard = voice[: len(voice) - lag] if lag >= 0 else voice[-lag:]
        products[place] = heard @ late
        squares_s[place], squares_m[place] = heard @ heard, late @ late
    return LagSums(products, squares_s, squares_m, count / RATE)


def estimate_offset(sums: LagSums) -> Offset:
    """The lag of the highest correlation, between values by a parabola."""
    r = sums.products / np.sqrt(sums.sound * sums.motion)
    best = int(r.argmax())
    shift = 0.0
    if 0 < best < len(r) - 1:
        low, mid, high = r[best - 1 : best + 2]
        bend = low - 2 * mid + high
        shift = 0.5 * (low - high) / bend if bend < 0 else 0.0
    zero = len(LAGS) // 2
    seconds = (float(LAGS[best]) + float(shift)) / RATE
    return Offset(seconds, float(r[best]), float(r[best] - r[zero]))


def _blurred(values: Floats) -> Floats:
    width = BLUR_S * RATE
    reach = round(3 * width)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    blurred = np.convolve(np.pad(values, reach, mode="edge"), kernel / kernel.sum(), "valid")
    return blurred.astype(np.float64)
