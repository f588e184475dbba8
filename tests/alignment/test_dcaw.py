"""DCAW: the forward sum and its derivative, Eq. 9, folding, three views, 41 x 128 x 3."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba", reason="needs the extra `wild`")
pytest.importorskip("torch", reason="needs the extra `train`")

import torch

from elocute.alignment import DcawConfig, align, fit_aligner, speech_view
from elocute.alignment.aligner import consistent_attention
from elocute.alignment.cca import whiten_pair
from elocute.alignment.dcaw import (
    PathMarginals,
    correlation,
    draw_pairs,
    encode_pairs,
    fold,
    start_from_components,
    warping,
)
from elocute.alignment.deep_fitting import ClipTensors
from elocute.alignment.dtw import soft_dtw
from elocute.alignment.path_lattice import marginals_slope, path_marginals
from elocute.alignment.settings import ATTENTIONS
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.errors import AlignmentError
from elocute.networks.dcaw import (
    WINDOW_FEATURES,
    EncoderConfig,
    WindowEncoder,
    log_attention,
    soft_attention,
)

SHAPES = [(1, 1), (1, 6), (7, 1), (9, 7), (12, 20)]
torch.set_num_threads(1)
CONFIG = DcawConfig(steps=3, dimensions=4, pairs=6)


def walk(frames: int = 45, features: int = 6, seed: int = 0) -> np.ndarray:
    steps = np.random.default_rng(seed).normal(size=(frames, features))
    return (np.cumsum(steps, axis=0) / 3).astype(np.float32)


def warped(view: np.ndarray, frames: int, power: float) -> tuple[np.ndarray, np.ndarray]:
    """The view at another pace, and where each of its frames was."""
    places = (len(view) - 1) * np.linspace(0, 1, frames) ** power
    columns = [np.interp(places, np.arange(len(view)), column) for column in view.T]
    return np.stack(columns, axis=1).astype(np.float32), places


def three(seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    view = walk(seed=seed)
    return view, warped(view, 60, 1.4)[0], warped(view, 38, 0.8)[0]


@pytest.mark.parametrize("open_source", [False, True])
@pytest.mark.parametrize("shape", SHAPES)
def test_marginals_are_soft_dtws_expected_alignment(
    shape: tuple[int, int], open_source: bool
) -> None:
    energies = 2 * np.random.default_rng(sum(shape)).normal(size=(1, *shape))
    found = path_marginals(energies, np.array([shape]), open_source)[0]
    np.testing.assert_allclose(found, soft_dtw(-energies[0], 1.0, open_source)[1], atol=1e-13)


def test_padding_changes_nothing_and_stays_zero() -> None:
    energies = np.random.default_rng(0).normal(size=(2, 9, 8))
    lengths = np.array([[9, 8], [5, 3]])
    found = path_marginals(energies, lengths)
    alone = path_marginals(energies[1:, :5, :3].copy(), lengths[1:])
    np.testing.assert_array_equal(found[1, :5, :3], alone[0])
    assert not found[1, 5:].any() and not found[1, :, 3:].any()
    assert not marginals_slope(energies, energies, lengths)[1, 5:].any()


@pytest.mark.parametrize("open_source", [False, True])
def test_the_derivative_is_exact(open_source: bool) -> None:
    torch.manual_seed(0)
    energies = torch.randn(3, 6, 5, dtype=torch.float64, requires_grad=True)
    lengths = torch.tensor([[6, 5], [4, 5], [1, 3]])

    def marginals(values: torch.Tensor) -> torch.Tensor:
        return PathMarginals.apply(values, lengths, open_source)  # pyright: ignore

    assert torch.autograd.gradcheck(marginals, (energies,))


def test_attention_over_the_source_is_half_of_its_energies() -> None:
    torch.manual_seed(0)
    scores, ones = torch.randn(1, 5, 4), (torch.ones(1, 5), torch.ones(1, 4))
    over_target = torch.log_softmax(scores, dim=2)
    both = torch.log(soft_attention(scores, ones[0])) + over_target
    torch.testing.assert_close(log_attention(scores, *ones), both / 2)
    alone = log_attention(scores, *ones, mutual=False)
    torch.testing.assert_close(alone.exp(), soft_attention(scores, ones[0]))


def test_the_objective_is_the_sum_over_all_pairs_of_sets() -> None:
    groups = [three(seed) for seed in range(2)]
    clips, network = ClipTensors(groups, True), start_from_components(groups, CONFIG, True, 0)
    batch = encode_pairs(network, clips, range(len(clips.pairs)))
    assert set(batch.sides) == set(permutations(range(3), 2))
    attention = warping(network, batch, CONFIG, "learned").detach()
    total = 0.0
    for sides in permutations(range(3), 2):
        chosen = [k for k, each in enumerate(batch.sides) if each == sides]
        one, other = [], []
        for k in chosen:
            rows, columns = batch.lengths[k].tolist()
            one.append(attention[k, :rows, :columns].T @ batch.source[k, :rows].detach())
            other.append(batch.target[k, :columns].detach())
        views = [np.concatenate([x.double().numpy() for x in side]) for side in (one, other)]
        total += whiten_pair(views[0], views[1], CONFIG.ridge).norm
    found = correlation(network, batch, CONFIG).item()
    assert found * 6 * CONFIG.dimensions == pytest.approx(total, rel=1e-5)


def test_training_correlates_the_views_more() -> None:
    views = [three(seed)[:2] for seed in range(3)]
    groups = [(one, other + walk(60, seed=9 + k)) for k, (one, other) in enumerate(views)]
    before, after = (
        fit_aligner(groups, "dcaw", replace(CONFIG, steps=steps, pairs=12)) for steps in (0, 30)
    )
    network = before.features.args[0], after.features.args[0]  # pyright: ignore
    clips = ClipTensors(groups, True)
    batches = [encode_pairs(each, clips, range(6)) for each in network]
    scores = [correlation(n, b, CONFIG).item() for n, b in zip(network, batches, strict=True)]
    assert scores[1] > scores[0] + 0.01


def test_folding_keeps_the_objective_and_uncorrelates_the_outputs() -> None:
    config = replace(CONFIG, ridge=1e-6, attention="diagonal")
    groups = [three(seed)[:2] for seed in range(3)]
    clips, network = ClipTensors(groups, True), start_from_components(groups, config, True, 0)
    rng = np.random.default_rng(0)
    every = range(len(clips.pairs))
    before = correlation(network, encode_pairs(network, clips, every), config).item()
    fold(network, clips, config, rng)
    batch = encode_pairs(network, clips, every)
    assert correlation(network, batch, config).item() == pytest.approx(before, abs=2e-3)
    rows = torch.cat([batch.target, warping(network, batch, config, "diagonal").mT @ batch.source])
    inside = torch.cat([batch.masks[1]] * 2).bool()
    covariance = np.cov(rows[inside].detach().numpy().T)
    spread = np.sqrt(np.diag(covariance))
    assert np.abs(covariance / np.outer(spread, spread) - np.eye(len(spread))).max() < 0.01


@pytest.mark.parametrize("attention", ATTENTIONS)
def test_every_warping_can_be_trained_with(attention: str) -> None:
    view, other, _ = three()
    config = replace(CONFIG, attention=attention)
    found = align([view, other], "dcaw", config)
    assert found.attention is not None
    again = align([view, other], "dcaw", config)
    np.testing.assert_array_equal(found.attention, again.attention)


def test_a_third_view_settles_what_two_leave_open() -> None:
    # 0 and 2 do not know each other; 1 knows both.
    blind, known = np.full((3, 3), 1 / 3, np.float32), np.eye(3, dtype=np.float32)
    pairs = dict.fromkeys(permutations(range(3), 2), known)
    pairs |= {(0, 2): blind, (2, 0): blind}
    found = consistent_attention(pairs, 0, 2)
    np.testing.assert_allclose(found.sum(axis=0), 1, atol=1e-6)
    assert (np.diag(found) > 0.5).all()
    two = {(0, 1): blind, (1, 0): blind}
    np.testing.assert_allclose(consistent_attention(two, 0, 1), blind, atol=1e-6)


def test_windows_are_what_the_papers_network_sees(speech_wav: Path) -> None:
    sound = read_audio(speech_wav)
    view = speech_view(Waveform(sound.samples[: sound.sample_rate], sound.sample_rate), "windows")
    assert view.shape == (50, WINDOW_FEATURES)
    torch.manual_seed(0)
    encoder = WindowEncoder(EncoderConfig(WINDOW_FEATURES, 4, windows=True))
    torch.nn.init.xavier_uniform_(encoder.out.weight)
    torch.nn.init.zeros_(encoder.direct.weight)
    torch.nn.init.zeros_(encoder.direct.bias)
    columns = np.pad(view.reshape(100, 128, 3), ((20, 20), (0, 0), (0, 0)))
    windows = np.stack([columns[2 * frame : 2 * frame + 41] for frame in range(50)])
    with torch.no_grad():
        found = encoder(torch.from_numpy(view)[None], torch.tensor([50]))
        whole, _ = encoder.windows.crnn(torch.from_numpy(windows)[None])
    torch.testing.assert_close(found, whole, atol=1e-4, rtol=1e-4)


def test_windows_are_aligned(speech_wav: Path) -> None:
    sound = read_audio(speech_wav)
    word = Waveform(sound.samples[: sound.sample_rate], sound.sample_rate)
    slow = Waveform(word.samples, round(word.sample_rate * 0.9))
    views = [speech_view(each, "windows") for each in (word, slow)]
    config = DcawConfig(steps=2, windows=True)
    found = align(views, "dcaw", config)
    assert np.abs(found.source_frames() - 0.9 * np.arange(len(views[1]))).mean() < 2.5
    with pytest.raises(AlignmentError, match="768"):
        align([walk(), walk()], "dcaw", config)
    with pytest.raises(AlignmentError, match="nothing changes"):
        speech_view(Waveform(np.zeros(16000, np.float32), 16000), "windows")


def test_what_is_too_long_to_train_on_is_said() -> None:
    long = np.zeros((2100, 1), np.float32)
    with pytest.raises(AlignmentError, match="4 million cells"):
        align([long, long], "dcaw")


def test_words_in_sentences_are_sources_alone() -> None:
    sentence, word = walk(90, seed=3), walk(30)
    clips = ClipTensors([(sentence, word)], True, from_first=True)
    assert clips.orders == [(0, 1)]
    numbers = draw_pairs(clips, 10, np.random.default_rng(0))
    assert numbers == [0]
