"""The experiments of in the wild 2019, section 6.4, on shards."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from elocute.audio.noise import babble, white_noise, with_noise
from elocute.audio.waveform import Waveform
from elocute.capture.blendshapes.basis_comparison import (
    Basis,
    Projection,
    project,
    strongest_shapes,
)
from elocute.corpus.corpus_store import Corpus
from elocute.corpus.shards import Shards
from elocute.corpus.word_clip import SENTENCE
from elocute.errors import AudioError, CorpusError
from elocute.evaluation.concordance import Figures, figures
from elocute.networks.crnn import Crnn, SharedCrnn
from elocute.training.crnn.config import CrnnTrainConfig
from elocute.training.crnn.export import export_crnn
from elocute.training.crnn.feature_cache import CachedClip, FeatureCache, at_rate, clip_features
from elocute.training.crnn.fit import TrainedCrnn, fit, predict_clips
from elocute.training.crnn.loss import explained_shares
from elocute.training.crnn.training_data import select_training_data
from elocute.training.training_log import Report

Array = NDArray[np.float32]
MODEL = "model.onnx"
HELD_OUT = 10  # one word in so many is kept from training, as 50 of 500
TRAININGS = ("speaker", "word", "mse")
PEOPLE = {
    "speaker": "other speakers, the same words",
    "word": "other speakers, other words",
    "mse": "as the first, mean squared error",
}


def shares_of(shards: Shards) -> Array:
    """(parameter,) of the variance, as the loss weighs them."""
    return explained_shares(torch.from_numpy(shards.basis.head.expression_basis)).numpy()


def held_out_words(words: Sequence[str]) -> tuple[str, ...]:
    """One word in ten, the same whatever else is there: chosen by a hash."""
    order = sorted({w for w in words if w != SENTENCE}, key=_hash)
    return tuple(sorted(order[: max(1, len(order) // HELD_OUT)]))


def _hash(word: str) -> str:
    return hashlib.sha256(word.encode()).hexdigest()


def rows_of(heard: FeatureCache, training: str) -> dict[str, list[CachedClip]]:
    """Rows of each split for one of TRAININGS. Raises CorpusError where a split is empty.

    "word" learns from words that are judged by nobody, and is judged on the others; clips of
    whole sentences are left out of it, as they hold words of both.
    """
    parts = {part: heard.select(part) for part in ("train", "validation", "test")}
    if training == "word":
        held = set(held_out_words([row.word for row in heard.clips]))
        parts = {
            part: [r for r in rows if r.word != SENTENCE and (r.word in held) != (part == "train")]
            for part, rows in parts.items()
        }
    for part, rows in parts.items():
        if not rows:
            raise CorpusError.about(
                "shards", found=f"no clip in {part} ({PEOPLE[training]})", allowed="one or more"
            )
    return parts


def train_one(
    shards: Shards,
    heard: FeatureCache,
    training: str,
    config: CrnnTrainConfig,
    folder: Path,
    report: Report | None = None,
) -> TrainedCrnn:
    """One training, resumed from `folder` where it began before; its model is left there."""
    folder.mkdir(exist_ok=True)
    rows = rows_of(heard, training)
    loss = "mse" if training == "mse" else config.loss
    data = select_training_data(
        heard, shards.basis.head.expression_basis, rows["train"], rows["validation"]
    )
    trained = fit(data, replace(config, loss=loss), folder, resume=True, report=report)
    export_crnn(trained, shards.basis, folder / MODEL, shards.note)
    return trained


def judge(
    trained: TrainedCrnn, heard: FeatureCache, training: str, shares: Array
) -> dict[str, Figures]:
    """Validation beside test."""
    rows = rows_of(heard, training)
    return {
        part: figures(*predict_clips(trained.network, heard, rows[part]), shares)
        for part in ("validation", "test")
    }


def judge_noise(
    network: Crnn, shards: Shards, heard: FeatureCache, kind: str, snr_db: float, shares: Array
) -> Figures:
    """The test clips with white noise or babble under them."""

    def noisy(sound: Waveform) -> Waveform:
        count = len(sound.samples)
        under = white_noise(count, 0) if kind == "white" else babble(sound, 0)
        try:
            return with_noise(sound, under, -snr_db)
        except AudioError:  # digital silence has no level to set noise against
            return sound

    wanted = {row.clip for row in heard.select("test")}
    predicted, true = [], []
    shared = SharedCrnn(network)
    for clip in shards.clips("test"):
        if clip.clip not in wanted:
            continue
        values, first, targets = clip_features(shards, clip, heard.fps, noisy)
        row = CachedClip(
            clip.clip, clip.word, clip.speaker, "test", 0, len(values), 0, len(targets), first
        )
        with torch.no_grad():
            starts = torch.from_numpy(heard.starts(row))[None]
            predicted.append(shared(torch.from_numpy(values)[None], starts)[0][0].numpy())
        true.append(targets)
    return figures(predicted, true, shares)


def judge_sentences(
    corpus: Corpus,
    names: Sequence[str],
    basis: Array,
    fps: float,
    shares: Array,
    predict: Callable[[Waveform], Array],
) -> Figures:
    """Continuous speech: clips of a corpus, their true motion projected onto the basis."""
    flat = basis.reshape(len(basis), -1).astype(np.float64)
    if flat.shape[1] != corpus.vertex_count * 3:
        raise CorpusError.about(
            corpus.folder,
            found=f"{corpus.vertex_count} vertices",
            allowed=f"{flat.shape[1] // 3}, as the basis has",
        )
    gram = flat @ flat.T
    inverse = np.linalg.inv(gram + 1e-9 * np.trace(gram) / len(gram) * np.eye(len(gram)))
    onto = (inverse @ flat).T
    predicted, true = [], []
    for name in names:
        moved = corpus.displacements(name)
        wanted = (moved.reshape(len(moved), -1) @ onto).astype(np.float32)
        wanted = at_rate(wanted, corpus.fps, fps)
        found = predict(corpus.sound(name))
        count = min(len(found), len(wanted))
        predicted.append(found[:count])
        true.append(wanted[:count])
    return figures(predicted, true, shares)


def compare_bases(
    corpus: Corpus, names: Sequence[str], speech: Array, arkit: Array
) -> list[Projection]:
    """Section 6.3: mean distance left of clips in the speech blendshapes, in all ARKit shapes,
    and in as many ARKit shapes as there are speech blendshapes, the best for these clips."""
    chosen = arkit[strongest_shapes(corpus, names, arkit, len(speech))]
    bases = [
        Basis("speech", speech),
        Basis("arkit", arkit),
        Basis(f"arkit best {len(chosen)}", chosen),
    ]
    return project(corpus, names, bases)
