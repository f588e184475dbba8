"""The test clips of VOCASET and BIWI, and the files that methods leave of them.

FaceFormer, CodeTalker and later work write a prediction as SUBJECT_SENTENCE_condition_SUBJECT.npy,
the second subject that whose style the model spoke in, each row a frame of all coordinates.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.corpus.importers.folder import read_vertices
from elocute.corpus.importers.foreign_arrays import checked_templates
from elocute.corpus.importers.published_splits import (
    BIWI_PARTS,
    BIWI_SEEN,
    VOCASET_OWN_SENTENCES,
    VOCASET_SUBJECTS,
    VOCASET_TEST,
)
from elocute.corpus.topologies import BIWI, FLAME, Topology
from elocute.errors import CorpusError
from elocute.evaluation.model_predictions import recorded_motion
from elocute.files.pickles.closed_pickle import read_pickle
from elocute.motion.vertex_motion import VertexMotion

NAMED_MOST = 3  # clips that a message names
LENGTHS_DIFFER = 0.1  # share by which lengths may differ at the same rate
ALL, OWN = "all", "own"


@dataclass(frozen=True)
class Benchmark:
    """What a data set's published figures are counted over.

    Attributes
    ----------
    name : str
        As the command takes it.
    topology : Topology
        The mesh of the data.
    subjects, sentences : frozenset of str
        Those of the test.
    speakers : tuple of str
        All subjects of the data, conditions among them.
    unit : str
        Of lengths, for people.
    """

    name: str
    topology: Topology
    subjects: tuple[str, ...]
    sentences: frozenset[str]
    speakers: tuple[str, ...]
    unit: str


BENCHMARKS = {
    "vocaset": Benchmark(
        "vocaset", FLAME, VOCASET_TEST, VOCASET_OWN_SENTENCES, VOCASET_SUBJECTS, "m"
    ),
    "biwi": Benchmark(
        "biwi",
        BIWI,
        BIWI_SEEN,
        frozenset(f"e{number}" for number in BIWI_PARTS[2]),
        BIWI_SEEN,
        "the data's unit",
    ),
}
"""BIWI's is Test-A, the one that has errors: what subjects of Test-B are conditioned on is not
themselves."""


@dataclass(frozen=True, eq=False)
class Truth:
    """The recorded test clips of a data set.

    Attributes
    ----------
    clips : dict of str to callable
        SUBJECT_SENTENCE to what reads it, every frame.
    """

    benchmark: Benchmark
    source: Path
    clips: dict[str, Callable[[], VertexMotion]]


@dataclass(frozen=True)
class Prediction:
    """A file with the motion of one test clip, in the style of `condition` ("" where not named)."""

    path: Path
    clip: str
    condition: str


def benchmark_named(name: str) -> Benchmark:
    """The benchmark of a data set.

    Parameters
    ----------
    name : str
        `vocaset` or `biwi`.

    Returns
    -------
    Benchmark

    Raises
    ------
    CorpusError
        For another name.
    """
    if name not in BENCHMARKS:
        raise CorpusError.about(
            f"benchmark {name[:60]!r}", found="unknown", allowed=", ".join(BENCHMARKS)
        )
    return BENCHMARKS[name]


def open_benchmark_truth(
    benchmark: Benchmark, source: Path, templates: Path | None = None
) -> Truth:
    """The recorded test clips.

    Parameters
    ----------
    benchmark : Benchmark
        Which data set.
    source : Path
        A converted corpus, a folder SUBJECT_SENTENCE.npy, or one that holds it as `vertices_npy`.
    templates : Path, optional
        The neutral faces of such a folder; `templates.pkl` in it or beside it by default.

    Returns
    -------
    Truth
        Nothing is read yet but neutral faces.

    Raises
    ------
    CorpusError
        For a folder without test clips or neutral faces, and another topology.
    """
    if (source / "corpus.json").is_file():
        return _corpus_truth(benchmark, open_corpus(source))
    folder = source / "vertices_npy" if (source / "vertices_npy").is_dir() else source
    if not folder.is_dir():
        raise CorpusError.about(
            source, found="no such folder", allowed="a corpus, or a folder vertices_npy"
        )
    paths = {p.stem: p for p in sorted(folder.glob("*.npy"))}
    wanted = [f"{who}_{what}" for who in benchmark.subjects for what in sorted(benchmark.sentences)]
    names = [name for name in wanted if name in paths]
    if not names:
        raise CorpusError.about(
            folder,
            found=f"none of {benchmark.name}'s test clips ({wanted[0]}.npy, …)",
            allowed="SUBJECT_SENTENCE.npy, or a corpus",
        )
    faces = _templates(benchmark, folder, templates, {name.rpartition("_")[0] for name in names})

    def reader(name: str) -> Callable[[], VertexMotion]:
        return lambda: read_prediction(paths[name], faces[name.rpartition("_")[0]])

    return Truth(benchmark, source, {name: reader(name) for name in names})


def _corpus_truth(benchmark: Benchmark, corpus: Corpus) -> Truth:
    """The test clips of a corpus, by the numbers that the data set gives its sentences."""
    if corpus.vertex_count != benchmark.topology.vertices:
        raise CorpusError.about(
            corpus.folder,
            found=f"{corpus.vertex_count} vertices",
            allowed=f"{benchmark.topology.vertices}, {benchmark.topology.title}",
        )
    clips: dict[str, Callable[[], VertexMotion]] = {}
    for entry in corpus.entries:
        sentence = entry.sentence.removeprefix(f"{entry.subject}_")
        if entry.subject in benchmark.subjects and sentence in benchmark.sentences:
            clips[f"{entry.subject}_{sentence}"] = _corpus_reader(corpus, entry.name)
    if not clips:
        raise CorpusError.about(
            corpus.folder,
            found=f"none of {benchmark.name}'s test clips by number",
            allowed=f"{benchmark.subjects[0]}.{min(benchmark.sentences)} and the like",
            remedy="convert without texts, or name the folder vertices_npy",
        )
    return Truth(benchmark, corpus.folder, clips)


def _corpus_reader(corpus: Corpus, name: str) -> Callable[[], VertexMotion]:
    return lambda: recorded_motion(corpus, name)


def _templates(
    benchmark: Benchmark, folder: Path, given: Path | None, subjects: set[str]
) -> dict[str, NDArray[np.float32]]:
    """Neutral faces of some subjects. Raises CorpusError where one is missing."""
    places = [given] if given else [folder / "templates.pkl", folder.parent / "templates.pkl"]
    path = next((place for place in places if place.is_file()), None)
    if path is None:
        raise CorpusError.about(
            places[-1], found="no such file", allowed="the data's templates.pkl"
        )
    faces = checked_templates(path, read_pickle(path), benchmark.topology.vertices)
    for subject in sorted(subjects - set(faces)):
        raise CorpusError.about(path, found=f"no template of {subject}", allowed="one for each")
    return faces


def read_prediction(path: Path, template: NDArray[np.float32]) -> VertexMotion:
    """A .npy as a motion in the data's unit. Raises CorpusError where it is not finite."""
    vertices = read_vertices(path, len(template))
    if not len(vertices):
        raise CorpusError.about(path, found="no frame", allowed="one or more")
    wrong = ~np.isfinite(vertices).all(axis=(1, 2))
    if wrong.any():
        raise CorpusError.about(
            path, found=f"NaN or infinity in frame {int(wrong.argmax())}", allowed="finite numbers"
        )
    return VertexMotion(vertices, template, 1.0)


def find_predictions(
    truth: Truth, folder: Path, *, condition: str = ALL, partial: bool = False
) -> list[Prediction]:
    """The files of a method.

    Parameters
    ----------
    truth : Truth
        The clips.
    folder : Path
        SUBJECT_SENTENCE.npy or SUBJECT_SENTENCE_condition_SUBJECT.npy, with anything and `_`
        before; files of other clips are left out.
    condition : str
        `all` scores every file, as the scripts for VOCASET do; `own` those conditioned on the
        clip's own subject; else a subject.
    partial : bool
        Whether test clips may be missing.

    Returns
    -------
    list of Prediction
        Sorted by clip and condition.

    Raises
    ------
    CorpusError
        For a folder without predictions, and one where test clips are missing.
    """
    if not folder.is_dir():
        raise CorpusError.about(folder, found="not a folder", allowed="a folder of predictions")
    subjects = "|".join(map(re.escape, truth.benchmark.speakers))
    pattern = re.compile(rf"(?:.*_)?((?:{subjects})_[^_]+)(?:_condition_(.+))?")
    found = []
    for path in sorted(folder.glob("*.npy")):
        match = pattern.fullmatch(path.stem)
        if match and match[1] in truth.clips:
            found.append(Prediction(path, match[1], match[2] or ""))
    chosen = [each for each in found if _wanted(each, condition)]
    missing = [name for name in truth.clips if name not in {each.clip for each in chosen}]
    if not chosen or (missing and not partial):
        named = ", ".join(missing[:NAMED_MOST]) + (" and more" if len(missing) > NAMED_MOST else "")
        under = "" if condition == ALL else f" in condition {condition}"
        raise CorpusError.about(
            folder,
            found=f"{len(missing)} of {len(truth.clips)} test clips missing{under}: {named}",
            allowed="SUBJECT_SENTENCE_condition_SUBJECT.npy or SUBJECT_SENTENCE.npy for each",
            remedy="`partial` scores those that are there" if chosen else "",
        )
    return sorted(chosen, key=lambda each: (each.clip, each.condition))


def _wanted(prediction: Prediction, condition: str) -> bool:
    if condition == OWN:
        condition = prediction.clip.rpartition("_")[0]
    return condition in (ALL, prediction.condition)


def frames_apart(truth: Truth, predictions: Sequence[Prediction]) -> int:
    """Every how manyth frame of the truth the predictions have: 1, or 2 for half the rate.

    FaceFormer and what followed it keep every second frame of VOCASET, 30 a second.

    Parameters
    ----------
    truth : Truth
        The clips.
    predictions : sequence of Prediction
        The files; the first tells.

    Returns
    -------
    int

    Raises
    ------
    CorpusError
        Where their lengths fit neither.
    """
    first = predictions[0]
    true = truth.clips[first.clip]()
    found = read_prediction(first.path, true.template.astype(np.float32)).frame_count
    for step in (1, 2):
        expected = -(-true.frame_count // step)
        if abs(found - expected) <= max(2, LENGTHS_DIFFER * expected):
            return step
    raise CorpusError.about(
        first.path,
        found=f"{found} frames",
        allowed=f"{true.frame_count}, as {first.clip} has, or every second of them",
        remedy="`every` sets how many frames of the truth lie between two of the prediction",
    )
