"""What both deep methods share: clips as tensors, the objective for autograd, the start."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from typing import Any

import numpy as np
import torch
from torch import Tensor

from elocute.alignment.aligner import DtwAligner, Embedded
from elocute.alignment.alignment import Array, Group, Path
from elocute.alignment.cca import Projection
from elocute.alignment.config import CtwConfig, DeepConfig
from elocute.alignment.correlation_objective import RIDGE, whitened
from elocute.alignment.ctw import CtwAligner, canonical_of, fit_ctw
from elocute.networks.dcaw import DcawNetwork, EncoderConfig


class NuclearNorm(torch.autograd.Function):
    """||K||_* of two (frame, feature) views, with the paper's sub-gradient (Eqs. 5 to 8)."""

    @staticmethod
    def forward(ctx: Any, first: Tensor, second: Tensor, ridge: float = RIDGE) -> Tensor:
        pair = whitened(first.detach().double().numpy(), second.detach().double().numpy(), ridge)
        slopes = (torch.from_numpy(slope).to(first.dtype) for slope in pair.gradients())
        ctx.save_for_backward(*slopes)
        return first.new_tensor(pair.norm)

    @staticmethod
    def backward(ctx: Any, *outer: Tensor) -> tuple[Tensor, Tensor, None]:
        first, second = ctx.saved_tensors
        return outer[0] * first, outer[0] * second, None


class Clips:
    """All views of all groups, each once, padded; and which of them are pairs.

    pairs: (source side, source clip, target side, target clip, group) of every ordered pair of
    views where they are of one kind, of every pair in order where not: Eq. 9's sum.
    """

    def __init__(self, groups: Sequence[Group], shared: bool) -> None:
        count = len(groups[0])
        self.views: list[list[Array]] = [[] for _ in range(1 if shared else count)]
        known: dict[tuple[int, int], int] = {}
        self.groups: list[tuple[int, ...]] = []
        for group in groups:
            places = []
            for k, view in enumerate(group):
                side = 0 if shared else k
                if (side, id(view)) not in known:
                    known[side, id(view)] = len(self.views[side])
                    self.views[side].append(view)
                places.append(known[side, id(view)])
            self.groups.append(tuple(places))
        orders = (
            list(permutations(range(count), 2))
            if shared
            else [(i, j) for j in range(count) for i in range(j)]
        )
        self.orders = orders
        self.tensors = [_padded(side) for side in self.views]
        self.pairs = [
            (i, places[i], j, places[j], g)
            for g, places in enumerate(self.groups)
            for i, j in orders
        ]

    def encode(self, network: DcawNetwork) -> list[Tensor]:
        """(clip, frame, output) of each kind of view."""
        return [
            network.encode(side, clips, lengths)
            for side, (clips, lengths) in enumerate(self.tensors)
        ]


def _padded(views: Sequence[Array]) -> tuple[Tensor, Tensor]:
    lengths = torch.tensor([len(view) for view in views])
    clips = torch.zeros(len(views), int(lengths.max()), views[0].shape[1])
    for clip, view in zip(clips, views, strict=True):
        clip[: len(view)] = torch.from_numpy(view)
    return clips, lengths


def start(
    groups: Sequence[Group], config: DeepConfig, shared: bool, seed: int
) -> tuple[DcawNetwork, CtwAligner]:
    """A network whose linear half is what CTW finds in the same groups, and that CTW."""
    linear = fit_ctw(
        groups,
        CtwConfig(
            band=config.band,
            open_source=config.open_source,
            dimensions=config.dimensions,
            ridge=config.ridge,
            shared=shared,
        ),
    )
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        outputs = linear.projections[0].directions.shape[1]
        widths = [view.shape[1] for view in groups[0]]
        network = DcawNetwork(
            [EncoderConfig(w, outputs, config.filters, config.units) for w in widths], shared
        )
    with torch.no_grad():
        for encoder, projection in zip(network.encoders, linear.projections, strict=False):
            matrix = torch.from_numpy(projection.directions.T.copy()).float()
            encoder.direct.weight.copy_(matrix)  # pyright: ignore
            encoder.direct.bias.copy_(-matrix @ torch.from_numpy(projection.mean).float())  # pyright: ignore
    return network, linear


def optimiser_of(network: DcawNetwork, config: DeepConfig) -> torch.optim.Optimizer:
    return torch.optim.AdamW(
        network.parameters(), config.learning_rate, (0.9, 0.99), weight_decay=config.weight_decay
    )


class DeepAligner(DtwAligner):
    """DTW of what a trained network makes of views, projected by CCA."""

    def __init__(
        self,
        config: DeepConfig,
        network: DcawNetwork,
        widths: Sequence[int],
        projections: Sequence[Projection] | None = None,
    ) -> None:
        super().__init__(config)
        self.network, self.widths = network.eval(), tuple(widths)
        self.projections = projections

    def hidden(self, view: Array, side: int) -> Array:
        """(frame, output) of the network."""
        with torch.no_grad():
            clips, lengths = _padded([view])
            return self.network.encode(side, clips, lengths)[0].numpy()

    def embed(self, view: Array, side: int) -> Embedded:
        hidden = self.hidden(view, side)
        if self.projections is None:
            return Embedded(hidden, hidden)
        return Embedded(self.projections[side](hidden), hidden)


def projected(
    aligner: DeepAligner, groups: Sequence[Group], paths: Sequence[Path], shared: bool
) -> tuple[Projection, ...]:
    """CCA of what the network makes of all groups, warped by their paths."""
    config = aligner.config
    assert isinstance(config, DeepConfig)
    known = {id(v): (v, k) for group in groups for k, v in enumerate(group)}
    made = {key: aligner.hidden(view, side) for key, (view, side) in known.items()}
    hidden = [tuple(made[id(view)] for view in group) for group in groups]
    return canonical_of(hidden, paths, config.dimensions, config.ridge, shared)


def drawn(count: int, wanted: int, rng: np.random.Generator) -> list[int]:
    """Which pairs a step learns from."""
    return sorted(rng.choice(count, min(wanted, count), replace=False).tolist())
