"""The trunk: the first layers of Whisper's encoder, taught to hear only so far ahead, with heads.

Every row of 20 ms attends to `history` rows before it and to so many after it as the caller says;
the heads look back only. That of the mouth reads the rows of its own layer from `mouth_ahead` rows
later, beside those of the last layer, which a stream has no later. Whisper's sinusoids tell
positions, rounded to a common period, so that a sound of any length goes on as it began.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from elocute.array_types import Float32Array

CONTEXT = 2  # frames of 10 ms that a row sees on both sides, before any attention
FAR = -1e4  # score of what is not attended to
LIVE_AHEAD = 1  # rows that a layer sees ahead where a mouth is wanted soon


@dataclass(frozen=True)
class TrunkConfig:
    """Sizes; Whisper base has a width of 512, six layers and eight heads."""

    bands: int = 80
    width: int = 512
    layers: int = 4
    heads: int = 8
    mouth_layer: int = 3  # that the mouth is told from beside the last; phones, from the last
    history: int = 150
    period: int = 500
    mouth: int = 7  # six measures, and whether the lips are shut
    mouth_channels: int = 96
    mouth_ahead: int = 4  # rows of the mouth's layer that its head sees ahead
    live_channels: int = 64
    live_late: int = 5  # rows by which a mouth is late whose layers see one row ahead each
    phones: int = 40
    phone_channels: int = 192


def position_rows(period: int, width: int, *, rounded: bool = True) -> Float32Array:
    """(period, width) sinusoids of Whisper's positions, rounded to a whole number of turns each.

    Those too slow for one turn in a period stand still, as at the beginning of a sound.
    """
    half = width // 2
    radians = np.exp(-np.log(10_000.0) / (half - 1) * np.arange(half))
    if rounded:
        radians = np.round(radians * period / (2 * np.pi)) * (2 * np.pi / period)
    angle = np.arange(period)[:, None] * radians
    return np.concatenate([np.sin(angle), np.cos(angle)], axis=1).astype(np.float32)


def weakened(x: Tensor, share: float) -> Tensor:
    """The same values, of whose gradient a share passes."""
    return share * x + (1 - share) * x.detach()


class Layer(nn.Module):
    """A layer of the transformer, normalised before each half."""

    def __init__(self, width: int, heads: int) -> None:
        super().__init__()
        self.heads = heads
        self.attention_norm, self.forward_norm = nn.LayerNorm(width), nn.LayerNorm(width)
        self.attend, self.leave = nn.Linear(width, 3 * width), nn.Linear(width, width)
        self.widen, self.narrow = nn.Linear(width, 4 * width), nn.Linear(4 * width, width)

    def forward(self, x: Tensor, bias: Tensor | None) -> Tensor:
        batch, rows, width = x.shape
        parts = self.attend(self.attention_norm(x)).view(batch, rows, 3, self.heads, -1)
        query, key, value = parts.permute(2, 0, 3, 1, 4)
        mask = None if bias is None else bias.to(query.dtype)
        mixed = functional.scaled_dot_product_attention(query, key, value, attn_mask=mask)
        x = x + self.leave(mixed.transpose(1, 2).reshape(batch, rows, width))
        return x + self.narrow(functional.gelu(self.widen(self.forward_norm(x))))


class CausalHead(nn.Module):
    """Dilated convolutions that look back only: (batch, row, width) to (batch, row, output)."""

    def __init__(
        self, width: int, channels: int, outputs: int, dilations: tuple[int, ...], dropout: float
    ) -> None:
        super().__init__()
        self.enter = nn.Linear(width, channels)
        self.layers = nn.ModuleList(
            nn.Conv1d(channels, channels, 3, dilation=dilation) for dilation in dilations
        )
        self.leave = nn.Linear(channels, outputs)
        self.dilations = dilations
        self.drop_rows, self.dropout = nn.Dropout(2 * dropout), nn.Dropout(dropout)

    @property
    def reach(self) -> int:
        """Rows that an output sees before its own."""
        return 2 * sum(self.dilations)

    def forward(self, rows: Tensor) -> Tensor:
        x = self.dropout(torch.relu(self.enter(self.drop_rows(rows)))).transpose(1, 2)
        for layer, dilation in zip(self.layers, self.dilations, strict=True):
            x = x + self.dropout(torch.relu(layer(functional.pad(x, (2 * dilation, 0)))))
        return self.leave(x.transpose(1, 2))


class Trunk(nn.Module):
    """Bands in, rows out, and what the heads make of them."""

    positions: Tensor

    def __init__(self, config: TrunkConfig | None = None) -> None:
        super().__init__()
        self.config = config = config or TrunkConfig()
        self.first = nn.Conv1d(config.bands, config.width, 3)
        self.second = nn.Conv1d(config.width, config.width, 3, stride=2)
        self.layers = nn.ModuleList(Layer(config.width, config.heads) for _ in range(config.layers))
        self.mouth = CausalHead(
            2 * config.width, config.mouth_channels, config.mouth, (1, 2, 4), dropout=0.15
        )
        self.live_mouth = CausalHead(
            2 * config.width, config.live_channels, config.mouth, (1, 2, 4), dropout=0.15
        )
        self.phones = CausalHead(
            config.width, config.phone_channels, config.phones, (1, 2, 4), dropout=0.05
        )
        positions = torch.from_numpy(position_rows(config.period, config.width))
        self.register_buffer("positions", positions, persistent=False)

    def told(self, rows: Tensor, last: Tensor, *, live: bool = False) -> Tensor:
        """What `rows` returns, both (batch, row, width), to (batch, row, 7) of the mouth.

        Nothing is before the first row and after the last. A `live` mouth is of rows that saw
        `LIVE_AHEAD` rows ahead a layer.
        """
        config, aheads, head = self.config, (self.config.mouth_ahead, 0), self.mouth
        if live:
            layers = (config.mouth_layer, config.layers)
            aheads = tuple(config.live_late - LIVE_AHEAD * number for number in layers)
            head = self.live_mouth
        most = max(aheads)
        read = [
            functional.pad(part, (0, 0, most - ahead, ahead))
            for part, ahead in zip((rows, last), aheads, strict=True)
        ]
        return head(torch.cat(read, dim=-1))[:, most:]

    def rows(
        self, bands: Tensor, ahead: int | None, first: int = 0, phones_pull: float = 1.0
    ) -> tuple[Tensor, Tensor]:
        """The rows that the mouth reads, and those that the phones read.

        Parameters
        ----------
        bands : (batch, 2 · row + 3, 80)
            `CONTEXT` frames more before the first row's own, and as many after the last's.
        ahead : int or None
            Rows that each layer sees ahead; None for all.
        first : int
            Position of the first row.
        phones_pull : float
            Share of the phones' gradient that reaches the layers up to the mouth's.

        Returns
        -------
        two (batch, row, width)
            Normalised.
        """
        x = functional.gelu(self.first(bands.transpose(1, 2)))
        x = functional.gelu(self.second(x)).transpose(1, 2)
        count = x.shape[1]
        place = torch.arange(count)
        x = x + self.positions[(first + place) % self.config.period]
        bias = None
        if ahead is not None:
            apart = place[None] - place[:, None]
            seen = (apart <= ahead) & (apart >= -self.config.history)
            bias = torch.zeros(count, count).masked_fill(~seen, FAR)
        normed = []
        for number, layer in enumerate(self.layers, 1):
            x = layer(x, bias)
            if number in (self.config.mouth_layer, len(self.layers)):
                normed.append(functional.layer_norm(x.float(), (self.config.width,)))
            if number == self.config.mouth_layer:
                x = weakened(x, phones_pull)
        return normed[0], normed[-1]
