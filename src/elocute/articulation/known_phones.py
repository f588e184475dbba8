"""Posteriors of phones whose times are known, for a face: alone, or over what the encoder heard."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elocute.array_types import Float32Array, FloatArray
from elocute.articulation.driver import (
    BILABIALS,
    LABIODENTALS,
    checked_phones,
    posteriors_from_phones,
)
from elocute.audio.phones_and_visemes import PHONES
from elocute.encoders.protocol import FEATURE_RATE

Phone = tuple[float, float, str]
RELEASED = ("P", "B")
RELEASE_S = 0.04
"""Lips part this long before the end of a p or b: labels count its burst and breath to it. Measured
against a real talker's lips: docs/measurements/text.md."""
SHORTEST_S = 0.02
OPEN = "AH"
HEARD_SHARE = 0.5
"""Of all but contacts, how much is left to what the encoder hears: a vowel has many colours."""
CONTACTS = [PHONES.index(phone) for phone in (*BILABIALS, *LABIODENTALS)]


def known_posteriors(phones: Sequence[Phone], duration_s: float) -> Float32Array:
    """Log-posteriors of known phones, with the lips of p and b parted at their burst.

    Parameters
    ----------
    phones : sequence of (float, float, str)
        Start in s, end in s, ARPAbet phone without stress.
    duration_s : float
        Of the sound.

    Returns
    -------
    (row, 40) float32
        50 rows a second.

    Raises
    ------
    InputError
        As `posteriors_from_phones`.
    """
    return posteriors_from_phones(_released(phones), duration_s, FEATURE_RATE)


def blended_posteriors(
    phones: Sequence[Phone],
    heard: FloatArray,
    duration_s: float,
    *,
    unknown: Sequence[tuple[float, float]] = (),
    heard_share: float = HEARD_SHARE,
) -> Float32Array:
    """Log-posteriors in which the contacts are those of known phones, the rest partly as heard.

    Parameters
    ----------
    phones : sequence of (float, float, str)
        As `known_posteriors` takes them.
    heard : (row, 40) float
        Log-posteriors of the encoder, 50 rows a second.
    duration_s : float
        Of the sound.
    unknown : sequence of (float, float)
        Stretches in s in which nothing is known, so that all is as heard.
    heard_share : float
        How much of all but the contacts is as heard, 0 to 1.

    Returns
    -------
    (row, 40) float32

    Raises
    ------
    InputError
        As `posteriors_from_phones`.
    """
    known = np.exp(known_posteriors(phones, duration_s))
    heard = np.exp(heard.astype(float))[: len(known)]
    known = known[: len(heard)]
    mixed = (1 - heard_share) * known + heard_share * heard
    mixed[:, CONTACTS] = known[:, CONTACTS]
    others = np.ones(len(PHONES), bool)
    others[CONTACTS] = False
    room = 1 - known[:, CONTACTS].sum(axis=1, keepdims=True)
    mixed[:, others] *= room / np.maximum(mixed[:, others].sum(axis=1, keepdims=True), 1e-9)
    times = np.arange(len(mixed)) / FEATURE_RATE
    for start, end in unknown:
        inside = (times >= start) & (times < end)
        mixed[inside] = heard[inside]
    return np.log(np.maximum(mixed, 1e-6)).astype(np.float32)


def _released(phones: Sequence[Phone]) -> list[Phone]:
    found: list[Phone] = []
    for start, end, phone in checked_phones(phones):
        parted = max(end - RELEASE_S, start + SHORTEST_S) if phone in RELEASED else end
        if parted < end:
            found += [(start, parted, phone), (parted, end, OPEN)]
        else:
            found.append((start, end, phone))
    return found
