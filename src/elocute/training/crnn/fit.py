"""The training loop of the recurrent model."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from elocute.audio.mel_with_deltas import BANDS, RATE
from elocute.errors import CorpusError, ModelError
from elocute.networks.crnn import Crnn, CrnnConfig, SharedCrnn
from elocute.numerics.mel import hz_to_mel
from elocute.training.crnn.batches import answer, random_batch, whole_batch
from elocute.training.crnn.config import BETAS, CrnnTrainConfig
from elocute.training.crnn.loss import LOSSES, concordance, explained_shares, tempered
from elocute.training.crnn.training_data import Heard, Row, batches, standard
from elocute.training.device import resolve_device
from elocute.training.training_log import Board
from elocute.training.voca.checkpoint import (
    check_state,
    load_checkpoint,
    network_tensors,
    restore_network,
    restore_optimiser,
    save_checkpoint,
    stored_log,
)

CHECKPOINT = "checkpoint.safetensors"
LOG_FIELDS = (
    "epoch",
    "train_loss",
    "validation_mean",
    "validation_weighted",
    "validation_loss",
    "best",
    "seconds",
)
GRADIENT_MOST = 5.0
Report = Callable[[float, str], None]
"""Share of all epochs done, and a line for people."""


@dataclass(frozen=True, eq=False)
class Lesson:
    """What to learn from: clips that teach, clips that choose the epoch, shares of variance."""

    heard: Heard
    train: Sequence[Row]
    validation: Sequence[Row]
    shares: torch.Tensor

    def __post_init__(self) -> None:
        if not self.train:
            raise CorpusError.about("shards", found="no clip in train", allowed="one or more")


def lesson_of(
    heard: Heard, basis: np.ndarray, train: Sequence[Row], validation: Sequence[Row]
) -> Lesson:
    """basis (component, vertex, 3) gives what each parameter weighs in the loss."""
    shares = explained_shares(torch.from_numpy(np.array(basis, np.float32)))
    return Lesson(heard, train, validation, shares)


@dataclass(frozen=True, eq=False)
class TrainedCrnn:
    """The network of the epoch that validated best (the last without validation)."""

    network: Crnn
    config: CrnnTrainConfig
    log: list[dict[str, float]]


def fit(
    lesson: Lesson,
    config: CrnnTrainConfig,
    folder: Path,
    *,
    resume: bool = False,
    report: Report | None = None,
    device: str = "auto",
) -> TrainedCrnn:
    """Train; in `folder`: checkpoint.safetensors, log.csv, events for TensorBoard.

    A resumed training goes on bit for bit on one CPU, for whatever is random is drawn from seed,
    epoch and batch. `device` is as for `resolve_device`; another one may go on where one stopped.
    Raises ModelError where a checkpoint belongs to other settings, and for a device that is not
    there.
    """
    network = new_network(lesson, config).to(resolve_device(device))
    optimiser = torch.optim.Adam(network.parameters(), config.learning_rate, BETAS)
    checkpoint = folder / CHECKPOINT
    log: list[dict[str, float]] = []
    best = {name: value.clone() for name, value in network.state_dict().items()}
    if resume and checkpoint.exists():
        log, best = _restore(checkpoint, network, optimiser, lesson, config)
    board = Board(folder, LOG_FIELDS, len(log))
    for epoch in range(len(log), config.epochs):
        begun = time.perf_counter()
        for group in optimiser.param_groups:
            group["lr"] = rate_of(config, epoch)
        row = {
            "epoch": epoch + 1.0,
            "train_loss": _epoch(network, optimiser, lesson, config, epoch),
        }
        row |= validate(network, lesson, config)
        reached = [r["validation_loss"] for r in log]
        row["best"] = float(not reached or not row["validation_loss"] >= min(reached))
        if row["best"]:
            best = {name: value.clone() for name, value in network.state_dict().items()}
        row["seconds"] = time.perf_counter() - begun
        log.append(row)
        tensors = network_tensors(network, optimiser)
        tensors |= {f"best.{name}": value for name, value in best.items()}
        save_checkpoint(checkpoint, tensors, _record(lesson, config, log))
        board.add(log)
        if report:
            report((epoch + 1) / config.epochs, _line(row))
    plain = Crnn(network.config)
    plain.load_state_dict({name: value.cpu() for name, value in best.items()})
    return TrainedCrnn(plain.eval(), config, log)


def rate_of(config: CrnnTrainConfig, epoch: int) -> float:
    """The learning rate of an epoch, from the first to `last_rate` on half a cosine."""
    wave = (1 + math.cos(math.pi * epoch / max(config.epochs - 1, 1))) / 2
    return config.learning_rate * (config.last_rate + (1 - config.last_rate) * wave)


def new_network(lesson: Lesson, config: CrnnTrainConfig) -> Crnn:
    """From the seed, with the standardisation of what the training clips sound like."""
    torch.manual_seed(config.seed)
    network = Crnn(CrnnConfig(lesson.heard.targets.shape[1]))
    audible = audible_bands(config.highest_hz)
    mean, deviation = standard(lesson.heard, lesson.train, audible)
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
    lesson: Lesson,
    config: CrnnTrainConfig,
    epoch: int,
) -> float:
    """One pass over all clips in a new order; mean loss."""
    network.train()
    shared, device = SharedCrnn(network), next(network.parameters()).device
    loss_of, weights = LOSSES[config.loss], tempered(lesson.shares, config.weight_power).to(device)
    order = np.random.default_rng([config.seed, epoch]).permutation(len(lesson.train))
    total, count = 0.0, 0
    for number, rows in enumerate(batches(lesson.train, config.batch_clips, order)):
        draw = np.random.default_rng([config.seed, epoch, number, 1])
        batch = random_batch(lesson.heard, rows, config, draw).to(device)
        predicted = answer(shared, batch)
        loss = loss_of(predicted, batch.targets, batch.mask, weights)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), GRADIENT_MOST)
        optimiser.step()
        total, count = total + loss.item() * len(rows), count + len(rows)
    if not math.isfinite(total):
        raise ModelError.about(
            "training",
            found=f"a loss of {total} in epoch {epoch + 1}",
            remedy="lower `learning_rate`",
        )
    return total / count


@torch.no_grad()
def validate(network: Crnn, lesson: Lesson, config: CrnnTrainConfig) -> dict[str, float]:
    """ρc over all validation frames: mean of the parameters, weighted by explained variance,
    and 1 - ρc weighted as the loss is, which chooses the epoch whatever the loss."""
    names = ("validation_mean", "validation_weighted", "validation_loss")
    if not lesson.validation:
        return dict.fromkeys(names, math.nan)
    predicted, true = predict_rows(network, lesson.heard, lesson.validation)
    x, y = (torch.from_numpy(np.concatenate(part))[None] for part in (true, predicted))
    found = concordance(y, x, torch.ones(x.shape[:2]))
    weights = tempered(lesson.shares, config.weight_power)
    values = (found.mean(), (found * lesson.shares).sum(), ((1 - found) * weights).sum())
    return dict(zip(names, map(float, values), strict=True))


@torch.no_grad()
def predict_rows(
    network: Crnn, heard: Heard, rows: Sequence[Row], batch_clips: int = 50
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """(frame, parameter) predicted and true of every clip."""
    network.eval()
    shared, device = SharedCrnn(network), next(network.parameters()).device
    predicted, true = [], []
    for some in batches(rows, batch_clips, np.arange(len(rows))):
        batch = whole_batch(heard, some).to(device)
        values = answer(shared, batch).cpu().numpy()
        predicted += [values[i, : row.frames] for i, row in enumerate(some)]
        true += [np.array(heard.parameters(row)) for row in some]
    return predicted, true


def _record(lesson: Lesson, config: CrnnTrainConfig, log: list[dict[str, float]]) -> dict[str, Any]:
    return {
        "kind": "crnn",
        "config": config.record(),
        "log": log,
        "clips": [len(lesson.train), len(lesson.validation)],
    }


def _restore(
    path: Path,
    network: Crnn,
    optimiser: torch.optim.Optimizer,
    lesson: Lesson,
    config: CrnnTrainConfig,
) -> tuple[list[dict[str, float]], dict[str, torch.Tensor]]:
    tensors, record = load_checkpoint(path)
    wanted = _record(lesson, config, [])
    stored = {**record, "log": []}
    # More epochs may follow where the rate does not depend on how many there are.
    if config.last_rate == 1.0 and isinstance(stored.get("config"), dict):
        stored["config"] = {**stored["config"], "epochs": config.epochs}
    if stored != wanted:
        theirs, ours = stored.get("config"), config.record()
        theirs = theirs if isinstance(theirs, dict) else {}
        differing = [k for k, v in ours.items() if theirs.get(k) != v] or ["clips"]
        raise ModelError.about(
            path,
            found=f"a training with other {', '.join(differing)}",
            allowed="the same settings and shards",
            remedy="choose another output folder",
        )
    restore_network(path, network, tensors)
    restore_optimiser(path, optimiser, tensors)
    best = {k.removeprefix("best."): v for k, v in tensors.items() if k.startswith("best.")}
    check_state(path, network, best)
    return stored_log(path, record), best


def _line(row: dict[str, float]) -> str:
    return (
        f"epoch {row['epoch']:.0f}: loss {row['train_loss']:.4f}, validation concordance "
        f"{row['validation_mean']:.3f} mean, {row['validation_weighted']:.3f} weighted "
        f"({row['seconds']:.1f} s)"
    )
