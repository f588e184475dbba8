"""The network's forward pass for training: the same arithmetic, channels last, a quarter faster."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from elocute.networks.phone_net import PhoneNet, ResidualBlock


def fast_logits(net: PhoneNet, features: Tensor) -> Tensor:
    """(batch, frame, band) to (batch, ceil(frame / 2), phone), as `net(features)` gives."""
    x = features.transpose(1, 2).unsqueeze(2)  # bands come last in memory: channels_last for free
    stem = net.stem
    x = functional.conv2d(
        x, stem.weight.unsqueeze(2), stride=(1, 2), padding=(0, net.config.stem_kernel // 2)
    )
    x = functional.relu(_normalise(net.norm, x), inplace=True)
    for block in net.blocks:
        assert isinstance(block, ResidualBlock)
        weight, dilation = block.convolution.weight.unsqueeze(2), block.convolution.dilation[0]
        y = functional.conv2d(functional.pad(x, block.padding), weight, dilation=(1, dilation))
        y = functional.relu(_normalise(block.norm, y), inplace=True)
        x = x + (_drop(y, net.config.dropout) if net.training else y)
    return functional.conv2d(x, net.head.weight.unsqueeze(2), net.head.bias).squeeze(2).mT


def _normalise(norm: nn.BatchNorm1d, x: Tensor) -> Tensor:
    return functional.batch_norm(
        x,
        norm.running_mean,
        norm.running_var,
        norm.weight,
        norm.bias,
        norm.training,
        norm.momentum or 0.1,
        norm.eps,
    )


def _drop(x: Tensor, share: float) -> Tensor:
    """Whole channels."""
    kept = torch.rand(x.shape[0], x.shape[1], 1, 1) > share
    return x * (kept / (1 - share))
