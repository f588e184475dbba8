"""Correlated features read by soft-DTW: a network that starts from CTW and follows its paths.

Encoders, additive attention and the nuclear-norm objective are those of deep canonical attentional
warping (Tzirakis et al. 2019, section 4.1), but the attention is a help of training: the network
starts from CTW's projections, learns CTW's paths in the first half of training, prefers the
diagonal by a prior, and its path is the middle of the alignment that soft-DTW expects through
distances of features, to which -log attention is added with a small weight.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import torch
from torch import Tensor

from elocute.alignment.aligner import Aligner, ViewFeatures, mean_squared_differences
from elocute.alignment.alignment import Views, WarpingPath
from elocute.alignment.ctw import is_shared
from elocute.alignment.deep_fitting import (
    ClipTensors,
    NuclearNorm,
    draw_pairs,
    fit_output_projections,
    initialise,
    make_optimiser,
    network_aligner,
    on_one_thread,
)
from elocute.alignment.dtw import CostMatrix
from elocute.alignment.settings import CcaSoftConfig
from elocute.array_types import Float32Array
from elocute.networks.dcaw import DcawNetwork, frame_mask, monotonic_attention, soft_attention


def attention_cost(
    network: DcawNetwork, config: CcaSoftConfig, source: ViewFeatures, target: ViewFeatures
) -> CostMatrix:
    """(source, target) mean squared differences of canonical features, and -log attention."""
    assert source.hidden is not None and target.hidden is not None
    scores = attention_scores(network, config, source.hidden, target.hidden)
    surprise = -torch.log_softmax(scores, dim=0).numpy().astype(np.float64)
    return mean_squared_differences(source, target) + config.sharpness * surprise


def attention_weights(
    network: DcawNetwork, config: CcaSoftConfig, source: ViewFeatures, target: ViewFeatures
) -> Float32Array:
    """(source, target) the attention of Eq. 2, columns over the source sum to one."""
    assert source.hidden is not None and target.hidden is not None
    scores = attention_scores(network, config, source.hidden, target.hidden)
    return torch.softmax(scores, dim=0).numpy()


def attention_scores(
    network: DcawNetwork, config: CcaSoftConfig, source: Float32Array, target: Float32Array
) -> Tensor:
    """(source, target) scores of the attention between outputs of the network, with the prior."""
    with torch.no_grad():
        one, other = torch.from_numpy(source)[None], torch.from_numpy(target)[None]
        scores = network.attention(one, other)[0]
    if not config.open_source:
        scores = scores + config.prior * diagonal_prior(len(source), len(target))
    return scores


def diagonal_prior(sources: int, targets: int) -> Tensor:
    """(source, target) -(difference of places)², each place 0 to 1."""
    one, other = torch.linspace(0, 1, sources), torch.linspace(0, 1, targets)
    return -((one[:, None] - other[None, :]) ** 2)


@on_one_thread
def fit_cca_soft(
    groups: Sequence[Views],
    config: CcaSoftConfig,
    seed: int,
    done: Callable[[float], None] | None = None,
) -> Aligner:
    """Gradient ascent on the correlation of the target with the source, warped by attention.

    `done` is called with the share of the steps that is done.
    """
    widths = tuple(view.shape[1] for view in groups[0])
    shared = is_shared(config.shared, widths)
    network, linear = initialise(groups, config, shared, seed)
    paths = [each.path for each in linear.align_all(groups)]
    clips, rng = ClipTensors(groups, shared), np.random.default_rng(seed)
    optimiser = make_optimiser(network, config)
    network.train()
    for step in range(config.steps):
        chosen = [clips.pairs[n] for n in draw_pairs(len(clips.pairs), config.pairs, rng)]
        early = max(0.0, 1 - 2 * step / config.steps)
        loss = _loss(network, clips, chosen, paths, config, early, shared)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        if done:
            done((step + 1) / config.steps)
    cost = partial(attention_cost, network, config)
    projections = fit_output_projections(network, config, groups, paths, shared)
    aligner = network_aligner(config, network, projections, widths, cost)
    paths = [each.path for each in aligner.align_all(groups)]
    projections = fit_output_projections(network, config, groups, paths, shared)
    fitted = network_aligner(config, network, projections, widths, cost)
    return replace(fitted, attend=partial(attention_weights, network, config))


def _loss(
    network: DcawNetwork,
    clips: ClipTensors,
    chosen: Sequence[tuple[int, int, int, int, int]],
    paths: Sequence[WarpingPath],
    config: CcaSoftConfig,
    early: float,
    shared: bool,
) -> Tensor:
    encoded = clips.encode(network)
    sides = [(0, 0) if shared else (pair[0], pair[2]) for pair in chosen]
    lengths = torch.tensor(
        [
            (len(clips.views[i][pair[1]]), len(clips.views[j][pair[3]]))
            for (i, j), pair in zip(sides, chosen, strict=True)
        ]
    )
    one = torch.stack([encoded[i][p[1]] for (i, _), p in zip(sides, chosen, strict=True)])
    other = torch.stack([encoded[j][p[3]] for (_, j), p in zip(sides, chosen, strict=True)])
    inside = frame_mask(lengths[:, 0], one.shape[1]), frame_mask(lengths[:, 1], other.shape[1])
    scores = network.attention(one, other)
    if not config.open_source:
        prior = torch.zeros_like(scores)
        for pair, (n, m) in enumerate(lengths.tolist()):
            prior[pair, :n, :m] = diagonal_prior(n, m)
        scores = scores + config.prior * prior
    attention = monotonic_attention(scores, inside[0], config.open_source)
    warped = attention.transpose(1, 2) @ one
    keep = inside[1].bool()
    norm = NuclearNorm.apply(warped[keep], other[keep], config.ridge)
    loss = -norm / one.shape[2]  # pyright: ignore
    if early > 0 and config.guide > 0:
        soft = torch.log(soft_attention(scores, inside[0]) + 1e-9)
        total = loss.new_zeros(())
        for pair, (i, _, j, _, group) in enumerate(chosen):
            cells = torch.from_numpy(paths[group][:, [i, j]].copy())
            total = total - soft[pair, cells[:, 0], cells[:, 1]].mean()
        loss = loss + early * config.guide * total / len(chosen)
    return loss
