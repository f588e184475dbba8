"""What every method must do: identity, known warps, three views, the same bits, clear errors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba", reason="needs the extra `wild`")

from elocute.alignment import METHODS, Alignment, align, fit_aligner, speech_view
from elocute.alignment.alignment import check_path
from elocute.alignment.dtw import (
    attention_path,
    diagonal_path,
    expected_path,
    merge_paths,
)
from elocute.errors import AlignmentError
from elocute.evaluation.alignment_scores import SOFTNESS, read_otherwise

DEEP = ("dctw", "cca-soft", "dcaw")


@pytest.fixture(params=list(METHODS))
def method(request: pytest.FixtureRequest) -> str:
    if request.param in DEEP:
        torch = pytest.importorskip("torch", reason="needs the extra `train`")
        torch.set_num_threads(1)
    return request.param


def brief(method: str, **settings: Any):
    """Few steps: what is tested holds from the first on."""
    config = METHODS[method].config(**settings)
    return replace(config, steps=4) if method in DEEP else config


def walk(frames: int = 45, features: int = 6, seed: int = 0) -> np.ndarray:
    steps = np.random.default_rng(seed).normal(size=(frames, features))
    return (np.cumsum(steps, axis=0) / 3).astype(np.float32)


def warped(view: np.ndarray, frames: int, power: float) -> tuple[np.ndarray, np.ndarray]:
    """The view at another pace, and where each of its frames was."""
    places = (len(view) - 1) * np.linspace(0, 1, frames) ** power
    columns = [np.interp(places, np.arange(len(view)), column) for column in view.T]
    return np.stack(columns, axis=1).astype(np.float32), places


def test_a_sequence_with_itself_is_the_diagonal(method: str) -> None:
    view = walk()
    found = align([view, view], method, brief(method))
    np.testing.assert_array_equal(found.path, np.arange(45)[:, None].repeat(2, axis=1))
    assert found.score > 0.999


@pytest.mark.parametrize("power", [0.7, 1.0, 1.5])
def test_a_known_warp_is_found(method: str, power: float) -> None:
    view = walk()
    other, places = warped(view, 60, power)
    found = align([view, other], method, brief(method))
    assert np.abs(found.source_frames() - places).max() <= 2
    assert np.abs(found.source_frames() - places).mean() <= 0.7


def test_time_reversal_is_not_followed(method: str) -> None:
    view = walk()
    found = align([view, view[::-1]], method, brief(method))
    check_path(found.path, [45, 45])
    same = align([view, view], method, brief(method))
    assert found.score < same.score - 0.2


def test_three_views_share_one_path(method: str) -> None:
    view = walk()
    two, of_two = warped(view, 60, 1.4)
    three, of_three = warped(view, 38, 0.8)
    found = align([view, two, three], method, brief(method))
    check_path(found.path, [45, 60, 38])
    assert np.abs(of_two[found.path[:, 1]] - found.path[:, 0]).mean() <= 1.2
    assert np.abs(of_three[found.path[:, 2]] - found.path[:, 0]).mean() <= 1.2
    assert len(found.features) == 3 and found.score > 0.8


def test_a_part_is_found_in_a_longer_sequence(method: str) -> None:
    sentence = walk(90, seed=3)
    word, places = warped(sentence[30:55], 30, 1.2)
    found = align([sentence, word], method, brief(method, open_source=True))
    assert not found.whole
    assert np.abs(found.source_frames() - places - 30).mean() <= 1.5


def test_columns_of_attention_and_posterior_sum_to_one() -> None:
    pytest.importorskip("torch", reason="needs the extra `train`")
    view = walk()
    other, _ = warped(view, 60, 1.3)
    for name, has in (
        ("softdtw", {"posterior"}),
        ("cca-soft", {"attention", "posterior"}),
        ("dcaw", {"attention"}),
    ):
        found = align([view, other], name, brief(name))
        for kind in ("attention", "posterior"):
            weights = getattr(found, kind)
            assert (weights is not None) == (kind in has)
            if weights is None:
                continue
            assert weights.shape == (45, 60)
            np.testing.assert_allclose(weights.sum(axis=0), 1, atol=1e-5)
            if (name, kind) != ("cca-soft", "attention"):  # which no path is read from
                assert (np.diff(np.arange(45) @ weights) > -1e-3).all()


def test_equal_seeds_give_equal_bits_and_fitting_changes_nothing(method: str) -> None:
    pairs = [(walk(seed=s), warped(walk(seed=s), 50, 1.3)[0]) for s in range(3)]
    one, other = (fit_aligner(pairs, method, brief(method), seed=7) for _ in range(2))
    first, again, second = one.align(*pairs[0]), one.align(*pairs[0]), other.align(*pairs[0])
    for found in (again, second):
        np.testing.assert_array_equal(first.path, found.path)
        np.testing.assert_array_equal(first.features[0], found.features[0])
        assert first.score == found.score
    together = one.align_all(pairs)
    np.testing.assert_array_equal(together[0].path, first.path)


def test_one_frame_and_constant_views(method: str) -> None:
    view = walk()
    found = align([view[:1], view], method, brief(method))
    np.testing.assert_array_equal(found.path[:, 0], 0)
    assert align([view[:1], view[:1]], method, brief(method)).path.tolist() == [[0, 0]]
    still = np.zeros((9, 6), np.float32)
    assert align([still, view], method, brief(method)).score == 0


def test_any_features_can_be_read_along_the_expected_alignment(method: str) -> None:
    view = walk()
    other, places = warped(view, 60, 1.5)
    fitted = fit_aligner([(view, other)], method, brief(method))
    found = read_otherwise(fitted, SOFTNESS).align(view, other)
    check_path(found.path, (45, 60))
    assert np.abs(found.source_frames() - places).mean() <= 1.5
    assert found.posterior is not None
    np.testing.assert_allclose(found.posterior.sum(axis=0), 1, atol=1e-5)


@pytest.mark.parametrize("name", ["ctw", "dctw", "cca-soft", "dcaw"])
def test_views_of_other_kinds_are_aligned(name: str) -> None:
    if name in DEEP:
        pytest.importorskip("torch", reason="needs the extra `train`")
    view = walk()
    other, places = warped(view, 60, 1.1)
    mixed = other @ np.random.default_rng(1).normal(size=(6, 9)).astype(np.float32)
    found = align([view, mixed], name, brief(name))
    assert np.abs(found.source_frames() - places).mean() <= 3


def test_what_cannot_be_aligned_is_said(method: str) -> None:
    view = walk()
    broken = view.copy()
    broken[7, 2] = np.nan
    for views, says in (
        ([view], "two or more"),
        ([view, broken], "frame 7"),
        ([view, view[:0]], "at least one"),
        ([view, view[0]], "shape"),
        ([view, "speech"], "numbers"),
    ):
        with pytest.raises(AlignmentError, match=says):
            align(views, method)  # pyright: ignore[reportArgumentType]
    aligner = fit_aligner([(view, view)], method, brief(method))
    if aligner.widths:
        with pytest.raises(AlignmentError, match="fitted"):
            aligner.align(view[:, :4], view[:, :4])
    else:
        with pytest.raises(AlignmentError, match="equal counts"):
            aligner.align(view[:, :4], view)


def test_settings_that_are_no_use_are_said() -> None:
    view = walk()
    with pytest.raises(AlignmentError, match="dtw, softdtw, ctw"):
        align([view, view], "magic")
    with pytest.raises(AlignmentError, match="CtwConfig"):
        align([view, view], "ctw", METHODS["dtw"].config())
    with pytest.raises(AlignmentError, match="none"):
        fit_aligner([])
    with pytest.raises(AlignmentError, match="feature counts"):
        fit_aligner([(view, view), (view[:, :3], view)], "ctw")
    with pytest.raises(AlignmentError, match="million cells"):
        align([np.zeros((9000, 1), np.float32)] * 2, "dtw")


def test_an_alignment_checks_itself() -> None:
    features = (walk(3), walk(3))
    path = diagonal_path(3, 3)
    for wrong in (path[::-1], path[:2], path[1:], path[:, :1]):
        with pytest.raises(AlignmentError, match="path"):
            Alignment(features, wrong, 0.5)
    with pytest.raises(AlignmentError, match="columns"):
        Alignment(features, path, 0.5, np.ones((3, 3), np.float32))
    with pytest.raises(AlignmentError, match="score"):
        Alignment(features, path, float("nan"))


def test_attention_and_paths_go_into_each_other() -> None:
    path = np.array([[0, 0], [1, 1], [2, 1], [3, 2], [3, 3]])
    attention = np.zeros((4, 4))
    attention[path[:, 0], path[:, 1]] = 1  # each target frame looks evenly at its source frames
    attention /= attention.sum(axis=0)
    np.testing.assert_allclose(attention.sum(axis=0), 1)
    np.testing.assert_array_equal(attention_path(attention), path)
    cells = np.zeros((4, 4))
    cells[tuple(path.T)] = 1
    np.testing.assert_array_equal(expected_path(cells), path)
    both = merge_paths([path, path[:, [1, 0]]], 4)
    check_path(both, [4, 4, 4])


def test_the_example_against_itself_slower(speech_wav: Path) -> None:
    from elocute.audio.read import read_audio
    from elocute.audio.waveform import Waveform

    sound = read_audio(speech_wav)
    word = Waveform(sound.samples[: 2 * sound.sample_rate], sound.sample_rate)
    # The same samples played at nine tenths of the rate: slower, and lower.
    slow = Waveform(word.samples, round(word.sample_rate * 0.9))
    found = align([speech_view(word), speech_view(slow)], "dtw")
    assert np.abs(found.source_frames() - 0.9 * np.arange(len(found.features[1]))).mean() < 1.5
    silence = Waveform(np.zeros(16000, np.float32), 16000)
    with pytest.raises(AlignmentError, match="nothing changes"):
        speech_view(silence)
