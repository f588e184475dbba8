"""The network of VOCA 2019, Table 1."""

from __future__ import annotations

import pytest

pytest.importorskip("torch", reason="needs the extra `train`")

import torch

from elocute.networks.voca import SharedVoca, Voca, VocaConfig
from elocute.training.decoder import principal_components, start_decoder

PAPER = VocaConfig(features=29, styles=8, outputs=5023 * 3)


def lively(config: VocaConfig) -> Voca:
    """A network in evaluation with numbers nowhere zero, so that every path is felt."""
    torch.manual_seed(0)
    voca = Voca(config)
    for parameter in voca.parameters():
        torch.nn.init.normal_(parameter, std=0.3)
    held = dict(voca.norm.named_buffers())
    held["running_mean"].fill_(0.4)
    held["running_var"].fill_(2.0)
    return voca.eval()


def test_every_shape_is_that_of_table_1() -> None:
    voca = Voca(PAPER)
    seen: list[tuple[int, ...]] = []
    for layer in (*voca.layers, voca.hidden, voca.embedding, voca.decoder):
        layer.register_forward_hook(lambda _m, _i, out: seen.append(tuple(out.shape[1:])))
    inputs: list[int] = []
    voca.layers[0].register_forward_hook(lambda _m, i, _o: inputs.append(i[0].shape[1]))
    voca.hidden.register_forward_hook(lambda _m, i, _o: inputs.append(i[0].shape[1]))
    voca(torch.zeros(2, 16, 29), torch.zeros(2, 8))
    assert seen == [(32, 8), (32, 4), (64, 2), (64, 1), (128,), (50,), (15069,)]
    assert inputs == [37, 72]


def test_the_parameters_are_as_many_as_table_1_has() -> None:
    convolutions = (37 * 32 + 32 * 32 + 32 * 64 + 64 * 64) * 3 + 32 + 32 + 64 + 64
    dense = 72 * 128 + 128 + 128 * 50 + 50 + 50 * 15069 + 15069
    batch_norm = 2
    total = sum(parameter.numel() for parameter in Voca(PAPER).parameters())
    assert total == convolutions + dense + batch_norm == 809_563


@pytest.mark.parametrize(("features", "styles", "frames"), [(29, 8, 50), (40, 3, 1), (7, 1, 13)])
def test_shared_windows_give_the_numbers_of_single_windows(
    features: int, styles: int, frames: int
) -> None:
    voca = lively(VocaConfig(features, styles, 30)).double()
    clip = torch.randn(frames, features, dtype=torch.float64)
    style = torch.softmax(torch.randn(1, styles, dtype=torch.float64), 1)
    padded = torch.nn.functional.pad(clip, (0, 0, 8, 7))
    windows = padded.unfold(0, 16, 1).transpose(1, 2)
    with torch.no_grad():
        one_by_one = voca(windows, style.expand(frames, -1))
        shared = SharedVoca(voca)(clip, style)
    torch.testing.assert_close(shared, one_by_one, atol=1e-9, rtol=1e-9)


def test_the_decoder_starts_from_components_and_no_bias() -> None:
    voca = Voca(VocaConfig(29, 8, 30, components=20))
    targets = torch.randn(200, 30)
    start_decoder(voca.decoder, targets)
    assert torch.equal(voca.decoder(torch.eye(20)), principal_components(targets, 20))


def test_styles_mix_alike_among_vertices_and_in_the_embedding() -> None:
    """Section 4: the decoder is linear, so convex mixes commute with it."""
    voca = lively(VocaConfig(29, 2, 30))
    windows, one, two = torch.randn(5, 16, 29), torch.eye(2)[:1], torch.eye(2)[1:]
    with torch.no_grad():
        first, second = (voca.encode(windows, style.expand(5, -1)) for style in (one, two))
        of_vertices = 0.3 * voca.decoder(first) + 0.7 * voca.decoder(second)
        torch.testing.assert_close(voca.decoder(0.3 * first + 0.7 * second), of_vertices)


def test_the_initialisers_of_the_released_code() -> None:
    torch.manual_seed(0)
    voca = Voca(PAPER)
    voca.start_as_released()
    for layer in voca.layers:
        assert layer.bias is not None
        assert layer.weight.abs().max() <= 0.04 and layer.bias.abs().max() <= 0.04
        # A normal distribution cut at two deviations has 0.88 of its deviation.
        assert float(layer.weight.detach().std()) == pytest.approx(0.88 * 0.02, rel=0.05)
        assert layer.bias.abs().max() > 0
    for layer in (voca.hidden, voca.embedding):
        assert layer.weight.abs().max() <= 0.2
        assert float(layer.weight.detach().std()) == pytest.approx(0.88 * 0.1, rel=0.05)
        assert not layer.bias.any()


def test_the_norm_is_one_mean_and_one_variance_for_all_features() -> None:
    voca = Voca(PAPER).train()
    windows = torch.randn(6, 1, 16, 29) * 3 + 2
    out = voca.norm(windows)
    expected = (windows - windows.mean()) / windows.std(correction=0)
    torch.testing.assert_close(out, expected, atol=1e-5, rtol=1e-4)
