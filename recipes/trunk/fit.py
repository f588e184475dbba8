"""Teaching the trunk: mouths and phones share it, and the rows of the whole encoder hold it."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from elocute.encoders.phones_and_visemes import PHONES, SILENCE
from recipes.encoder.mixing import LIPS, Mixer
from recipes.encoder.store import UNKNOWN, VOICED
from recipes.trunk.mouths import FIELDS, MouthBatches
from recipes.trunk.network import CONTEXT, LIVE_AHEAD, Trunk, TrunkConfig, position_rows, weakened
from recipes.trunk.spectrum import BatchLogMel
from recipes.trunk.whisper import load_whisper

ROWS = 400  # of a sequence: 8 s
WHISPER_ROWS = 1500  # that the published encoder hears at once
SPEED_ROWS = 2  # over which speeds are compared


@dataclass(frozen=True)
class FitSettings:
    """How the trunk learns.

    Attributes
    ----------
    minutes : float
        Of wall time.
    mouths, speech : int
        Sequences of each kind in a batch.
    trunk_rate, head_rate : float
        Learning rates.
    ahead : tuple of (int, float)
        Rows that a layer sees ahead, and how often.
    rows_share : float
        Weight of the distance of the mouth's rows from those of the encoder as it was published,
        hearing the whole.
    mouth_pull, phones_pull : float
        Share of the gradient of each head that reaches the layers up to the mouth's.
    phones_alone : bool
        Whether the mouth and what it hears through stay as the checkpoint has them.
    """

    minutes: float = 50.0
    mouths: int = 5
    speech: int = 4
    trunk_rate: float = 2e-4
    head_rate: float = 2e-3
    warm_steps: int = 60
    ahead: tuple[tuple[int, float], ...] = ((1, 0.2), (2, 0.3), (4, 0.15), (25, 0.35))
    rows_share: float = 6.0
    mouth_pull: float = 0.1
    phones_pull: float = 0.2
    phones_share: float = 1.0
    lip_weight: float = 2.0
    smoothing: float = 0.05
    velocity: float = 0.3
    level: float = 0.15
    shut: float = 0.3
    importance: tuple[float, ...] = (1.0, 0.6, 0.4, 0.6, 0.4, 0.4)
    ema: float = 0.998
    report_minutes: float = 12.0
    phones_alone: bool = False
    seed: int = 7


def mouth_loss(told: Tensor, targets: Tensor, clip: Tensor, settings: FitSettings) -> Tensor:
    """Correlation within clips, that of speeds, distance and shut lips."""
    count = int(clip.max()) + 1
    fields = len(FIELDS)
    importance = torch.tensor(settings.importance)
    value = 1 - _correlations(told[..., :fields], targets[..., :fields], clip, count)
    step = SPEED_ROWS
    moving = torch.where(clip[:, step:] == clip[:, :-step], clip[:, step:], -1)
    speed = 1 - _correlations(
        told[:, step:, :fields] - told[:, :-step, :fields],
        targets[:, step:, :fields] - targets[:, :-step, :fields],
        moving,
        count,
    )
    known = clip >= 0
    far = functional.smooth_l1_loss(told[..., :fields], targets[..., :fields], reduction="none")
    level = far[known].mean(0)
    shut = functional.binary_cross_entropy_with_logits(
        told[..., fields][known], targets[..., fields][known]
    )
    each = value.mean(0) + settings.velocity * speed.mean(0) + settings.level * level
    return (each * importance).sum() + settings.shut * shut


def phones_loss(heard: Tensor, target: Tensor, weight: Tensor, smoothing: float) -> Tensor:
    """Cross entropy of (sequence, row, phone) logits; of voices without phones, that of silence."""
    voiced = target == VOICED
    phones = functional.cross_entropy(
        heard.transpose(1, 2),
        target.masked_fill(voiced, UNKNOWN),
        weight,
        ignore_index=UNKNOWN,
        label_smoothing=smoothing,
    )
    if not voiced.any():
        return phones
    silent = torch.softmax(heard[voiced], -1)[:, SILENCE]
    return phones - torch.log((1 - silent).clamp(min=1e-4)).sum() / target.numel()


def _correlations(first: Tensor, second: Tensor, clip: Tensor, count: int) -> Tensor:
    """(clip, field) Pearson's r within each clip."""
    known = clip >= 0
    a, b, own = first[known], second[known], clip[known]

    def sums(values: Tensor) -> Tensor:
        return torch.zeros(count, values.shape[1]).index_add(0, own, values)

    size = torch.zeros(count).index_add(0, own, torch.ones(len(own)))[:, None].clamp(min=1)
    a, b = a - (sums(a) / size)[own], b - (sums(b) / size)[own]
    return sums(a * b) / (sums(a * a) * sums(b * b) + 1e-3).sqrt()


def published(config: TrunkConfig, whisper: Path) -> Trunk:
    """The encoder as it was published, up to the layer of the mouth, with its own positions."""
    config = replace(config, layers=config.mouth_layer, period=WHISPER_ROWS)
    teacher = Trunk(config)
    load_whisper(teacher, whisper)
    teacher.positions = torch.from_numpy(position_rows(WHISPER_ROWS, config.width, rounded=False))
    return teacher.eval().requires_grad_(False)


def fit(
    whisper: Path,
    config: TrunkConfig,
    mouths: MouthBatches,
    speech: Mixer,
    checkpoint: Path,
    settings: FitSettings,
    report: Callable[[Trunk], str],
) -> Trunk:
    """Teach for `settings.minutes`, going on from `checkpoint` where it exists."""
    torch.manual_seed(settings.seed)
    trunk, mean, teacher = Trunk(config), Trunk(config), published(config, whisper)
    load_whisper(trunk, whisper)
    heads = [p for name, p in trunk.named_parameters() if name.startswith(("mouth.", "phones."))]
    own = [p for name, p in trunk.named_parameters() if not name.startswith(("mouth.", "phones."))]
    optimiser = torch.optim.AdamW(
        [
            {"params": own, "lr": settings.trunk_rate, "weight_decay": 1e-2},
            {"params": heads, "lr": settings.head_rate, "weight_decay": 2e-2},
        ],
        betas=(0.9, 0.98),
    )
    rates = [group["lr"] for group in optimiser.param_groups]
    step, spent = 0, 0.0
    if checkpoint.exists():
        state = torch.load(checkpoint, weights_only=True)
        trunk.load_state_dict(state["trunk"])
        mean.load_state_dict(state["mean"])
        optimiser.load_state_dict(state["optimiser"])
        step, spent = state["step"], 0.0 if settings.phones_alone else state["spent"]
    else:
        mean.load_state_dict(trunk.state_dict())
    if settings.phones_alone:
        later = tuple(f"layers.{number}." for number in range(config.mouth_layer, config.layers))
        for name, parameter in trunk.named_parameters():
            parameter.requires_grad_(name.startswith(("phones.", *later)))
    draw, front_end = random.Random(settings.seed + step), BatchLogMel(settings.seed + step)
    lips = torch.ones(len(PHONES))
    lips[[PHONES.index(phone) for phone in LIPS]] = settings.lip_weight
    logged = saved = started = time.monotonic()
    seen: list[list[float]] = []
    while (share := (spent + time.monotonic() - started) / (60 * settings.minutes)) < 1:
        fading = 0.5 * (1 + math.cos(math.pi * share)) + 1e-3
        for group, rate in zip(optimiser.param_groups, rates, strict=True):
            group["lr"] = rate * min(1, (step + 1) / settings.warm_steps) * fading
        batch = mouths.draw(settings.mouths)
        waves, labels = speech.batch(settings.speech)
        with torch.no_grad():
            bands = front_end(
                torch.from_numpy(np.concatenate([batch.waves, waves])), CONTEXT, augment=True
            )
        choices, weights = zip(*settings.ahead, strict=True)
        ahead = draw.choices(choices, weights)[0]
        first = draw.randrange(config.period)
        trunk.train()
        with torch.autocast("cpu", torch.bfloat16):
            rows, last = trunk.rows(bands, ahead, first, settings.phones_pull)
            with torch.no_grad():
                whole, _ = teacher.rows(bands, None, draw.randrange(WHISPER_ROWS - ROWS))
        # The mouth reads the last layer as the phones make it.
        told = trunk.told(
            weakened(rows[: settings.mouths], settings.mouth_pull),
            last[: settings.mouths].detach(),
            live=ahead == LIVE_AHEAD,
        )
        heard = trunk.phones(last[settings.mouths :])
        lips_loss = mouth_loss(
            told,
            torch.from_numpy(batch.targets),
            torch.from_numpy(batch.clip),
            settings,
        )
        target = torch.from_numpy(labels.astype(np.int64))
        phone_loss = phones_loss(heard, target, lips, settings.smoothing)
        missed = (rows - whole).square().mean()
        loss = lips_loss + settings.phones_share * phone_loss + settings.rows_share * missed
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(trunk.parameters(), 1.0)
        optimiser.step()
        step += 1
        decay = min(settings.ema, (1 + step) / (10 + step))
        with torch.no_grad():
            for kept, new in zip(mean.parameters(), trunk.parameters(), strict=True):
                kept.lerp_(new, 1 - decay)
        right = (heard.argmax(-1) == target).float().mean().item()
        seen.append([lips_loss.item(), phone_loss.item(), missed.item(), right])
        now = time.monotonic()
        if now - logged > 60:
            values = " ".join(f"{value:.3f}" for value in np.mean(seen, axis=0))
            print(
                f"{share * settings.minutes:.1f} min step {step}: mouth, phones, rows,"
                f" phones right {values}",
                flush=True,
            )
            logged, seen = now, []
        if now - saved > settings.report_minutes * 60:
            _save(checkpoint, trunk, mean, optimiser, step, spent + now - started)
            print(report(mean), flush=True)
            saved = now
    _save(checkpoint, trunk, mean, optimiser, step, 60 * settings.minutes)
    print(report(mean), flush=True)
    return mean


def _save(
    path: Path, trunk: Trunk, mean: Trunk, optimiser: torch.optim.Optimizer, step: int, spent: float
) -> None:
    draft = path.with_suffix(".draft")
    state = {"trunk": trunk.state_dict(), "mean": mean.state_dict(), "step": step, "spent": spent}
    config = asdict(trunk.config)
    torch.save({**state, "optimiser": optimiser.state_dict(), "config": config}, draft)
    draft.replace(path)
