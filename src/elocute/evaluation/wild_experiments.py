"""The experiments of Tzirakis et al. 2019 (in the wild), section 6.4, on shards.

`study_wild` runs all of them in one call.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

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
from elocute.errors import AudioError, CorpusError, InputError
from elocute.evaluation.concordance import ConcordanceScore, score_concordance
from elocute.evaluation.tracked_mouth_scores import GroupScore, evaluate_tracked_mouths
from elocute.evaluation.wild_parts import (
    TRAININGS,
    ExperimentClips,
    exact_parameters,
    experiment_clips,
)
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

MODEL = "model.onnx"
PAPER = {
    "speaker validation": 0.679,
    "speaker participant": 0.621,
    "word validation": 0.554,
    "word participant": 0.502,
    "sentences pieces": 0.463,
}
"""µ28 of Table 2, by our rows: its test set is a captured participant (section 6.4)."""
NOISES = ("white", "babble")
SNRS_DB = (0.0, 10.0, 20.0)
NOISE_CLIPS = 300  # most clips that noise is laid under
EXACT = ", exact"  # ends the names of rows that are measured against exact parameters


@dataclass(frozen=True, eq=False)
class WildStudy:
    """Results of the experiments.

    Attributes
    ----------
    concordance : dict of str to ConcordanceScore
        ρc of each training and part, with noise under the test clips, and on sentences. Rows that
        end in ", exact" are measured against exact parameters; "carried" rows measure what was
        carried over against these, and so how good a network's lessons were.
    bases : list of ReconstructionErrors
        What speech blendshapes and ARKit's shapes leave of the sentences, mm.
    talker : dict of str to GroupScore
        A real talker: the recurrent model beside VOCA and the rules.
    missing : tuple of (str, str)
        Clips whose sound could not be read, with the reason.
    """

    concordance: dict[str, ConcordanceScore]
    bases: list[ReconstructionErrors]
    talker: dict[str, GroupScore]
    missing: tuple[tuple[str, str], ...]

    __repr__ = one_line

    def record(self) -> dict[str, Any]:
        """Numbers by name, for reports; None for what is not available."""
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
    held_out: Sequence[str] | None = None,
    exact: Shards | None = None,
    sentences: Corpus | None = None,
    names: Sequence[str] = (),
    talker: Path | None = None,
    talker_names: list[str] | None = None,
    contacts: str = "auto",
    report: Report | None = None,
) -> WildStudy:
    """Train and measure: speakers, words, a loss, noise, sentences, bases and a real talker.

    Parameters
    ----------
    shards : Shards
        Words of many speakers with parameters.
    folder : Path
        An existing folder; each training resumes in FOLDER/NAME.
    config : CrnnTrainConfig, optional
        Settings of the trainings.
    trainings : sequence of str
        Some of `TRAININGS`, "speaker" among them.
    held_out : sequence of str, optional
        Words that the training "word" holds out; by default one in ten, chosen by a hash.
    exact : Shards, optional
        Clips of `shards` with exact parameters, where a simulator knows them.
    sentences : Corpus, optional
        Continuous speech on the basis's topology.
    names : sequence of str
        Clips of `sentences` to measure.
    talker : Path, optional
        Folder of a tracked talker's recordings.
    talker_names : list of str, optional
        Recordings to measure; all by default.
    contacts : str
        As `animate` takes it, for the talker.
    report : callable, optional
        Receives the progress of the trainings.

    Returns
    -------
    WildStudy
        All results.

    Raises
    ------
    InputError
        For other trainings; CorpusError for shards without a clip in some part.
    """
    check_trainings(trainings)
    config = config or CrnnTrainConfig()
    features = cache_features(shards, folder, config.fps)
    chosen = {name: experiment_clips(features, name, config, held_out) for name in trainings}
    known = {} if exact is None else exact_parameters(shards, exact, config.fps)
    table, shares = dict[str, ConcordanceScore](), variance_shares(shards)
    # All trainings first: a run that is resumed measures once.
    networks = {
        name: train_one(shards, features, name, clips, config, folder / name, report)
        for name, clips in chosen.items()
    }
    for name, clips in chosen.items():
        if name != "mse":
            table |= score_carried(features, name, clips, known, shares)
        table |= score_training(networks[name], features, name, clips, known, shares)
    some = evenly(chosen["speaker"].measured["test"], NOISE_CLIPS)
    for kind in NOISES:
        for snr in SNRS_DB:
            table[f"{kind} {snr:.0f} dB"] = score_noise(
                networks["speaker"].network, shards, features, some, kind, snr, shares
            )
    model, bases = folder / "speaker" / MODEL, list[ReconstructionErrors]()
    if sentences is not None:
        table |= score_continuous_speech(sentences, names, model, shards)
        bases = compare_with_arkit(sentences, names, shards)
    talking = score_talker(talker, model, talker_names, contacts) if talker else {}
    return WildStudy(table, bases, talking, features.missing)


def check_trainings(names: Sequence[str]) -> None:
    """Check which trainings are asked for.

    Parameters
    ----------
    names : sequence of str
        Some of `TRAININGS`.

    Raises
    ------
    InputError
        For an unknown name, or where "speaker" is missing.
    """
    if "speaker" not in names or not set(names) <= set(TRAININGS):
        raise InputError.about(
            f"`trainings` {', '.join(names)}",
            found="speaker is missing, or one is unknown",
            allowed=", ".join(TRAININGS),
        )


def select_sentences(
    corpus: Corpus, shards: Shards, subject: str | None = None, count: int = 50
) -> list[str]:
    """Select clips of a corpus, evenly spaced.

    Parameters
    ----------
    corpus : Corpus
        Continuous speech.
    shards : Shards
        Their basis must have the corpus's topology.
    subject : str, optional
        Only clips of this subject.
    count : int
        Most clips.

    Returns
    -------
    list of str
        Names of clips.

    Raises
    ------
    CorpusError
        For another topology, or an unknown subject.
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


def variance_shares(shards: Shards) -> Float32Array:
    """(parameter,) share of the variance that each parameter explains, as the loss weighs them."""
    return explained_shares(torch.from_numpy(shards.basis.head.expression_basis)).numpy()


def train_one(
    shards: Shards,
    features: FeatureCache,
    training: str,
    clips: ExperimentClips,
    config: CrnnTrainConfig,
    folder: Path,
    report: Report | None = None,
) -> TrainedCrnn:
    """Run one training, or resume it; its model is left in its folder.

    Parameters
    ----------
    shards : Shards
        With the basis.
    features : FeatureCache
        Clips of the shards.
    training : str
        One of `TRAININGS`.
    clips : ExperimentClips
        Its clips.
    config : CrnnTrainConfig
        Its settings, but for the loss of "mse".
    folder : Path
        Made where it does not exist.
    report : callable, optional
        Receives the progress.

    Returns
    -------
    TrainedCrnn
        The network.
    """
    folder.mkdir(exist_ok=True)
    loss = "mse" if training == "mse" else config.loss
    data = select_training_data(
        features, shards.basis.head.expression_basis, clips.train, clips.validation
    )
    trained = fit(data, replace(config, loss=loss), folder, resume=True, report=report)
    export_crnn(trained, shards.basis, folder / MODEL, shards.note)
    return trained


def score_training(
    trained: TrainedCrnn,
    features: FeatureCache,
    training: str,
    clips: ExperimentClips,
    known: Mapping[str, Float32Array],
    shares: Float32Array,
) -> dict[str, ConcordanceScore]:
    """Concordance of a trained network on each part that it is measured on.

    Parameters
    ----------
    trained : TrainedCrnn
        The network.
    features : FeatureCache
        Clips of the shards.
    training : str
        Begins the names of the rows.
    clips : ExperimentClips
        What is measured on.
    known : mapping of str to (frame, parameter) float32
        Exact parameters by clip; parts without any have no row of them.
    shares : (parameter,) float32
        As for `score_concordance`.

    Returns
    -------
    dict of str to ConcordanceScore
        "speaker test" and "speaker test, exact", for example.
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
    """Concordance of parameters that were carried over with the exact ones.

    Parameters
    ----------
    features : FeatureCache
        Clips of the shards.
    training : str
        Whose clips these are.
    clips : ExperimentClips
        What is measured on.
    known : mapping of str to (frame, parameter) float32
        Exact parameters by clip.
    shares : (parameter,) float32
        As for `score_concordance`.

    Returns
    -------
    dict of str to ConcordanceScore
        "carried, speaker train" and the like, for parts that hold clips carried over.
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
    found: list[Float32Array] = []
    true: list[Float32Array] = []
    for row, value in zip(rows, values, strict=True):
        wanted = known.get(row.clip)
        if wanted is None:
            continue
        count = min(len(value), len(wanted))
        found.append(np.asarray(value[:count]))
        true.append(wanted[:count])
    return (found, true) if found else None


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
    """Concordance on clips with noise under them.

    Parameters
    ----------
    network : Crnn
        A trained network.
    shards : Shards
        With the sounds.
    features : FeatureCache
        Clips of the shards.
    rows : sequence of CachedClip
        Clips of the test part to measure on.
    kind : str
        "white" or "babble".
    snr_db : float
        Level of the speech over the noise, dB.
    shares : (parameter,) float32
        As for `score_concordance`.

    Returns
    -------
    ConcordanceScore
        Over these clips.
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
        values, first, targets = clip_features(shards, clip, features.fps, noisy)
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

    Parameters
    ----------
    corpus : Corpus
        Continuous speech.
    names : sequence of str
        Its clips to measure.
    basis : (parameter, vertex, 3) float32
        What the parameters weigh, m.
    fps : float
        Frames per second of the prediction.
    shares : (parameter,) float32
        As for `score_concordance`.
    predict : callable
        Takes a Waveform and gives parameters (frame, parameter).

    Returns
    -------
    ConcordanceScore
        Over all clips.

    Raises
    ------
    CorpusError
        For another topology than the basis's.
    """
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
    corpus: Corpus, names: Sequence[str], speech: Float32Array, arkit: Float32Array
) -> list[ReconstructionErrors]:
    """Mean distance that bases leave of clips (Tzirakis et al. 2019, section 6.3).

    Parameters
    ----------
    corpus : Corpus
        Continuous speech.
    names : sequence of str
        Its clips to measure.
    speech : (component, vertex, 3) float32
        Speech blendshapes, m.
    arkit : (shape, vertex, 3) float32
        ARKit's shapes, m.

    Returns
    -------
    list of ReconstructionErrors
        Of the speech blendshapes, of all ARKit shapes, and of as many ARKit shapes as there are
        speech blendshapes, those that fit these clips best.
    """
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
    """`compare_bases` with ARKit's shapes of the built-in head; empty on another mesh."""
    head = load_builtin_head()
    if corpus.vertex_count != head.vertex_count:
        return []
    places = [head.expression_names.index(n) for n in ARKIT_NAMES if n in head.expression_names]
    speech = shards.basis.head.expression_basis
    return compare_bases(corpus, names, speech, head.expression_basis[places])


def score_talker(
    folder: Path, model: Path, names: list[str] | None = None, contacts: str = "auto"
) -> dict[str, GroupScore]:
    """A real talker's mouth: the recurrent model beside VOCA and the rules.

    Parameters
    ----------
    folder : Path
        Tracked recordings, as for `evaluate_tracked_mouths`.
    model : Path
        The recurrent model (.onnx).
    names : list of str, optional
        Recordings to take; all by default.
    contacts : str
        As `animate` takes it.

    Returns
    -------
    dict of str to GroupScore
        By model.
    """
    eye_mm = 1000 * load_builtin_head().eye_distance_m
    found = {}
    for name, chosen in (("crnn", model), ("voca", "voca"), ("articulation", "articulation")):
        report = evaluate_tracked_mouths(
            folder,
            lambda sound, chosen=chosen: measure_mouth(
                animate(sound, model=chosen, contacts=contacts).motion
            ),
            eye_mm,
            names=names,
        )
        found[name] = report.summary
    return found
