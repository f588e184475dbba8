"""Deep canonical time warping (Trigeorgis et al. 2016): a network alternating with DTW."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch

from elocute.alignment.aligner import Aligner
from elocute.alignment.alignment import Views
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
from elocute.alignment.settings import DctwConfig


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
