"""`elocute corpus`: what a corpus holds, what is wrong with it, and how to make one."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from typer.main import get_command

from elocute.cli import options
from elocute.cli.commands import Commands
from elocute.cli.flags import in_flags
from elocute.cli.names import read_names
from elocute.cli.outputs import settled
from elocute.cli.progress import progress_bar
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    from elocute.corpus.corpus_checks import Finding

app = Commands("Look at, check and convert corpora of talking faces.")

Folder = typer.Argument(..., help="A corpus folder, as `corpus convert` writes it.")


@app.command("info")
def info_command(folder: Path = Folder, as_json: bool = options.Json) -> None:
    """Say what a corpus holds: subjects, sentences, minutes and splits."""
    from elocute.corpus.corpus_statistics import corpus_summary
    from elocute.corpus.corpus_store import open_corpus

    record = corpus_summary(open_corpus(folder))
    if as_json:
        print(json.dumps({"folder": str(folder), **record}))
        return
    for name, value in record.items():
        if isinstance(value, dict):
            print(f"{name}:")
            for key, inner in value.items():
                told = (
                    ", ".join(f"{count} {part}" for part, count in inner.items())
                    if isinstance(inner, dict)
                    else f"{inner} min"
                )
                print(f"  {key:28} {told}")
        else:
            print(f"{name:12} {value}")


@app.command("check")
def check_command(folder: Path = Folder, as_json: bool = options.Json) -> None:
    """Look for what would spoil training; exit 1 where an error was found."""
    from elocute.corpus.corpus_checks import check_corpus
    from elocute.corpus.corpus_store import open_corpus

    corpus = open_corpus(folder)
    with progress_bar(f"checking {folder.name}", as_json) as progress:
        findings = [_in_flags_of_convert(found) for found in check_corpus(corpus, progress)]
    errors = sum(finding.level == "error" for finding in findings)
    if as_json:
        record = {"folder": str(folder), "errors": errors, "warnings": len(findings) - errors}
        print(json.dumps(record | {"findings": [asdict(finding) for finding in findings]}))
    else:
        _print_table(findings)
        print(f"{errors} errors, {len(findings) - errors} warnings in {len(corpus.entries)} clips")
    if errors:
        raise typer.Exit(1)


def _in_flags_of_convert(finding: Finding) -> Finding:
    """What is to be done about it is done by `corpus convert`."""
    group: Any = get_command(app)
    return replace(finding, what=in_flags(finding.what, group.commands["convert"]))


def _print_table(findings: list[Finding]) -> None:
    wide = max((len(finding.about) for finding in findings), default=0)
    for finding in findings:
        place = "" if finding.frame is None else f"  (frame {finding.frame})"
        print(f"{finding.level:8} {finding.about:{wide}}  {finding.what}{place}")


@app.command("convert")
def convert_command(
    source: Path = typer.Argument(..., help="Folder of VOCASET, BIWI, … as it was distributed."),
    output: Path = typer.Option(..., "-o", "--output", help="A new corpus folder."),
    format: str | None = typer.Option(
        None, help="vocaset, biwi, folder or grid; found out by default."
    ),
    fps: float | None = typer.Option(
        None, help="Frames a second of folder (told by its sounds), or to make of grid (60)."
    ),
    units: str | None = typer.Option(
        None,
        help="Of lengths in biwi and folder: mm, cm, dm, m, inch, or metres a unit; told by the "
        "size of a head.",
    ),
    split: str | None = typer.Option(
        None,
        help="published (VOCASET, BIWI), even, sentences, or subjects for validation/test: "
        "ann,bob/cy. By default published, or even where there is none.",
    ),
    texts: Path | None = typer.Option(None, help="What was said: subject TAB sentence TAB text."),
    leave_out: Path | None = typer.Option(
        None, help="A text file of subjects or clips to leave out."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Make a corpus folder of recordings; say what was assumed, and what was skipped and why.

    folder is what FaceFormer, CodeTalker and later work keep: vertices_npy/, wav/, templates.pkl.
    """
    from elocute.corpus.corpus_store import open_corpus
    from elocute.corpus.importers.registry import convert

    plan = OutputPlan([given for given in (texts, leave_out) if given is not None])
    plan.add(output, source)
    if settled(plan, overwrite, no_clobber, as_json):
        return
    unwanted = frozenset(read_names(leave_out, least=0) or ())
    with plan.writing(output), progress_bar(f"converting {source.name}", as_json) as progress:
        notes = convert(
            source,
            output,
            format=format,
            fps=fps,
            texts=texts,
            leave_out=unwanted,
            units=units,
            split=split,
            progress=progress,
        )
    corpus = open_corpus(output)
    if as_json:
        record = {"source": str(source), "output": str(output), "clips": len(corpus.entries)}
        notes = [in_flags(note) for note in notes]
        print(json.dumps(record | {"subjects": len(corpus.subjects), "notes": notes}))
        return
    for note in notes:
        print(in_flags(note))
    print(output)
