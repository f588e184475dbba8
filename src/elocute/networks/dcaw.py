"""Networks of deep canonical attentional warping (Tzirakis et al. 2019, section 4.1).

Recurrent convolutional networks of views, Bahdanau's score (Eq. 3) and what is made of it: Eq. 2,
and monotonic attention in the expected form of Raffel et al. (2017). Shapes: (clip, frame,
feature), padded at the end.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from elocute.audio.mel_with_deltas import BANDS, CONTEXT
from elocute.networks.crnn import CHANNELS, Crnn, CrnnConfig, SharedCrnn

KERNEL = 3
BUMP = 1.0  # half the distance of the flanks, in units of the difference's width
PROBABILITY_MIN = 1e-6
HIDDEN_SCORE = -1e4
"""Of frames that are padding: far below every score, and finite, so that no gradient is NaN."""
COLUMNS_PER_FRAME = 2
WINDOW_FEATURES = COLUMNS_PER_FRAME * BANDS * CHANNELS
"""Of a frame of 20 ms: the two columns of 10 ms that it adds to the windows of 41."""


@dataclass(frozen=True)
class EncoderConfig:
    """Sizes of an encoder.

    inputs: features of a frame. outputs: canonical dimensions before CCA. windows: the features
    are columns of windows of 41 x 128 x 3 (`WindowEncoder`).
    """

    inputs: int
    outputs: int
    filters: int = 32
    units: int = 16
    windows: bool = False


class Encoder(nn.Module):
    """A linear map of the input, and a recurrent convolutional network that is added to it.

    The linear map is given by `start_from`, and the network's last layer starts from zero, so that
    training starts from features that are already worth comparing: a word has seconds of data, not
    hours.
    """

    direct: nn.Linear
    out: nn.Linear

    def start_from(self, matrix: Tensor, mean: Tensor) -> None:
        """Begin as x → (x - mean) @ matrix, of (input, output)."""
        with torch.no_grad():
            self.direct.weight.copy_(matrix.T)
            self.direct.bias.copy_(-mean @ matrix)
            self.out.weight.zero_()
            self.out.bias.zero_()

    def fold(self, matrix: Tensor, mean: Tensor) -> None:
        """Apply y → (y - mean) @ matrix to all outputs from now on, within the last layers."""
        with torch.no_grad():
            for layer in (self.direct, self.out):
                layer.weight.copy_(matrix.T @ layer.weight)
            self.direct.bias.copy_((self.direct.bias - mean) @ matrix)
            self.out.bias.copy_(self.out.bias @ matrix)


class ViewEncoder(Encoder):
    """Of any features: two convolutions over time and a bidirectional GRU.

    Convolutions are initialised as by He et al., recurrent weights as by Glorot (section 6.1).
    """

    def __init__(self, config: EncoderConfig) -> None:
        super().__init__()
        self.direct = nn.Linear(config.inputs, config.outputs)
        self.first = nn.Conv1d(config.inputs, config.filters, KERNEL, padding=KERNEL // 2)
        self.second = nn.Conv1d(config.filters, config.filters, KERNEL, padding=KERNEL // 2)
        self.recurrent = nn.GRU(config.filters, config.units, batch_first=True, bidirectional=True)
        self.out = nn.Linear(config.filters + 2 * config.units, config.outputs)
        for layer in (self.first, self.second):
            nn.init.kaiming_uniform_(layer.weight, nonlinearity="relu")
            nn.init.zeros_(layer.bias)  # pyright: ignore[reportArgumentType]
        for name, weight in self.recurrent.named_parameters():
            (nn.init.xavier_uniform_ if "weight" in name else nn.init.zeros_)(weight)
        nn.init.zeros_(self.out.weight)
        nn.init.zeros_(self.out.bias)

    def forward(self, clips: Tensor, lengths: Tensor) -> Tensor:
        """(clip, frame, input) and (clip,) to (clip, frame, output), zero in the padding."""
        inside = frame_mask(lengths, clips.shape[1]).unsqueeze(2)
        x = functional.relu(self.first(clips.transpose(1, 2))) * inside.transpose(1, 2)
        x = functional.relu(self.second(x)) * inside.transpose(1, 2)
        x = x.transpose(1, 2)
        packed = nn.utils.rnn.pack_padded_sequence(
            x, lengths.cpu(), batch_first=True, enforce_sorted=False
        )
        recurrent, _ = self.recurrent(packed)
        recurrent, _ = nn.utils.rnn.pad_packed_sequence(
            recurrent, batch_first=True, total_length=clips.shape[1]
        )
        return (self.direct(clips) + self.out(torch.cat([x, recurrent], dim=2))) * inside


class WindowEncoder(Encoder):
    """Of windows of 41 x 128 x 3: the paper's convolutional recurrent network (section 5).

    A frame of 20 ms holds its two columns of 10 ms (2 · 128 · 3, see `sound_views.speech_view`);
    its window is the 41 columns around the first of them, zeros beyond the ends of the clip. The
    columns that windows share are computed once.
    """

    def __init__(self, config: EncoderConfig) -> None:
        super().__init__()
        self.direct = nn.Linear(config.inputs, config.outputs)
        self.windows = SharedCrnn(Crnn(CrnnConfig(config.outputs)))
        self.out = self.windows.crnn.output
        nn.init.zeros_(self.out.weight)

    def forward(self, clips: Tensor, lengths: Tensor) -> Tensor:
        """(clip, frame, 768) and (clip,) to (clip, frame, output), zero in the padding."""
        count, frames, _ = clips.shape
        columns = clips.reshape(count, frames * COLUMNS_PER_FRAME, BANDS, CHANNELS)
        columns = functional.pad(columns, (0, 0, 0, 0, CONTEXT, CONTEXT))
        starts = (torch.arange(frames) * COLUMNS_PER_FRAME).expand(count, -1)
        hidden, _ = self.windows.crnn.head(self.windows.embed_columns(columns, starts))
        inside = frame_mask(lengths, frames).unsqueeze(2)
        return (self.direct(clips) + hidden) * inside


def build_encoder(config: EncoderConfig) -> Encoder:
    """The encoder for such features."""
    return WindowEncoder(config) if config.windows else ViewEncoder(config)


class BahdanauScore(nn.Module):
    """score(h1, h2) = vᵀ tanh(Wt h1 + Ws h2 + b), Eq. 3 with Bahdanau's bias.

    Units come in pairs, tanh(d + b) - tanh(d - b) of a difference d = w · (h1 - h2), which is a
    bump around d = 0: from the first step, similar frames score high. All weights are learned.
    """

    def __init__(self, features: int, width: float, height: float) -> None:
        super().__init__()
        self.source = nn.Linear(features, 2 * features)
        self.target = nn.Linear(features, 2 * features, bias=False)
        self.v = nn.Linear(2 * features, 1, bias=False)
        both = torch.eye(features).repeat(2, 1) / width
        sign = torch.cat([torch.ones(features), -torch.ones(features)])
        with torch.no_grad():
            self.source.weight.copy_(both)
            self.target.weight.copy_(-both)
            self.source.bias.copy_(BUMP * sign)
            self.v.weight.copy_((height * sign / features).unsqueeze(0))

    def forward(self, source: Tensor, target: Tensor) -> Tensor:
        """(pair, source, feature) and (pair, target, feature) to (pair, source, target)."""
        joined = self.source(source).unsqueeze(2) + self.target(target).unsqueeze(1)
        return self.v(torch.tanh(joined)).squeeze(3)


def frame_mask(lengths: Tensor, frames: int) -> Tensor:
    """(clip, frame) 1 where a clip has a frame, else 0."""
    return (torch.arange(frames)[None, :] < lengths[:, None]).float()


def soft_attention(scores: Tensor, source_mask: Tensor) -> Tensor:
    """Eq. 2 over the source: (pair, source, target), columns sum to one."""
    hidden = scores.masked_fill(source_mask.unsqueeze(2) == 0, -torch.inf)
    return torch.softmax(hidden, dim=1)


def log_attention(
    scores: Tensor, source_mask: Tensor, target_mask: Tensor, mutual: bool = True
) -> Tensor:
    """log of Eq. 2, (pair, source, target); zero in the padding.

    Eq. 2 lets every target frame choose among the source frames. With `mutual`, source frames
    choose among the target frames too, and the two logarithms are averaged: a frame that is like
    everything then attracts nobody.
    """
    inside = (source_mask.unsqueeze(2) * target_mask.unsqueeze(1)).bool()
    over_source = scores.masked_fill(source_mask.unsqueeze(2) == 0, HIDDEN_SCORE)
    chosen = torch.log_softmax(over_source, dim=1)
    if mutual:
        over_target = scores.masked_fill(target_mask.unsqueeze(1) == 0, HIDDEN_SCORE)
        chosen = 0.5 * (chosen + torch.log_softmax(over_target, dim=2))
    return chosen.masked_fill(~inside, 0.0)


def monotonic_attention(scores: Tensor, source_mask: Tensor, free_start: bool = False) -> Tensor:
    """Expected attention of a reader that never goes back (Raffel et al. 2017, Eqs. 8 to 13).

    At each target frame the reader moves on from where it was, and stops at source frame i with
    probability sigmoid(score): α_j[i] = p_j[i] Π_{k<i}(1 - p_j[k]) Σ_{k≤i} α_{j-1}[k] /
    Π_{l<k}(1 - p_j[l]). Each column is divided by its sum, which gives back the probability of
    reading past the end, so that columns over the source sum to one. The reader starts at the
    first frame or, with `free_start`, anywhere.
    """
    stops = torch.sigmoid(scores) * source_mask.unsqueeze(2)
    stops = stops.clamp(PROBABILITY_MIN, 1 - PROBABILITY_MIN)
    goes = torch.log1p(-stops)
    before = torch.exp(torch.cumsum(goes, dim=1) - goes).clamp_min(PROBABILITY_MIN)
    if free_start:
        last = source_mask / source_mask.sum(dim=1, keepdim=True)
    else:
        last = functional.one_hot(torch.zeros(len(scores), dtype=torch.long), scores.shape[1])
        last = last.to(scores.dtype)
    columns = []
    for j in range(scores.shape[2]):
        reach = before[:, :, j]
        here = stops[:, :, j] * reach * torch.cumsum(last / reach, dim=1) * source_mask
        last = here / here.sum(dim=1, keepdim=True).clamp_min(1e-12)
        columns.append(last)
    return torch.stack(columns, dim=2)


class DcawNetwork(nn.Module):
    """An encoder per view, or one for all, and the attention between two views."""

    def __init__(
        self, configs: list[EncoderConfig], shared: bool, width: float = 2.0, height: float = 4.0
    ) -> None:
        super().__init__()
        count = 1 if shared else len(configs)
        self.encoders = nn.ModuleList(build_encoder(config) for config in configs[:count])
        self.attention = BahdanauScore(configs[0].outputs, width, height)

    def encode(self, side: int, clips: Tensor, lengths: Tensor) -> Tensor:
        """(clip, frame, output) of view `side`."""
        return self.encoders[min(side, len(self.encoders) - 1)](clips, lengths)
