"""German and Dutch: the network's own Viterbi alignment against espeak-ng's phones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from elocute.articulation.phones import PHONES
from elocute.audio.front_end import encoder_features

from encoder.natural import list_recordings, read, split_of
from encoder.ship import load_net
from encoder.store import HOP, ShardWriter
from encoder.synthesise import Espeak

SILENCE = PHONES.index("SIL")
WORST = -2.6  # mean log-posterior along the path below which text and sound do not fit


def viterbi(log_posteriors: np.ndarray, phones: list[int]) -> tuple[np.ndarray, float]:
    """(frame,) phone indices of the best path through `phones` in order, and its mean score.

    Each phone lasts at least one frame; silence may come before, after and between any two.
    """
    states = [SILENCE]
    for phone in phones:
        states += [phone, SILENCE]
    scores = log_posteriors[:, states]
    frames, count = scores.shape
    optional = np.array([index % 2 == 0 for index in range(count)])
    total = np.full(count, -np.inf)
    total[:2] = scores[0, :2]
    came = np.zeros((frames, count), np.int8)
    for frame in range(1, frames):
        stay = total
        step = np.concatenate([[-np.inf], total[:-1]])
        skip = np.concatenate([[-np.inf, -np.inf], total[:-2]])
        skip[optional] = -np.inf  # only silences may be skipped
        options = np.stack([stay, step, skip])
        came[frame] = options.argmax(axis=0)
        total = options.max(axis=0) + scores[frame]
    state = count - 1 if total[-1] > total[-2] else count - 2
    best = total[state]
    path = np.empty(frames, int)
    for frame in range(frames - 1, -1, -1):
        path[frame] = states[state]
        state -= came[frame, state]
    return path, float(best / frames)


def realigned_shards(data: Path, work: Path, checkpoint: Path) -> None:
    """Write train and test shards of the German and the Dutch recordings."""
    net, engine = load_net(checkpoint), Espeak()
    writers = {"train": ShardWriter(), "test": ShardWriter()}
    refused = 0
    for recording in list_recordings(data):
        if recording.language not in ("de", "nl"):
            continue
        samples = read(recording.path)
        _, phones = engine.speak(recording.text, recording.language, 170, 50, 50)
        names = [PHONES.index(p) for _, _, p in phones if p != "SIL"]
        with torch.no_grad():
            logits = net(torch.from_numpy(encoder_features(samples)[None]))[0]
        posteriors = torch.log_softmax(logits, -1).numpy()
        if not names or len(names) * 1.5 > len(posteriors):
            refused += 1
            continue
        path, score = viterbi(np.maximum(posteriors, -8), names)
        if score < WORST:
            refused += 1
            continue
        writers[split_of(recording)].add(
            samples[: len(path) * 2 * HOP], np.repeat(path, 2), speaker=recording.speaker,
            source=recording.source, language=recording.language, text=recording.text,
        )  # fmt: skip
    for split, writer in writers.items():
        print(split, len(writer.items), "realigned;", refused, "refused in all", flush=True)
        if writer.items:
            writer.save(work, f"{'test' if split == 'test' else 'nat'}_german_dutch")
