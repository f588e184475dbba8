"""The linear decoder in which a network trained on a Corpus ends: how it starts, what it weighs."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from elocute.training.corpus_data import MotionSpace

MM = 1000.0


class Embeds(Protocol):
    """A network that decodes an embedding of sound and style."""

    def embed(self, features: Tensor, styles: Tensor, /) -> Tensor: ...


class Embedding(nn.Module):
    """Features and a style to weights of the decoder's columns, the last of which is always one.

    A decoder is linear, so its columns are a basis and its bias a shape whose weight is one.
    """

    def __init__(self, shared: Embeds) -> None:
        super().__init__()
        self.shared = shared

    def forward(self, features: Tensor, style: Tensor) -> Tensor:
        return functional.pad(self.shared.embed(features, style), (0, 1), value=1.0)


def principal_components(targets: Tensor, count: int) -> Tensor:
    """(count, output): directions of greatest variance, each as long as its standard deviation."""
    centred = (targets - targets.mean(dim=0)).numpy().astype(np.float64)
    if centred.shape[1] > 2 * count and centred.shape[1] > 1000:
        _, values, vectors = torch.svd_lowrank(torch.from_numpy(centred).float(), count, niter=4)
        return (vectors * values / math.sqrt(len(centred))).T.contiguous()
    values, vectors = np.linalg.eigh(centred.T @ centred / len(centred))
    order = np.argsort(values)[::-1][:count]
    scaled = vectors[:, order] * np.sqrt(np.maximum(values[order], 0))
    return torch.from_numpy(scaled.T.astype(np.float32))


def start_decoder(decoder: nn.Linear, targets: Tensor) -> None:
    """Set the weights to the principal components of (frame, output); the bias stays zero."""
    with torch.no_grad():
        decoder.weight.copy_(principal_components(targets, decoder.in_features).T)


def decoder_basis(decoder: nn.Linear, space: MotionSpace | None) -> Tensor:
    """(component, vertex, 3) m: the columns of a decoder in mm, and its bias as the last."""
    shapes = torch.cat([decoder.weight.detach().T, decoder.bias.detach()[None]]) / MM
    if space is not None:
        shapes = shapes @ torch.from_numpy(space.basis)
    return shapes.reshape(len(shapes), -1, 3)


def decoder_to_weights(decoder: nn.Linear, to_weights: Tensor) -> dict[str, Tensor]:
    """Weight and bias of a decoder to coordinates, made one to weights of the corpus's shapes."""
    weight, bias = decoder.weight.detach(), decoder.bias.detach()
    return {"weight": to_weights.T @ weight, "bias": bias @ to_weights}
