"""The network of Karras et al. 2017: half a second of sound and an emotional state to a face.

Formant analysis: five convolutions over the autocorrelation of each row of sound by itself.
Articulation: five convolutions over time, the emotional state beside the output of each. Output:
two linear layers, the second a basis of the face (Table 1 of the paper). Rectified linear units
follow every convolution.

In training the input of every convolution is multiplied by 1.4^N(0, 1), one factor for each
feature map, the same for frames whose motion is compared (section 4.4, "Training and data
augmentation"). What of this was not checked against the paper's text is in
docs/decisions/011-karras.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from elocute.audio.autocorrelation import COEFFICIENTS, WINDOW_ROWS

FORMANT_MAPS = (72, 108, 162, 243, 256)
ARTICULATION_MAPS = 256
EMOTION, COMPONENTS = 16, 150
NOISE = 1.4
HALVINGS = 4  # convolutions with stride 2, in both networks; the fifth takes in what is left


@dataclass(frozen=True)
class KarrasConfig:
    """outputs: 3 · vertices, or the size of a reduced decoder; emotion: E of the paper."""

    outputs: int
    emotion: int = EMOTION
    components: int = COMPONENTS


class Noise:
    """The factors of a batch of runs, drawn afresh for each convolution in turn."""

    def __init__(self, runs: int, generator: torch.Generator) -> None:
        self.runs, self.generator = runs, generator

    def __call__(self, values: Tensor) -> Tensor:
        """Scale (item, map, place): every run has as many neighbouring items."""
        drawn = torch.randn(self.runs, values.shape[1], generator=self.generator)
        factors = (NOISE**drawn).to(values).repeat_interleave(len(values) // self.runs, dim=0)
        return values * factors[:, :, None]


class Karras(nn.Module):
    """(batch, 64, 32) of autocorrelation and (batch, emotion) to (batch, output)."""

    def __init__(self, config: KarrasConfig) -> None:
        super().__init__()
        self.config = config
        maps = (1, *FORMANT_MAPS)
        self.formants = nn.ModuleList(
            nn.Conv1d(maps[depth], maps[depth + 1], 3, stride=2, padding=1)
            for depth in range(HALVINGS)
        )
        self.formants.append(nn.Conv1d(maps[HALVINGS], maps[-1], COEFFICIENTS >> HALVINGS))
        seen = ARTICULATION_MAPS + config.emotion
        self.articulation = nn.ModuleList(
            nn.Conv1d(seen if depth else FORMANT_MAPS[-1], ARTICULATION_MAPS, 3, 2, padding=1)
            for depth in range(HALVINGS)
        )
        self.articulation.append(nn.Conv1d(seen, ARTICULATION_MAPS, WINDOW_ROWS >> HALVINGS))
        self.embedding = nn.Linear(seen, config.components)
        self.decoder = nn.Linear(config.components, config.outputs)
        for layer in (*self.formants, *self.articulation):
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")  # pyright: ignore
            nn.init.zeros_(layer.bias)  # pyright: ignore
        nn.init.xavier_normal_(self.embedding.weight)
        nn.init.zeros_(self.embedding.bias)
        nn.init.zeros_(self.decoder.bias)

    def analyse(self, rows: Tensor, noise: Noise | None = None) -> Tensor:
        """(row, 32) of autocorrelation to (row, 256): the formant analysis network."""
        x = rows[:, None]
        for layer in self.formants:
            x = functional.relu(layer(noise(x) if noise else x))
        return x.squeeze(2)

    def forward(self, windows: Tensor, emotions: Tensor) -> Tensor:
        """One face for each window."""
        rows = self.analyse(windows.flatten(0, 1)).unflatten(0, windows.shape[:2])
        x = functional.relu(self.articulation[0](rows.transpose(1, 2)))
        return self._from_first(x, emotions, None)

    def of_runs(
        self, rows: Tensor, places: Tensor, emotions: Tensor, noise: Noise | None = None
    ) -> Tensor:
        """The faces of runs of overlapping windows, what they share computed once.

        rows: (run, row, 32). places: (run, frame), the first row of each window. emotions: (run,
        frame, emotion). Gives (run, frame, output), which `forward` gives window by window.
        """
        runs, frames = places.shape
        formants = self.analyse(rows.flatten(0, 1), noise).unflatten(0, rows.shape[:2])
        x = formants.transpose(1, 2)
        first, edge = _along(self.articulation[0], noise(x) if noise else x)
        reach = torch.arange(2, WINDOW_ROWS, 2, device=places.device)
        inner = (places[:, :, None] + reach).flatten(1)
        # As a lookup, whose gradient is the same in every run; an index's is not, on many threads.
        run = first.shape[2] * torch.arange(runs, device=places.device)[:, None]
        maps = functional.embedding(run + inner, first.transpose(1, 2).flatten(0, 1))
        maps = maps.unflatten(1, (frames, len(reach)))
        begun = functional.embedding(run + places, edge.transpose(1, 2).flatten(0, 1))[:, :, None]
        x = torch.cat([begun, maps], dim=2).flatten(0, 1).transpose(1, 2)
        return self._from_first(x, emotions.flatten(0, 1), noise).unflatten(0, (runs, frames))

    def _from_first(self, x: Tensor, emotions: Tensor, noise: Noise | None) -> Tensor:
        """(batch, 256, 32) after the first convolution over time to (batch, output)."""
        for layer in self.articulation[1:]:
            x = _with_emotion(x, emotions)
            x = functional.relu(layer(noise(x) if noise else x))
        return self.decoder(self.embedding(_with_emotion(x, emotions).squeeze(2)))


def _with_emotion(x: Tensor, emotions: Tensor) -> Tensor:
    """The emotional state as further maps, alike at all places."""
    return torch.cat([x, emotions[:, :, None].expand(-1, -1, x.shape[2])], dim=1)


def _along(layer: nn.Module, x: Tensor) -> tuple[Tensor, Tensor]:
    """A convolution of three at every row, with and without the row before it.

    A window's first place has padding before it instead of a row.
    """
    assert isinstance(layer, nn.Conv1d)
    weight, bias, padded = layer.weight, layer.bias, functional.pad(x, (1, 1))
    whole = functional.conv1d(padded, weight, bias)
    begun = functional.conv1d(padded[:, :, 1:], weight[:, :, 1:], bias)
    return functional.relu(whole), functional.relu(begun)


class SharedKarras(nn.Module):
    """The same numbers for a whole sound in one emotional state, every convolution computed once.

    (row, 32) and (1, style) shares to (row - 63, output): a face for every window of 64 rows. The
    places of a window lie 2, 4, 8 and 16 rows apart in the outputs of the layers, so over the
    sound each layer is a dilated convolution; the first place of a window, which sees padding
    instead of the row before it, is one further value per row.
    """

    def __init__(self, karras: Karras, emotions: Tensor) -> None:
        super().__init__()
        self.karras = karras
        self.register_buffer("emotions", emotions)

    def forward(self, rows: Tensor, shares: Tensor) -> Tensor:
        return self.karras.decoder(self.embed(rows, shares))

    def embed(self, rows: Tensor, shares: Tensor) -> Tensor:
        """(row - 63, component): everything before the last layer."""
        return self.articulate(self.analyse(rows), shares @ self.emotions)  # pyright: ignore

    def analyse(self, rows: Tensor) -> Tensor:
        """(1, 256, row): what does not depend on the emotional state."""
        return self.karras.analyse(rows).T[None]

    def articulate(self, formants: Tensor, emotion: Tensor) -> Tensor:
        """(row - 63, component) in the emotional state (1, emotion)."""
        first, *middle, last = self.karras.articulation
        inner, edge = _along(first, formants)
        for depth, layer in enumerate(middle, 1):
            inner, edge = _with_emotion(inner, emotion), _with_emotion(edge, emotion)
            inner, edge = _next(layer, inner, edge, 2**depth)
        inner, edge = _with_emotion(inner, emotion), _with_emotion(edge, emotion)
        assert isinstance(last, nn.Conv1d)
        reach = 2**HALVINGS
        begun = functional.conv1d(edge, last.weight[:, :, :1], last.bias)
        rest = functional.conv1d(inner[:, :, reach:], last.weight[:, :, 1:], dilation=reach)
        count = formants.shape[2] - WINDOW_ROWS + 1
        x = functional.relu(begun[:, :, :count] + rest[:, :, :count])
        return self.karras.embedding(_with_emotion(x, emotion).squeeze(0).T)


def _next(layer: nn.Module, inner: Tensor, edge: Tensor, reach: int) -> tuple[Tensor, Tensor]:
    """`_along` where the first place of a window already differs from the others."""
    assert isinstance(layer, nn.Conv1d)
    weight, bias = layer.weight, layer.bias
    padded = functional.pad(inner, (reach, reach))
    whole = functional.conv1d(padded, weight, bias, dilation=reach)
    begun = functional.conv1d(edge, weight[:, :, 1:2], bias)
    after = functional.conv1d(padded[:, :, 2 * reach :], weight[:, :, 2:])
    return functional.relu(whole), functional.relu(begun + after)
