"""The experiments of in the wild 2019, section 6.4, on shards.

`study_wild` is all of them in one call.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from elocute.animation import animate
from elocute.audio.noise import babble, white_noise, with_noise
from elocute.audio.waveform import Waveform
from elocute.capture.blendshapes.basis_comparison import (
    BasisProjection,
    ReconstructionErrors,
    reconstruction_errors,
    strongest_shapes,
)
from elocute.corpus.corpus_store import Corpus
from elocute.corpus.shards import Shards
from elocute.corpus.word_clip import SENTENCE
from elocute.errors import AudioError, CorpusError, InputError
from elocute.evaluation.concordance import ConcordanceScore, score_concordance
from elocute.evaluation.tracked_mouth_scores import MeanMouthScore, evaluate_tracked_mouths
from elocute.head.builtin import load_builtin_head
from elocute.models.crnn_network import JOINS, CrnnNetwork, stream_weights
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.mouth_measures import measure_mouth
from elocute.networks.crnn import Crnn, SharedCrnn
from elocute.one_line_repr import one_line
from elocute.training.crnn.config import CrnnTrainConfig
from elocute.training.crnn.export import export_crnn
from elocute.training.crnn.feature_cache import (
    CachedClip,
    FeatureCache,
    at_rate,
    cache_features,
    clip_features,
)
from elocute.training.crnn.fit import TrainedCrnn, fit, predict_clips
from elocute.training.crnn.loss import explained_shares
from elocute.training.crnn.training_data import select_training_data
from elocute.training.training_log import Report

Array = NDArray[np.float32]
MODEL = "model.onnx"
HELD_OUT = 10  # one word in so many is kept from training, as 50 of 500
TRAININGS = ("speaker", "word", "mse")
PAPER = {"speaker": 0.621, "word": 0.502, "sentences": 0.463}  # µ28 on test, Table 2
NOISES = ("white", "babble")
SNRS_DB = (0.0, 10.0, 20.0)
TRAINING_CONTENTS = {
    "speaker": "other speakers, the same words",
    "word": "other speakers, other words",
    "mse": "as the first, mean squared error",
}


@dataclass(frozen=True, eq=False)
class WildStudy:
    """What came of the experiments.

    concordance  ρc of each training and part, of noise under the test clips, of sentences
    bases        what speech blendshapes and ARKit's shapes leave of the sentences, mm
    talker       a real talker: the recurrent model beside VOCA and the rules
    missing      clips that could not be heard, with the reason
    """

    concordance: dict[str, ConcordanceScore]
    bases: list[ReconstructionErrors]
    talker: dict[str, MeanMouthScore]
    missing: tuple[tuple[str, str], ...]

    __repr__ = one_line

    def record(self) -> dict[str, Any]:
        """For reports; what is not available is None."""
        return {
            "paper": PAPER,
            "concordance": {name: found.record() for name, found in self.concordance.items()},
            "bases_mm": {
                found.name: {"components": found.components, "mean_mm": found.mean_mm}
                for found in self.bases
            },
            "talker": {
                name: {
                    key: value if value == value else None for key, value in asdict(found).items()
                }
                for name, found in self.talker.items()
            },
        }


def study_wild(
    shards: Shards,
    folder: Path,
    config: CrnnTrainConfig | None = None,
    *,
    trainings: Sequence[str] = TRAININGS,
    sentences: Corpus | None = None,
    names: Sequence[str] = (),
    talker: Path | None = None,
    talker_names: list[str] | None = None,
    report: Report | None = None,
) -> WildStudy:
    """Train and measure: other speakers, other words, a loss, noise, sentences, bases, a talker.

    folder        there already; each training goes on in FOLDER/NAME where it was left
    trainings     of TRAININGS, "speaker" among them
    sentences     a corpus of continuous speech on the basis's topology; `names` are the clips
    talker        folder of a tracked talker's clips; `talker_names` those that are measured, or all

    Raises InputError for other trainings, CorpusError for shards without a clip in some part.
    """
    check_trainings(trainings)
    config = config or CrnnTrainConfig()
    heard = cache_features(shards, folder, config.fps)
    for name in trainings:
        training_clips(heard, name)
    table, shares = dict[str, ConcordanceScore](), variance_shares(shards)
    for name in trainings:
        trained = train_one(shards, heard, name, config, folder / name, report)
        for part, found in score_training(trained, heard, name, shares).items():
            table[f"{name} {part}"] = found
        if name == "speaker":
            for kind in NOISES:
                for snr in SNRS_DB:
                    found = score_noise(trained.network, shards, heard, kind, snr, shares)
                    table[f"{kind} {snr:.0f} dB"] = found
    model, bases = folder / "speaker" / MODEL, list[ReconstructionErrors]()
    if sentences is not None:
        table |= score_continuous_speech(sentences, names, model, shards)
        bases = compare_with_arkit(sentences, names, shards)
    talking = score_talker(talker, model, talker_names) if talker else {}
    return WildStudy(table, bases, talking, heard.missing)


def check_trainings(names: Sequence[str]) -> None:
    """Raises InputError for trainings without "speaker", or one that there is not."""
    if "speaker" not in names or not set(names) <= set(TRAININGS):
        raise InputError.about(
            f"`trainings` {', '.join(names)}",
            found="speaker is missing, or one is unknown",
            allowed=", ".join(TRAININGS),
        )


def select_sentences(
    corpus: Corpus, shards: Shards, subject: str | None = None, count: int = 50
) -> list[str]:
    """At most `count` clips, evenly taken, of all subjects or of one.

    Raises CorpusError for another topology than the basis's, and for a subject that is not there.
    """
    vertices = shards.basis.head.vertex_count
    if corpus.vertex_count != vertices:
        raise CorpusError.about(
            corpus.folder,
            found=f"{corpus.vertex_count} vertices",
            allowed=f"{vertices}, as the basis has",
        )
    if subject is not None and subject not in corpus.subjects:
        raise CorpusError.about(
            corpus.folder, found=f"no subject {subject}", allowed=", ".join(corpus.subjects)
        )
    names = [entry.name for entry in corpus.entries if subject in (None, entry.subject)]
    return names[:: max(1, len(names) // count)][:count]


def variance_shares(shards: Shards) -> Array:
    """(parameter,) of the variance, as the loss weighs them."""
    return explained_shares(torch.from_numpy(shards.basis.head.expression_basis)).numpy()


def held_out_words(words: Sequence[str]) -> tuple[str, ...]:
    """One word in ten, the same whatever else is there: chosen by a hash."""
    order = sorted({w for w in words if w != SENTENCE}, key=_hash)
    return tuple(sorted(order[: max(1, len(order) // HELD_OUT)]))


def _hash(word: str) -> str:
    return hashlib.sha256(word.encode()).hexdigest()


def training_clips(heard: FeatureCache, training: str) -> dict[str, list[CachedClip]]:
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
                "shards",
                found=f"no clip in {part} ({TRAINING_CONTENTS[training]})",
                allowed="one or more",
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
    rows = training_clips(heard, training)
    loss = "mse" if training == "mse" else config.loss
    data = select_training_data(
        heard, shards.basis.head.expression_basis, rows["train"], rows["validation"]
    )
    trained = fit(data, replace(config, loss=loss), folder, resume=True, report=report)
    export_crnn(trained, shards.basis, folder / MODEL, shards.note)
    return trained


def score_training(
    trained: TrainedCrnn, heard: FeatureCache, training: str, shares: Array
) -> dict[str, ConcordanceScore]:
    """Validation beside test."""
    rows = training_clips(heard, training)
    return {
        part: score_concordance(*predict_clips(trained.network, heard, rows[part]), shares)
        for part in ("validation", "test")
    }


def score_noise(
    network: Crnn, shards: Shards, heard: FeatureCache, kind: str, snr_db: float, shares: Array
) -> ConcordanceScore:
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
    return score_concordance(predicted, true, shares)


def score_sentences(
    corpus: Corpus,
    names: Sequence[str],
    basis: Array,
    fps: float,
    shares: Array,
    predict: Callable[[Waveform], Array],
) -> ConcordanceScore:
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
    return score_concordance(predicted, true, shares)


def compare_bases(
    corpus: Corpus, names: Sequence[str], speech: Array, arkit: Array
) -> list[ReconstructionErrors]:
    """Section 6.3: mean distance left of clips in the speech blendshapes, in all ARKit shapes,
    and in as many ARKit shapes as there are speech blendshapes, the best for these clips."""
    chosen = arkit[strongest_shapes(corpus, names, arkit, len(speech))]
    bases = [
        BasisProjection("speech", speech),
        BasisProjection("arkit", arkit),
        BasisProjection(f"arkit best {len(chosen)}", chosen),
    ]
    return reconstruction_errors(corpus, names, bases)


def score_continuous_speech(
    corpus: Corpus, names: Sequence[str], model: Path, shards: Shards
) -> dict[str, ConcordanceScore]:
    """Sentences with the state going on, and in pieces of 15 frames as the paper does."""
    opened, basis = CrnnNetwork(model), shards.basis.head.expression_basis
    shares = variance_shares(shards)
    return {
        f"sentences {joins}": score_sentences(
            corpus,
            names,
            basis,
            opened.record.fps,
            shares,
            lambda sound, joins=joins: stream_weights(opened, sound, joins),
        )
        for joins in JOINS
    }


def compare_with_arkit(
    corpus: Corpus, names: Sequence[str], shards: Shards
) -> list[ReconstructionErrors]:
    """`compare_bases` with ARKit's shapes of the built-in head; empty on another mesh."""
    head = load_builtin_head()
    if corpus.vertex_count != head.vertex_count:
        return []
    places = [head.expression_names.index(n) for n in ARKIT_NAMES if n in head.expression_names]
    speech = shards.basis.head.expression_basis
    return compare_bases(corpus, names, speech, head.expression_basis[places])


def score_talker(
    folder: Path, model: Path, names: list[str] | None = None
) -> dict[str, MeanMouthScore]:
    """The real talker: the recurrent model beside VOCA and the rules."""
    eye_mm = 1000 * load_builtin_head().eye_distance_m
    found = {}
    for name, chosen in (("crnn", model), ("voca", "voca"), ("articulation", "articulation")):
        found[name], _ = evaluate_tracked_mouths(
            folder,
            lambda sound, chosen=chosen: measure_mouth(animate(sound, model=chosen).motion),
            eye_mm,
            names=names,
        )
    return found
