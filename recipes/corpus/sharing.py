"""Who says what: the sharing scheme of VOCASET (VOCA 2019, section 6).

Five sentences are said by everybody, fifteen of each subject by three to five (50 in all) and
twenty by one or two (200 in all): 40 a subject, 255 in all. The subjects of validation and test
say their last twenty alone, so that no part shares a sentence with another.
"""

from __future__ import annotations

import random
from collections.abc import Sequence

SHARED_BY_ALL, SHARED_BY_SOME, SHARED_BY_FEW = 5, 50, 200
SOME_EACH, FEW_EACH = 15, 20


def share_sentences(
    subjects: Sequence[str], alone: Sequence[str], seed: int
) -> dict[str, list[int]]:
    """Subject to sentence numbers, 0 … 254; `alone` are those of validation and test."""
    draw = random.Random(seed)
    spoken: dict[str, list[int]] = {s: list(range(SHARED_BY_ALL)) for s in subjects}
    for number, speakers in enumerate(_groups(subjects, draw), SHARED_BY_ALL):
        for subject in speakers:
            spoken[subject].append(number)
    numbers = iter(range(SHARED_BY_ALL + SHARED_BY_SOME, 255))
    for subject in alone:
        spoken[subject] += [next(numbers) for _ in range(FEW_EACH)]
    _few(spoken, [s for s in subjects if s not in alone], list(numbers), draw)
    return spoken


def _groups(subjects: Sequence[str], draw: random.Random) -> list[list[str]]:
    """Fifty groups of three to five in which everybody is fifteen times."""
    slots = len(subjects) * SOME_EACH
    sizes = [3] * SHARED_BY_SOME
    for _ in range(slots - sum(sizes)):
        smaller = [i for i, size in enumerate(sizes) if size < 5]
        sizes[draw.choice(smaller)] += 1
    left = dict.fromkeys(subjects, SOME_EACH)
    groups = []
    for size in sorted(sizes, reverse=True):
        # Who has most left goes first, so that nobody is left over at the end.
        order = sorted(left, key=lambda s: (-left[s], draw.random()))
        groups.append(order[:size])
        for subject in order[:size]:
            left[subject] -= 1
    return groups


def _few(
    spoken: dict[str, list[int]], subjects: list[str], numbers: list[int], draw: random.Random
) -> None:
    """Twenty each out of `numbers`, every one said once or twice."""
    slots = [subject for subject in subjects for _ in range(FEW_EACH)]
    twice = len(slots) - len(numbers)
    queue = sorted(slots, key=lambda s: slots.index(s))
    for number in numbers:
        spoken[queue.pop(0)].append(number)
    for number in draw.sample(numbers, twice):
        speaker = next(s for s in queue if number not in spoken[s])
        queue.remove(speaker)
        spoken[speaker].append(number)
