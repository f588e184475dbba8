"""`elocute study report`, `plan` and `simulate`: answers, and what comes before them."""

from __future__ import annotations

import json
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.settings_options import option, options_of
from elocute.errors import StudyError
from elocute.study.crowd import Crowd
from elocute.study.design.plan_settings import Plan

if TYPE_CHECKING:
    from elocute.study.design.design import Design
    from elocute.study.report.answers import Answer

OF_STUDY = ("trials", "stimuli", "comparisons", "margin", "confidence")
"""What a plan takes from a study, where there is one and they are not given."""
StudyFile = typer.Argument(..., help="A study's folder, or its file (study.toml).")
StudyData = typer.Option(None, help="Folder of the files it names; by default its own.")


def report_command(
    study: Path = StudyFile,
    output: Path = typer.Option(..., "-o", "--output", help="Folder of the report."),
    answers: Path | None = typer.Option(
        None,
        help="Table of answers (.csv, .json, .parquet), of this study run anywhere; by default "
        "what was served from the folder.",
    ),
    database: str = typer.Option("", help="PostgreSQL that it was served with."),
    overwrite: bool = typer.Option(False, "--overwrite", help="Replace a report that is there."),
    as_json: bool = options.Json,
) -> None:
    """Report a perceptual study: tests, models, plots, and tables for a paper.

    The folder has report.html, report.pdf, and every table as CSV and LaTeX. Who and what is left
    out follows the rules that study.toml fixed.
    """
    from elocute.study.report.report import make_report
    from elocute.study.report.report_files import check_place, write_report
    from elocute.study.stimuli.manifest import known_design

    check_place(output, overwrite)
    design, served = known_design(study, elsewhere=True)
    table, digest = _answers(study, answers, database, design)
    report = make_report(design, table, served_sha256=served, answers_sha256=digest)
    files = write_report(report, output, overwrite=overwrite)
    if as_json:
        facts = dict(report.facts)
        print(json.dumps({"outputs": [str(each) for each in files], **facts}))
    else:
        for name, value in report.facts[:3]:
            print(f"{name}: {value}")
        print(files[0])
    for warning in report.warnings:
        print(f"elocute: {warning}", file=sys.stderr)


def _answers(
    study: Path, answers: Path | None, database: str, design: Design
) -> tuple[list[Answer], str]:
    """The table, and the SHA-256 of it as CSV where it has no file."""
    import hashlib

    from elocute.files.reading import FileKind, read_bytes
    from elocute.study.report.answers import FILE_MAX_BYTES, answers_text, read_answers

    if answers is not None:
        if database:
            raise StudyError.about("--database", found="--answers beside it", allowed="one of them")
        table = read_answers(answers)
        data = read_bytes(answers, FileKind("a table of answers", FILE_MAX_BYTES, StudyError))
        return table, hashlib.sha256(data).hexdigest()
    from elocute.study.serving.store import Store

    folder = study if study.is_dir() else study.parent
    source = database or folder / "answers.db"
    if isinstance(source, Path) and not source.is_file():
        raise StudyError.about(
            source,
            found="no such file",
            allowed="answers",
            remedy="`elocute study serve` collects them; --answers names a table",
        )
    store = Store(design, source)
    try:
        table = store.answers()
    finally:
        store.close()
    return table, hashlib.sha256(answers_text(table, ".csv").encode()).hexdigest()


def plan_command(
    study: Path | None = typer.Argument(
        None, help="A study's folder or file, for its trials, stimuli and comparisons."
    ),
    plan: Plan = options_of(Plan, without=OF_STUDY),
    trials: int | None = option(Plan, "trials", default=None),
    stimuli: int | None = option(Plan, "stimuli", default=None),
    comparisons: int | None = option(Plan, "comparisons", default=None),
    margin: float | None = option(Plan, "margin", default=None),
    confidence: float | None = option(Plan, "confidence", default=None),
    data: Path | None = StudyData,
    as_json: bool = options.Json,
) -> None:
    """Say how many people a preference needs to be found, by simulated studies.

    People and stimuli differ, and answers lapse, as far as the options say. Who will be excluded
    comes on top.
    """
    from elocute.study.design.power import plan_for, plan_study
    from elocute.study.stimuli.manifest import known_design

    of_study = {
        "trials": trials,
        "stimuli": stimuli,
        "comparisons": comparisons,
        "margin": margin,
        "confidence": confidence,
    }
    chosen = {name: value for name, value in of_study.items() if value is not None}
    if study is None and data is not None:
        raise StudyError.about("--data", found="no study beside it", allowed="both, or neither")
    if study is not None:
        others = {name: value for name, value in asdict(plan).items() if name not in of_study}
        plan = plan_for(known_design(study, data)[0], **others, **chosen)
    else:
        plan = replace(plan, **chosen)
    result = plan_study(plan)
    if as_json:
        tried = [asdict(each) for each in result.tried]
        print(json.dumps({"people": result.people, "plan": asdict(plan), "tried": tried}))
        return
    wanted = "equivalence" if plan.equivalent else f"a preference of {100 * plan.share:g} %"
    print(
        f"{wanted}, {plan.trials} answers of each person, {plan.stimuli} stimuli, "
        f"{100 * plan.lapses:g} % lapses, significance {plan.level:.2g}"
    )
    print("people  found in      were answers independent")
    for each in result.tried:
        low, high = 100 * each.power.low, 100 * each.power.high
        print(
            f"{each.people:6}  {100 * each.power.value:3.0f} % ({low:.0f} to {high:.0f})"
            f"{'':4}{100 * each.exact:3.0f} %"
        )
    if result.people:
        print(f"{result.people} people are needed for {100 * plan.power:g} %")
    else:
        print(
            f"no number of people is enough for {100 * plan.power:g} %: stimuli differ too much "
            "for so few of them; show more stimuli"
        )


def simulate_command(
    study: Path = StudyFile,
    output: Path = typer.Option(..., "-o", "--output", help="Table of answers (.csv, .json)."),
    people: int = typer.Option(50, min=1, max=100_000, help="Number of people."),
    level: list[str] | None = typer.Option(
        None,
        help="CONDITION=NUMBER, its strength: logits, or points of a rating. Can be repeated; 0, "
        "or 50 points, where none is given.",
    ),
    data: Path | None = StudyData,
    crowd: Crowd = options_of(Crowd, without=("levels",)),
    seed: int = typer.Option(0, min=0, help="Seed of people, stimuli and answers."),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
) -> None:
    """Answer a study by a simulated crowd, to try it and its report before people are asked.

    What comes of it is no evidence of what people see, and a report of it says so.
    """
    from elocute.cli.outputs import check_file_suffix, plan_files
    from elocute.study.crowd import crowd_answers, seats_of
    from elocute.study.design.design_file import read_design
    from elocute.study.report.answers import SUFFIXES, write_answers
    from elocute.study.stimuli.manifest import known_design
    from elocute.study.stimuli.sources import has_patterns

    check_file_suffix(output, *SUFFIXES)
    design, _ = known_design(study, data)
    if data is not None and not has_patterns(read_design(study)):
        allowed = "a study with a pattern of sounds (ours/*.mp4)"
        raise StudyError.about("--data", found="no pattern in the study", allowed=allowed)
    levels = _levels(level or [], [each.name for each in design.judged])
    crowd = replace(crowd, levels=levels)
    plan = plan_files([study], [output], overwrite, no_clobber)
    if not plan.wants(output):
        return
    answers = crowd_answers(design, crowd, seats_of(design, people), seed)
    with plan.writing(output):
        write_answers(answers, output)
    print(f"{output}: {len(answers)} answers of {people} simulated people")


def _levels(texts: list[str], names: list[str]) -> dict[str, float]:
    levels = {}
    for each in texts:
        name, _, number = each.partition("=")
        try:
            levels[name] = float(number)
        except ValueError:
            levels[name] = float("nan")
        if name not in names or not abs(levels[name]) <= 100:
            raise StudyError.about(
                "--level",
                found=each,
                allowed=f"CONDITION=NUMBER, of {', '.join(names)} and -100 to 100",
            )
    return levels
