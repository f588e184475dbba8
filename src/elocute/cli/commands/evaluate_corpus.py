"""`elocute evaluate corpus`: a model against recorded clips."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.name_lists import names_of_part
from elocute.cli.outputs import check_file_suffix, plan_files, write_json_report
from elocute.cli.progress import progress_bar

if TYPE_CHECKING:
    from elocute.corpus.corpus_store import Corpus
    from elocute.evaluation.confidence_intervals import ConfidenceInterval
    from elocute.evaluation.corpus_scores import MetricConfig, SubjectScore
    from elocute.evaluation.vertex_regions import VertexRegion

PARTS = ("test", "validation", "train")


def corpus_command(
    corpus: Path = options.Corpus,
    model: str = options.Model,
    split: str = options.Split,
    part: str = typer.Option("test", help="Part to measure: test, validation or train."),
    style: str = typer.Option(
        "each",
        help="Style: each, best (per subject, chosen by the truth), even, a name or a mix.",
    ),
    lips: Path | None = typer.Option(
        None,
        help="Lip vertices for LVE (.json, .txt, .npy, .npz, .pkl or .pp); by default those of the "
        "built-in head, or the published list for FLAME and BIWI.",
    ),
    upper_face: Path | None = typer.Option(None, help="Upper-face vertices for FDD, likewise."),
    contacts: str = options.ContactsMeasuredOff,
    mix: str = options.Mix,
    limit: int = typer.Option(0, min=0, help="Use only this many clips, evenly spaced; 0 for all."),
    seed: int = typer.Option(0, min=0, help="Seed of the confidence intervals."),
    output: Path | None = options.JsonReport,
    table: list[Path] | None = options.Table,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Compare predicted with recorded motion: lips, whole face, dynamics and closures.

    LVE is the largest error of a lip vertex in each frame, as a distance (mm) and squared (mm²).
    FDD is given twice: as CodeTalker's paper defines it (from distances, mm), and as the code
    behind the published figures computes it (from squared distances, mm²). SLCC is the correlation
    of how much lips move with how loud the speech is, over clips. The last two are shares of the
    silence in which predicted and true lips move.
    """
    from elocute.articulation.settings import mixes_outputs
    from elocute.cli.tables import check_tables, write_tables
    from elocute.corpus.corpus_store import open_corpus
    from elocute.evaluation.corpus_scores import best_style_scores, score_clips, subject_scores
    from elocute.evaluation.model_predictions import clip_predictor
    from elocute.models.registry import open_model

    check_file_suffix(output, ".json")
    tables = check_tables(table)
    lists = [path for path in (lips, upper_face) if path is not None]
    plan = plan_files([corpus, model, *lists], [output, *tables], overwrite, no_clobber)
    opened = open_corpus(corpus)
    names = _names(opened, split, part, limit)
    measure = measure_of(opened, lips, upper_face)
    chosen, outputs = open_model(model), mixes_outputs(mix)
    styles = (chosen.styles or ("plain",)) if style in ("each", "best") else (style,)
    scores_of: dict[str, list[SubjectScore]] = {}
    for each in options.contacts_measured(contacts):
        predict = clip_predictor(chosen, opened, contacts=each == "auto", outputs=outputs)
        with progress_bar(f"measuring, contacts {each}", as_json) as progress:
            scores = score_clips(opened, names, styles, predict, measure, progress)
        scores_of[each] = (best_style_scores if style == "best" else subject_scores)(scores, seed)
    report = {
        "corpus": corpus.name,
        "model": Path(model).name,
        "split": split,
        "part": part,
        "style": style,
        "contacts": contacts,
        "clips": len(names),
        **measure.record(),
        "confidence": 0.95,
        "rows": [
            {"contacts": each, **row.record()} for each in scores_of for row in scores_of[each]
        ],
    }
    text = json.dumps(report, allow_nan=False)
    if output is not None and plan.wants(output):
        with plan.writing(output):
            write_json_report(output, text)
    write_tables(plan, tables, *_table(scores_of))
    if as_json:
        print(text)
    else:
        _show(scores_of, measure)


def _names(corpus: Corpus, split: str, part: str, limit: int) -> list[str]:
    names = names_of_part(corpus, split, part, PARTS)
    step = max(1, len(names) // limit) if limit else 1
    return names[::step][: limit or None]


def measure_of(corpus: Corpus, lips: Path | None, upper_face: Path | None) -> MetricConfig:
    """Lists of files; else those of the built-in head, FLAME or BIWI, whose mesh it is."""
    from elocute.corpus.topologies import topology_of
    from elocute.evaluation.corpus_scores import MetricConfig
    from elocute.evaluation.vertex_regions import (
        builtin_region,
        published_region,
        read_vertex_region,
    )
    from elocute.head.builtin import load_builtin_head

    head, count = load_builtin_head(), corpus.vertex_count
    ours = corpus.topology == head.name and count == head.vertex_count
    known = topology_of(count)
    face = corpus.template(corpus.subjects[0])

    def chosen(path: Path | None, name: str) -> VertexRegion | None:
        if path is not None:
            return read_vertex_region(path, count, region=name, template=face)
        if ours:
            return builtin_region(name)
        return published_region(known, name) if known else None

    return MetricConfig(chosen(lips, "lips"), chosen(upper_face, "upper_face"), mouth=ours)


def _table(scores: dict[str, list[SubjectScore]]) -> tuple[list[str], list[list[Any]]]:
    """Columns and rows of the table, with the measures that any row has."""
    there = _present(scores)
    columns = ["subject", "style", "contacts", "clips", *(title for _, title in there)]
    cells = [
        [row.subject, row.style, each, row.clips, *(row.intervals[name] for name, _ in there)]
        for each, rows in scores.items()
        for row in rows
    ]
    return columns, cells


def _present(scores: dict[str, list[SubjectScore]]) -> list[tuple[str, str]]:
    """Name and title of the measures that any row has."""
    from elocute.evaluation.metrics import TITLES

    rows = [row for each in scores.values() for row in each]
    return [c for c in TITLES.items() if any(row.intervals[c[0]].record() for row in rows)]


def _show(scores: dict[str, list[SubjectScore]], measure: MetricConfig) -> None:
    """One line per row; what no row has is left out and named below."""
    there = _present(scores)
    titles = (f"{title:>22}" for _, title in there)
    print(f"{'subject':12} {'style':12} {'contacts':8} {'clips':>5}", *titles)
    for each, rows in scores.items():
        for row in rows:
            cells = (f"{cell(row.intervals[name]):>22}" for name, _ in there)
            print(f"{row.subject:12} {row.style:12} {each:8} {row.clips:5}", *cells)
    print("[low, high]: 95 % confidence over clips")
    for title, chosen in (("lips", measure.lips), ("upper face", measure.upper_face)):
        if chosen:
            print(f"{title}: {chosen.name}, {len(chosen.indices)} vertices, {chosen.digest}")
        else:
            print(
                f"{title}: not available in this topology; name vertices with --lips, --upper-face"
            )
    if not measure.mouth:
        print("closures: not available in this topology")


def cell(interval: ConfidenceInterval) -> str:
    if interval.record() is None:
        return "-"
    return f"{interval.value:.3g} [{interval.low:.3g}, {interval.high:.3g}]"
