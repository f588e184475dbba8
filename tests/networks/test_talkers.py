"""The network of the model `talkers`."""

from __future__ import annotations

import pytest

torch = pytest.importorskip("torch", reason="needs the extra `train`")

from elocute.networks.talkers import MeanOfTalkerNets, TalkerNet, TalkerNetConfig  # noqa: E402

CONFIG = TalkerNetConfig(inputs=12, rules=3, channels=8)


def lively(seed: int = 0) -> TalkerNet:
    torch.manual_seed(seed)
    network = TalkerNet(CONFIG)
    for parameter in network.parameters():
        torch.nn.init.normal_(parameter, std=0.4)
    return network.eval()


def test_before_training_it_is_a_share_of_the_rules() -> None:
    given = torch.randn(2, 30, 12)
    told = TalkerNet(CONFIG).eval()(given)
    assert told.shape == (2, 30, 5)
    assert torch.allclose(told[..., :4], 0.5 * given[..., 3:7])
    assert torch.equal(told[..., 4], torch.zeros(2, 30))


def test_an_output_sees_no_further_than_its_reach() -> None:
    given, network = torch.randn(1, 60, 12), lively()
    told = network(given)
    for at, same in ((30 - CONFIG.reach - 1, True), (30 - CONFIG.reach, False)):
        changed = given.clone()
        changed[0, at] += 5
        changed[0, 60 - at] += 5
        assert torch.allclose(network(changed)[0, 30], told[0, 30], atol=1e-6) == same


def test_a_mean_of_networks_is_the_mean_of_what_they_say() -> None:
    given, networks = torch.randn(1, 20, 12), [lively(1), lively(2)]
    both = (networks[0](given) + networks[1](given)) / 2
    assert torch.allclose(MeanOfTalkerNets(networks)(given), both, atol=1e-6)
    guarded = MeanOfTalkerNets(networks, 0.25)(given)
    assert torch.allclose(guarded[..., 0], both[..., 0] + 0.25 * given[..., 3], atol=1e-6)
    assert torch.allclose(guarded[..., 1:], both[..., 1:], atol=1e-6)
