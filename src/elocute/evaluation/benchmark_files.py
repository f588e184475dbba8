"""The test clips of VOCASET and BIWI, and the files that methods leave of them.

FaceFormer, CodeTalker and later work write a prediction as SUBJECT_SENTENCE_condition_SUBJECT.npy,
the second subject that whose style the model spoke in, each row a frame of all coordinates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.corpus.importers.folder import read_vertices, subject_and_sentence
from elocute.corpus.importers.foreign_arrays import checked_templates
from elocute.corpus.importers.frame_gaps import check_finite
from elocute.corpus.importers.split_choice import (
    BIWI_PARTS,
    BIWI_SEEN,
    VOCASET_OWN_SENTENCES,
    VOCASET_TEST,
)
from elocute.corpus.topologies import BIWI, FLAME, Topology, topology_of
from elocute.errors import CorpusError
from elocute.evaluation.model_predictions import recorded_motion
from elocute.files.pickles.closed_pickle import read_pickle
from elocute.motion.vertex_motion import VertexMotion

NAMED_MOST = 3  # clips that a message names
LENGTHS_DIFFER = 0.1  # share by which lengths may differ at the same rate
ALL, OWN = "all", "own"
OWN_DATA = "own"
"""Stands for a data set of one's own in place of a published one."""
DATA_UNIT = "the data's unit"


@dataclass(frozen=True)
class Benchmark:
    """What a data set's published figures are counted over: subjects and sentences of its test.

    name: as the command takes it. topology: the mesh of the data. unit: of lengths, for people.
    """

    name: str
    topology: Topology
    subjects: tuple[str, ...]
    sentences: frozenset[str]
    unit: str


BENCHMARKS = {
    "vocaset": Benchmark("vocaset", FLAME, VOCASET_TEST, VOCASET_OWN_SENTENCES, "m"),
    "biwi": Benchmark(
        "biwi",
        BIWI,
        BIWI_SEEN,
        frozenset(f"e{number}" for number in BIWI_PARTS[2]),
        DATA_UNIT,
    ),
}
"""BIWI's is Test-A, the one that has errors: what subjects of Test-B are conditioned on is not
themselves."""


@dataclass(frozen=True, eq=False)
class Truth:
    """The recorded test clips of a data set: SUBJECT_SENTENCE to what reads it, every frame.

    subjects: SUBJECT of each clip.
    """

    benchmark: Benchmark
    source: Path
    clips: dict[str, Callable[[], VertexMotion]]
    subjects: dict[str, str]


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
            f"benchmark {name[:60]!r}",
            found="unknown",
            allowed=f"{', '.join(BENCHMARKS)}, or `{OWN_DATA}` for a data set of your own",
        )
    return BENCHMARKS[name]


def open_benchmark_truth(
    benchmark: Benchmark | None, source: Path, templates: Path | None = None
) -> Truth:
    """The recorded test clips.

    Parameters
    ----------
    benchmark : Benchmark or None
        Which data set; None for one of your own, all of whose clips are for the test: those of a
        corpus's test part where it has one.
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
    named = {} if benchmark is None else _published_clips(benchmark, folder, paths)
    faces_at = _templates_file(folder, templates)
    faces = checked_templates(faces_at, read_pickle(faces_at))
    vertices = len(next(iter(faces.values())))
    if benchmark is not None:
        _check_topology(benchmark, vertices, faces_at)
    else:
        benchmark = _own(vertices, DATA_UNIT)
        subjects = {name: subject_and_sentence(name, faces)[0] for name in paths}
        named = {name: subject for name, subject in subjects.items() if subject}
        if not named:
            raise CorpusError.about(
                folder, found="no SUBJECT_SENTENCE.npy", allowed=f"of subjects in {faces_at.name}"
            )
    for subject in sorted(set(named.values()) - set(faces)):
        raise CorpusError.about(faces_at, found=f"no template of {subject}", allowed="one for each")

    def reader(name: str) -> Callable[[], VertexMotion]:
        return lambda: read_prediction(paths[name], faces[named[name]])

    return Truth(benchmark, source, {name: reader(name) for name in named}, named)


def _published_clips(benchmark: Benchmark, folder: Path, paths: dict[str, Path]) -> dict[str, str]:
    """The test clips that are there, and their subjects. Raises CorpusError for none."""
    wanted = {
        f"{who}_{what}": who for who in benchmark.subjects for what in sorted(benchmark.sentences)
    }
    named = {name: who for name, who in wanted.items() if name in paths}
    if not named:
        raise CorpusError.about(
            folder,
            found=f"none of {benchmark.name}'s test clips ({next(iter(wanted))}.npy, …)",
            allowed="SUBJECT_SENTENCE.npy, or a corpus",
            remedy=f"`{OWN_DATA}` takes all clips of a data set of your own",
        )
    return named


def _own(vertices: int, unit: str) -> Benchmark:
    """A data set of one's own, which may have a known mesh."""
    known = topology_of(vertices) or Topology(OWN_DATA, "this data set's mesh", vertices, (), {})
    return Benchmark(OWN_DATA, known, (), frozenset(), unit)


def _check_topology(benchmark: Benchmark, vertices: int, source: Path) -> None:
    topology = benchmark.topology
    if vertices != topology.vertices:
        raise CorpusError.about(
            source,
            found=f"{vertices} vertices",
            allowed=f"{topology.vertices}, {topology.title}",
            remedy=f"`{OWN_DATA}` takes any mesh",
        )


def _corpus_truth(benchmark: Benchmark | None, corpus: Corpus) -> Truth:
    """The test clips of a corpus, by the numbers that the data set gives its sentences."""
    tested = corpus.split().test if "default" in corpus.splits else ()
    clips: dict[str, Callable[[], VertexMotion]] = {}
    subjects: dict[str, str] = {}
    if benchmark is not None:
        _check_topology(benchmark, corpus.vertex_count, corpus.folder)
    for entry in corpus.entries:
        sentence = entry.sentence.removeprefix(f"{entry.subject}_")
        if benchmark is None:
            wanted = not tested or entry.name in tested
        else:
            wanted = entry.subject in benchmark.subjects and sentence in benchmark.sentences
        if wanted:
            name = f"{entry.subject}_{sentence}"
            clips[name], subjects[name] = _corpus_reader(corpus, entry.name), entry.subject
    if benchmark is None:
        benchmark = _own(corpus.vertex_count, "m")
    elif not clips:
        raise CorpusError.about(
            corpus.folder,
            found=f"none of {benchmark.name}'s test clips by number",
            allowed=f"{benchmark.subjects[0]}.{min(benchmark.sentences)} and the like",
            remedy="convert without texts, or name the folder vertices_npy",
        )
    return Truth(benchmark, corpus.folder, clips, subjects)


def _corpus_reader(corpus: Corpus, name: str) -> Callable[[], VertexMotion]:
    return lambda: recorded_motion(corpus, name)


def _templates_file(folder: Path, chosen: Path | None) -> Path:
    """The file of neutral faces. Raises CorpusError where there is none."""
    places = [chosen] if chosen else [folder / "templates.pkl", folder.parent / "templates.pkl"]
    path = next((place for place in places if place.is_file()), None)
    if path is None:
        raise CorpusError.about(
            places[-1], found="no such file", allowed="the data's templates.pkl"
        )
    return path


def read_prediction(path: Path, template: NDArray[np.float32]) -> VertexMotion:
    """A .npy as a motion in the data's unit. Raises CorpusError where it is not finite."""
    vertices = read_vertices(path, len(template))
    if not len(vertices):
        raise CorpusError.about(path, found="no frame", allowed="one or more")
    check_finite(vertices, path)
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
    predictions = []
    for path in sorted(folder.glob("*.npy")):
        stem, _, under = path.stem.partition("_condition_")
        words = stem.split("_")  # others may stand before
        names = ("_".join(words[start:]) for start in range(len(words)))
        clip = next((name for name in names if name in truth.clips), None)
        if clip is not None:
            predictions.append(Prediction(path, clip, under))
    chosen = [
        each
        for each in predictions
        if condition in (ALL, each.condition)
        or (condition == OWN and each.condition == truth.subjects[each.clip])
    ]
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


def frames_apart(truth: Truth, predictions: Sequence[Prediction]) -> int:
    """The N of every Nth frame of the truth that predictions have: 1, or 2 for half the rate.

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
    frames = read_prediction(first.path, true.template.astype(np.float32)).frame_count
    for step in (1, 2):
        expected = -(-true.frame_count // step)
        if abs(frames - expected) <= max(2, LENGTHS_DIFFER * expected):
            return step
    raise CorpusError.about(
        first.path,
        found=f"{frames} frames",
        allowed=f"{true.frame_count}, as {first.clip} has, or every second of them",
        remedy="`every` sets how many frames of the truth lie between two of the prediction",
    )
