"""What deep methods share: clips as tensors, the objective, the start from CTW; and DCTW."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial, wraps
from itertools import permutations
from typing import Any, TypeVar, cast

import numpy as np
import torch
from torch import Tensor

from elocute.alignment.aligner import (
    Aligner,
    PairCost,
    ViewFeatures,
    find_dtw_path,
    mean_squared_differences,
    projected_aligner,
)
from elocute.alignment.alignment import Views, WarpingPath
from elocute.alignment.cca import RIDGE, LinearProjection, whiten_pair
from elocute.alignment.ctw import canonical_along_paths, fit_projections, is_shared
from elocute.alignment.settings import CtwConfig, DctwConfig, DeepConfig
from elocute.array_types import Float32Array
from elocute.networks.dcaw import DcawNetwork, EncoderConfig

Fit = TypeVar("Fit", bound=Callable[..., Aligner])


def on_one_thread(fit: Fit) -> Fit:
    """Run a fitting on one thread: its sums are then always the same, and it is no slower.

    Matrices here are small, so that threads would spend more time waiting than working.
    """

    @wraps(fit)
    def alone(*given: Any, **named: Any) -> Aligner:
        threads = torch.get_num_threads()
        torch.set_num_threads(1)
        try:
            return fit(*given, **named)
        finally:
            torch.set_num_threads(threads)

    return cast(Fit, alone)


class NuclearNorm(torch.autograd.Function):
    """||K||_* of two (frame, feature) views, with the paper's sub-gradient (Eqs. 5 to 8)."""

    @staticmethod
    def forward(ctx: Any, first: Tensor, second: Tensor, ridge: float = RIDGE) -> Tensor:
        pair = whiten_pair(first.detach().double().numpy(), second.detach().double().numpy(), ridge)
        slopes = (torch.from_numpy(slope).to(first.dtype) for slope in pair.gradients())
        ctx.save_for_backward(*slopes)
        return first.new_tensor(pair.norm)

    @staticmethod
    def backward(ctx: Any, *outer: Tensor) -> tuple[Tensor, Tensor, None]:
        first, second = ctx.saved_tensors
        return outer[0] * first, outer[0] * second, None


class ClipTensors:
    """All views of all groups, each once, padded; and which of them are pairs.

    pairs: (source side, source clip, target side, target clip, group) of every ordered pair of
    views where they are of one kind, of every pair in order where not: Eq. 9's sum. They are in the
    order of groups, `orders` of each; with `from_first` the first view alone is a source.
    """

    def __init__(self, groups: Sequence[Views], shared: bool, from_first: bool = False) -> None:
        count = len(groups[0])
        self.views: list[list[Float32Array]] = [[] for _ in range(1 if shared else count)]
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
        if from_first:
            orders = [(0, j) for j in range(1, count)]
        elif shared:
            orders = list(permutations(range(count), 2))
        else:
            orders = [(i, j) for j in range(count) for i in range(j)]
        self.orders = orders
        self.tensors = [_padded(side) for side in self.views]
        self.pairs = [
            (i, places[i], j, places[j], g)
            for g, places in enumerate(self.groups)
            for i, j in orders
        ]
        longest = [max(map(len, side)) for side in zip(*groups, strict=True)]
        self.cells_max = max(longest[i] * longest[j] for i, j in orders)

    def encode(self, network: DcawNetwork) -> list[Tensor]:
        """(clip, frame, output) of each kind of view."""
        return [
            network.encode(side, clips, lengths)
            for side, (clips, lengths) in enumerate(self.tensors)
        ]


def _padded(views: Sequence[Float32Array]) -> tuple[Tensor, Tensor]:
    lengths = torch.tensor([len(view) for view in views])
    clips = torch.zeros(len(views), int(lengths.max()), views[0].shape[1])
    for clip, view in zip(clips, views, strict=True):
        clip[: len(view)] = torch.from_numpy(view)
    return clips, lengths


def initialise(
    groups: Sequence[Views], config: DeepConfig, shared: bool, seed: int
) -> tuple[DcawNetwork, Aligner]:
    """A network whose linear half is what CTW finds in the same groups, and that CTW."""
    settings = CtwConfig(
        band=config.band,
        open_source=config.open_source,
        dimensions=config.dimensions,
        ridge=config.ridge,
        shared=shared,
    )
    widths = [view.shape[1] for view in groups[0]]
    projections = fit_projections(groups, settings)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        outputs = projections[0].directions.shape[1]
        network = DcawNetwork(
            [EncoderConfig(w, outputs, config.filters, config.units) for w in widths], shared
        )
    for encoder, projection in zip(network.encoders, projections, strict=False):
        matrix = torch.from_numpy(projection.directions).float()
        encoder.start_from(matrix, torch.from_numpy(projection.mean).float())  # pyright: ignore
    return network, projected_aligner(settings, projections, widths)


def make_optimiser(network: DcawNetwork, config: DeepConfig) -> torch.optim.Optimizer:
    return torch.optim.AdamW(
        network.parameters(), config.learning_rate, (0.9, 0.99), weight_decay=config.weight_decay
    )


def encode_view(network: DcawNetwork, view: Float32Array, place: int) -> Float32Array:
    """(frame, output) of the network for one view; `place` is its place among the views."""
    with torch.no_grad():
        clips, lengths = _padded([view])
        return network.encode(place, clips, lengths)[0].numpy()


def network_features(
    network: DcawNetwork, projections: Sequence[LinearProjection], view: Float32Array, place: int
) -> ViewFeatures:
    """What the network makes of a view, projected by CCA; attention looks at it unprojected."""
    hidden = encode_view(network, view, place)
    return ViewFeatures(projections[place](hidden), hidden)


def network_aligner(
    config: DeepConfig,
    network: DcawNetwork,
    projections: Sequence[LinearProjection],
    widths: Sequence[int],
    pair_cost: PairCost = mean_squared_differences,
) -> Aligner:
    """DTW of what a trained network makes of views."""
    return Aligner(
        config=config,
        find_path=partial(find_dtw_path, config),
        features=partial(network_features, network.eval(), tuple(projections)),
        pair_cost=pair_cost,
        widths=tuple(widths),
    )


def fit_output_projections(
    network: DcawNetwork,
    config: DeepConfig,
    groups: Sequence[Views],
    paths: Sequence[WarpingPath],
    shared: bool,
) -> tuple[LinearProjection, ...]:
    """CCA of what the network makes of all groups, warped by their paths."""
    network.eval()
    known = {id(view): (view, k) for group in groups for k, view in enumerate(group)}
    encoded = {key: encode_view(network, view, place) for key, (view, place) in known.items()}
    hidden = [tuple(encoded[id(view)] for view in group) for group in groups]
    return canonical_along_paths(hidden, paths, config.dimensions, config.ridge, shared)


def draw_pairs(count: int, wanted: int, rng: np.random.Generator) -> list[int]:
    """Numbers of the pairs that a step learns from, in order."""
    return sorted(rng.choice(count, min(wanted, count), replace=False).tolist())


@on_one_thread
def fit_dctw(
    groups: Sequence[Views],
    config: DctwConfig,
    seed: int,
    done: Callable[[float], None] | None = None,
) -> Aligner:
    """Steps of gradient ascent on the correlation along paths, then paths by DTW, and again.

    `done` is called with the share of the steps that is done.
    """
    widths = tuple(view.shape[1] for view in groups[0])
    shared = is_shared(config.shared, widths)
    network, linear = initialise(groups, config, shared, seed)
    clips, rng = ClipTensors(groups, shared), np.random.default_rng(seed)
    optimiser, aligner = make_optimiser(network, config), linear
    for turn in range(config.rounds):
        paths = [each.path for each in aligner.align_all(groups)]
        network.train()
        first_step = config.steps * turn // config.rounds
        for step in range(first_step, config.steps * (turn + 1) // config.rounds):
            encoded = clips.encode(network)
            first, second = [], []
            for number in draw_pairs(len(clips.pairs), config.pairs, rng):
                i, source, j, target, group = clips.pairs[number]
                one, other = encoded[0 if shared else i], encoded[0 if shared else j]
                first.append(one[source][torch.from_numpy(paths[group][:, i].copy())])
                second.append(other[target][torch.from_numpy(paths[group][:, j].copy())])
            norm = NuclearNorm.apply(torch.cat(first), torch.cat(second), config.ridge)
            optimiser.zero_grad()
            (-norm).backward()  # pyright: ignore
            optimiser.step()
            if done:
                done((step + 1) / config.steps)
        projections = fit_output_projections(network, config, groups, paths, shared)
        aligner = network_aligner(config, network, projections, widths)
    return aligner
