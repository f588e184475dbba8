"""The training loop and the loss of VOCA (Cudeiro et al. 2019, section 5)."""

from __future__ import annotations

import math
import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from elocute.networks.voca import Voca, VocaConfig
from elocute.one_line_repr import one_line
from elocute.training.checkpoint import network_tensors, restore_training
from elocute.training.corpus_data import MotionSpace
from elocute.training.decoder import principal_components, start_decoder
from elocute.training.device import resolve_device
from elocute.training.epochs import Report, Row, check_loss, checkpoint_to_resume, run_epochs
from elocute.training.voca.settings import VocaTrainConfig
from elocute.training.voca.training_data import TrainingFrames, VocaTrainingData

LOG_FIELDS: tuple[str, ...] = (
    "epoch",
    "train_mm2",
    "validation_mm2",
    "validation_best_style_mm2",
    "seconds",
)
VALIDATION_BATCH = 4096
FEATURES_MOST = 64  # of more, the principal components are heard
PROJECTION_ROWS = 50_000  # of which these are found


@dataclass(frozen=True, eq=False)
class TrainedVoca:
    """A trained network with what is needed to use it."""

    network: Voca
    space: MotionSpace | None
    styles: tuple[str, ...]
    config: VocaTrainConfig
    fps: float
    log: list[dict[str, float]]

    __repr__ = one_line


def fit(
    data: VocaTrainingData,
    config: VocaTrainConfig,
    folder: Path | None = None,
    *,
    resume: bool = False,
    report: Report | None = None,
    device: str = "auto",
) -> TrainedVoca:
    """Train VOCA on what `prepare` returned (Cudeiro et al. 2019, section 5).

    folder: where to leave checkpoint.safetensors, log.csv and TensorBoard's events, if anywhere.
    resume: from the checkpoint there, bit for bit on one CPU. report: called after every epoch.
    device: as for `resolve_device`; a training may be resumed on another one. Gives the network
    after the last epoch, on the CPU. Raises ModelError where the checkpoint belongs to other
    settings, the loss is no longer finite, or the device is missing.
    """
    fabric = _fabric(device)
    fabric.launch()
    torch.manual_seed(config.seed)
    network = new_network(data, config)
    optimiser = torch.optim.Adam(network.parameters(), config.learning_rate)
    record, log = checkpoint_record(data, config), list[Row]()
    if checkpoint := checkpoint_to_resume(folder, resume):
        log, _ = restore_training(checkpoint, network, optimiser, record)
    seen = _projected(network, data)
    network, optimiser = fabric.setup(network, optimiser)
    train = seen.train.to(fabric.device)

    def epoch(number: int) -> Row:
        loss = _epoch(fabric, network, optimiser, train, config, number, data.vertices)
        return {"train_mm2": loss, **validate(network, seen)}

    first = fabric.is_global_zero
    run_epochs(
        log,
        config.epochs,
        epoch,
        lambda: network_tensors(network, optimiser),
        folder=folder if first else None,
        fields=LOG_FIELDS,
        record=record,
        describe=_describe,
        report=report if first else None,
    )
    plain = new_network(data, config)
    plain.load_state_dict(
        {k.removeprefix("module."): v.cpu() for k, v in network.state_dict().items()}
    )
    plain.eval()
    return TrainedVoca(plain, data.space, data.styles, config, data.fps, log)


def _fabric(device: str) -> Any:
    """One device as named; `auto` takes every CUDA device there is.

    On CPUs there are as many processes as torchrun has started.
    """
    from lightning_fabric import Fabric

    place = resolve_device(device)
    if place.type == "cpu":
        launched = torch.distributed.is_torchelastic_launched()
        processes = int(os.environ["WORLD_SIZE"]) if launched else 1
        return Fabric(
            accelerator="cpu", devices=processes, strategy="ddp" if processes > 1 else "auto"
        )
    if place.type == "mps":
        return Fabric(accelerator="mps", devices=1)
    return Fabric(accelerator="cuda", devices="auto" if device == "auto" else [place.index])


def new_network(data: VocaTrainingData, config: VocaTrainConfig) -> Voca:
    """A network whose decoder starts from the principal components of the training motion.

    Features of which there are many are projected onto theirs, each with a deviation of one.
    """
    targets, heard = data.train.targets, data.train.features
    outputs, many = targets.shape[1], heard.shape[1]
    features, count = min(many, FEATURES_MOST), min(config.components, outputs)
    shape = VocaConfig(features, len(data.styles), outputs, count, many if many > features else 0)
    network = Voca(shape)
    if shape.heard:
        some = heard[:: max(1, len(heard) // PROJECTION_ROWS)]
        components = principal_components(some, features).T
        network.projection.copy_(components / components.norm(dim=0) ** 2)
    if config.initialisers == "released":
        network.start_as_released()
    start_decoder(network.decoder, targets)
    return network


def _projected(network: Voca, data: VocaTrainingData) -> VocaTrainingData:
    """The same data with the features that windows have."""
    train, validation = (
        part and replace(part, features=network.projected(part.features))
        for part in (data.train, data.validation)
    )
    return replace(data, train=train, validation=validation)


def _epoch(
    fabric: Any,
    network: Voca,
    optimiser: Any,
    data: TrainingFrames,
    config: VocaTrainConfig,
    epoch: int,
    vertices: int,
) -> float:
    """One pass over all pairs in a new order; mean loss.

    Processes share every batch, and their gradients are averaged, so that several make the very
    steps that one would.
    """
    network.train()
    order = torch.randperm(
        len(data.pairs), generator=torch.Generator().manual_seed(config.seed * 100_003 + epoch)
    )
    pairs = data.pairs[order.to(data.pairs.device)]
    eye = torch.eye(network.config.styles, device=data.targets.device)
    total = 0.0
    for start in range(0, len(pairs), config.batch_pairs):
        batch = pairs[start : start + config.batch_pairs]
        later, weight = share_of_batch(batch, fabric.global_rank, fabric.world_size)
        frames = torch.cat([later - 1, later])
        styles = eye[data.subjects[frames]]
        predicted = network(data.windows(frames), styles)
        shape = (2, len(later), -1)
        loss = weight * pair_loss(
            predicted.reshape(shape), data.targets[frames].reshape(shape), config, vertices
        )
        optimiser.zero_grad(set_to_none=True)
        fabric.backward(loss)
        optimiser.step()
        total += loss.item() * len(batch)
    if fabric.world_size > 1:
        total = float(fabric.all_reduce(torch.tensor(total, dtype=torch.float64), reduce_op="mean"))
    check_loss(total, epoch, "lower `learning_rate`, or look at the corpus: elocute corpus check")
    return total / len(pairs)


def share_of_batch(batch: Tensor, rank: int, processes: int) -> tuple[Tensor, float]:
    """What one process computes of a batch, and the weight of its mean loss.

    The mean over processes of the weighted losses is the loss of the batch, also where the batch
    cannot be shared evenly; a batch of fewer pairs than processes is computed by each of them.
    """
    if len(batch) < processes:
        return batch, 1.0
    share = batch[rank::processes]
    return share, len(share) * processes / len(batch)


@torch.no_grad()
def validate(network: Voca, data: VocaTrainingData) -> dict[str, float]:
    """Squared distance (mm² a vertex) over every style: their mean, and the best style's."""
    held_out = data.validation
    if held_out is None:
        return {"validation_mm2": math.nan, "validation_best_style_mm2": math.nan}
    network.eval()
    device = next(network.parameters()).device
    losses = []
    for style in torch.eye(len(data.styles)):
        total = 0.0
        for start in range(0, len(held_out.targets), VALIDATION_BATCH):
            frames = torch.arange(start, min(start + VALIDATION_BATCH, len(held_out.targets)))
            windows = held_out.windows(frames).to(device)
            predicted = network(windows, style.to(device).expand(len(frames), -1)).cpu()
            total += float((predicted - held_out.targets[frames]).square().sum())
        losses.append(total / len(held_out.targets) / data.vertices)
    return {"validation_mm2": float(np.mean(losses)), "validation_best_style_mm2": min(losses)}


def checkpoint_record(data: VocaTrainingData, config: VocaTrainConfig) -> dict[str, Any]:
    """What a checkpoint tells of its training, beside the log."""
    return {"config": asdict(config), "styles": data.styles, "fps": data.fps}


def _describe(row: Row) -> str:
    return f"train {row['train_mm2']:.4f}, validation {row['validation_mm2']:.4f} mm²"


def pair_loss(predicted: Tensor, target: Tensor, config: VocaTrainConfig, vertices: int) -> Tensor:
    """Position and velocity terms of (2, pair, output): mm² a vertex.

    The first row holds the frames before, the second the frames themselves.
    """
    error = predicted - target
    position = error.square().sum(dim=-1).mean() / vertices
    velocity = (error[1] - error[0]).square().sum(dim=-1).mean() / vertices
    return config.position_weight * position + config.velocity_weight * velocity
