"""Decodes where lips meet over a phrase: Viterbi over phones that last, instead of a threshold.

p, b and m look alike and are one state; so are f and v. Every other phone is a state of its own, so
a contact has to win against what else the sound may be. The path is found in windows at fixed rows:
a stretch of a take gives the same contacts as the whole of it. A contact must also weigh enough:
the evidence for it, summed over its rows.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray
from elocute.articulation.contacts_and_rest import contact_evidence, runs
from elocute.encoders.phones_and_visemes import PHONES, SILENCE
from elocute.numerics.lasting_states import best_paths
from elocute.numerics.smoothing import smoothstep

POOLS = (("P", "B", "M"), ("F", "V"))
SEALED, AT_TEETH = 0, 1  # their states
SWITCH_NATS = 0.7  # what a change of phones costs
MISSING_NATS = (0.75, 0.5)  # how much worse a contact that is missed is than one too many
EVIDENCE_ROWS = (0.6, 1.0)  # what rows of a contact must weigh, each up to 1
BLOCK, BEFORE, AFTER = 16, 30, 20  # rows that are decided together, and rows that have a say
UNLIKELY = 1e-6
BESIDE = 2  # rows beside a contact whose evidence counts too
HOLD_S, LONGEST_S = 0.04, 0.12  # of a seal in running speech
HELD_S = 0.22  # a longer m is hummed, and sealed as long
WAIT_S = 0.12  # lips are shut this long before a first burst at most
RELEASE_S = 0.04  # lips part so long before a p, b or m is no longer heard
BETWEEN_S = 0.09  # lips do not part for less than this between two seals
CLOSING_S, OPENING_S = 0.045, 0.045
HUMMED, HUM_SHARE = PHONES.index("M"), 0.5  # of the evidence for it
CORE = 0.5  # of the greatest evidence: where it falls below, a contact has ended
KNOWN_SHARE = 0.1  # of a row, below which a known phone hardly touches it
KNOWN_ROWS = 0.5  # that a known phone must last: half a row
REACH_S = (BLOCK + AFTER) / 50.0 + HELD_S
"""Posteriors are looked at no further ahead of a moment than this."""


@dataclass(frozen=True)
class Contact:
    """A stretch of contact.

    Parameters
    ----------
    start_s, end_s : float
        Its first and last moment, s.
    """

    start_s: float
    end_s: float


def contact_states(posteriors: FloatArray, first_row: int = 0) -> NDArray[np.int64]:
    """What each row is: SEALED, AT_TEETH, or another number.

    Parameters
    ----------
    posteriors : (row, 40)
        Of phones.
    first_row : int
        Where the first lies in the take.

    Returns
    -------
    (row,) int64
    """
    count = len(posteriors)
    if not count:
        return np.zeros(0, np.int64)
    scores = _scores(posteriors)
    begin = first_row // BLOCK
    blocks = np.arange(begin, -(-(first_row + count) // BLOCK))
    places = blocks[:, None] * BLOCK + np.arange(-BEFORE, BLOCK + AFTER) - first_row
    known = (places >= 0) & (places < count)
    windows = np.where(known[..., None], scores[np.clip(places, 0, count - 1)], 0.0)
    path = best_paths(windows, SWITCH_NATS)
    middle = slice(BEFORE, BEFORE + BLOCK)
    states = np.full(count, len(PHONES), np.int64)
    states[places[:, middle][known[:, middle]]] = path[:, middle][known[:, middle]]
    return states


def _scores(posteriors: FloatArray) -> NDArray[np.float32]:
    """(row, state) log-posteriors, pooled contacts first."""
    pooled = [posteriors[:, [PHONES.index(p) for p in pool]].sum(axis=1) for pool in POOLS]
    single = [k for k, phone in enumerate(PHONES) if not any(phone in pool for pool in POOLS)]
    table = np.concatenate([np.stack(pooled, axis=1), posteriors[:, single]], axis=1)
    scores = np.log(np.maximum(table, UNLIKELY))
    scores[:, : len(POOLS)] += MISSING_NATS
    return scores.astype(np.float32)


def decoded_contacts(
    posteriors: FloatArray,
    rate: float,
    kind: int,
    first_row: int = 0,
    states: NDArray[np.int64] | None = None,
) -> list[Contact]:
    """Stretches in which lips meet each other, or the teeth.

    Parameters
    ----------
    posteriors : (row, 40)
        Of phones.
    rate : float
        Rows per second.
    kind : int
        SEALED or AT_TEETH.
    first_row : int
        Where the first lies in the take.
    states : (row,) int64, optional
        What `contact_states` gives, where both kinds are asked for.

    Returns
    -------
    list of Contact
        In order, in seconds since the first row. A first p is shut before it is heard; between
        seals that nearly touch the lips stay shut.
    """
    if not len(posteriors):
        return []
    evidence = contact_evidence(_pooled(posteriors, kind), posteriors[:, SILENCE])
    states = contact_states(posteriors, first_row) if states is None else states
    likely = [
        (start, stop)
        for start, stop in runs(states == kind)
        if evidence[max(0, start - BESIDE) : stop + BESIDE].sum() >= EVIDENCE_ROWS[kind]
    ]
    return _contacts(likely, evidence, posteriors, rate, kind, heard=True)


def known_contacts(posteriors: FloatArray, rate: float, kind: int) -> list[Contact]:
    """Stretches in which lips meet, of phones that are known instead of heard.

    Each of them counts, however short: nothing is weighed against what it might be instead.

    Parameters
    ----------
    posteriors : (row, 40)
        Of phones.
    rate : float
        Rows per second.
    kind : int
        SEALED or AT_TEETH.

    Returns
    -------
    list of Contact
        As `decoded_contacts` gives them.
    """
    shares = _pooled(posteriors, kind)
    told = [
        (start, stop)
        for start, stop in runs(shares > KNOWN_SHARE)
        if shares[start:stop].sum() >= KNOWN_ROWS
    ]
    return _contacts(told, shares, posteriors, rate, kind, heard=False)


def _pooled(posteriors: FloatArray, kind: int) -> FloatArray:
    return posteriors[:, [PHONES.index(phone) for phone in POOLS[kind]]].sum(axis=1)


def _contacts(
    stretches: Iterable[tuple[int, int]],
    evidence: FloatArray,
    posteriors: FloatArray,
    rate: float,
    kind: int,
    *,
    heard: bool,
) -> list[Contact]:
    """Stretches of rows as lips make them."""
    back, silence = round(WAIT_S * rate), posteriors[:, SILENCE]
    early_s = RELEASE_S if heard and kind == SEALED else 0.0
    found: list[Contact] = []
    for start, stop in stretches:
        core = np.flatnonzero(evidence[start:stop] >= CORE * evidence[start:stop].max())
        start, stop = start + int(core[0]), start + int(core[-1]) + 1
        waiting = start
        while waiting > max(0, start - back) and silence[waiting - 1] > 0.5:
            waiting -= 1
        hummed = posteriors[start:stop, HUMMED].sum() > HUM_SHARE * evidence[start:stop].sum()
        begin_s, end_s = _shaped(start / rate, (stop - 1) / rate, early_s, hummed=bool(hummed))
        contact = Contact(min(waiting / rate, begin_s), end_s)
        if found and contact.start_s - found[-1].end_s < BETWEEN_S:
            contact = Contact(found.pop().start_s, contact.end_s)
        found.append(contact)
    return found


def _shaped(start_s: float, end_s: float, early_s: float, *, hummed: bool) -> tuple[float, float]:
    """A contact as lips make it: not too short, and not too long unless it is hummed."""
    if hummed and end_s - start_s >= HELD_S:
        return start_s, end_s
    end_s = min(max(end_s - early_s, start_s), start_s + LONGEST_S)
    short = max(0.0, HOLD_S - (end_s - start_s))
    return start_s - short / 2, end_s + short / 2


def contact_track(contacts: list[Contact], times_s: FloatArray) -> NDArray[np.float32]:
    """How far lips are shut at given moments.

    Parameters
    ----------
    contacts : list of Contact
        In order.
    times_s : (frame,)
        Moments, s.

    Returns
    -------
    (frame,) float32
        1 in contact, eased to 0 outside.
    """
    track = np.zeros(len(times_s), np.float32)
    for contact in contacts:
        rise = 1 - np.clip((contact.start_s - times_s) / CLOSING_S, 0, 1)
        fall = 1 - np.clip((times_s - contact.end_s) / OPENING_S, 0, 1)
        track = np.maximum(track, smoothstep(np.minimum(rise, fall)).astype(np.float32))
    return track
