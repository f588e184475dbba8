"""What the model of many talkers is given: phones, loudness, and the mouth of the rules.

Training and inference share it. Phones are given that somebody speaks, so that a pause is no
evidence instead of a far point; whatever depends on level is relative to the voice's own.
"""

from __future__ import annotations

import numpy as np

from elocute.array_types import Float32Array, Float64Array, FloatArray
from elocute.articulation.driver import articulate
from elocute.articulation.phone_targets import curve_names
from elocute.audio.phones_and_visemes import PHONES, SILENCE
from elocute.encoders.protocol import FEATURE_RATE
from elocute.motion.mouth_response import builtin_response

SPEECH_FLOOR = 0.15
LEVEL_AHEAD = 30  # rows in which the voice may still get louder
LEVEL_DB = 20.0  # one unit of level
LEVEL_LEAST, LEVEL_MOST = -2.0, 0.5
RULES_MIDDLE_MM = np.array([3.0, 53.0, 0.5, 4.0], np.float32)
RULES_UNIT_MM = np.array([3.0, 3.0, 2.0, 4.0], np.float32)
PHONE_COLUMNS = len(PHONES) - 1
SILENCE_COLUMN, LEVEL_COLUMN = PHONE_COLUMNS, PHONE_COLUMNS + 1
RULES_COLUMN = LEVEL_COLUMN + 1


def rule_curves(log_posteriors: FloatArray, first_row: int, begin: int, count: int) -> Float32Array:
    """What coarticulation alone makes of phones, a frame for each row.

    Parameters
    ----------
    log_posteriors : (row, 40)
        Of phones.
    first_row : int
        Where the first lies in the take.
    begin, count : int
        The first row wanted, and how many.

    Returns
    -------
    (count, curve) float32
        In the order of `curve_names`.
    """
    bare = articulate(
        log_posteriors,
        FEATURE_RATE,
        fps=FEATURE_RATE,
        frame_count=count,
        first_frame=begin,
        first_row=first_row,
        contacts=False,
    )
    return bare.select(curve_names()).values


def rule_measures(curves: FloatArray) -> Float64Array:
    """The mouth that `rule_curves` make on the built-in head.

    Parameters
    ----------
    curves : (row, curve)
        As `rule_curves` gives them.

    Returns
    -------
    (row, measure) float64
        In mm.
    """
    found = builtin_response(curve_names()).measures(curves)
    return np.concatenate([np.maximum(found[:, :1], 0), found[:, 1:]], axis=1)


def relative_level(loudness: FloatArray, loudest: FloatArray) -> Float32Array:
    """Loudness relative to the voice's loudest, from what is heard and what comes soon.

    Parameters
    ----------
    loudness, loudest : (row,)
        dB, the columns of `Loudness`.

    Returns
    -------
    (row,) float32
        0 at the loudest, -1 at 20 dB below.
    """
    # The loudest so far rises only where something is louder, so the one to come holds both.
    ahead = np.concatenate([loudest, np.repeat(loudest[-1:], LEVEL_AHEAD)])
    top = np.lib.stride_tricks.sliding_window_view(ahead, LEVEL_AHEAD + 1).max(axis=1)
    return np.clip((loudness - top) / LEVEL_DB, LEVEL_LEAST, LEVEL_MOST).astype(np.float32)


def talker_inputs(
    log_posteriors: FloatArray, loudness: FloatArray, measures: FloatArray
) -> Float32Array:
    """The rows that the network is given.

    Parameters
    ----------
    log_posteriors : (row, 40)
        Of phones.
    loudness : (row, 2)
        As `Loudness` gives it; rows after those wanted may follow, for the level.
    measures : (wanted, measure)
        As `rule_measures` gives them, of the first rows.

    Returns
    -------
    (wanted, input) float32
    """
    count = len(measures)
    posteriors = np.exp(log_posteriors[:count])
    silence = posteriors[:, SILENCE, None]
    phones = np.delete(posteriors, SILENCE, axis=1) / (1 - silence + SPEECH_FLOOR)
    level = relative_level(loudness[:, 0], loudness[:, 1])[:count, None]
    rules = (measures - RULES_MIDDLE_MM) / RULES_UNIT_MM
    return np.concatenate([phones, silence, level, rules], axis=1).astype(np.float32)
