"""Makes posteriors of phones whose times are known: alone, or blended with what was heard."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from elocute.array_types import Float32Array, FloatArray
from elocute.encoders.phones_and_visemes import BILABIALS, LABIODENTALS, PHONES
from elocute.encoders.protocol import FEATURE_RATE
from elocute.errors import InputError
from elocute.numerics.input_checks import check_kind, real_number
from elocute.one_line_repr import brief
from elocute.speech.times.labels import Label

RELEASED = ("P", "B")
RELEASE_S = 0.04
"""Lips part this long before the end of a p or b: labels count its burst and breath to it. Measured
against a real talker's lips: docs/measurements/text.md."""
SHORTEST_S = 0.02
OPEN = "AH"
HEARD_SHARE = 0.5
"""Of all but contacts, how much is left to what the encoder hears: a vowel has many colours."""
CONTACTS = [PHONES.index(phone) for phone in (*BILABIALS, *LABIODENTALS)]


def checked_phones(
    phones: Sequence[Label],
) -> Sequence[Label]:
    """The same phones with their times. Raises InputError as `posteriors_from_phones` does."""
    check_kind("phones", phones, list | tuple, "a list of (start s, end s, phone)")
    for label in phones:
        try:
            start_s, end_s, phone = label
        except (TypeError, ValueError):
            raise InputError.about(
                "phones", found=brief(label), allowed="(start s, end s, phone)"
            ) from None
        if not isinstance(phone, str) or phone not in PHONES:
            raise InputError.about(
                f"phone {brief(phone)}", found="unknown", allowed=" ".join(PHONES)
            )
        start, end = real_number(start_s), real_number(end_s)
        if start is None or end is None or not 0 <= start <= end:
            raise InputError.about(
                f"phone {phone!r}",
                found=f"times {brief(start_s)} to {brief(end_s)}",
                allowed="0 <= start <= end",
            )
    return phones


def posteriors_from_phones(
    phones: list[Label], duration_s: float, rate: float = FEATURE_RATE
) -> FloatArray:
    """Log-posteriors of phones whose times are known.

    Parameters
    ----------
    phones : list of (float, float, str)
        Start in s, end in s, ARPAbet phone without stress. What nothing covers is silence; a row
        that two phones share is split between them.
    duration_s : float
        Of the sound.
    rate : float
        Rows per second.

    Returns
    -------
    (row, 40) float32
        Natural logarithms.

    Raises
    ------
    InputError
        For an unknown phone, or times that run backwards.
    """
    count = max(1, int(np.ceil(duration_s * rate)))
    shares = np.zeros((count, len(PHONES)))
    centres = np.arange(count) / rate
    for start_s, end_s, phone in checked_phones(phones):
        half = 0.5 / rate
        overlap = np.minimum(end_s, centres + half) - np.maximum(start_s, centres - half)
        shares[:, PHONES.index(phone)] += np.clip(overlap * rate, 0, 1)
    shares[:, PHONES.index("SIL")] += np.clip(1 - shares.sum(axis=1), 0, 1)
    shares /= shares.sum(axis=1, keepdims=True)
    return np.log(np.maximum(shares, 1e-6)).astype(np.float32)


def known_posteriors(phones: Sequence[Label], duration_s: float) -> Float32Array:
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
    phones: Sequence[Label],
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


def _released(phones: Sequence[Label]) -> list[Label]:
    labels: list[Label] = []
    for start, end, phone in checked_phones(phones):
        parted = max(end - RELEASE_S, start + SHORTEST_S) if phone in RELEASED else end
        if parted < end:
            labels += [(start, parted, phone), (parted, end, OPEN)]
        else:
            labels.append((start, end, phone))
    return labels
