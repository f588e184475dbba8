"""`elocute propagate`: motion of captured speakers, carried to recordings of the same words."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.flags import in_flags
from elocute.cli.progress import progress_bar, resumable
from elocute.cli.work_folder import prepare_work
from elocute.errors import CorpusError

if TYPE_CHECKING:
    from elocute.jobs.pool import Pool
    from elocute.propagation.corpus_propagation import PropagationSummary

WRITTEN = ("basis.npz", "manifest.json", "rejects.csv", "*.parquet")
DEEP = ("dctw", "dcaw")  # their sums depend on the number of threads: workers have one


def propagate_command(
    corpus: Path = typer.Argument(..., help="A corpus folder of captured speakers."),
    recordings: Path = typer.Argument(
        ..., help="WORD/{train,val,test}/*.wav, WORD/*.wav, or LRW as it is distributed."
    ),
    output: Path = typer.Option(..., "-o", "--output", help="A new folder of shards (Parquet)."),
    words: Path | None = typer.Option(
        None, help="Folder of SUBJECT.SENTENCE.json: words of the captured clips, with times."
    ),
    basis: Path | None = typer.Option(
        None, help="Speech blendshapes (.npz); learned from the training clips by default."
    ),
    root: Path | None = typer.Option(
        None, help="Folder above both that sounds are named from; RECORDINGS by default."
    ),
    method: str = typer.Option("dcaw", help="dtw, softdtw, ctw, dctw or dcaw."),
    split: str = typer.Option("default", help="Which split of the corpus; train is carried over."),
    fit_pairs: int = typer.Option(50, help="Recordings that a word's network is fitted to."),
    confidence: float = typer.Option(0.3, help="Least confidence of what is kept, 0 to 1."),
    seed: int = typer.Option(0, min=0, max=options.SEED_MAX, help="Seed of all random numbers."),
    jobs: int = typer.Option(1, help="Processes; 0 takes all processors."),
    ray: str | None = typer.Option(
        None, "--ray", help="HOST:PORT of a Ray cluster, or local; jobs is its number of actors."
    ),
    resume: bool = typer.Option(False, help="Resume in the output folder."),
    as_json: bool = options.Json,
) -> None:
    """Align every recording with the captured speakers and carry their parameters over.

    Leaves a Parquet shard for each word, manifest.json, basis.npz and rejects.csv. Exit 1 where a
    word failed after the others were finished.
    """
    from elocute.alignment.methods import resolve_method
    from elocute.corpus.corpus_store import open_corpus
    from elocute.propagation.blendshape_basis import provide_basis
    from elocute.propagation.captured_words import captured_words
    from elocute.propagation.corpus_propagation import propagate
    from elocute.propagation.settings import PropagationSettings
    from elocute.propagation.word_job import RECORDS
    from elocute.propagation.word_recordings import find_recordings

    resolve_method(method)
    opened, found = open_corpus(corpus), find_recordings(recordings)
    captured = captured_words(opened, words, split)
    top = (root or recordings).resolve()
    if not found.folder.resolve().is_relative_to(top):
        raise CorpusError.about(recordings, found="not below --root", allowed=f"a folder in {top}")
    pool = _pool(jobs, ray, method)
    prepare_work(output, resume, RECORDS, WRITTEN)
    (output / RECORDS).mkdir(exist_ok=True)  # tells the folder for ours from the start
    settings = PropagationSettings(
        corpus=str(corpus.resolve()),
        basis=str(provide_basis(opened, output, basis, split)),
        recordings=str(recordings.resolve()),
        root=str(top),
        folder=str(output.resolve()),
        method=method,
        seed=seed,
        fit_pairs=fit_pairs,
        confidence=confidence,
        truth=corpus.resolve().is_relative_to(top),
    )
    with (
        resumable("--resume goes on"),
        progress_bar(f"carrying over to {recordings.name}", as_json) as progress,
    ):
        summary = propagate(settings, captured, found, pool, progress)
    _tell(summary, output, as_json)


def _pool(jobs: int, address: str | None, method: str) -> Pool:
    if address is not None:
        from elocute.jobs.ray_cluster import ray_pool

        return ray_pool(address, jobs)
    if jobs == 1 and method not in DEEP:
        from elocute.jobs.pool import one_after_another

        return one_after_another
    from elocute.jobs.process_pool import local_pool

    return local_pool(jobs)


def _tell(summary: PropagationSummary, output: Path, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"output": str(output), **asdict(summary)}))
    else:
        print(
            f"{summary.words} words: {summary.aligned} recordings carried over, "
            f"{summary.captured} captured, {summary.rejected} rejected (rejects.csv)"
        )
        if summary.kept:
            print(f"{summary.kept} words kept from an earlier run")
        if summary.unheard:
            print(f"without recordings: {', '.join(summary.unheard)}")
        print(output)
    for word, reason in summary.failed:
        typer.echo(f"elocute: word {word}: {in_flags(reason)}", err=True)
    if summary.failed:
        raise typer.Exit(1)
