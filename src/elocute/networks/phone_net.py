"""The phone network: dilated convolutions over log-mel features, looking back more than ahead.

100 Hz features in, 40 phone logits at 50 Hz out. Each block is padded more on the left than on
the right, so the whole looks ahead only `lookahead_frames` feature frames.
"""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor, nn
from torch.nn import functional


@dataclass(frozen=True)
class PhoneNetConfig:
    """Widths and reach; `blocks` gives (dilation, taps to the right) of each block."""

    bands: int = 64
    phones: int = 40
    channels: int = 192
    kernel: int = 5
    blocks: tuple[tuple[int, int], ...] = (
        (1, 2),
        (2, 1),
        (4, 0),
        (1, 2),
        (2, 1),
        (4, 0),
        (1, 0),
        (8, 0),
        (1, 0),
    )
    stem_kernel: int = 5
    dropout: float = 0.05

    @property
    def lookahead_frames(self) -> int:
        """Feature frames (10 ms) seen beyond an output's own time."""
        return self.stem_kernel // 2 + 2 * sum(d * right for d, right in self.blocks)

    @property
    def history_frames(self) -> int:
        """Feature frames seen before it."""
        back = sum(d * (self.kernel - 1 - right) for d, right in self.blocks)
        return self.stem_kernel // 2 + 2 * back


class ResidualBlock(nn.Module):
    """Convolution, batch norm and ReLU, added to the input."""

    def __init__(self, config: PhoneNetConfig, dilation: int, right: int) -> None:
        super().__init__()
        reach = dilation * (config.kernel - 1)
        self.padding = (reach - dilation * right, dilation * right)
        self.convolution = nn.Conv1d(
            config.channels, config.channels, config.kernel, dilation=dilation, bias=False
        )
        self.norm = nn.BatchNorm1d(config.channels)
        # Whole channels: drawing a number for every frame took a fifth of the training time.
        self.dropout = nn.Dropout1d(config.dropout)

    def forward(self, x: Tensor) -> Tensor:
        y = self.norm(self.convolution(functional.pad(x, self.padding)))
        return x + self.dropout(functional.relu(y))


class PhoneNet(nn.Module):
    """(batch, frame, 64) features to (batch, ceil(frame / 2), 40) logits."""

    def __init__(self, config: PhoneNetConfig | None = None) -> None:
        super().__init__()
        self.config = config = config or PhoneNetConfig()
        self.stem = nn.Conv1d(
            config.bands,
            config.channels,
            config.stem_kernel,
            stride=2,
            padding=config.stem_kernel // 2,
            bias=False,
        )
        self.norm = nn.BatchNorm1d(config.channels)
        self.blocks = nn.Sequential(*[ResidualBlock(config, d, r) for d, r in config.blocks])
        self.head = nn.Conv1d(config.channels, config.phones, 1)

    def forward(self, features: Tensor) -> Tensor:
        x = functional.relu(self.norm(self.stem(features.transpose(1, 2))))
        return self.head(self.blocks(x)).transpose(1, 2)
