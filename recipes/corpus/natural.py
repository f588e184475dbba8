"""Natural speech for the corpus: aligned recordings, simulated in every style; the real talker."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from itertools import groupby
from pathlib import Path

import numpy as np

from elocute.audio.waveform import Waveform
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import CorpusWriter
from elocute.encoders.phones_and_visemes import PHONES
from recipes.corpus import subjects
from recipes.corpus.faces import Faces
from recipes.encoder.store import LABEL_RATE, RATE, Item, Shard, load_shard

Phones = list[tuple[float, float, str]]
PER_SPEAKER = 6
PER_LONE_SPEAKER = 60  # of the corpora that have one speaker only
SHORTEST_S, LONGEST_S = 1.2, 12.0


def write_natural(writer: CorpusWriter, work: Path, faces: Faces, fps: float) -> None:
    """Training speakers of the encoder's shards in `work`, each clip in one of the styles.

    Only subjects of the training part speak them, so speakers that the encoder was tested on
    stay unheard, and so do the styles of validation and test.
    """
    held_out = {*subjects.VALIDATION, *subjects.TEST}
    styles = [s.style for s in subjects.SUBJECTS if s.style not in held_out]
    chosen = chosen_recordings(work)
    for number, (shard, item) in enumerate(chosen):
        style = styles[number % len(styles)]
        samples = shard.samples(item)
        phones = aligned_phones(shard.item_labels(item))
        sound, name = Waveform(samples, RATE), f"n{number:05}"
        frames = faces.frames(phones, sound, style, name, fps)
        writer.add(Clip(style, name, item.text, sound, frames))
    print(f"natural speech: {len(chosen)} clips", flush=True)


def chosen_recordings(work: Path) -> list[tuple[Shard, Item]]:
    """A few recordings of every speaker, in an order that depends on nothing but their names."""
    names = sorted(p.stem for p in work.glob("*_train_*.json"))
    shards = [load_shard(work, name) for name in names]
    listed = [(shard, item) for shard in shards for item in shard.items]
    listed = [pair for pair in listed if SHORTEST_S <= pair[1].frames / LABEL_RATE <= LONGEST_S]
    listed.sort(key=lambda pair: hashlib.sha256(pair[1].path.encode()).hexdigest())
    count: dict[str, int] = {}
    chosen = []
    for shard, item in listed:
        who = item.speaker or item.path.split("__")[0]
        lone = item.source in ("kathleen_en", "kerstin_de", "nathalie_nl")
        count[who] = count.get(who, 0) + 1
        if count[who] <= (PER_LONE_SPEAKER if lone else PER_SPEAKER):
            chosen.append((shard, item))
    return chosen


def aligned_phones(labels: np.ndarray) -> Phones:
    phones, at = [], 0
    for label, run in groupby(np.minimum(labels, len(PHONES))):
        count = len(list(run))
        if label < len(PHONES):
            phones.append((at / LABEL_RATE, (at + count) / LABEL_RATE, PHONES[label]))
        at += count
    return phones


def write_grid(writer: CorpusWriter, folder: Path, faces: Faces) -> None:
    """The real talker's clips, development clips left out."""
    from elocute.corpus.importers.grid import grid_clips

    held_out = set((folder / "dev.txt").read_text(encoding="utf-8").split())
    residuals = []
    for clip, residual in grid_clips(folder / "clips", leave_out=held_out, fps=60.0):
        frames = faces.of_weights(np.asarray(clip.frames), clip.subject)
        writer.add(replace(clip, frames=frames))
        residuals.append(residual)
    print(
        f"real talker: {len(residuals)} clips, residual {np.median(residuals):.2f} mm", flush=True
    )
