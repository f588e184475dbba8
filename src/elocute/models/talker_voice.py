"""Whether what sounds like phones is a voice: a small network over half a second on both sides.

The ear is asked how sure it is, how fast its phones change and of which kinds they are; the
spectrum what it is like in the mean and how it varies. `recipes.train_voice` fits the network.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from elocute.array_types import Float64Array, FloatArray
from elocute.audio.phones_and_visemes import PHONES, SILENCE
from elocute.files.array_reading import read_npz
from elocute.numerics.smoothing import smoothstep

VOICE_PATH = Path(__file__).parent / "assets" / "voice.npz"
FILE_MAX_BYTES = 65_536
WINDOW_S = 0.5
LEAST_ROWS = 3.0  # of sound that a judgement needs
NOISE, VOICE = -1.5, 0.0  # the network's answer where nothing moves, and where all of it does
LIKELY = 4.0  # deviations from the mean: what is further off counts as so far
KINDS = (
    "AA AE AH AO EH ER IH IY UH UW AW AY EY OW OY",
    "M N NG L R W Y",
    "S Z SH ZH CH JH F TH HH",
    "P B T D K G",
)


def voice_features(posteriors: FloatArray, bands: FloatArray, rate: float) -> Float64Array:
    """What a judgement is made from, within `WINDOW_S` of each row.

    Parameters
    ----------
    posteriors : (row, 40)
        Of phones.
    bands : (row, band)
        As `BandLevels` gives them.
    rate : float
        Rows per second.

    Returns
    -------
    (row, feature) float64
        The first is the rows of sound.
    """
    sound = np.clip(1 - posteriors[:, SILENCE].astype(np.float64), 0, 1)
    given = posteriors.astype(np.float64) / np.maximum(sound, 1e-6)[:, None]
    phones = np.delete(given, SILENCE, axis=1)
    heard = _windowed(sound, rate)

    def mean(values: Float64Array) -> Float64Array:
        columns = values.reshape(len(values), -1).T
        return np.stack([_windowed(c * sound, rate) / np.maximum(heard, 1e-3) for c in columns], 1)

    def deviation(values: Float64Array) -> Float64Array:
        return np.sqrt(np.maximum(mean(values**2) - mean(values) ** 2, 0))

    # From one phone to another: that a sound begins or ends is no change.
    both = np.minimum(sound, np.concatenate([sound[:1], sound[:-1]]))
    changes = np.abs(np.diff(phones, axis=0, prepend=phones[:1])).sum(axis=1) / 2
    pace = _windowed(both * changes, rate) * rate / np.maximum(heard, 1e-3)
    levels = bands.astype(np.float64)
    level = levels.mean(axis=1)
    shape = levels - level[:, None]
    kinds = [given[:, [PHONES.index(p) for p in kind.split()]].sum(axis=1) for kind in KINDS]
    columns = [
        heard[:, None],
        mean(phones.max(axis=1)),
        mean(-(phones * np.log(phones + 1e-9)).sum(axis=1)),
        pace[:, None],
        mean(sound),
        mean(np.stack(kinds, axis=1)),
        mean(_steps(levels)),
        mean(_steps(shape)),
        deviation(level),
        mean(shape),
        deviation(shape),
    ]
    return np.concatenate(columns, axis=1)


def voice_share(posteriors: FloatArray, bands: FloatArray, rate: float) -> Float64Array:
    """How surely somebody speaks, sings or laughs, where there is any sound.

    Parameters
    ----------
    posteriors, bands, rate
        As `voice_features` takes them.

    Returns
    -------
    (row,) float64
        1 for a voice and for silence, 0 for noise.
    """
    features = voice_features(posteriors, bands, rate)
    stored = _network()
    z = np.clip((features - stored["middle"]) / stored["spread"], -LIKELY, LIKELY)
    told = np.tanh(z @ stored["inner"] + stored["inner_bias"]) @ stored["outer"]
    share = (told + stored["outer_bias"] - NOISE) / (VOICE - NOISE)
    judged = np.clip(features[:, 0] / LEAST_ROWS, 0, 1)
    return 1 - judged * (1 - smoothstep(np.clip(share, 0, 1)))


@cache
def _network() -> dict[str, Float64Array]:
    """The network that ships: `middle`, `spread` (feature,), `inner` (feature, unit), `inner_bias`
    and `outer` (unit,), `outer_bias` ().
    """
    stored = read_npz(VOICE_PATH, max_bytes=FILE_MAX_BYTES, allowed="the network for voices")
    return {name: values.astype(np.float64) for name, values in stored.items()}


def _steps(values: Float64Array) -> Float64Array:
    """(row,) mean change of a spectrum since the row before."""
    return np.abs(np.diff(values, axis=0, prepend=values[:1])).mean(axis=1)


def _windowed(values: Float64Array, rate: float) -> Float64Array:
    """(row,) sums over a window about each row."""
    half = round(WINDOW_S * rate)
    sums = np.concatenate([[0.0], np.cumsum(np.pad(values, half))])
    return np.maximum(sums[2 * half + 1 :] - sums[: -2 * half - 1], 0)
