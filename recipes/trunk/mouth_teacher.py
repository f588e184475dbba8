"""The mouth's head, taught on what other heads tell of voices that nobody filmed.

Few people's mouths were tracked with their sound. The published encoder, which hears the whole of
a sound, follows strangers better than the trunk does. So small heads that look both ways are
taught on the tracked mouths, through three layers of it; what they tell of many readers is a third
source of mouths for the trunk's own heads, that of files and that of live streams. Every row is
made once and kept, and the trunk stays as it is but for those heads.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from elocute.array_types import Float32Array, Float64Array
from recipes.encoder.augment import Augmenter
from recipes.trunk.fit import FitSettings, mouth_loss, published
from recipes.trunk.mouths import FIELDS, ROW_SAMPLES, MouthClip
from recipes.trunk.network import CONTEXT, LIVE_AHEAD, Trunk, TrunkConfig
from recipes.trunk.spectrum import BatchLogMel

LAYERS = (2, 3, 4)  # of the published encoder
TEACHERS = ((3,), (3,), LAYERS)  # the layers that each head of the teacher reads
TEACHER_STEPS, STEPS = 600, 750
RATE, DECAY, WARM, EMA = 2e-3, 2e-2, 0.15, 0.995
PIECE_ROWS, SHARED_ROWS = 1300, 50  # what the encoder hears at once, less the sound around it
REST_ROWS = 10
AHEADS, ANY_AHEAD = (4, 2, 25), (2, 2, 4, 4, 4, 25)
LIVE_AHEADS = (LIVE_AHEAD,)
AUGMENTED_MOST = 50 * 16_000  # samples

RowsF16 = NDArray[np.float16]
Heard = tuple[RowsF16, ...]


@dataclass(frozen=True, eq=False)
class HeardMouth:
    """Versions of what a network hears in a recording, (row, value) each, and the mouth in it."""

    versions: Heard
    targets: Float32Array
    known: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Source:
    """Recordings of which a batch has `count` stretches of `rows`, with a share of the loss."""

    clips: Sequence[HeardMouth]
    count: int
    rows: int
    share: float
    often: Float64Array | None = None

    def draw(self, chance: np.random.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """(count, row, value) heard, (count, row, 7) targets and (count, row) numbers of clips."""
        width = self.clips[0].versions[0].shape[1]
        heard = np.zeros((self.count, self.rows, width), np.float32)
        targets = np.zeros((self.count, self.rows, len(FIELDS) + 1), np.float32)
        clip = np.full((self.count, self.rows), -1)
        for number, chosen in enumerate(chance.choice(len(self.clips), self.count, p=self.often)):
            one = self.clips[chosen]
            begin = int(chance.integers(0, max(1, len(one.known) - self.rows + 1)))
            stretch = slice(begin, begin + self.rows)
            known = one.known[stretch]
            version = one.versions[chance.integers(len(one.versions))]
            heard[number, : len(known)] = version[stretch]
            targets[number, : len(known)] = one.targets[stretch]
            clip[number, : len(known)] = np.where(known, number, -1)
        return torch.from_numpy(heard), torch.from_numpy(targets), torch.from_numpy(clip)


class BothWays(nn.Module):
    """A head of the teacher: convolutions that see 0.2 s on both sides."""

    def __init__(self, width: int, channels: int = 64) -> None:
        super().__init__()
        self.enter, self.leave = nn.Linear(width, channels), nn.Linear(channels, len(FIELDS) + 1)
        self.layers = nn.ModuleList(
            nn.Conv1d(channels, channels, 3, dilation=far, padding=far) for far in (1, 1, 2, 2, 4)
        )
        self.drop_rows, self.dropout = nn.Dropout(0.3), nn.Dropout(0.15)

    def forward(self, rows: Tensor) -> Tensor:
        x = self.dropout(torch.relu(self.enter(self.drop_rows(rows)))).transpose(1, 2)
        for layer in self.layers:
            x = x + self.dropout(torch.relu(layer(x)))
        return self.leave(x.transpose(1, 2))


class Teacher:
    """Several heads on the published encoder, whose mean is what they tell."""

    def __init__(self, whisper: Path) -> None:
        self._encoder = published(TrunkConfig(mouth_layer=max(LAYERS)), whisper)
        self._front_end = BatchLogMel(0)
        self._heads: list[tuple[slice, nn.Module]] = []

    def hear(self, samples: Float32Array) -> RowsF16:
        """(row, value) of the layers beside one another, at places of 30 s as it learned them."""
        parts = []
        for begin in range(0, len(samples) // ROW_SAMPLES, PIECE_ROWS):
            first = max(0, begin - SHARED_ROWS)
            piece = samples[first * ROW_SAMPLES : (begin + PIECE_ROWS + SHARED_ROWS) * ROW_SAMPLES]
            heard = hear(self._encoder, self._front_end, piece, None, LAYERS)
            parts.append(heard[begin - first :][:PIECE_ROWS])
        return np.concatenate(parts)

    def learn(self, sources: Sequence[Source], seed: int) -> None:
        """From sources whose recordings are as `hear` gives them."""
        width = self._encoder.config.width
        for number, layers in enumerate(TEACHERS):
            first = LAYERS.index(layers[0]) * width
            part = slice(first, first + len(layers) * width)
            torch.manual_seed(seed + number)
            head = BothWays(len(layers) * width)

            def told(rows: Tensor, part: slice = part, head: nn.Module = head) -> Tensor:
                return head(rows[..., part])

            teach(head, told, sources, TEACHER_STEPS, seed + number)
            self._heads.append((part, head))

    @torch.no_grad()
    def tell(self, heard: RowsF16) -> Float32Array:
        """(row, 7) targets of a recording as `hear` gives it."""
        rows = torch.from_numpy(heard.astype(np.float32))[None]
        told = [head(rows[..., part])[0] for part, head in self._heads]
        mean = torch.stack(told).mean(dim=0)
        mean[:, -1] = torch.sigmoid(mean[:, -1])
        return mean.numpy()


@torch.no_grad()
def hear(
    network: Trunk,
    front_end: BatchLogMel,
    samples: Float32Array,
    ahead: int | None,
    layers: Sequence[int],
    *,
    augment: bool = False,
) -> RowsF16:
    """(row, value) after some layers, normalised and beside one another, with rest around."""
    sound = np.pad(samples, REST_ROWS * ROW_SAMPLES)
    found: list[Tensor] = []
    hooks = [
        network.layers[number - 1].register_forward_hook(lambda *given: found.append(given[2]))
        for number in layers
    ]
    with torch.autocast("cpu", torch.bfloat16):
        network.rows(front_end(torch.from_numpy(sound)[None], CONTEXT, augment), ahead)
    for hook in hooks:
        hook.remove()
    normed = [functional.layer_norm(each[0].float(), each.shape[2:]) for each in found]
    return torch.cat(normed, dim=-1)[REST_ROWS:-REST_ROWS].half().numpy()


def teach(
    network: nn.Module,
    told: Callable[[Tensor], Tensor],
    sources: Sequence[Source],
    steps: int,
    seed: int,
) -> None:
    """Teach `network`, by which `told` makes mouths of rows; it ends as the mean of its steps."""
    chance, settings = np.random.default_rng(seed), FitSettings()
    optimiser = torch.optim.AdamW(network.parameters(), RATE, weight_decay=DECAY, betas=(0.9, 0.98))
    plan = torch.optim.lr_scheduler.OneCycleLR(optimiser, RATE, total_steps=steps, pct_start=WARM)
    mean = {name: values.clone() for name, values in network.state_dict().items()}
    network.train()
    for step in range(steps):
        loss = torch.zeros(())
        for source in sources:
            heard, targets, clip = source.draw(chance)
            loss = loss + source.share * mouth_loss(told(heard), targets, clip, settings)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        plan.step()
        decay = min(EMA, (1 + step) / (10 + step))
        for name, values in network.state_dict().items():
            mean[name].lerp_(values, 1 - decay)
    network.load_state_dict(mean)
    network.eval()


@dataclass(frozen=True, eq=False)
class Voice:
    """Somebody who was heard, but not filmed."""

    speaker: str
    samples: Float32Array


class MouthLesson:
    """What a head of the trunk is taught from: people who were filmed, and voices.

    `clean` has the rows that a layer sees ahead in clean sound; elsewhere they are one of `mixed`.
    """

    def __init__(
        self,
        trunk: Trunk,
        augment: Augmenter,
        seed: int,
        clean: Sequence[int],
        mixed: Sequence[int],
    ) -> None:
        self._trunk, self._augment = trunk.eval(), augment
        self._clean, self._mixed = clean, mixed
        self._layers = (trunk.config.mouth_layer, trunk.config.layers)
        self._front_end = BatchLogMel(seed)
        self._chance = np.random.default_rng(seed)

    def filmed(self, clips: Sequence[MouthClip]) -> list[HeardMouth]:
        """As the trunk hears them: clean at each look-ahead, and not."""
        ours = []
        for clip in clips:
            versions = [self._hear(clip.samples, ahead) for ahead in self._clean]
            versions.append(self._hear_augmented(clip.samples, clips))
            ours.append(HeardMouth(tuple(versions), clip.targets, clip.known))
        return ours

    def voiced(self, voices: Sequence[Voice], told: Sequence[Float32Array]) -> list[HeardMouth]:
        """With the teacher's mouths; every other is augmented for the trunk."""
        found = []
        for number, (voice, targets) in enumerate(zip(voices, told, strict=True)):
            if number % 2 and len(voice.samples) < AUGMENTED_MOST:
                heard = self._hear_augmented(voice.samples, voices)
            else:
                heard = self._hear(voice.samples, self._any_ahead())
            found.append(HeardMouth((heard,), targets, np.ones(len(targets), np.bool_)))
        return found

    def _any_ahead(self) -> int:
        return int(self._chance.choice(self._mixed))

    def _hear(self, samples: Float32Array, ahead: int, augment: bool = False) -> RowsF16:
        return hear(self._trunk, self._front_end, samples, ahead, self._layers, augment=augment)

    def _hear_augmented(
        self, samples: Float32Array, others: Sequence[MouthClip] | Sequence[Voice]
    ) -> RowsF16:
        other = others[int(self._chance.integers(len(others)))]
        behind = np.resize(other.samples, len(samples))
        return self._hear(self._augment(samples, behind), self._any_ahead(), augment=True)


def spread_over_speakers(voices: Sequence[Voice]) -> Float64Array:
    """How often each is drawn: by its length, who speaks much less often for it."""
    total = Counter[str]()
    for voice in voices:
        total[voice.speaker] += len(voice.samples)
    often = np.array([len(one.samples) / total[one.speaker] ** 0.5 for one in voices])
    return often / often.sum()


def teach_mouth(
    trunk: Trunk,
    whisper: Path,
    words: Sequence[MouthClip],
    sentences: Sequence[MouthClip],
    voices: Sequence[Voice],
    augment: Augmenter,
    seed: int,
) -> None:
    """Give a trunk other heads for the mouth; its layers and its phones stay as they are."""
    teacher = Teacher(whisper)
    filmed = [
        [HeardMouth((teacher.hear(clip.samples),), clip.targets, clip.known) for clip in clips]
        for clips in (words, sentences)
    ]
    teacher.learn([Source(filmed[0], 22, 64, 0.7), Source(filmed[1], 10, 150, 0.3)], seed)
    told = [teacher.tell(teacher.hear(voice.samples)) for voice in voices]
    often, width = spread_over_speakers(voices), trunk.config.width
    for head, live in ((trunk.mouth, False), (trunk.live_mouth, True)):
        clean, mixed = (LIVE_AHEADS, LIVE_AHEADS) if live else (AHEADS, ANY_AHEAD)
        lesson = MouthLesson(trunk, augment, seed, clean, mixed)
        sources = [
            Source(lesson.filmed(words), 20, 64, 0.625),
            Source(lesson.filmed(sentences), 8, 150, 0.25),
            Source(lesson.voiced(voices, told), 12, 200, 1.0, often),
        ]

        def answer(rows: Tensor, live: bool = live) -> Tensor:
            return trunk.told(rows[..., :width], rows[..., width:], live=live)

        teach(head, answer, sources, STEPS, seed)
