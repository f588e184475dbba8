"""Training one network on talkers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from elocute.array_types import Float32Array
from elocute.encoders.protocol import FEATURE_RATE
from elocute.models.talker_inputs import RULES_COLUMN
from elocute.motion.mouth_measures import MEASURES
from elocute.networks.talkers import MeanOfTalkerNets, TalkerNet, TalkerNetConfig
from elocute.numerics.correlation import pearson
from recipes.talkers.batches import Batch, Batches, silent_stretches
from recipes.talkers.clips import Clip, TalkerSpeech, by_talker, set_targets

GUARD = 0.3  # share of the rules that is added to the mean of the networks


@dataclass(frozen=True)
class FitSettings:
    """How a network is trained.

    `sentences` is the share of a batch that is whole sentences of the man who pauses; the rest is
    words of many people. `importance` is that of each measure, `velocity` of its speed, `level` of
    its value beside its correlation, and `shut` of telling whether lips are shut.
    """

    channels: int = 64
    dropout: float = 0.3
    epochs: int = 16
    steps: int = 40
    batch: int = 32
    rows: int = 150
    sentences: float = 0.3
    learning_rate: float = 2e-3
    warm_up: int = 100
    weight_decay: float = 0.1
    noise: float = 0.0
    importance: tuple[float, ...] = (1.0, 0.4, 0.15, 0.25)
    velocity: float = 0.3
    level: float = 0.15
    shut: float = 0.3
    lags_s: tuple[float, ...] = (-0.04, -0.02, 0.0, 0.02, 0.04)
    lag_cost: float = 0.1
    lag_clips: int = 12  # that a talker must have to be given a lag of his own


def fit(
    words: Sequence[Clip],
    sentences: Sequence[Clip],
    speech: Mapping[str, TalkerSpeech],
    seed: int,
    settings: FitSettings,
    say: Callable[[str], None],
) -> TalkerNet:
    """A network trained on words of many talkers, and sentences of one who pauses between them."""
    torch.manual_seed(seed)
    config = TalkerNetConfig(
        words[0].inputs.shape[1], RULES_COLUMN, len(MEASURES), settings.channels,
        dropout=settings.dropout,
    )  # fmt: skip
    network = TalkerNet(config)
    for clip in words:
        set_targets(clip, speech[clip.talker], 0.0)
    of_sentences = round(settings.batch * settings.sentences)
    draws = [
        (
            Batches(words, settings.rows, seed, silent_stretches(sentences)),
            settings.batch - of_sentences,
        ),
        (Batches(sentences, settings.rows, seed + 1000), of_sentences),
    ]
    optimiser = torch.optim.AdamW(network.parameters(), weight_decay=settings.weight_decay)
    total, done = settings.epochs * settings.steps, 0
    for epoch in range(settings.epochs):
        if epoch in (settings.epochs // 3, 2 * settings.epochs // 3):
            _estimate_lags(network, words, speech, settings)
        network.train()
        losses = []
        for _ in range(settings.steps):
            for group in optimiser.param_groups:
                group["lr"] = _rate(done, total, settings)
            loss = sum(
                _loss(network, batches.draw(size), settings) * (size / settings.batch)
                for batches, size in draws
                if size
            )
            assert isinstance(loss, Tensor)
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            losses.append(float(loss.detach()))
            done += 1
        say(f"seed {seed} epoch {epoch + 1} loss {np.mean(losses):.3f}")
    return network.eval()


def _rate(step: int, total: int, settings: FitSettings) -> float:
    """Warm up, then half a cosine."""
    warm = min(1.0, (step + 1) / settings.warm_up)
    return settings.learning_rate * warm * 0.5 * (1 + math.cos(math.pi * step / total))


def _loss(network: TalkerNet, batch: Batch, settings: FitSettings) -> Tensor:
    inputs, targets, weight = map(torch.from_numpy, (batch.inputs, batch.targets, batch.weight))
    if settings.noise:
        inputs = inputs + settings.noise * torch.randn_like(inputs)
    told = network(inputs)
    count = weight.sum().clamp(min=1)
    shut = functional.binary_cross_entropy_with_logits(
        told[..., -1], targets[..., -1], reduction="none"
    )
    loss = settings.shut * (shut * weight).sum() / count
    both = weight[:, 2:] * weight[:, :-2]
    for place, importance in enumerate(settings.importance):
        mine, true = told[..., place], targets[..., place]
        speed, true_speed = mine[:, 2:] - mine[:, :-2], true[:, 2:] - true[:, :-2]
        level = functional.smooth_l1_loss(mine, true, reduction="none")
        loss = loss + importance * (
            (1 - _correlation(mine, true, weight)).mean()
            + settings.velocity * (1 - _correlation(speed, true_speed, both)).mean()
            + settings.level * (level * weight).sum() / count
        )
    return loss


def _correlation(first: Tensor, second: Tensor, weight: Tensor) -> Tensor:
    """(sequence,) Pearson's r over weighted rows."""
    count = weight.sum(-1, keepdim=True).clamp(min=1)
    a = (first - (first * weight).sum(-1, keepdim=True) / count) * weight
    b = (second - (second * weight).sum(-1, keepdim=True) / count) * weight
    return (a * b).sum(-1) / ((a * a).sum(-1) * (b * b).sum(-1) + 1e-3).sqrt()


@torch.no_grad()
def told_by(networks: Sequence[TalkerNet], inputs: Float32Array) -> Float32Array:
    """(row, output): the mean of networks on one clip, with the guard of the rules."""
    return MeanOfTalkerNets(networks, GUARD)(torch.from_numpy(inputs[None]))[0].numpy()


def _estimate_lags(
    network: TalkerNet,
    clips: Sequence[Clip],
    speech: Mapping[str, TalkerSpeech],
    settings: FitSettings,
) -> None:
    """One lag a talker, where the network so far fits best; small ones are preferred."""
    network.eval()
    for talker, own in by_talker(clips).items():
        if len(own) < settings.lag_clips:
            continue
        openings = [told_by([network], clip.inputs)[:, 0] for clip in own]
        fits = [
            np.mean(
                [fit_at(clip, track, 0, lag) for clip, track in zip(own, openings, strict=True)]
            )
            - settings.lag_cost * abs(lag)
            for lag in settings.lags_s
        ]
        lag_s = settings.lags_s[int(np.argmax(fits))]
        for clip in own:
            set_targets(clip, speech[talker], lag_s)


def fit_at(clip: Clip, track: Float32Array, measure: int, lag_s: float) -> float:
    """Correlation of a track with the tracked mouth of a clip, at the picture's own frames."""
    times = np.arange(len(track)) / FEATURE_RATE
    return pearson(np.interp(clip.times_s - lag_s, times, track), clip.tracked[:, measure])
