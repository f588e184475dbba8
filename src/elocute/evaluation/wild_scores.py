"""Scores of the experiments in the wild (Tzirakis et al. 2019, sections 6.3 and 6.4).

A trained network on parts of the shards, under noise and on continuous speech; what was carried
over; bases of shapes; a real talker.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import torch

from elocute.animation import animate
from elocute.array_types import Float32Array
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
from elocute.errors import AudioError, CorpusError
from elocute.evaluation.concordance import ConcordanceScore, score_concordance
from elocute.evaluation.tracked_mouth_scores import GroupScore, evaluate_tracked_mouths
from elocute.evaluation.wild_parts import ExperimentClips
from elocute.head.builtin import load_builtin_head
from elocute.models.crnn_network import JOINS, CrnnNetwork, stream_weights
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.mouth_measures import measure_as_tracked
from elocute.networks.crnn import Crnn, SharedCrnn
from elocute.numerics.ridge import ridge_projection
from elocute.training.crnn.feature_cache import CachedClip, FeatureCache, at_rate, clip_features
from elocute.training.crnn.fit import TrainedCrnn, predict_clips
from elocute.training.crnn.loss import explained_shares

EXACT = ", exact"  # ends the names of rows that are measured against exact parameters


def variance_shares(shards: Shards) -> Float32Array:
    """(parameter,) share of the variance that each parameter explains, as the loss weighs them."""
    return explained_shares(torch.from_numpy(shards.basis.head.expression_basis)).numpy()


def score_training(
    trained: TrainedCrnn,
    features: FeatureCache,
    training: str,
    clips: ExperimentClips,
    known: Mapping[str, Float32Array],
    shares: Float32Array,
) -> dict[str, ConcordanceScore]:
    """Concordance of a trained network on each part: "speaker test", "speaker test, exact" and so
    on.

    training begins the names of the rows. known: exact parameters (frame, parameter) by clip; parts
    without any have no row of them. shares: (parameter,) as for `score_concordance`.
    """
    table = dict[str, ConcordanceScore]()
    for part, rows in clips.measured.items():
        predicted, true = predict_clips(trained.network, features, rows)
        table[f"{training} {part}"] = score_concordance(predicted, true, shares)
        pairs = _exact_pairs(rows, predicted, known)
        if pairs:
            table[f"{training} {part}{EXACT}"] = score_concordance(*pairs, shares)
    return table


def score_carried(
    features: FeatureCache,
    training: str,
    clips: ExperimentClips,
    known: Mapping[str, Float32Array],
    shares: Float32Array,
) -> dict[str, ConcordanceScore]:
    """Concordance of parameters that were carried over with the exact ones: "carried, speaker
    train".

    Arguments are those of `score_training`; only parts that hold clips carried over have a row.
    """
    table = dict[str, ConcordanceScore]()
    for part, rows in {"train": clips.train, **clips.measured}.items():
        carried = [row for row in rows if row.carried]
        pairs = _exact_pairs(carried, [features.parameters(row) for row in carried], known)
        if pairs:
            table[f"carried, {training} {part}"] = score_concordance(*pairs, shares)
    return table


def _exact_pairs(
    rows: Sequence[CachedClip], values: Sequence[Float32Array], known: Mapping[str, Float32Array]
) -> tuple[list[Float32Array], list[Float32Array]] | None:
    """Values of the clips whose exact parameters are known, and those; None for no such clip."""
    matched: list[Float32Array] = []
    true: list[Float32Array] = []
    for row, value in zip(rows, values, strict=True):
        wanted = known.get(row.clip)
        if wanted is None:
            continue
        count = min(len(value), len(wanted))
        matched.append(np.asarray(value[:count]))
        true.append(wanted[:count])
    return (matched, true) if matched else None


def evenly(rows: Sequence[CachedClip], count: int) -> list[CachedClip]:
    """At most so many clips, evenly spaced."""
    places = np.linspace(0, len(rows) - 1, min(count, len(rows))).round().astype(int)
    return [rows[place] for place in places]


def score_noise(
    network: Crnn,
    shards: Shards,
    features: FeatureCache,
    rows: Sequence[CachedClip],
    kind: str,
    snr_db: float,
    shares: Float32Array,
) -> ConcordanceScore:
    """Concordance on clips of the test part with noise, "white" or "babble", under them.

    snr_db: level of the speech over the noise. shares: (parameter,) as for `score_concordance`.
    """

    def noisy(sound: Waveform) -> Waveform:
        count = len(sound.samples)
        under = white_noise(count, 0) if kind == "white" else babble(sound, 0)
        try:
            return with_noise(sound, under, -snr_db)
        except AudioError:  # digital silence has no level to set noise against
            return sound

    wanted = {row.clip for row in rows}
    predicted, true = [], []
    shared = SharedCrnn(network)
    for clip in shards.clips("test"):
        if clip.clip not in wanted:
            continue
        values, first, targets = clip_features(shards, clip, features.fps, noisy, features.encoder)
        row = CachedClip(
            clip.clip,
            clip.word,
            clip.speaker,
            clip.source,
            "test",
            0,
            len(values),
            0,
            len(targets),
            first,
        )
        with torch.no_grad():
            starts = torch.from_numpy(features.starts(row))[None]
            predicted.append(shared(torch.from_numpy(values)[None], starts)[0][0].numpy())
        true.append(targets)
    return score_concordance(predicted, true, shares)


def score_sentences(
    corpus: Corpus,
    names: Sequence[str],
    basis: Float32Array,
    fps: float,
    shares: Float32Array,
    predict: Callable[[Waveform], Float32Array],
) -> ConcordanceScore:
    """Concordance on continuous speech, whose true motion is projected onto the basis.

    basis: (parameter, vertex, 3) m. fps: of what `predict` makes of a sound, (frame, parameter).
    shares: (parameter,) as for `score_concordance`. Raises CorpusError for another topology than
    the basis's.
    """
    flat = basis.reshape(len(basis), -1).astype(np.float64)
    if flat.shape[1] != corpus.vertex_count * 3:
        raise CorpusError.about(
            corpus.folder,
            found=f"{corpus.vertex_count} vertices",
            allowed=f"{flat.shape[1] // 3}, as the basis has",
        )
    onto = ridge_projection(flat)
    predicted, true = [], []
    for name in names:
        moved = corpus.displacements(name)
        wanted = (moved.reshape(len(moved), -1) @ onto).astype(np.float32)
        wanted = at_rate(wanted, corpus.fps, fps)
        parameters = predict(corpus.sound(name))
        count = min(len(parameters), len(wanted))
        predicted.append(parameters[:count])
        true.append(wanted[:count])
    return score_concordance(predicted, true, shares)


def score_continuous_speech(
    corpus: Corpus, names: Sequence[str], model: Path, shards: Shards
) -> dict[str, ConcordanceScore]:
    """Concordance of a stream that keeps its state, and in pieces of 15 frames as in the paper."""
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
    """Mean distance that bases leave of clips (Tzirakis et al. 2019, section 6.3), mm.

    Of the speech blendshapes, of all ARKit shapes of the built-in head, and of as many of these as
    there are speech blendshapes, those that fit these clips best; empty on another mesh.
    """
    head = load_builtin_head()
    if corpus.vertex_count != head.vertex_count:
        return []
    places = [head.expression_names.index(n) for n in ARKIT_NAMES if n in head.expression_names]
    speech = shards.basis.head.expression_basis
    arkit = head.expression_basis[places]
    chosen = arkit[strongest_shapes(corpus, names, arkit, len(speech))]
    bases = [
        BasisProjection("speech", speech),
        BasisProjection("arkit", arkit),
        BasisProjection(f"arkit best {len(chosen)}", chosen),
    ]
    return reconstruction_errors(corpus, names, bases)


def score_talker(
    folder: Path, model: Path, names: list[str] | None = None, contacts: str = "auto"
) -> dict[str, GroupScore]:
    """A real talker's mouth, by model: the recurrent model (.onnx) beside VOCA and the rules.

    folder, names: recordings as for `evaluate_tracked_mouths`. contacts: as `animate` takes it.
    """
    eye_mm = 1000 * load_builtin_head().eye_distance_m
    by_model = {}
    for name, chosen in (("crnn", model), ("voca", "voca"), ("articulation", "articulation")):
        report = evaluate_tracked_mouths(
            folder,
            lambda sound, chosen=chosen: measure_as_tracked(
                animate(sound, model=chosen, contacts=contacts, life=0).motion
            ),
            eye_mm,
            names=names,
        )
        by_model[name] = report.summary
    return by_model
