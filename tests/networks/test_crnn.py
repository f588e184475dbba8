"""The recurrent network: every shape, and the shared form against window by window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from elocute.audio.mel_with_deltas import (
    BANDS,
    CONTEXT,
    MARGIN,
    mel_columns,
    mel_delta_windows,
    mel_deltas,
)
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.networks.crnn import BLOCK, COLUMNS, Crnn, CrnnConfig, SharedCrnn, with_slopes


@pytest.fixture(scope="module")
def network() -> Crnn:
    torch.manual_seed(3)
    network = Crnn()
    network.shift.copy_(torch.tensor([-6.0, 0.01, 0.0]))
    network.scale.copy_(torch.tensor([4.0, 0.5, 0.1]))
    return network.eval()


def test_shapes_of_every_layer(network: Crnn) -> None:
    shapes: list[tuple[int, ...]] = []
    for layer in (*network.frequency, *network.time, network.dense):
        layer.register_forward_hook(lambda _m, _i, out: shapes.append(tuple(out.shape[1:])))
    out, state = network(torch.randn(2, 3, COLUMNS, BANDS, 3))
    bands = [(64, 41, n) for n in (63, 31, 15, 7, 3, 1)]
    assert shapes[:6] == bands
    assert shapes[6:11] == [(64, n) for n in (21, 11, 6, 3, 1)]
    assert shapes[11] == (3, 128)
    assert out.shape == (2, 3, 28) and state[0].shape == state[1].shape == (1, 2, 128)
    for layer in (*network.frequency, *network.time, network.dense):
        layer._forward_hooks.clear()


def test_initialisation_is_he_and_glorot() -> None:
    torch.manual_seed(0)
    fresh = Crnn(CrnnConfig(5))
    for layer in (*list(fresh.frequency)[1:], *fresh.time):
        assert isinstance(layer, torch.nn.Conv1d | torch.nn.Conv2d) and layer.bias is not None
        fan_in = layer.weight[0].numel()
        assert float(layer.weight.detach().std()) == pytest.approx((2 / fan_in) ** 0.5, rel=0.05)
        assert not layer.bias.any()
    recurrent = dict(fresh.recurrent.named_parameters())
    bound = (6 / 256) ** 0.5
    assert float(recurrent["weight_hh_l0"].detach().abs().max()) == pytest.approx(bound, rel=0.01)
    assert fresh.output.out_features == 5


@pytest.mark.parametrize("columns", [1, BLOCK, 2 * BLOCK + 37])
def test_blocks_of_columns_give_the_same_values_and_gradients(network: Crnn, columns: int) -> None:
    torch.manual_seed(columns)
    values, outer = torch.randn(1, columns, BANDS, 3), torch.randn(1, columns, 64)
    first = dict(network.named_parameters())["frequency.0.weight"]
    found = []
    for form in (network.columns, network.columns_in_blocks):
        out = form(values)
        found.append((out.detach(), *torch.autograd.grad((out * outer).sum(), [first])))
    for whole, blocks in zip(*found, strict=True):
        assert whole.std() > 1e-3
        torch.testing.assert_close(blocks, whole, rtol=1e-4, atol=1e-4 * float(whole.abs().max()))


@pytest.mark.parametrize("fps", [30.0, 25.0, 29.97, 60.0])
def test_shared_form_equals_window_by_window(network: Crnn, speech_wav: Path, fps: float) -> None:
    speech = read_audio(speech_wav)  # windows of all of it would take a gigabyte
    words = Waveform(speech.samples[: 4 * speech.sample_rate], speech.sample_rate)
    heard = mel_columns(words, fps)
    starts = torch.from_numpy(heard.starts)[None]
    static = torch.from_numpy(heard.static)[None]
    with torch.no_grad():
        values = with_slopes(static)[0]
        windows = values[starts[0][:, None] + torch.arange(COLUMNS)]
        expected, state = network(windows[None])
        found, after = SharedCrnn(network)(static, starts)
    assert expected.std() > 1e-3
    assert float((found - expected).abs().max()) < 1e-5
    assert float((after[1] - state[1]).abs().max()) < 1e-5


def test_columns_are_those_of_mel_deltas(speech_wav: Path) -> None:
    sound = read_audio(speech_wav)
    heard = mel_columns(sound, 30.0)
    values = with_slopes(torch.from_numpy(heard.static)[None])[0].numpy()
    true = mel_delta_windows(sound, 30.0)
    assert len(heard.starts) == len(true) == len(mel_deltas(sound, 30.0))
    # Each third frame lies on the grid; the others are within 5 ms of it.
    for frame in range(0, len(true), 3):
        first = heard.starts[frame]
        assert np.allclose(values[first : first + COLUMNS], true[frame], atol=2e-4)
    off = np.abs(heard.starts / 100 - np.arange(len(true)) / 30)
    assert off.max() < 0.005
    assert len(heard.static) == heard.starts[-1] + 2 * (CONTEXT + MARGIN) + 1


def test_state_goes_on(network: Crnn) -> None:
    windows = torch.randn(1, 9, COLUMNS, BANDS, 3)
    with torch.no_grad():
        whole, _ = network(windows)
        first, state = network(windows[:, :4])
        second, _ = network(windows[:, 4:], state)
    assert float((torch.cat([first, second], 1) - whole).abs().max()) < 1e-6
