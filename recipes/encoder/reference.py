"""The phones of the test clips as a small file, so that the benchmark needs no aligner."""

from __future__ import annotations

import json
from itertools import groupby
from pathlib import Path

import numpy as np
import soundfile

from elocute.encoders.phones_and_visemes import PHONES
from recipes.encoder.evaluate import Utterance
from recipes.encoder.natural import PAD_S
from recipes.encoder.store import RATE, load_shard


def write_reference(work: Path, names: list[str], path: Path) -> None:
    """JSON: per clip its file, speaker, language and run-lengths of phones at 50 Hz."""
    pad = round(PAD_S * 100)
    clips = []
    for name in names:
        shard = load_shard(work, name)
        for item in shard.items:
            labels = np.asarray(shard.item_labels(item))[pad::2]
            runs = [f"{PHONES[k]}{len(list(run))}" for k, run in groupby(labels)]
            clips.append(
                {
                    "path": item.path,
                    "speaker": item.speaker,
                    "source": item.source,
                    "language": item.language,
                    "phones": " ".join(runs),
                }
            )
    clips.sort(key=lambda clip: clip["path"])
    lines = ",\n".join(json.dumps(clip, ensure_ascii=False) for clip in clips)
    path.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def read_reference(path: Path, speech: Path) -> list[Utterance]:
    """Test clips with sound from the folder `speech`."""
    utterances = []
    for clip in json.loads(path.read_text(encoding="utf-8")):
        samples, rate = soundfile.read(speech / clip["path"], dtype="float32")
        if rate != RATE:
            raise ValueError(f"{clip['path']}: {rate} Hz, not {RATE}")
        runs = [
            (run.rstrip("0123456789"), run.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ"))
            for run in clip["phones"].split()
        ]
        labels = np.concatenate([np.full(int(n), PHONES.index(phone)) for phone, n in runs])
        utterances.append(
            Utterance(
                clip["speaker"],
                clip["source"],
                clip["language"],
                samples,
                labels[: -(-len(samples) // 320)],
            )
        )
    return utterances
