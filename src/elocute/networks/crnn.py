"""The recurrent model: log-mel columns in, weights of speech blendshapes out.

The network of Tzirakis et al. 2019, section 5: convolutions over frequency, then over the 400 ms
of a window, each with kernel 3, stride 2 and 64 filters; a dense layer of 128, an LSTM of 128 and
as many outputs as there are blendshapes. The paper names neither the number of layers nor the
padding. Here six convolutions without padding take 127 mel bands to one (the topmost of 128, at
the upper end of hearing, is not used), and five take 41 columns to one, the first four with a zero
at either end.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from elocute.audio.mel_with_deltas import BANDS, CONTEXT, MARGIN

COLUMNS = 2 * CONTEXT + 1  # 41
CHANNELS, FILTERS, HIDDEN = 3, 64, 128
BLOCK = 128  # columns whose convolutions stay in a processor's cache
FREQUENCY_LAYERS = 6  # 128 → 63 → 31 → 15 → 7 → 3 → 1
TIME_PADDING = (1, 1, 1, 1, 0)  # 41 → 21 → 11 → 6 → 3 → 1
State = tuple[Tensor, Tensor]
"""The LSTM's (1, batch, 128) output and cell."""


@dataclass(frozen=True)
class CrnnConfig:
    """outputs: speech blendshapes, 28 in the paper. features: of a column, where an encoder gives
    them; 0 for the paper's mel bands."""

    outputs: int = 28
    features: int = 0


class Crnn(nn.Module):
    """(batch, frame, 41, 128, 3) windows to (batch, frame, output), window by window.

    An encoder's features (batch, frame, 41, feature) go through one layer in place of the
    convolutions over frequency. `SharedCrnn` gives the same numbers from columns. `shift` and
    `scale` standardise the three channels of mel bands and `audible` mutes bands; training sets
    them from its data and settings.
    """

    shift: Tensor
    scale: Tensor
    audible: Tensor

    def __init__(self, config: CrnnConfig | None = None) -> None:
        super().__init__()
        self.config = config or CrnnConfig()
        self.register_buffer("shift", torch.zeros(CHANNELS))
        self.register_buffer("scale", torch.ones(CHANNELS))
        self.register_buffer("audible", torch.ones(BANDS, 1))
        self.frequency = nn.ModuleList(
            [nn.Linear(self.config.features, FILTERS)]
            if self.config.features
            else (
                nn.Conv2d(FILTERS if depth else CHANNELS, FILTERS, (1, 3), stride=(1, 2))
                for depth in range(FREQUENCY_LAYERS)
            )
        )
        self.time = nn.ModuleList(
            nn.Conv1d(FILTERS, FILTERS, 3, stride=2, padding=padding) for padding in TIME_PADDING
        )
        self.dense = nn.Linear(FILTERS, HIDDEN)
        self.recurrent = nn.LSTM(HIDDEN, HIDDEN, batch_first=True)
        self.output = nn.Linear(HIDDEN, self.config.outputs)
        self._initialise()

    def _initialise(self) -> None:
        """He for feature layers, Glorot for LSTM and output (section 6.1); biases are zero."""
        for layer in (*self.frequency, *self.time, self.dense):
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")  # pyright: ignore
            nn.init.zeros_(layer.bias)  # pyright: ignore
        for name, value in self.recurrent.named_parameters():
            if "weight" in name:
                for gate in value.chunk(4):
                    nn.init.xavier_uniform_(gate)
            else:
                nn.init.zeros_(value)
        nn.init.xavier_uniform_(self.output.weight)
        nn.init.zeros_(self.output.bias)

    def columns(self, values: Tensor) -> Tensor:
        """(batch, column, 128, 3) to (batch, column, 64): every column on its own."""
        if self.config.features:
            return functional.relu(self.frequency[0](values))
        # One product and one sum over whole rows: the fastest form.
        gain = self.audible / self.scale
        x = (values * gain - self.shift * gain).permute(0, 3, 1, 2)
        for layer in self.frequency:
            x = functional.relu(layer(x))
        return x.squeeze(3).transpose(1, 2)

    def seen(self, static: Tensor) -> Tensor:
        """(batch, column + 8, 128) to (batch, column, 128, 3), or the later features."""
        if self.config.features:
            return static[:, 2 * MARGIN :]
        return with_slopes(static)

    def columns_in_blocks(self, values: Tensor) -> Tensor:
        """The same block by block: on a processor training is more than twice as fast."""
        return torch.cat([self.columns(block) for block in values.split(BLOCK, 1)], 1)

    def windows(self, columns: Tensor) -> Tensor:
        """(window, 41, 64) to (window, 64)."""
        return self.after_first(functional.relu(self.time[0](columns.transpose(1, 2))))

    def after_first(self, x: Tensor) -> Tensor:
        """(window, 64, 21), the first convolution over time done, to (window, 64)."""
        for layer in list(self.time)[1:]:
            x = functional.relu(layer(x))
        return x.squeeze(2)

    def head(self, x: Tensor, state: State | None = None) -> tuple[Tensor, State]:
        """(batch, frame, 64) to (batch, frame, output), continuing from a state."""
        hidden, after = self.recurrent(functional.relu(self.dense(x)), state)
        return self.output(hidden), after

    def forward(self, windows: Tensor, state: State | None = None) -> tuple[Tensor, State]:
        batch, frames = windows.shape[:2]
        columns = self.columns(windows.flatten(0, 1))
        return self.head(self.windows(columns).unflatten(0, (batch, frames)), state)


class SharedCrnn(nn.Module):
    """The same numbers with every column, and the first convolution over time, computed once.

    (batch, column + 8, 128) log-mel bands, or features, and (batch, frame) first columns of
    windows to (batch, frame, output) and the state after the last frame.
    """

    def __init__(self, crnn: Crnn) -> None:
        super().__init__()
        self.crnn = crnn

    def forward(
        self, static: Tensor, starts: Tensor, state: State | None = None
    ) -> tuple[Tensor, State]:
        return self.crnn.head(self.embed(static, starts), state)

    def embed(self, static: Tensor, starts: Tensor) -> Tensor:
        """(batch, frame, 64): all convolutions."""
        return self.embed_columns(self.crnn.seen(static), starts)

    def embed_columns(self, values: Tensor, starts: Tensor) -> Tensor:
        """The same of (batch, column, 128, 3) with the derivatives made."""
        return self.embed_windows(self.crnn.columns(values), starts)

    def embed_windows(self, columns: Tensor, starts: Tensor) -> Tensor:
        """The same of (batch, column, 64) that `Crnn.columns` gave: convolutions over time."""
        x = self._first(columns, starts)
        batch, frames = starts.shape
        return self.crnn.after_first(x.flatten(0, 1)).reshape(batch, frames, FILTERS)

    def _first(self, columns: Tensor, starts: Tensor) -> Tensor:
        """(batch, frame, 64, 21) of the first convolution over time.

        Its inner values are those of the whole sound; at both ends of a window a zero stands
        where the sound goes on.
        """
        layer = self.crnn.time[0]
        assert isinstance(layer, nn.Conv1d) and layer.bias is not None
        weight, bias = layer.weight, layer.bias
        inner = functional.conv1d(columns.transpose(1, 2), weight, bias).transpose(1, 2)
        inside = torch.arange(1, COLUMNS - 2, 2, device=starts.device)
        left = (
            _at(columns, starts) @ weight[:, :, 1].T + _at(columns, starts + 1) @ weight[:, :, 2].T
        )
        end = starts + COLUMNS - 1
        right = _at(columns, end - 1) @ weight[:, :, 0].T + _at(columns, end) @ weight[:, :, 1].T
        places = (starts.unsqueeze(2) + inside).flatten(1)
        middle = _at(inner, places).reshape(*starts.shape, len(inside), FILTERS)
        joined = torch.cat([(left + bias).unsqueeze(2), middle, (right + bias).unsqueeze(2)], dim=2)
        return functional.relu(joined).transpose(2, 3)


def with_slopes(static: Tensor) -> Tensor:
    """(batch, column + 8, 128) to (batch, column, 128, 3): with slopes and their slopes."""
    first = _slope(static)
    second = _slope(first)
    trimmed = static[:, MARGIN : static.shape[1] - MARGIN]
    return torch.stack([trimmed, first[:, MARGIN // 2 : first.shape[1] - MARGIN // 2], second], 3)


def _slope(x: Tensor) -> Tensor:
    last = x.shape[1]
    near = x[:, 3 : last - 1] - x[:, 1 : last - 3]
    far = x[:, 4:last] - x[:, 0 : last - 4]
    return (near + 2 * far) / 10


def _at(values: Tensor, places: Tensor) -> Tensor:
    """(batch, place, feature) of (batch, column, feature) at (batch, place)."""
    return torch.gather(values, 1, places.unsqueeze(2).expand(-1, -1, values.shape[2]))


assert BANDS - 1 == 2 ** (FREQUENCY_LAYERS + 1) - 1
