"""DTW and soft-DTW: against a plain reference, librosa, brute force and finite differences."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

pytest.importorskip("numba", reason="needs the extra `wild`")

from elocute.alignment.alignment import check_path
from elocute.alignment.dtw import dtw, soft_dtw, squared_distances
from elocute.errors import AlignmentError

SHAPES = [(1, 1), (1, 7), (9, 1), (12, 12), (30, 17), (8, 41)]


def plain_dtw(cost: np.ndarray) -> float:
    total = np.full((cost.shape[0] + 1, cost.shape[1] + 1), np.inf)
    total[0, 0] = 0
    for i, j in itertools.product(range(cost.shape[0]), range(cost.shape[1])):
        total[i + 1, j + 1] = cost[i, j] + min(total[i, j], total[i, j + 1], total[i + 1, j])
    return float(total[-1, -1])


def every_path(rows: int, columns: int) -> list[list[tuple[int, int]]]:
    if (rows, columns) == (1, 1):
        return [[(0, 0)]]
    before = [(rows - a, columns - b) for a, b in ((1, 1), (1, 0), (0, 1))]
    ways = [way for r, c in before if r > 0 and c > 0 for way in every_path(r, c)]
    return [[*way, (rows - 1, columns - 1)] for way in ways]


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
def test_the_cheapest_path_costs_what_plain_python_and_librosa_say(shape: tuple[int, int]) -> None:
    librosa = pytest.importorskip("librosa")
    rng = np.random.default_rng(shape[0])
    source, target = (rng.normal(size=(size, 5)) for size in shape)
    cost = squared_distances(source, target)
    np.testing.assert_allclose(cost, ((source[:, None] - target) ** 2).sum(axis=2), atol=1e-9)
    path, total = dtw(cost)
    check_path(path, shape)
    assert (np.abs(np.diff(path, axis=0)).max(axis=1, initial=1) == 1).all()
    assert total == pytest.approx(cost[tuple(path.T)].sum())
    assert total == pytest.approx(plain_dtw(cost))
    assert total == pytest.approx(librosa.sequence.dtw(C=cost)[0][-1, -1])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_sequence_with_itself_is_the_diagonal_even_through_silence(dtype: type) -> None:
    view = np.random.default_rng(0).normal(size=(40, 6)).astype(dtype)
    view[10:25] = view[10]
    path, total = dtw(squared_distances(view, view))
    assert total == 0
    np.testing.assert_array_equal(path, np.arange(40)[:, None].repeat(2, axis=1))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("band", [1, 3, 0.1, 0.5])
def test_a_band_is_kept_to(shape: tuple[int, int], band: float) -> None:
    cost = np.random.default_rng(1).random(shape)
    path, total = dtw(cost, band)
    check_path(path, shape)
    longest = max(shape)
    frames = max(1.0, band * longest if band < 1 else band)
    places = path * longest / np.array(shape)
    slope = longest / min(shape)
    assert np.abs(places[:, 0] - places[:, 1]).max() <= frames + 2 * slope
    assert total >= dtw(cost)[1] - 1e-12


def test_open_ends_find_a_part() -> None:
    rng = np.random.default_rng(2)
    source = rng.normal(size=(60, 4))
    path, total = dtw(squared_distances(source, source[23:41]), open_source=True)
    assert total == 0
    np.testing.assert_array_equal(path[:, 0], np.arange(23, 41))


@pytest.mark.parametrize("band", [0, -1, np.nan])
def test_a_band_that_is_none_is_refused(band: float) -> None:
    with pytest.raises(AlignmentError, match="band"):
        dtw(np.ones((3, 3)), band)


def test_costs_without_a_finite_path_are_refused() -> None:
    with pytest.raises(AlignmentError, match="finite"):
        dtw(np.full((3, 3), np.nan))


def test_soft_dtw_is_the_soft_minimum_over_all_paths() -> None:
    cost, gamma = np.random.default_rng(3).random((4, 5)), 0.3
    costs = np.array([sum(cost[cell] for cell in path) for path in every_path(4, 5)])
    shares = np.exp(-costs / gamma) / np.exp(-costs / gamma).sum()
    expected = np.zeros((4, 5))
    for share, path in zip(shares, every_path(4, 5), strict=True):
        for cell in path:
            expected[cell] += share
    value, found = soft_dtw(cost, gamma)
    assert value == pytest.approx(-gamma * np.log(np.exp(-costs / gamma).sum()))
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize("open_source", [False, True])
def test_the_expected_alignment_is_the_gradient(open_source: bool) -> None:
    cost = np.random.default_rng(4).random((6, 5))
    _, expected = soft_dtw(cost, 0.2, open_source)
    for cell in itertools.product(range(6), range(5)):
        step = np.zeros_like(cost)
        step[cell] = 1e-5
        up, down = (soft_dtw(cost + sign * step, 0.2, open_source)[0] for sign in (1, -1))
        assert (up - down) / 2e-5 == pytest.approx(expected[cell], abs=1e-6)


def test_soft_dtw_becomes_dtw() -> None:
    cost = np.random.default_rng(5).random((20, 30)) * 100
    value, expected = soft_dtw(cost, 1e-3)
    path, total = dtw(cost)
    assert value == pytest.approx(total, abs=1e-2)
    np.testing.assert_allclose(expected[tuple(path.T)], 1, atol=1e-6)
