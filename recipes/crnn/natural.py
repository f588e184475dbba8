"""Natural recordings with simulated motion: what makes a model ready for real voices."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import numpy as np
import soundfile

from elocute.corpus.shards import ShardWriter
from elocute.corpus.word_clip import SENTENCE, WordClip
from elocute.head.builtin import load_builtin_head
from elocute.models.model_shapes import to_shapes
from elocute.motion.motion import Motion
from recipes.corpus.natural import aligned_phones, chosen_recordings
from recipes.crnn.simulation import FPS, simulate
from recipes.encoder.store import RATE

VALIDATION_SHARE = 0.1


def add_natural(writer: ShardWriter, basis: Motion, sounds: Path, work: Path) -> None:
    """Training speakers of the encoder's shards in `work`, a tenth of them for validation."""
    names = load_builtin_head().expression_names
    chosen = chosen_recordings(work)
    for number, (shard, item) in enumerate(chosen):
        speaker = "n-" + re.sub(r"\W+", "-", item.speaker or item.path.split("__")[0])
        share = int(hashlib.sha256(speaker.encode()).hexdigest()[:8], 16) / 0xFFFFFFFF
        part = "validation" if share < VALIDATION_SHARE else "train"
        samples = shard.samples(item)
        duration_s = len(samples) / RATE
        weights = simulate(aligned_phones(shard.item_labels(item)), duration_s, "plain")
        parameters = to_shapes(weights, names, basis.head.expression_basis)
        name = f"{speaker}/{number:06}.flac"
        (sounds / speaker).mkdir(parents=True, exist_ok=True)
        soundfile.write(sounds / name, np.clip(samples, -1, 1), RATE, subtype="PCM_16")
        end_s = len(parameters) / FPS
        writer.add(
            WordClip(
                f"n{number:06}",
                SENTENCE,
                speaker,
                speaker,
                part,
                name,
                0.0,
                end_s,
                FPS,
                parameters,
            )
        )
    print(f"natural speech: {len(chosen)} clips", flush=True)
