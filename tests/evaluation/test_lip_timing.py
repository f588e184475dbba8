"""Mean temporal misalignment is counted as the published code counts it."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("numba")
pytest.importorskip("scipy")

from scipy import ndimage, signal

from elocute.evaluation.lip_timing import extrema, lip_distance, temporal_misalignments
from elocute.motion.vertex_motion import VertexMotion


def speech(frames: int, seed: int) -> np.ndarray:
    """(frame,) a course that opens and closes some four times a second at 30 frames, mm."""
    noise = np.random.default_rng(seed).normal(size=frames)
    return 5 + 20 * ndimage.gaussian_filter1d(noise, 2.0)


def as_published(predicted: np.ndarray, true: np.ndarray) -> list[int]:
    """By SciPy's filter and peaks, and a table of warping filled cell by cell."""
    true, predicted = (ndimage.gaussian_filter1d(each, 2.0) for each in (true, predicted))
    slopes = [np.diff(each, prepend=each[0]) for each in (true, predicted)]
    total = np.full((len(true) + 1, len(predicted) + 1), np.inf)
    total[0, 0] = 0
    for i, a in enumerate(slopes[0], 1):
        for j, b in enumerate(slopes[1], 1):
            total[i, j] = abs(a - b) + min(total[i - 1, j - 1], total[i - 1, j], total[i, j - 1])
    pairs, (i, j) = [], (len(true), len(predicted))
    while i and j:
        pairs.append((i - 1, j - 1))
        ways = [(i - 1, j - 1), (i - 1, j), (i, j - 1)]
        i, j = min(ways, key=lambda place: total[place])
    kinds, others = (
        {int(at): sign for sign in (1, -1) for at in signal.find_peaks(sign * each)[0]}
        for each in (true, predicted)
    )
    places, apart = sorted(kinds), []
    for at, other in reversed(pairs):
        if at in kinds and kinds[at] == others.get(other):
            here = places.index(at)
            low = places[here - 1] if here else 0
            high = places[here + 1] if here + 1 < len(places) else len(true) - 1
            if low <= other <= high:
                apart.append(abs(at - other))
    return apart


@pytest.mark.parametrize("seed", range(6))
def test_it_is_counted_as_published(seed: int):
    true = speech(120, seed)
    predicted = np.roll(true, 2)[: 120 - seed] + 0.3 * speech(120 - seed, 100 + seed)
    found = temporal_misalignments(predicted, true)
    assert found.tolist() == as_published(predicted, true) and len(found) > 5


@pytest.mark.parametrize("late", [0, 2, 4])
def test_lips_that_are_late_are_so_many_frames_apart(late: int):
    course = speech(160, 3)
    found = temporal_misalignments(course[10 - late : 150 - late], course[10:150])
    assert np.median(found) == late and abs(found.mean() - late) < 0.3


def test_lips_that_do_not_move_have_nothing_to_compare():
    still = np.full(50, 3.0)
    assert not len(temporal_misalignments(still, speech(50, 1))) and extrema(still) == {}
    assert not len(temporal_misalignments(np.array([1.0]), np.array([2.0])))


def test_of_a_level_stretch_the_middle_counts_and_ends_do_not():
    assert extrema(np.array([9.0, 1, 3, 3, 3, 2, 2, 4, 0])) == {1: -1, 3: 1, 5: -1, 7: 1}


def test_the_distance_is_that_of_two_vertices_in_mm():
    vertices = np.zeros((3, 4, 3), np.float32)
    vertices[:, 2, 1] = [0.001, 0.002, 0.004]
    motion = VertexMotion(vertices, vertices[0], 30.0)
    assert np.allclose(lip_distance(motion, (2, 3)), [1, 2, 4])
