"""The concordance correlation coefficient, and losses (Tzirakis et al. 2019, Eq. 10)."""

from __future__ import annotations

import torch
from torch import Tensor

TINY = 1e-8  # variance of a parameter that does not move


def concordance(predicted: Tensor, true: Tensor, mask: Tensor) -> Tensor:
    """(parameter,) ρc over all frames that `mask` keeps, taken together.

    predicted, true (batch, frame, parameter); mask (batch, frame), 1 for frames of a clip and 0
    for padding. A parameter that moves in neither has 0.
    """
    weight = (mask / mask.sum()).unsqueeze(2)
    mean_x, mean_y = (weight * true).sum((0, 1)), (weight * predicted).sum((0, 1))
    x, y = true - mean_x, predicted - mean_y
    var_x, var_y = (weight * x * x).sum((0, 1)), (weight * y * y).sum((0, 1))
    return 2 * (weight * x * y).sum((0, 1)) / (var_x + var_y + (mean_x - mean_y) ** 2 + TINY)


def concordance_loss(predicted: Tensor, true: Tensor, mask: Tensor, weights: Tensor) -> Tensor:
    """Σ wᵢ (1 - ρc); weights (parameter,) sum to one, in the paper shares of the variance."""
    return (weights * (1 - concordance(predicted, true, mask))).sum()


def squared_loss(predicted: Tensor, true: Tensor, mask: Tensor, weights: Tensor) -> Tensor:
    """Σ wᵢ of the mean squared error, what the paper compares with, over the same frames."""
    error = (predicted - true).square() * mask.unsqueeze(2)
    return (weights * error.sum((0, 1)) / mask.sum()).sum()


LOSSES = {"concordance": concordance_loss, "mse": squared_loss}


def explained_shares(basis: Tensor) -> Tensor:
    """(parameter,) share of the variance that each shape explains, summing to one.

    basis (component, vertex, 3): a weight of 1 is one deviation, so a shape's squared length is
    the variance it explains.
    """
    energy = basis.flatten(1).square().sum(1).double()
    return (energy / energy.sum()).float() if energy.sum() > 0 else torch.ones_like(energy).float()


def tempered_weights(shares: Tensor, power: float) -> Tensor:
    """(parameter,) shares to a power, summing to one: below 1, what moves little weighs more."""
    raised = shares.clamp(min=TINY) ** power
    return raised / raised.sum()
