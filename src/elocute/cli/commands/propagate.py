"""`elocute propagate`: motion of captured speakers, carried over to other recordings."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.flags import in_flags
from elocute.cli.progress import progress_bar, resumable
from elocute.cli.settings_options import options_of
from elocute.files.work_folder import no_empty_folder
from elocute.propagation.settings import PropagateConfig

if TYPE_CHECKING:
    from elocute.propagation.corpus_propagation import PropagationSummary


def propagate_command(
    corpus: Path = typer.Argument(..., help="Corpus folder of the captured speakers."),
    recordings: Path = typer.Argument(
        ...,
        help="Recordings: WORD/{train,val,test}/*.wav, WORD/*.wav, or LRW as distributed.",
    ),
    output: Path = typer.Option(..., "-o", "--output", help="A new folder of shards (Parquet)."),
    words: Path | None = typer.Option(
        None, help="Folder of the word times of the captured clips: SUBJECT.SENTENCE.json."
    ),
    basis: Path | None = typer.Option(
        None, help="Speech blendshapes (.npz); by default learned from the training clips."
    ),
    root: Path | None = typer.Option(
        None, help="Folder to which the paths of sounds are relative; RECORDINGS by default."
    ),
    split: str = typer.Option(
        "default", help="Name of the split of the corpus; its training part is carried over."
    ),
    sources: list[str] = typer.Option(
        [],
        "--source",
        help="A captured subject whose motion alone is carried over, as in the paper; may be given "
        "again: each then has its shards in OUTPUT/SUBJECT.",
    ),
    config: PropagateConfig = options_of(PropagateConfig),
    jobs: int = typer.Option(1, help="Number of processes; 0 takes all processors."),
    ray: str | None = typer.Option(
        None,
        "--ray",
        help="HOST:PORT of a Ray cluster, or local; `jobs` is then the number of its actors.",
    ),
    resume: bool = typer.Option(False, help="Resume an interrupted run in the output folder."),
    as_json: bool = options.Json,
) -> None:
    """Align recordings with captured speakers, and carry their animation parameters over.

    The output folder receives a Parquet shard for each word, manifest.json, basis.npz and
    rejects.csv. A word that fails does not stop the others; the exit code is then 1.
    """
    from elocute.propagation.corpus_propagation import propagate_corpus

    with (
        resumable("--resume continues"),
        no_empty_folder(output),
        progress_bar(f"carrying over to {recordings.name}", as_json) as progress,
    ):
        summary = propagate_corpus(
            corpus,
            recordings,
            output,
            config,
            words=words,
            basis=basis,
            root=root,
            split=split,
            sources=sources,
            jobs=jobs,
            ray=ray,
            resume=resume,
            progress=progress,
        )
    _tell(summary, output, as_json)


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
