"""`elocute corpus`: a corpus described, checked, or converted from recordings."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from typer.main import get_command

from elocute.cli import options
from elocute.cli.command_group import CommandGroup
from elocute.cli.flags import in_flags
from elocute.cli.name_lists import read_names
from elocute.cli.outputs import nothing_to_do
from elocute.cli.progress import progress_bar
from elocute.files.output_plan import OutputPlan
from elocute.numerics.frame_rates import frame_rate

if TYPE_CHECKING:
    from elocute.corpus.corpus_checks import Finding

app = CommandGroup("Describe, check and convert corpora of talking faces.")

Folder = typer.Argument(..., help="A corpus folder, as `corpus convert` writes it.")


@app.command("info")
def info_command(folder: Path = Folder, as_json: bool = options.Json) -> None:
    """Describe a corpus: subjects, sentences, minutes and splits."""
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
                shown = (
                    ", ".join(f"{count} {part}" for part, count in inner.items())
                    if isinstance(inner, dict)
                    else f"{inner} min"
                )
                print(f"  {key:28} {shown}")
        else:
            print(f"{name:12} {value}")


@app.command("check")
def check_command(folder: Path = Folder, as_json: bool = options.Json) -> None:
    """Check a corpus for what would spoil training; the exit code is 1 where errors are found."""
    from elocute.corpus.corpus_checks import check_corpus
    from elocute.corpus.corpus_store import open_corpus

    corpus = open_corpus(folder)
    with progress_bar(f"checking {folder.name}", as_json) as progress:
        findings = [_in_flags_of_convert(finding) for finding in check_corpus(corpus, progress)]
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
    source: Path = typer.Argument(..., help="Folder of VOCASET, BIWI, … as distributed."),
    output: Path = typer.Option(..., "-o", "--output", help="A new corpus folder."),
    format: str | None = typer.Option(
        None, help="Format of the source: vocaset, biwi, folder or grid; recognised by default."
    ),
    fps: float | None = typer.Option(
        None,
        help="Frames per second of the format folder (by default from its sounds), or to convert "
        "grid to (60).",
        parser=frame_rate,
        metavar="RATE",
    ),
    units: str | None = typer.Option(
        None,
        help="Unit of length in biwi and folder: mm, cm, dm, m, inch, or its metres as a number; "
        "by default recognised by the size of a head.",
    ),
    split: str | None = typer.Option(
        None,
        help="Split: published (VOCASET, BIWI), even, sentences, or the subjects for "
        "validation/test, as ann,bob/cy. By default published, or even where none is.",
    ),
    texts: Path | None = typer.Option(
        None, help="File of what was said, a line for each clip: subject TAB sentence TAB text."
    ),
    leave_out: Path | None = typer.Option(
        None, help="Text file of subjects or clips to leave out."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Convert recordings to a corpus folder, and say what was assumed, and what was skipped.

    The format folder is that of FaceFormer, CodeTalker and later work: vertices_npy/, wav/ and
    templates.pkl.
    """
    from elocute.corpus.corpus_store import open_corpus
    from elocute.corpus.importers.registry import convert

    plan = OutputPlan([given for given in (texts, leave_out) if given is not None])
    plan.add(output, source)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
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
