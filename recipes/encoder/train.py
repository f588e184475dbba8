"""Training of the phone network: one process mixes speech, the other learns."""

from __future__ import annotations

import math
import multiprocessing
import random
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import soundfile
import torch
from torch.nn import functional

from elocute.audio.phones_and_visemes import PHONES
from elocute.networks.phone_net import PhoneNet, PhoneNetConfig
from recipes.encoder.augment import CHUNK_FRAMES, Augmenter, silence_gap, stretch
from recipes.encoder.fast import fast_logits
from recipes.encoder.spectrum import BatchFrontEnd
from recipes.encoder.store import HOP, UNKNOWN, Shard, load_shard

# How often each kind of speech is heard; speakers count for more than minutes.
MIX = {
    "espeak": 0.20,
    "flite": 0.05,
    "festival": 0.05,
    "speechocean": 0.32,
    "kathleen_en": 0.11,
    "wakeword": 0.09,
    "fsdd": 0.03,
    "kerstin_de": 0.07,
    "nathalie_nl": 0.05,
    "precise": 0.04,
    "readers": 0.25,
    "nothing": 0.06,
    "voices": 0.04,
}
NOTHING_SHARE = 0.02
LIPS = ("P", "B", "M", "F", "V")


@dataclass(frozen=True)
class TrainConfig:
    minutes: float = 75.0
    batch: int = 12
    learning_rate: float = 2e-3
    weight_decay: float = 1e-2
    lip_weight: float = 2.0
    smoothing: float = 0.05
    ema: float = 0.999
    seed: int = 7
    checkpoint_s: float = 120.0


class Mixer:
    """Draws augmented chunks of CHUNK_FRAMES labels from all shards of a folder."""

    def __init__(self, shards: list[Shard], noises: list[np.ndarray], seed: int) -> None:
        self.pools: dict[str, list[tuple[Shard, int]]] = {}
        for shard in shards:
            for index, item in enumerate(shard.items):
                self.pools.setdefault(item.source, []).append((shard, index))
        self.draw = random.Random(seed)
        self.augment = Augmenter(noises, seed + 1)
        self.sources = [name for name in MIX if name in self.pools]

    def _pick(self) -> tuple[np.ndarray, np.ndarray]:
        shard, index = self.draw.choice(self.pools[self.source])
        item = shard.items[index]
        return shard.samples(item), shard.item_labels(item)

    def chunk(self) -> tuple[np.ndarray, np.ndarray]:
        self.source = self.draw.choices(self.sources, [MIX[name] for name in self.sources])[0]
        if self.draw.random() < NOTHING_SHARE:  # a room where nobody speaks
            return self.augment(*self._nothing()), np.zeros(CHUNK_FRAMES, np.uint8)
        rate = self.draw.uniform(0.82, 1.22)
        need = int(CHUNK_FRAMES * rate) + 2
        sounds, labels, have = [], [], 0
        while have < need:
            sound, label = silence_gap(self.draw) if self.draw.random() < 0.15 else self._pick()
            if have == 0 and len(label) > need + 10:
                cut = self.draw.randrange(len(label) - need)
                sound, label = sound[cut * HOP :], label[cut:]
            sound = sound * 10 ** (self.draw.uniform(-6, 6) / 20)
            sounds.append(sound)
            labels.append(label)
            have += len(label)
        sound, label = stretch(np.concatenate(sounds), np.concatenate(labels), rate)
        return self.augment(sound, self._babble(len(sound))), label

    def _nothing(self) -> tuple[np.ndarray, np.ndarray]:
        count = CHUNK_FRAMES * HOP
        return np.zeros(count, np.float32), self.augment.white(count)

    def _babble(self, count: int) -> np.ndarray:
        """A few other people at once."""
        total = np.zeros(count, np.float32)
        if self.draw.random() < 0.2:
            for _ in range(4):
                voice, _ = self._pick()
                total += np.resize(voice, count)
        else:
            total += self.augment.white(count)
        return total

    def batch(self, size: int) -> tuple[np.ndarray, np.ndarray]:
        chunks = [self.chunk() for _ in range(size)]
        return np.stack([c[0] for c in chunks]), np.stack([c[1][::2] for c in chunks])


def _feed(
    queue, folder: Path, names: list[str], noise_paths: list[Path], config: TrainConfig, step: int
):
    shards = [load_shard(folder, name) for name in names]
    mixer = Mixer(shards, read_noises(noise_paths), config.seed + step)  # new draws on resuming
    while True:
        queue.put(mixer.batch(config.batch))


def read_noises(paths: list[Path]) -> list[np.ndarray]:
    return [soundfile.read(path, dtype="float32")[0] for path in paths]


def train(
    folder: Path,
    names: list[str],
    noise_paths: list[Path],
    checkpoint: Path,
    config: TrainConfig,
    net_config: PhoneNetConfig,
) -> None:
    """Train for `config.minutes` of wall time, resuming from `checkpoint` where it exists."""
    torch.manual_seed(config.seed)
    net, ema = PhoneNet(net_config), PhoneNet(net_config)
    optimiser = torch.optim.AdamW(
        net.parameters(), config.learning_rate, betas=(0.9, 0.98), weight_decay=config.weight_decay
    )
    step, spent = 0, 0.0
    if checkpoint.exists():
        state = torch.load(checkpoint, weights_only=True)
        net.load_state_dict(state["net"])
        ema.load_state_dict(state["ema"])
        optimiser.load_state_dict(state["optimiser"])
        step, spent = state["step"], state["spent"]
    else:
        ema.load_state_dict(net.state_dict())
    weights = torch.ones(len(PHONES))
    weights[[PHONES.index(p) for p in LIPS]] = config.lip_weight
    front_end = BatchFrontEnd(CHUNK_FRAMES, config.seed + step)
    queue = multiprocessing.get_context("spawn").Queue(maxsize=6)
    feeder = multiprocessing.get_context("spawn").Process(
        target=_feed, args=(queue, folder, names, noise_paths, config, step), daemon=True
    )
    feeder.start()
    saved = logged = started = time.monotonic()
    heard = right = 0
    while True:
        now = time.monotonic()
        elapsed = spent + now - started
        share = elapsed / (config.minutes * 60)
        if share >= 1:
            break
        rate = (
            config.learning_rate * min(1, (step + 1) / 60) * 0.5 * (1 + math.cos(math.pi * share))
        )
        for group in optimiser.param_groups:
            group["lr"] = rate + 1e-6
        waves, labels = queue.get()
        target = torch.from_numpy(labels.astype(np.int64))
        with torch.no_grad():
            features = front_end(torch.from_numpy(waves), augment=True)
        net.train()
        logits = fast_logits(net, features)
        loss = functional.cross_entropy(
            logits.transpose(1, 2),
            target,
            weights,
            ignore_index=UNKNOWN,
            label_smoothing=config.smoothing,
        )
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        optimiser.step()
        step += 1
        decay = min(config.ema, (1 + step) / (10 + step))
        with torch.no_grad():
            for mine, other in zip(
                ema.state_dict().values(), net.state_dict().values(), strict=True
            ):
                if mine.is_floating_point():
                    mine.lerp_(other, 1 - decay)
                else:
                    mine.copy_(other)
        heard, right = heard + target.numel(), right + int((logits.argmax(-1) == target).sum())
        if now - logged > 30:
            print(
                f"{elapsed / 60:.1f} min step {step} loss {loss.item():.3f} phone accuracy "
                f"{right / heard:.3f} queue {queue.qsize()}",
                flush=True,
            )
            logged, heard, right = now, 0, 0
        if now - saved > config.checkpoint_s:
            _save(checkpoint, net, ema, optimiser, step, elapsed)
            saved = now
    feeder.terminate()
    _save(checkpoint, net, ema, optimiser, step, config.minutes * 60)


def _save(path: Path, net, ema, optimiser, step: int, spent: float) -> None:
    draft = path.with_suffix(".draft")
    torch.save(
        {
            "net": net.state_dict(),
            "ema": ema.state_dict(),
            "step": step,
            "spent": spent,
            "optimiser": optimiser.state_dict(),
            "config": asdict(net.config),
        },
        draft,
    )
    draft.replace(path)
