# SPDX-FileCopyrightText: 2026 Elocute contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Keys of a curve: which of them are needed."""

from __future__ import annotations

from collections.abc import Sequence


def needed(values: Sequence[float]) -> list[int]:
    """The frames that are keyed: each, or the first alone of a curve that rests."""
    still = not values or max(values) - min(values) < 1e-6
    return [0][: len(values)] if still else list(range(len(values)))


def cleaned(keys: Sequence[tuple[float, float]], tolerance: float) -> list[tuple[float, float]]:
    """The fewest of some keys (frame, value) whose straight lines are within a tolerance of all.

    Ends stay. By Ramer's way: the key that is farthest off splits the line, until none is.
    """
    if len(keys) < 3:
        return list(keys)
    kept = {0, len(keys) - 1}
    open_parts = [(0, len(keys) - 1)]
    while open_parts:
        first, last = open_parts.pop()
        (start, low), (end, high) = keys[first], keys[last]
        slope = (high - low) / (end - start) if end > start else 0.0
        off, farthest = 0.0, first
        for place in range(first + 1, last):
            away = abs(keys[place][1] - low - slope * (keys[place][0] - start))
            if away > off:
                off, farthest = away, place
        if off > tolerance:
            kept.add(farthest)
            open_parts += [(first, farthest), (farthest, last)]
    return [keys[place] for place in sorted(kept)]
