"""VOCA: a window of speech features and a speaking style in, displacements of the face out.

The network of Cudeiro et al. 2019, Table 1, for any feature size D, style count S and decoder
size. Windows are zero-padded "same" as in the released code: with stride 2 the padding stands at
the right end only, and 16 frames become 8, 4, 2, 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

WINDOW = 16  # frames at 60 fps (section 5)
FILTERS = (32, 32, 64, 64)
HIDDEN, COMPONENTS = 128, 50


@dataclass(frozen=True)
class VocaConfig:
    """features: D; styles: S; outputs: 3 · vertices, or the size of a reduced decoder.

    heard: features of an encoder that are projected onto D first; 0 where they are taken as is.
    """

    features: int
    styles: int
    outputs: int
    components: int = COMPONENTS
    heard: int = 0


class ScalarBatchNorm(nn.BatchNorm2d):
    """Batch norm of network inputs by one mean and one variance.

    Where several processes share a batch, both are those of the whole batch. Inputs need no
    gradient, so neither do their statistics; torch's SyncBatchNorm exists for CUDA alone.
    """

    def __init__(self) -> None:
        super().__init__(1)

    def forward(self, input: Tensor) -> Tensor:
        if not self.training or not _processes():
            return super().forward(input)
        with torch.no_grad():
            mean, variance, count = _shared_moments(input)
            assert self.running_mean is not None and self.running_var is not None
            assert self.num_batches_tracked is not None and self.momentum is not None
            self.running_mean.lerp_(mean.to(self.running_mean), self.momentum)
            unbiased = (variance * count / (count - 1)).to(self.running_var)
            self.running_var.lerp_(unbiased, self.momentum)
            self.num_batches_tracked += 1
        scale = torch.rsqrt(variance + self.eps).to(input.dtype)
        return (input - mean.to(input.dtype)) * (scale * self.weight) + self.bias


def _processes() -> bool:
    together = torch.distributed.is_available() and torch.distributed.is_initialized()
    return together and torch.distributed.get_world_size() > 1


def _shared_moments(values: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Mean, variance and count over the values of all processes, in double precision."""
    double = values.double()
    sums = torch.stack([double.new_tensor(double.numel()), double.sum(), double.square().sum()])
    torch.distributed.all_reduce(sums)
    count, total, squares = sums
    mean = total / count
    return mean, squares / count - mean.square(), count


class Voca(nn.Module):
    """(batch, 16, feature) and (batch, style) to (batch, output).

    Batch norm is one scalar mean and variance for all features, and the styles pass it by, as in
    the released code. Windows are of what `projected` gives.
    """

    projection: Tensor

    def __init__(self, config: VocaConfig) -> None:
        super().__init__()
        self.config = config
        if config.heard:
            self.register_buffer("projection", torch.zeros(config.heard, config.features))
        self.norm = ScalarBatchNorm()
        widths = (config.features + config.styles, *FILTERS)
        self.convolutions = nn.ModuleList(
            nn.Conv1d(before, after, 3, stride=2)
            for before, after in zip(widths, FILTERS, strict=False)
        )
        self.hidden = nn.Linear(FILTERS[-1] + config.styles, HIDDEN)
        self.embedding = nn.Linear(HIDDEN, config.components)
        self.decoder = nn.Linear(config.components, config.outputs)
        for layer in (*self.layers, self.hidden, self.embedding):
            nn.init.xavier_uniform_(layer.weight)
            if layer.bias is not None:
                nn.init.zeros_(layer.bias)
        nn.init.zeros_(self.decoder.bias)

    def start_as_released(self) -> None:
        """Initialise all layers but the decoder as the authors' released code does.

        Weights and biases of convolutions are normal with a standard deviation of 0.02, weights of
        the other layers of 0.1, both cut at two standard deviations; their biases are zero.
        """
        for layer in self.layers:
            _cut_normal(layer.weight, 0.02)
            assert layer.bias is not None
            _cut_normal(layer.bias, 0.02)
        for layer in (self.hidden, self.embedding):
            _cut_normal(layer.weight, 0.1)
            nn.init.zeros_(layer.bias)

    @property
    def layers(self) -> list[nn.Conv1d]:
        """The four convolutions."""
        return list(self.convolutions)  # pyright: ignore[reportReturnType]

    def projected(self, heard: Tensor) -> Tensor:
        """(frame, feature) of (frame, feature of the encoder)."""
        return heard @ self.projection if self.config.heard else heard

    def encode(self, windows: Tensor, styles: Tensor) -> Tensor:
        """(batch, component): everything before the decoder."""
        x = self.norm(windows.unsqueeze(1)).squeeze(1).transpose(1, 2)
        spread = styles.unsqueeze(2).expand(-1, -1, x.shape[2])
        x = torch.cat([x, spread], dim=1)
        for layer in self.layers:
            x = functional.relu(layer(functional.pad(x, (0, 1))))
        x = torch.cat([x.squeeze(2), styles], dim=1)
        return self.embedding(torch.tanh(self.hidden(x)))

    def forward(self, windows: Tensor, styles: Tensor) -> Tensor:
        return self.decoder(self.encode(windows, styles))


def _cut_normal(values: Tensor, deviation: float) -> None:
    nn.init.trunc_normal_(values, std=deviation, a=-2 * deviation, b=2 * deviation)


class SharedVoca(nn.Module):
    """The same numbers for a whole clip, every convolution computed once.

    (frame, feature) and (1, style) to (frame, output). Neighbouring windows share what does not
    touch the padding at their right end; what does is one further value per frame and layer, so
    layer k needs two dilated convolutions over the clip instead of one for every window.
    """

    def __init__(self, voca: Voca) -> None:
        super().__init__()
        self.voca = voca

    def forward(self, features: Tensor, styles: Tensor) -> Tensor:
        return self.voca.decoder(self.embed(features, styles))

    def embed(self, features: Tensor, styles: Tensor) -> Tensor:
        """(frame, component): everything before the decoder."""
        voca, frames = self.voca, features.shape[0]
        padded = functional.pad(voca.projected(features), (0, 0, WINDOW // 2, WINDOW // 2 - 1))
        x = voca.norm(padded[None, None]).squeeze(1).transpose(1, 2)
        x = torch.cat([x, styles.unsqueeze(2).expand(-1, -1, x.shape[2])], dim=1)
        # inner: values untouched by padding; edge: the last place of a window, which sees it.
        inner = edge = x
        for depth, layer in enumerate(voca.layers):
            reach = 2**depth  # frames between neighbouring places of the layer before
            weight, bias = layer.weight, layer.bias
            after = functional.conv1d(edge[:, :, reach:], weight[:, :, 1:2])
            before = functional.conv1d(inner[:, :, : after.shape[2]], weight[:, :, :1], bias)
            edge = functional.relu(before + after)
            if layer is not voca.layers[-1]:
                inner = functional.relu(functional.conv1d(inner, weight, bias, dilation=reach))
        embedded = edge.squeeze(0).T
        hidden = torch.cat([embedded, styles.expand(frames, -1)], dim=1)
        return voca.embedding(torch.tanh(voca.hidden(hidden)))
