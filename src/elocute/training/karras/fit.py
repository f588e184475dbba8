"""The training loop of the network of Karras et al. 2017, and its loss.

The loss has three terms (section 4.3), balanced by running averages (section 4.4).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from elocute.audio.autocorrelation import COEFFICIENTS, WINDOW_ROWS
from elocute.networks.karras import Karras, KarrasConfig, Noise, SharedKarras
from elocute.one_line_repr import one_line
from elocute.training.checkpoint import network_tensors, restore_training
from elocute.training.corpus_data import MotionSpace
from elocute.training.decoder import start_decoder
from elocute.training.device import resolve_device
from elocute.training.epochs import Report, Row, check_loss, checkpoint_to_resume, run_epochs
from elocute.training.karras.settings import KarrasTrainConfig
from elocute.training.karras.training_data import (
    KarrasFrames,
    KarrasTrainingData,
    Runs,
    batches,
    draw_runs,
    read_between,
)

DECAY = 0.99  # of the running averages
TINY = 1e-8
TERMS = ("position", "motion", "emotion")


def loss_terms(predicted: Tensor, target: Tensor, emotions: Tensor, vertices: int) -> Tensor:
    """(3,): position mm², motion mm² and emotion.

    predicted, target: (run, frame, output) mm; emotions: (run, frame, emotion). With two frames in
    a run these are the paper's terms: the position is the mean squared difference of coordinates,
    the motion twice that of their steps from frame to frame, the emotion twice the mean squared
    step of the emotional state, divided by its mean square in the batch, which makes it
    independent of the scale of the state.
    """
    coordinates = 3 * vertices
    error = predicted - target
    position = error.square().sum(dim=-1).mean() / coordinates
    motion = 2 * error.diff(dim=1).square().sum(dim=-1).mean() / coordinates
    steps = 2 * emotions.diff(dim=1).square().mean()
    return torch.stack([position, motion, steps / (emotions.square().mean() + TINY)])


class Balance(nn.Module):
    """Divides each term by the root of a running average of its square.

    As Adam normalises gradients: averages start from zero, and their bias is taken out. All terms
    then weigh alike, whatever their units.
    """

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("squares", torch.zeros(len(TERMS), dtype=torch.float64))
        self.register_buffer("steps", torch.zeros((), dtype=torch.float64))

    def forward(self, terms: Tensor) -> Tensor:
        """One number to minimise."""
        with torch.no_grad():
            self.steps += 1
            self.squares.lerp_(terms.double().square(), 1 - DECAY)  # pyright: ignore
            level = (self.squares / (1 - DECAY**self.steps)).sqrt()  # pyright: ignore
        return (terms / (level.to(terms) + TINY)).sum()


LOG_FIELDS = (
    "epoch",
    *(f"train_{term}" for term in TERMS),
    "validation_mm2",
    "validation_best_style_mm2",
    "seconds",
)
"""`train_position` and `train_motion` are mm² a coordinate, as published; a vertex has three."""
NEUTRAL = "neutral"
BETAS = (0.9, 0.999)
RISE = 100.0  # how much the learning rate grows in the first epoch
VALIDATION_CLIPS = 12  # evenly spaced; every style is tried on each


@dataclass(frozen=True, eq=False)
class TrainedKarras:
    """A trained network with what is needed to use it.

    emotions: (style, emotion), a vector for each of `styles`.
    """

    network: Karras
    emotions: Tensor
    space: MotionSpace | None
    styles: tuple[str, ...]
    config: KarrasTrainConfig
    log: list[dict[str, float]]

    __repr__ = one_line


class _Learned(nn.Module):
    """All that a training learns and keeps: network, emotion vectors, running averages."""

    def __init__(self, network: Karras, vectors: int) -> None:
        super().__init__()
        self.network = network
        self.emotions = nn.Parameter(torch.randn(vectors, network.config.emotion))
        self.balance = Balance()


def fit(
    data: KarrasTrainingData,
    config: KarrasTrainConfig,
    folder: Path | None = None,
    *,
    resume: bool = False,
    report: Report | None = None,
    device: str = "auto",
) -> TrainedKarras:
    """Train the network and the emotion vectors together (Karras et al. 2017, sections 4.3 and
    4.4).

    Whatever is random is drawn from seed and epoch, so a resumed training goes on bit for bit on
    one CPU. data: what `prepare` returned. Arguments, result and errors are otherwise those of
    `voca.fit`.
    """
    place = resolve_device(device)
    learned = _new(data, config).to(place)
    weights = [*learned.network.parameters()]
    optimiser = torch.optim.Adam(
        [{"params": weights}, {"params": [learned.emotions]}], config.learning_rate, BETAS
    )
    record, log = checkpoint_record(data, config), list[Row]()
    if checkpoint := checkpoint_to_resume(folder, resume):
        log, _ = restore_training(checkpoint, learned, optimiser, record)
    train = data.train.to(place)

    def epoch(number: int) -> Row:
        terms = _epoch(learned, optimiser, train, data.vertices, config, number)
        emotions = style_emotions(learned.emotions, data)
        losses = {f"train_{term}": value for term, value in terms.items()}
        return {**losses, **validate(learned.network, emotions, data)}

    run_epochs(
        log,
        config.epochs,
        epoch,
        lambda: network_tensors(learned, optimiser),
        folder=folder,
        fields=LOG_FIELDS,
        record=record,
        describe=_describe,
        report=report,
    )
    learned = learned.cpu().eval()
    emotions = learned.emotions.detach()
    named = torch.cat(
        [style_emotions(emotions, data), neutral_emotion(learned.network, data, emotions)]
    )
    return TrainedKarras(
        learned.network, named, data.space, (*data.styles, _free(NEUTRAL, data.styles)), config, log
    )


def _new(data: KarrasTrainingData, config: KarrasTrainConfig) -> _Learned:
    """A network whose decoder starts from the principal components of the training motion."""
    torch.manual_seed(config.seed)
    targets = data.train.targets
    count = min(config.components, targets.shape[1])
    network = Karras(KarrasConfig(targets.shape[1], config.emotion, count))
    start_decoder(network.decoder, targets)
    last = data.train.clips[-1]
    return _Learned(network, last.vector + last.vectors)


def learning_rate(config: KarrasTrainConfig, epoch: float) -> float:
    """The rate after so many epochs: it rises geometrically in the first, then falls as 1/√t."""
    if epoch < 1:
        return config.learning_rate * RISE ** (epoch - 1)
    return config.learning_rate / epoch**0.5


def _epoch(
    learned: _Learned,
    optimiser: torch.optim.Optimizer,
    data: KarrasFrames,
    vertices: int,
    config: KarrasTrainConfig,
    epoch: int,
) -> dict[str, float]:
    """One pass over all clips; the mean of each term."""
    learned.train()
    generator = torch.Generator().manual_seed(config.seed * 100_003 + epoch)
    runs = draw_runs(data, config, generator)
    totals = torch.zeros(len(TERMS), dtype=torch.float64)
    for done, batch in enumerate(batches(runs, config.batch_runs)):
        rate = learning_rate(config, epoch + done * config.batch_runs / len(runs))
        optimiser.param_groups[0]["lr"] = rate
        optimiser.param_groups[1]["lr"] = rate * config.emotion_speed
        terms = _terms(learned, data, batch, vertices, config, generator)
        optimiser.zero_grad(set_to_none=True)
        learned.balance(terms).backward()
        optimiser.step()
        totals += terms.detach().double().cpu() * len(batch)
    check_loss(
        float(totals.sum()),
        epoch,
        "lower `learning_rate`, or look at the corpus: elocute corpus check",
    )
    return dict(zip(TERMS, (totals / len(runs)).tolist(), strict=True))


def _terms(
    learned: _Learned,
    data: KarrasFrames,
    batch: Runs,
    vertices: int,
    config: KarrasTrainConfig,
    generator: torch.Generator,
) -> Tensor:
    """(3,) of a batch."""
    emotions = read_between(learned.emotions, batch.vectors)
    noise = Noise(len(batch), generator) if config.noise else None
    windows = batch.windows.to(data.rows.device)
    predicted = learned.network.of_runs(data.sound_of(batch), windows, emotions, noise)
    return loss_terms(predicted, data.targets_of(batch), emotions, vertices)


def style_emotions(emotions: Tensor, data: KarrasTrainingData) -> Tensor:
    """(style, emotion): the mean of the vectors of each speaker's clips."""
    means = []
    for style in range(len(data.styles)):
        own = [clip for clip in data.train.clips if clip.style == style]
        vectors = [emotions[clip.vector : clip.vector + clip.vectors] for clip in own]
        means.append(torch.cat(vectors).mean(dim=0))
    return torch.stack(means).detach()


@torch.no_grad()
def neutral_emotion(network: Karras, data: KarrasTrainingData, emotions: Tensor) -> Tensor:
    """(1, emotion): of the clips' mean vectors the one in which silence moves the face least.

    The first step of how the paper mines its emotion database (section 5.1); what follows there
    is done by eye.
    """
    means = torch.stack(
        [emotions[c.vector : c.vector + c.vectors].mean(dim=0) for c in data.train.clips]
    )
    silence = torch.zeros(1, WINDOW_ROWS, COEFFICIENTS).expand(len(means), -1, -1)
    faces = network(silence, means)
    return means[faces.square().sum(dim=1).argmin()][None]


@torch.no_grad()
def validate(network: Karras, emotions: Tensor, data: KarrasTrainingData) -> dict[str, float]:
    """Squared distance of a vertex, mm², over some validation clips: mean over styles, and best."""
    names = ("validation_mm2", "validation_best_style_mm2")
    if data.validation is None:
        return dict.fromkeys(names, float("nan"))
    network.eval()
    held_out = data.validation
    step = max(1, len(held_out.clips) // VALIDATION_CLIPS)
    losses = np.zeros(len(emotions))
    count = 0
    device = next(network.parameters()).device
    shared = SharedKarras(network, emotions)
    for clip in held_out.clips[::step]:
        target = held_out.clip_targets(clip).to(device)
        formants = shared.analyse(held_out.clip_rows(clip).to(device))
        for style, emotion in enumerate(emotions):
            predicted = network.decoder(shared.articulate(formants, emotion[None]))
            losses[style] += (predicted - target).square().sum().item() / data.vertices
        count += clip.outputs
    losses /= count
    return dict(zip(names, (float(losses.mean()), float(losses.min())), strict=True))


def _free(name: str, taken: tuple[str, ...]) -> str:
    """A name that no speaker has."""
    return name if name not in taken else _free(f"mined_{name}", taken)


def checkpoint_record(data: KarrasTrainingData, config: KarrasTrainConfig) -> dict[str, Any]:
    """What a checkpoint tells of its training, beside the log."""
    clips = [clip.name for clip in data.train.clips]
    return {"config": asdict(config), "styles": data.styles, "clips": clips}


def _describe(row: Row) -> str:
    return f"train {3 * row['train_position']:.4f}, validation {row['validation_mm2']:.4f} mm²"
