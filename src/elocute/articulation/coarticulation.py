"""Soft-dominance co-articulation: posteriors of phones to smooth curves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.phone_targets import (
    DIPHTHONGS,
    curve_groups,
    curve_names,
    phone_dominances,
    phone_targets,
)
from elocute.encoders.phones_and_visemes import PHONES, SILENCE

REACH_S = 0.30  # the kernel is below 1 % beyond this
DIPHTHONG_S = 0.5  # a longer diphthong is looked at no further than this on both sides
BLOCK = 2048  # output frames at a time: memory stays bounded for an hour of speech


def split_diphthongs(posteriors: NDArray[np.float32], rate: float) -> NDArray[np.float32]:
    """Hand each diphthong's posterior to its two vowels, first to last within each run.

    (frame, phone) at `rate` Hz to (frame, phone). The share of the second vowel rises with the
    posterior mass that has passed since the run began, so it works for soft posteriors.
    """
    result = posteriors.copy()
    for phone, (first, second) in DIPHTHONGS.items():
        column = posteriors[:, PHONES.index(phone)]
        share = _progress(column, round(DIPHTHONG_S * rate))
        result[:, PHONES.index(first)] += column * (1 - share)
        result[:, PHONES.index(second)] += column * share
        result[:, PHONES.index(phone)] = 0
    return result


def _progress(
    posterior: NDArray[np.float32], reach: int, floor: float = 0.02
) -> NDArray[np.float32]:
    """(frame,) share 0…1 of a run's mass that lies before each frame's middle.

    Of a run longer than `reach` frames, what lies within `reach` on both sides counts: a live
    voice that holds a diphthong need not come to its end first.
    """
    inside = posterior > floor
    edges = np.diff(np.concatenate([[0], inside.astype(np.int8), [0]]))
    share = np.zeros(len(posterior), np.float32)
    for start, stop in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        mass = posterior[start:stop]
        passed = np.cumsum(mass)
        if len(mass) <= reach:
            share[start:stop] = (passed - mass / 2) / mass.sum()
            continue
        places = np.arange(len(mass))
        sums = np.concatenate([[0], passed])
        before = sums[np.maximum(places - reach, 0)]
        around = sums[np.minimum(places + reach + 1, len(mass))] - before
        share[start:stop] = (passed - mass / 2 - before) / around
    # A sharper hand-over: each vowel holds its own third of the sound.
    return np.clip(1.5 * share - 0.25, 0, 1)


def coarticulate(
    posteriors: NDArray[np.float32],
    rate: float,
    frame_count: int,
    fps: float,
    anticipation_s: float,
    carry_s: float,
    *,
    first_frame: int = 0,
    first_row: int = 0,
) -> NDArray[np.float32]:
    """Blend the targets of all phones near each output frame.

    posteriors (frame, phone) at `rate` Hz, row k at (first_row + k) / rate; returns
    (frame_count, curve) at `fps` from `first_frame` on, in the order of `curve_names()`:
    x(t) = Σ q·α·k·T / Σ q·α·k, where α is the dominance and k falls off exponentially, slower
    towards sounds to come (anticipation) or passed (carry-over) as the two times say. Beyond both
    ends there is silence.
    """
    weighted = (
        split_diphthongs(posteriors, rate)[:, :, None] * phone_dominances()
    )  # frame, phone, group
    groups = curve_groups()
    targets = phone_targets()
    columns = [weighted[:, :, group] @ targets[:, groups == group] for group in np.unique(groups)]
    pull = np.concatenate([*columns, weighted.sum(axis=1)], axis=1)
    order = np.concatenate([np.flatnonzero(groups == group) for group in np.unique(groups)])

    reach = int(np.ceil(REACH_S * rate))
    silent = np.zeros((1, pull.shape[1]), np.float32)
    silent[0, len(groups) :] = phone_dominances()[SILENCE]
    last_row = int(np.ceil((first_frame + frame_count) / fps * rate)) - first_row
    after = max(0, last_row - len(pull)) + reach + 1
    pull = np.concatenate([np.repeat(silent, reach, 0), pull, np.repeat(silent, after, 0)])

    result = np.empty((frame_count, len(curve_names())), np.float32)
    for start in range(0, frame_count, BLOCK):
        times = np.arange(first_frame + start, first_frame + min(start + BLOCK, frame_count)) / fps
        positions = times * rate - first_row
        blended = _gather(pull, positions, rate, reach, anticipation_s, carry_s)
        strength = blended[:, len(groups) :][:, groups[order]]
        result[start : start + len(times), order] = blended[:, : len(groups)] / strength
    return result


def _gather(
    pull: NDArray[np.floating],
    positions: NDArray[np.float64],
    rate: float,
    reach: int,
    anticipation_s: float,
    carry_s: float,
) -> NDArray[np.float32]:
    """Sum rows of `pull` around each position with the asymmetric exponential kernel."""
    nearest = np.floor(positions).astype(int)
    taps = nearest[:, None] + np.arange(-reach, reach + 1)
    lead_s = (taps - positions[:, None]) / rate  # positive: the sound is still to come
    # (1 + x) exp(-x) has no cusp at its own time, so that curves have no corners; halving the
    # time constants keeps the area of a plain exponential.
    distance = np.where(lead_s > 0, 2 * lead_s / anticipation_s, -2 * lead_s / carry_s)
    kernel = (1 + distance) * np.exp(-distance)
    return np.einsum("ft,ftc->fc", kernel.astype(np.float32), pull[taps + reach], optimize=True)
