"""The network of the model `talkers`: what people's mouths do beyond the rules.

A residual convolution over a fifth of a second on both sides. The first outputs are the measures of
the mouth in deviations of a talker's speech, added to a share of what the rules make; the last says
whether the lips are shut.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor, nn


@dataclass(frozen=True)
class TalkerNetConfig:
    """Sizes; `rules` is the column of the first measure that the rules make."""

    inputs: int
    rules: int
    measures: int = 4
    channels: int = 64
    dilations: tuple[int, ...] = (1, 1, 2, 2, 4)
    dropout: float = 0.3

    @property
    def reach(self) -> int:
        """Rows that an output sees on both sides."""
        return sum(self.dilations)


class TalkerNet(nn.Module):
    """(batch, row, input) to (batch, row, measure + 1)."""

    def __init__(self, config: TalkerNetConfig) -> None:
        super().__init__()
        self.config, channels = config, config.channels
        self.enter = nn.Conv1d(config.inputs, channels, 1)
        self.layers = nn.ModuleList(
            nn.Conv1d(channels, channels, 3, dilation=d, padding=d) for d in config.dilations
        )
        self.leave = nn.Conv1d(channels, config.measures + 1, 1)
        self.share_of_rules = nn.Parameter(torch.full((config.measures,), 0.5))
        self.dropout = nn.Dropout(config.dropout)
        nn.init.zeros_(self.leave.weight)
        if self.leave.bias is not None:  # training begins at the rules
            nn.init.zeros_(self.leave.bias)

    def forward(self, inputs: Tensor) -> Tensor:
        first, count = self.config.rules, self.config.measures
        rules = inputs[..., first : first + count] * self.share_of_rules
        x = self.dropout(torch.relu(self.enter(inputs.transpose(1, 2))))
        for layer in self.layers:
            x = x + self.dropout(torch.relu(layer(x)))
        told = self.leave(x).transpose(1, 2)
        return torch.cat([told[..., :count] + rules, told[..., count:]], dim=-1)


class MeanOfTalkerNets(nn.Module):
    """The mean of networks that were trained from different seeds, and the rules once more.

    A share of the opening that the rules make is added to what the networks say of it: it is the
    guard for voices and languages that they know nothing of.
    """

    def __init__(self, networks: Sequence[TalkerNet], guard: float = 0.0) -> None:
        super().__init__()
        self.networks, self.guard = nn.ModuleList(networks), guard
        self.rules = networks[0].config.rules

    def forward(self, inputs: Tensor) -> Tensor:
        told = torch.stack([network(inputs) for network in self.networks]).mean(dim=0)
        opening = told[..., :1] + self.guard * inputs[..., self.rules : self.rules + 1]
        return torch.cat([opening, told[..., 1:]], dim=-1)
