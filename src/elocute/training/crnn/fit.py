"""The training loop of the recurrent model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from elocute.audio.mel_with_deltas import BANDS, RATE
from elocute.models.crnn_encoders import MEL
from elocute.networks.crnn import Crnn, CrnnConfig, SharedCrnn
from elocute.numerics.mel import hz_to_mel
from elocute.training.checkpoint import (
    check_state,
    network_tensors,
    restore_training,
    tensors_of,
)
from elocute.training.crnn.batches import predict_batch, random_batch, whole_batch
from elocute.training.crnn.feature_cache import CachedClip, FeatureCache
from elocute.training.crnn.loss import LOSSES, concordance, tempered_weights
from elocute.training.crnn.settings import BETAS, CrnnTrainConfig
from elocute.training.crnn.training_data import (
    CrnnTrainingData,
    channel_statistics,
    split_into_batches,
)
from elocute.training.device import resolve_device
from elocute.training.epochs import Report, Row, check_loss, checkpoint_to_resume, run_epochs

LOG_FIELDS = (
    "epoch",
    "train_loss",
    "validation_mean",
    "validation_weighted",
    "validation_loss",
    "best",
    "seconds",
)


@dataclass(frozen=True, eq=False)
class TrainedCrnn:
    """The network of the epoch that validated best (the last without validation)."""

    network: Crnn
    config: CrnnTrainConfig
    log: list[dict[str, float]]


def fit(
    data: CrnnTrainingData,
    config: CrnnTrainConfig,
    folder: Path,
    *,
    resume: bool = False,
    report: Report | None = None,
    device: str = "auto",
) -> TrainedCrnn:
    """Train the recurrent model (Tzirakis et al. 2019, sections 5 and 6).

    Whatever is random is drawn from seed, epoch and batch, so a resumed training goes on bit for
    bit on one CPU. data: what `select_training_data` returned. folder: where to leave
    checkpoint.safetensors, log.csv and TensorBoard's events. report: called after every epoch.
    device: as for `resolve_device`; a training may be resumed on another one. Gives the network of
    the best epoch, on the CPU. Raises ModelError where the checkpoint belongs to other settings or
    clips, the loss is no longer finite, or the device is missing.
    """
    network = new_network(data, config).to(resolve_device(device))
    optimiser = torch.optim.Adam(network.parameters(), config.learning_rate, BETAS)
    log, best = list[Row](), _weights(network)
    if checkpoint := checkpoint_to_resume(folder, resume):
        log, best = restore_crnn(checkpoint, network, optimiser, data, config)

    def epoch(number: int) -> Row:
        nonlocal best
        for group in optimiser.param_groups:
            group["lr"] = rate_of(config, number)
        row = {"train_loss": _epoch(network, optimiser, data, config, number)}
        row |= validate(network, data, config)
        reached = [r["validation_loss"] for r in log]
        row["best"] = float(not reached or not row["validation_loss"] >= min(reached))
        if row["best"]:
            best = _weights(network)
        return row

    def state() -> dict[str, Tensor]:
        kept = {f"best.{name}": value for name, value in best.items()}
        return network_tensors(network, optimiser) | kept

    run_epochs(
        log,
        config.epochs,
        epoch,
        state,
        folder=folder,
        fields=LOG_FIELDS,
        record=_record(data, config),
        describe=_describe,
        report=report,
    )
    plain = Crnn(network.config)
    plain.load_state_dict({name: value.cpu() for name, value in best.items()})
    return TrainedCrnn(plain.eval(), config, log)


def rate_of(config: CrnnTrainConfig, epoch: int) -> float:
    """The learning rate of an epoch, from the first to `last_rate` on half a cosine."""
    wave = (1 + math.cos(math.pi * epoch / max(config.epochs - 1, 1))) / 2
    return config.learning_rate * (config.last_rate + (1 - config.last_rate) * wave)


def new_network(data: CrnnTrainingData, config: CrnnTrainConfig) -> Crnn:
    """A network drawn from the seed, mel bands standardised by the training clips."""
    torch.manual_seed(config.seed)
    outputs, features = data.cache.targets.shape[1], data.cache.static.shape[1]
    if data.cache.encoder != MEL:
        return Crnn(CrnnConfig(outputs, features))
    network = Crnn(CrnnConfig(outputs))
    audible = audible_bands(config.highest_hz)
    mean, deviation = channel_statistics(data.cache, data.train, audible)
    network.shift.copy_(torch.from_numpy(mean))
    network.scale.copy_(torch.from_numpy(deviation))
    network.audible.copy_(torch.from_numpy(audible)[:, None])
    return network


def audible_bands(highest_hz: float) -> np.ndarray:
    """(128,) 1 for bands whose upper edge is not above `highest_hz`, else 0."""
    top = float(hz_to_mel(RATE / 2))
    edges = (np.arange(BANDS) + 2) * top / (BANDS + 1)
    return (edges <= float(hz_to_mel(highest_hz)) + 1e-6).astype(np.float32)


def _epoch(
    network: Crnn,
    optimiser: torch.optim.Optimizer,
    data: CrnnTrainingData,
    config: CrnnTrainConfig,
    epoch: int,
) -> float:
    """One pass over all clips in a new order; mean loss."""
    network.train()
    shared, device = SharedCrnn(network), next(network.parameters()).device
    loss_of, weights = (
        LOSSES[config.loss],
        tempered_weights(data.shares, config.weight_power).to(device),
    )
    order = np.random.default_rng([config.seed, epoch]).permutation(len(data.train))
    total, count = 0.0, 0
    for number, clips in enumerate(split_into_batches(data.train, config.batch_clips, order)):
        draw = np.random.default_rng([config.seed, epoch, number, 1])
        batch = random_batch(data.cache, clips, config, draw).to(device)
        predicted = predict_batch(shared, batch)
        loss = loss_of(predicted, batch.targets, batch.mask, weights)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        if config.gradient_limit:
            torch.nn.utils.clip_grad_norm_(network.parameters(), config.gradient_limit)
        optimiser.step()
        total, count = total + loss.item() * len(clips), count + len(clips)
    check_loss(total, epoch, "lower `learning_rate`")
    return total / count


@torch.no_grad()
def validate(network: Crnn, data: CrnnTrainingData, config: CrnnTrainConfig) -> dict[str, float]:
    """ρc over all validation frames, and what chooses the best epoch.

    validation_mean and validation_weighted are the plain mean over parameters and that weighted by
    explained variance; validation_loss is 1 - ρc with the weights of the loss, also where the loss
    is mse.
    """
    names = ("validation_mean", "validation_weighted", "validation_loss")
    if not data.validation:
        return dict.fromkeys(names, math.nan)
    predicted, true = predict_clips(network, data.cache, data.validation)
    x, y = (torch.from_numpy(np.concatenate(part))[None] for part in (true, predicted))
    concordances = concordance(y, x, torch.ones(x.shape[:2]))
    weights = tempered_weights(data.shares, config.weight_power)
    values = (
        concordances.mean(),
        (concordances * data.shares).sum(),
        ((1 - concordances) * weights).sum(),
    )
    return dict(zip(names, map(float, values), strict=True))


@torch.no_grad()
def predict_clips(
    network: Crnn, cache: FeatureCache, clips: Sequence[CachedClip], batch_clips: int = 50
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """(frame, parameter) predicted and true of every clip."""
    network.eval()
    shared, device = SharedCrnn(network), next(network.parameters()).device
    predicted, true = [], []
    for some in split_into_batches(clips, batch_clips, np.arange(len(clips))):
        batch = whole_batch(cache, some).to(device)
        values = predict_batch(shared, batch).cpu().numpy()
        predicted += [values[i, : clip.frames] for i, clip in enumerate(some)]
        true += [np.array(cache.parameters(clip)) for clip in some]
    return predicted, true


def _weights(network: Crnn) -> dict[str, Tensor]:
    """A copy that further steps leave alone."""
    return {name: value.clone() for name, value in network.state_dict().items()}


def _record(data: CrnnTrainingData, config: CrnnTrainConfig) -> dict[str, Any]:
    """What a checkpoint tells of its training, beside the log."""
    clips = [len(data.train), len(data.validation)]
    return {"kind": "crnn", "config": asdict(config), "clips": clips}


def restore_crnn(
    path: Path,
    network: Crnn,
    optimiser: torch.optim.Optimizer,
    data: CrnnTrainingData,
    config: CrnnTrainConfig,
) -> tuple[list[Row], dict[str, Tensor]]:
    """The log of a checkpoint and the best weights so far; the training is taken up from it."""
    # More epochs may follow where the rate does not depend on how many there are.
    free = ("epochs",) if config.last_rate == 1.0 else ()
    log, tensors = restore_training(
        path, network, optimiser, _record(data, config), source="shards", free=free
    )
    best = tensors_of(tensors, "best")
    check_state(path, network, best)
    return log, best


def _describe(row: Row) -> str:
    return (
        f"loss {row['train_loss']:.4f}, validation concordance "
        f"{row['validation_mean']:.3f} mean, {row['validation_weighted']:.3f} weighted"
    )
