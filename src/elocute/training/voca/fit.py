"""The training loop of VOCA."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from elocute.corpus.corpus_store import Corpus
from elocute.errors import ModelError
from elocute.networks.voca import Voca, VocaConfig
from elocute.one_line_repr import one_line
from elocute.training.device import resolve_device
from elocute.training.training_log import Board
from elocute.training.voca.checkpoint import (
    load_checkpoint,
    network_tensors,
    restore_network,
    restore_optimiser,
    save_checkpoint,
    stored_log,
)
from elocute.training.voca.config import TrainConfig
from elocute.training.voca.target_space import MotionSpace, motion_space
from elocute.training.voca.training_data import Encode, Frames, load_frames

LOG_FIELDS: tuple[str, ...] = (
    "epoch",
    "train_mm2",
    "validation_mm2",
    "validation_best_style_mm2",
    "seconds",
)
VALIDATION_BATCH = 4096
Report = Callable[[float, str], None]
"""Share of all epochs done, and a line for people."""


@dataclass(frozen=True, eq=False)
class Trained:
    """A trained network with what is needed to use it."""

    network: Voca
    space: MotionSpace | None
    styles: tuple[str, ...]
    config: TrainConfig
    fps: float
    log: list[dict[str, float]]

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class Material:
    """Frames to learn from and to validate on; vertices is what a squared distance is shared by."""

    train: Frames
    validation: Frames | None
    space: MotionSpace | None
    styles: tuple[str, ...]
    vertices: int
    fps: float


def prepare(
    corpus: Corpus,
    config: TrainConfig,
    encode: Encode,
    split: str = "default",
    report: Report | None = None,
) -> Material:
    """Hear the corpus once and put everything the loop needs into memory.

    Styles are the subjects of the training part. Raises CorpusError for a corpus that cannot
    be learned from, before the first epoch.
    """
    parts = corpus.split(split)
    styles = tuple(
        s for s in corpus.subjects if any(corpus.entry(n).subject == s for n in parts.train)
    )
    space = motion_space(corpus, parts.train) if config.reduced else None

    def progress(share: float) -> None:
        if report:
            report(0.0, f"hearing the corpus: {share:.0%}")

    train = load_frames(corpus, parts.train, styles, encode, space, progress)
    validation = (
        load_frames(corpus, parts.validation, styles, encode, space) if parts.validation else None
    )
    return Material(train, validation, space, styles, corpus.vertex_count, corpus.fps)


def fit(
    material: Material,
    config: TrainConfig,
    folder: Path | None = None,
    *,
    resume: bool = False,
    report: Report | None = None,
    device: str = "auto",
) -> Trained:
    """Train for `config.epochs`; in `folder`: checkpoint.safetensors, log.csv, events for
    TensorBoard.

    `device` is as for `resolve_device`; another one may go on where one stopped. A resumed
    training goes on bit for bit on one CPU. Raises ModelError where a checkpoint belongs to
    other settings, and for a device that is not there.
    """
    fabric = _fabric(device)
    fabric.launch()
    torch.manual_seed(config.seed)
    network = new_network(material, config)
    optimiser = torch.optim.Adam(network.parameters(), config.learning_rate)
    checkpoint = folder / "checkpoint.safetensors" if folder else None
    log: list[dict[str, float]] = []
    if resume and checkpoint and checkpoint.exists():
        log = _restore(checkpoint, network, optimiser, material, config)
    network, optimiser = fabric.setup(network, optimiser)
    train = _moved(material.train, fabric.device)
    board = Board(folder, LOG_FIELDS, len(log)) if folder and fabric.is_global_zero else None
    for epoch in range(len(log), config.epochs):
        started = time.perf_counter()
        loss = _epoch(fabric, network, optimiser, train, config, epoch, material.vertices)
        row = {"epoch": epoch + 1.0, "train_mm2": loss, **validate(network, material)}
        row["seconds"] = time.perf_counter() - started
        log.append(row)
        if checkpoint and fabric.is_global_zero:
            save_checkpoint(
                checkpoint, network_tensors(network, optimiser), _record(material, config, log)
            )
        if board:
            board.add(log)
        if report:
            report((epoch + 1) / config.epochs, _line(row))
    plain = new_network(material, config)
    plain.load_state_dict(
        {k.removeprefix("module."): v.cpu() for k, v in network.state_dict().items()}
    )
    plain.eval()
    return Trained(plain, material.space, material.styles, config, material.fps, log)


def _fabric(device: str) -> Any:
    """One device as named; `auto` takes every CUDA device there is."""
    from lightning_fabric import Fabric

    place = resolve_device(device)
    if place.type == "cpu":
        return Fabric(accelerator="cpu", devices=1)
    if place.type == "mps":
        return Fabric(accelerator="mps", devices=1)
    return Fabric(accelerator="cuda", devices="auto" if device == "auto" else [place.index])


def new_network(material: Material, config: TrainConfig) -> Voca:
    """A network whose decoder starts from the principal components of the training motion."""
    targets = material.train.targets
    count = min(config.components, targets.shape[1])
    shape = VocaConfig(
        material.train.features.shape[1], len(material.styles), targets.shape[1], count
    )
    network = Voca(shape)
    network.start_decoder(principal_components(targets, count))
    return network


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


def pair_loss(predicted: Tensor, target: Tensor, config: TrainConfig, vertices: int) -> Tensor:
    """Position and velocity terms (section 5) of (2, pair, output): mm² a vertex.

    The first row holds the frames before, the second the frames themselves.
    """
    error = predicted - target
    position = error.square().sum(dim=-1).mean() / vertices
    velocity = (error[1] - error[0]).square().sum(dim=-1).mean() / vertices
    return config.position_weight * position + config.velocity_weight * velocity


def _epoch(
    fabric: Any,
    network: Voca,
    optimiser: Any,
    data: Frames,
    config: TrainConfig,
    epoch: int,
    vertices: int,
) -> float:
    """One pass over all pairs in a new order, each process its share; mean loss."""
    network.train()
    order = torch.randperm(
        len(data.pairs), generator=torch.Generator().manual_seed(config.seed * 100_003 + epoch)
    )
    mine = data.pairs[order[fabric.global_rank :: fabric.world_size]]
    eye = torch.eye(network.config.styles, device=data.targets.device)
    total = 0.0
    for start in range(0, len(mine), config.batch_pairs):
        later = mine[start : start + config.batch_pairs]
        frames = torch.cat([later - 1, later])
        styles = eye[data.subjects[frames]]
        predicted = network(data.windows(frames), styles)
        shape = (2, len(later), -1)
        loss = pair_loss(
            predicted.reshape(shape), data.targets[frames].reshape(shape), config, vertices
        )
        optimiser.zero_grad(set_to_none=True)
        fabric.backward(loss)
        optimiser.step()
        total += loss.item() * len(later)
    if not math.isfinite(total):
        raise ModelError.about(
            "training",
            found=f"a loss of {total} in epoch {epoch + 1}",
            remedy="lower `learning_rate`, or look at the corpus: elocute corpus check",
        )
    return total / len(mine)


@torch.no_grad()
def validate(network: Voca, material: Material) -> dict[str, float]:
    """Squared distance (mm² a vertex) over every style: their mean, and the best style's."""
    data = material.validation
    if data is None:
        return {"validation_mm2": math.nan, "validation_best_style_mm2": math.nan}
    network.eval()
    device = next(network.parameters()).device
    losses = []
    for style in torch.eye(len(material.styles)):
        total = 0.0
        for start in range(0, len(data.targets), VALIDATION_BATCH):
            frames = torch.arange(start, min(start + VALIDATION_BATCH, len(data.targets)))
            windows = data.windows(frames).to(device)
            predicted = network(windows, style.to(device).expand(len(frames), -1)).cpu()
            total += float((predicted - data.targets[frames]).square().sum())
        losses.append(total / len(data.targets) / material.vertices)
    return {"validation_mm2": float(np.mean(losses)), "validation_best_style_mm2": min(losses)}


def _moved(data: Frames, device: torch.device) -> Frames:
    return Frames(*(value.to(device) for value in vars(data).values()))


def _record(material: Material, config: TrainConfig, log: list[dict[str, float]]) -> dict[str, Any]:
    return {"config": config.record(), "styles": material.styles, "fps": material.fps, "log": log}


def _restore(
    path: Path,
    network: Voca,
    optimiser: torch.optim.Optimizer,
    material: Material,
    config: TrainConfig,
) -> list[dict[str, float]]:
    tensors, record = load_checkpoint(path)
    settings = record.get("config")
    stored = {**(settings if isinstance(settings, dict) else {}), "epochs": config.epochs}
    if stored != config.record() or record.get("styles") != list(material.styles):
        differing = [k for k, v in config.record().items() if stored.get(k) != v] or ["styles"]
        raise ModelError.about(
            path,
            found=f"a training with other {', '.join(differing)}",
            allowed="the same settings and corpus",
            remedy="choose another output folder",
        )
    restore_network(path, network, tensors)
    restore_optimiser(path, optimiser, tensors)
    return stored_log(path, record)


def _line(row: dict[str, float]) -> str:
    return (
        f"epoch {row['epoch']:.0f}: train {row['train_mm2']:.4f}, "
        f"validation {row['validation_mm2']:.4f} mm² ({row['seconds']:.1f} s)"
    )
