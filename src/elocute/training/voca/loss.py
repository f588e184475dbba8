"""The loss of VOCA (Cudeiro et al. 2019, section 5)."""

from __future__ import annotations

from torch import Tensor

from elocute.training.voca.settings import VocaTrainConfig


def pair_loss(predicted: Tensor, target: Tensor, config: VocaTrainConfig, vertices: int) -> Tensor:
    """Position and velocity terms of (2, pair, output): mm² a vertex.

    The first row holds the frames before, the second the frames themselves.
    """
    error = predicted - target
    position = error.square().sum(dim=-1).mean() / vertices
    velocity = (error[1] - error[0]).square().sum(dim=-1).mean() / vertices
    return config.position_weight * position + config.velocity_weight * velocity
