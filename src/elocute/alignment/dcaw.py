"""Deep canonical attentional warping (Tzirakis et al. 2019, section 4.1).

Recurrent convolutional networks of all views, Bahdanau's score between their outputs (Eq. 3), an
attention over the source for each target frame (Eq. 2), and gradient ascent on the nuclear norm of
the correlation between H1·A and H2 (Eqs. 5 to 8), summed over all pairs of sets (Eq. 9). The path
is read from the attention and from nothing else.

Where the paper leaves a choice, or its choice did not lead to an aligner:

- Monotonic attention is the forward sum over all monotone paths: the energy of a cell is the log
  of Eq. 2, A the probability that a path passes it, columns divided by their sums. The paper cites
  attention by sampled sigmoids (`attention="sampled"`).
- Source frames choose among target frames too: the energy is the mean of both logs (`mutual`).
- The linear part of the encoders begins as principal components, and the score as a bump around
  equal frames. The score learns at a tenth of the encoders' rate.
- The constraint of Eq. 4 is kept by folding: every so many steps the canonical variates of the
  warped outputs become the outputs, within the last layers. Eq. 5 does not change by it (but for
  the ridge), and the score sees canonical variates.
- Of three or more views in use, each pair's attention sees the others' (`Aligner.all_pairs`).

Why, and what else was tried: docs/measurements/alignment.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from elocute.alignment.aligner import (
    Aligner,
    PairPath,
    ViewFeatures,
    normalised_columns,
)
from elocute.alignment.alignment import Views
from elocute.alignment.cca import LinearProjection, canonical_projections
from elocute.alignment.ctw import is_shared, view_bases
from elocute.alignment.deep_fitting import ClipTensors, NuclearNorm, encode_view, on_one_thread
from elocute.alignment.dtw import CostMatrix, attention_path, dtw, squared_distances
from elocute.alignment.path_lattice import marginals_slope, path_marginals
from elocute.alignment.settings import DcawConfig
from elocute.array_types import Float32Array
from elocute.errors import AlignmentError
from elocute.networks.dcaw import (
    WINDOW_FEATURES,
    DcawNetwork,
    EncoderConfig,
    frame_mask,
    log_attention,
    monotonic_attention,
)

CLIP_NORM = 5.0
FOLD_PAIRS = 400  # ordered pairs that canonical variates are estimated from, at most
BATCH_CELLS = 1_000_000  # of all pairs of a step: each takes some 300 bytes
PAIR_CELLS_MAX = 4_000_000
DIAGONAL_WIDTH = 0.7  # frames of the source that a target frame sees in the diagonal attention
SMALL = 1e-9


class PathMarginals(torch.autograd.Function):
    """The forward sum's marginals of (pair, source, target) energies, in double precision."""

    @staticmethod
    def forward(ctx: Any, energies: Tensor, lengths: Tensor, open_source: bool) -> Tensor:
        ctx.given = energies.detach().double().numpy(), lengths.numpy(), open_source
        return torch.from_numpy(path_marginals(*ctx.given)).to(energies.dtype)

    @staticmethod
    def backward(ctx: Any, *outer: Tensor) -> tuple[Tensor, None, None]:
        energies, lengths, open_source = ctx.given
        slope = marginals_slope(energies, outer[0].double().numpy(), lengths, open_source)
        return torch.from_numpy(slope).to(outer[0].dtype), None, None


@dataclass(frozen=True, eq=False)
class PairBatch:
    """Encoded pairs of views, padded: H1 and H2 (pair, frame, output), (pair, 2) lengths, sides.

    sides: of each pair the places of source and target among the views.
    """

    source: Tensor
    target: Tensor
    lengths: Tensor
    sides: tuple[tuple[int, int], ...]

    @property
    def masks(self) -> tuple[Tensor, Tensor]:
        return (
            frame_mask(self.lengths[:, 0], self.source.shape[1]),
            frame_mask(self.lengths[:, 1], self.target.shape[1]),
        )


@on_one_thread
def fit_dcaw(
    groups: Sequence[Views],
    config: DcawConfig,
    seed: int,
    done: Callable[[float], None] | None = None,
) -> Aligner:
    """Gradient ascent on the correlation of all views with each other, warped by attention.

    `done` is called with the share of the steps that is done.
    """
    widths = tuple(view.shape[1] for view in groups[0])
    _check_size(groups, config, widths)
    shared = is_shared(config.shared, widths)
    clips = ClipTensors(groups, shared, config.open_source)
    network = start_from_components(groups, config, shared, seed)
    rng = np.random.default_rng(seed)
    if not shared:  # outputs of views of different kinds cannot be compared yet
        fold(network, clips, config, rng, "diagonal")
    for _ in range(config.folds):
        fold(network, clips, config, rng)
    optimiser = _make_optimiser(network, config)
    pairs = min(config.pairs, max(1, BATCH_CELLS // clips.cells_max))
    for step in range(config.steps):
        if step and step % config.fold_every == 0:
            fold(network, clips, config, rng)
        batch = encode_pairs(network, clips, draw_pairs(clips, pairs, rng))
        loss = -correlation(network, batch, config)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), CLIP_NORM)
        optimiser.step()
        if done:
            done((step + 1) / config.steps)
    if config.steps:
        fold(network, clips, config, rng)
    return dcaw_aligner(config, network.eval(), widths)


def dcaw_aligner(config: DcawConfig, network: DcawNetwork, widths: Sequence[int]) -> Aligner:
    """Paths through the attention between outputs of a fitted network."""
    sampled = config.attention == "sampled"
    return Aligner(
        config=config,
        find_path=partial(find_sampled_path if sampled else find_attended_path, config),
        features=partial(output_features, network),
        pair_cost=partial(sampled_cost if sampled else attention_cost, network, config),
        widths=tuple(widths),
        all_pairs=True,
    )


def output_features(network: DcawNetwork, view: Float32Array, place: int) -> ViewFeatures:
    """What the network makes of a view: canonical variates, as the last fold left them.

    A recurrent network counts frames even where nothing moves: a still view stays still.
    """
    outputs = encode_view(network, view, place)
    if (view == view[0]).all():
        outputs = np.broadcast_to(outputs.mean(axis=0), outputs.shape).copy()
    return ViewFeatures(outputs)


def attention_cost(
    network: DcawNetwork, config: DcawConfig, source: ViewFeatures, target: ViewFeatures
) -> CostMatrix:
    """(source, target) minus the log of Eq. 2."""
    one, other = source.compared, target.compared
    _check_cells(len(one), len(other))
    with torch.no_grad():
        scores = network.attention(torch.from_numpy(one)[None], torch.from_numpy(other)[None])
        rows, columns = (torch.ones(1, len(view)) for view in (one, other))
        return -log_attention(scores.double(), rows, columns, config.mutual)[0].numpy()


def find_attended_path(config: DcawConfig, cost: CostMatrix) -> PairPath:
    """The path of the attention, which is the forward sum through minus these costs."""
    lengths = np.array([cost.shape])
    marginals = path_marginals(-cost[None].astype(np.float64), lengths, config.open_source)[0]
    attention = normalised_columns(marginals)
    path = attention_path(attention, config.band, config.open_source)
    return PairPath(path, attention=attention)


def sampled_cost(
    network: DcawNetwork, config: DcawConfig, source: ViewFeatures, target: ViewFeatures
) -> CostMatrix:
    """(source, target) minus the log of attention by sampled sigmoids."""
    one, other = source.compared, target.compared
    _check_cells(len(one), len(other))
    with torch.no_grad():
        scores = network.attention(torch.from_numpy(one)[None], torch.from_numpy(other)[None])
        inside = torch.ones(1, len(one))
        attention = monotonic_attention(scores, inside, config.open_source)[0].double().numpy()
    return -np.log(np.maximum(attention, SMALL))


def find_sampled_path(config: DcawConfig, cost: CostMatrix) -> PairPath:
    """The path through attention by sampled sigmoids."""
    attention = normalised_columns(np.exp(-cost))
    return PairPath(attention_path(attention, config.band, config.open_source), None, attention)


def start_from_components(
    groups: Sequence[Views], config: DcawConfig, shared: bool, seed: int
) -> DcawNetwork:
    """A network whose encoders begin as the principal components of their views."""
    bases = view_bases(groups, config.energy, shared)
    outputs = min(config.dimensions, *(basis.directions.shape[1] for basis in bases))
    sizes = {"filters": config.filters, "units": config.units, "windows": config.windows}
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = DcawNetwork(
            [EncoderConfig(len(basis.mean), outputs, **sizes) for basis in bases], shared
        )
    for encoder, basis in zip(network.encoders, bases, strict=False):
        matrix, mean = _tensors(LinearProjection(basis.mean, basis.directions[:, :outputs]))
        encoder.start_from(matrix, mean)  # pyright: ignore[reportCallIssue]
    return network


def correlation(network: DcawNetwork, batch: PairBatch, config: DcawConfig) -> Tensor:
    """Eq. 9 as a share of what it could be: the norms of Eq. 5, summed over all pairs of sets."""
    attention = warping(network, batch, config, config.attention)
    warped = attention.transpose(1, 2) @ batch.source
    inside = batch.masks[1].bool()
    norms = []
    for sides in dict.fromkeys(batch.sides):
        chosen = torch.tensor([each == sides for each in batch.sides])
        keep = inside & chosen[:, None]
        if keep.sum() > 1:  # of a single frame nothing correlates
            norms.append(NuclearNorm.apply(warped[keep], batch.target[keep], config.ridge))
    return torch.stack(norms or [warped.sum() * 0]).mean() / batch.source.shape[2]


def warping(network: DcawNetwork, batch: PairBatch, config: DcawConfig, kind: str) -> Tensor:
    """A of each pair, (pair, source, target): columns over the source sum to one."""
    inside, wanted = batch.masks
    if kind == "uniform":
        weights = inside.unsqueeze(2) * wanted.unsqueeze(1)
    elif kind == "diagonal":
        weights = _diagonal(batch) * inside.unsqueeze(2) * wanted.unsqueeze(1)
    elif kind == "path":
        weights = _feature_paths(batch, config.open_source)
    else:
        scores = network.attention(batch.source, batch.target)
        if kind == "sampled":
            return monotonic_attention(scores, inside, config.open_source)
        energies = log_attention(scores, inside, wanted, config.mutual)
        weights = PathMarginals.apply(energies, batch.lengths, config.open_source)
    return weights / weights.sum(dim=1, keepdim=True).clamp_min(SMALL)  # pyright: ignore


def fold(
    network: DcawNetwork,
    clips: ClipTensors,
    config: DcawConfig,
    rng: np.random.Generator,
    kind: str | None = None,
) -> None:
    """Make the canonical variates of warped outputs the outputs: the constraint of Eq. 4.

    Views of one kind share a network and must have the same statistics, so every pair counts in
    both orders. Views of different kinds are all warped onto the last of them.
    """
    numbers = draw_pairs(clips, FOLD_PAIRS, rng)
    last = len(clips.groups[0]) - 1
    shared = len(network.encoders) == 1
    if not shared:
        numbers = [number for number in numbers if clips.pairs[number][2] == last]
    sides: dict[int, list[NDArray[np.float64]]] = {place: [] for place in range(last + 1)}
    size = max(1, BATCH_CELLS // clips.cells_max)
    with torch.no_grad():
        for start in range(0, len(numbers), size):
            batch = encode_pairs(network, clips, numbers[start : start + size])
            attention = warping(network, batch, config, kind or config.attention)
            warped = attention.transpose(1, 2) @ batch.source
            for pair, (place, _) in enumerate(batch.sides):
                frames = int(batch.lengths[pair, 1])
                source = warped[pair, :frames].double().numpy()
                target = batch.target[pair, :frames].double().numpy()
                if shared:
                    sides[0] += [source, target]
                    sides[1] += [target, source]
                else:
                    sides[place].append(source)
                    if place == 0:
                        sides[last].append(target)
    views = [np.concatenate(side) for side in sides.values() if side]
    projections = canonical_projections(views, views[0].shape[1], config.ridge)
    for encoder, projection in zip(network.encoders, projections, strict=False):
        encoder.fold(*_tensors(projection))  # pyright: ignore[reportCallIssue]


def draw_pairs(clips: ClipTensors, wanted: int, rng: np.random.Generator) -> list[int]:
    """Numbers of ordered pairs: all those of randomly drawn groups, at most so many or one group's.

    All pairs of sets of Eq. 9 are then there equally often.
    """
    each = len(clips.orders)
    groups = sorted(rng.permutation(len(clips.groups))[: max(1, wanted // each)].tolist())
    return [group * each + order for group in groups for order in range(each)]


def encode_pairs(network: DcawNetwork, clips: ClipTensors, numbers: Sequence[int]) -> PairBatch:
    """Encode what these pairs need, each clip once."""
    shared = len(network.encoders) == 1
    sides, ends = [], []
    for number in numbers:
        i, source, j, target, _ = clips.pairs[number]
        sides.append((i, j))
        ends.append(((0 if shared else i, source), (0 if shared else j, target)))
    encoded: dict[tuple[int, int], Tensor] = {}
    for side, (views, lengths) in enumerate(clips.tensors):
        used = sorted({clip for pair in ends for place, clip in pair if place == side})
        if used:
            frames = int(lengths[used].max())
            outputs = network.encode(side, views[used, :frames], lengths[used])
            encoded |= {(side, clip): outputs[k] for k, clip in enumerate(used)}
    lengths = torch.tensor([[int(clips.tensors[s][1][c]) for s, c in pair] for pair in ends])
    stacks = [
        torch.nn.utils.rnn.pad_sequence(
            [encoded[pair[end]][: lengths[k, end]] for k, pair in enumerate(ends)],
            batch_first=True,
        )
        for end in (0, 1)
    ]
    return PairBatch(stacks[0], stacks[1], lengths, tuple(sides))


def _make_optimiser(network: DcawNetwork, config: DcawConfig) -> torch.optim.Optimizer:
    rate = config.attention_rate if config.attention in ("learned", "sampled") else 0.0
    groups = [
        {"params": list(network.encoders.parameters()), "lr": config.learning_rate},
        {"params": list(network.attention.parameters()), "lr": config.learning_rate * rate},
    ]
    return torch.optim.AdamW(groups, betas=(0.9, 0.99), weight_decay=config.weight_decay)


def _diagonal(batch: PairBatch) -> Tensor:
    """(pair, source, target) weights of source frames near a target frame's place in proportion."""
    places = [
        torch.arange(side.shape[1])[None] / (batch.lengths[:, end, None] - 1).clamp_min(1)
        for end, side in enumerate((batch.source, batch.target))
    ]
    off = (places[0].unsqueeze(2) - places[1].unsqueeze(1)) * batch.lengths[:, :1, None]
    return torch.exp(-0.5 * (off / DIAGONAL_WIDTH) ** 2)


def _feature_paths(batch: PairBatch, open_source: bool) -> Tensor:
    """(pair, source, target) 1 along DTW's path through the outputs: DCTW's warping."""
    weights = torch.zeros(len(batch.source), batch.source.shape[1], batch.target.shape[1])
    for pair, (rows, columns) in enumerate(batch.lengths.tolist()):
        one = batch.source[pair, :rows].detach().double().numpy()
        other = batch.target[pair, :columns].detach().double().numpy()
        path = dtw(squared_distances(one, other), open_source=open_source)[0]
        weights[pair, path[:, 0], path[:, 1]] = 1
    return weights


def _tensors(projection: LinearProjection) -> tuple[Tensor, Tensor]:
    return torch.from_numpy(projection.directions).float(), torch.from_numpy(
        projection.mean
    ).float()


def _check_size(groups: Sequence[Views], config: DcawConfig, widths: Sequence[int]) -> None:
    if config.windows and set(widths) != {WINDOW_FEATURES}:
        raise AlignmentError.about(
            "views for `windows`",
            found=f"{tuple(widths)} features",
            allowed=f"{WINDOW_FEATURES}, as `speech_view` gives for windows",
        )
    for group in groups:
        lengths = sorted(map(len, group))[-2:]
        _check_cells(*lengths)


def _check_cells(rows: int, columns: int) -> None:
    if rows * columns > PAIR_CELLS_MAX:
        raise AlignmentError.about(
            "views",
            found=f"{rows} against {columns} frames",
            allowed=f"{PAIR_CELLS_MAX / 1e6:g} million cells for dcaw",
            remedy="cut them into words, or use softdtw",
        )
