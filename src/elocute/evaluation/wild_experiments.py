"""The experiments of Tzirakis et al. 2019 (in the wild), section 6.4, on shards.

`study_wild` runs all of them in one call.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from elocute.capture.blendshapes.basis_comparison import ReconstructionErrors
from elocute.corpus.corpus_store import Corpus
from elocute.corpus.shards import Shards
from elocute.errors import CorpusError, InputError
from elocute.evaluation.concordance import ConcordanceScore
from elocute.evaluation.tracked_mouth_scores import GroupScore
from elocute.evaluation.wild_parts import (
    TRAININGS,
    ExperimentClips,
    exact_parameters,
    experiment_clips,
)
from elocute.evaluation.wild_scores import (
    compare_with_arkit,
    evenly,
    score_carried,
    score_continuous_speech,
    score_noise,
    score_talker,
    score_training,
    variance_shares,
)
from elocute.files.work_folder import MODEL
from elocute.one_line_repr import one_line
from elocute.training.crnn.feature_cache import FeatureCache, cache_features
from elocute.training.crnn.fit import TrainedCrnn, fit
from elocute.training.crnn.run import export_crnn
from elocute.training.crnn.settings import CrnnTrainConfig
from elocute.training.crnn.training_data import select_training_data
from elocute.training.epochs import Report

PAPER = {
    "speaker validation": 0.679,
    "speaker source": 0.621,
    "word validation": 0.554,
    "word source": 0.502,
    "sentences pieces": 0.463,
}
"""µ28 of Table 2, by our rows: its test set is the captured words of the participant
whose motion was carried over (section 6.4); of another participant it says nothing."""
NOISES = ("white", "babble")
SNRS_DB = (0.0, 10.0, 20.0)
NOISE_CLIPS = 300  # most clips that noise is laid under


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
            "concordance": {name: result.record() for name, result in self.concordance.items()},
            "bases_mm": {
                result.name: {"components": result.components, "mean_mm": result.mean_mm}
                for result in self.bases
            },
            "talker": {
                name: {
                    key: value if value == value else None for key, value in asdict(result).items()
                }
                for name, result in self.talker.items()
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
    features = cache_features(shards, folder, config.fps, encoder=config.encoder)
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
    """Raise InputError for a training that is not in `TRAININGS`, or where "speaker" is missing."""
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


def train_one(
    shards: Shards,
    features: FeatureCache,
    training: str,
    clips: ExperimentClips,
    config: CrnnTrainConfig,
    folder: Path,
    report: Report | None = None,
) -> TrainedCrnn:
    """Run one of `TRAININGS`, or resume it; its model is left in its folder, made if need be.

    config: its settings, but for the loss of "mse".
    """
    folder.mkdir(exist_ok=True)
    loss = "mse" if training == "mse" else config.loss
    data = select_training_data(
        features, shards.basis.head.expression_basis, clips.train, clips.validation
    )
    trained = fit(data, replace(config, loss=loss), folder, resume=True, report=report)
    export_crnn(trained, shards.basis, folder / MODEL, shards.note)
    return trained
