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
from elocute.cli.settings_options import options_of
from elocute.files.work_folder import no_empty_folder
from elocute.propagation.settings import PropagateConfig

if TYPE_CHECKING:
    from elocute.propagation.corpus_propagation import PropagationSummary


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
    split: str = typer.Option("default", help="Which split of the corpus; train is carried over."),
    config: PropagateConfig = options_of(PropagateConfig),
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
    from elocute.propagation.corpus_propagation import propagate_corpus

    with (
        resumable("--resume goes on"),
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
