"""`elocute evaluate wild`: the experiments of In the wild (2019) as tables."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.name_lists import read_names
from elocute.cli.settings_options import options_of
from elocute.errors import needs_extra
from elocute.training.crnn.settings import CrnnTrainConfig

if TYPE_CHECKING:
    from elocute.evaluation.concordance import ConcordanceScore


def wild_command(
    shards: Path = typer.Argument(..., help="A folder of shards."),
    sounds: Path = options.SoundsOfShards,
    output: Path = typer.Option(
        ..., "-o", "--output", help="Output folder for trainings and report."
    ),
    sentences: Path | None = typer.Option(
        None, help="Corpus folder of sentences, for continuous speech."
    ),
    exact: Path | None = typer.Option(
        None, help="A folder of shards: the same clips with exact parameters, to measure against."
    ),
    held_out: Path | None = typer.Option(
        None,
        help="JSON file of the words that the training `word` holds out: split.json of "
        "recipes.build_words; by default one word in ten.",
    ),
    subject: str | None = typer.Option(None, help="Use only the sentences of this subject."),
    real: Path | None = typer.Option(
        None, help="Folder of a tracked real talker (grid_s1/clips), for the mouth."
    ),
    names: Path | None = typer.Option(
        None, help="Text file of the talker's clips to use; all by default."
    ),
    contacts: str = options.Contacts,
    clips: int = typer.Option(50, min=1, help="Number of sentences to measure, evenly spaced."),
    trainings: str = typer.Option(
        "speaker,word,mse", help="Trainings to run, separated by commas."
    ),
    config: CrnnTrainConfig = options_of(
        CrnnTrainConfig, flags={"batch_clips": "--batch"}, presets=CrnnTrainConfig.presets
    ),
    resume: bool = typer.Option(False, help="Resume the trainings in the output folder."),
    tables: list[Path] | None = options.Table,
    overwrite: bool = options.OverwriteTable,
    no_clobber: bool = options.KeepTable,
    as_json: bool = options.Json,
) -> None:
    """Train and measure: new speakers, new words, sentences, losses, noise, bases, a real talker.

    ρc is the concordance over all frames of the clips together, with 95 % confidence from drawing
    clips again. The paper's test set is what its participant said herself, whose motion was carried
    over (rows `source`, with --no-captured); rows `participant` are of another. report.json is
    written last.
    """
    from elocute.articulation.settings import lays_contacts
    from elocute.cli.commands.train import report_left_out
    from elocute.cli.outputs import plan_files, write_json_report
    from elocute.cli.progress import EpochLines
    from elocute.cli.tables import check_tables, write_tables
    from elocute.corpus.corpus_store import open_corpus
    from elocute.corpus.shards import open_shards
    from elocute.files.work_folder import no_empty_folder, prepare_trainings

    with needs_extra("training", "train"):
        from elocute.evaluation.wild_experiments import (
            check_trainings,
            select_sentences,
            study_wild,
        )
        from elocute.evaluation.wild_parts import read_held_out
    lays_contacts(contacts)
    chosen = [name.strip() for name in trainings.split(",") if name.strip()]
    check_trainings(chosen)
    files = check_tables(tables)
    plan = plan_files([shards], files, overwrite, no_clobber)
    words = None if held_out is None else read_held_out(held_out)
    opened = open_shards(shards, sounds)
    known = None if exact is None else open_shards(exact, sounds)
    corpus = None if sentences is None else open_corpus(sentences)
    taken = [] if corpus is None else select_sentences(corpus, opened, subject, clips)
    wanted = read_names(names)
    with no_empty_folder(output):
        prepare_trainings(output, chosen, resume)
        result = study_wild(
            opened,
            output,
            config,
            trainings=chosen,
            held_out=words,
            exact=known,
            sentences=corpus,
            names=taken,
            talker=real,
            talker_names=wanted,
            contacts=contacts,
            report=EpochLines(as_json),
        )
    report = {
        "shards": shards.name,
        "clips": len(opened),
        "parameters": opened.components,
        "epochs": config.epochs,
        "contacts": contacts,
        "config": asdict(config),
        **result.record(),
    }
    text = json.dumps(report, allow_nan=False)
    write_json_report(output / "report.json", text)
    write_tables(plan, files, *_table(result.concordance))
    if as_json:
        print(text)
    else:
        _show(result.concordance, report)
    report_left_out([*opened.broken, *result.missing], len(opened))


def _table(rows: dict[str, ConcordanceScore]) -> tuple[list[str], list[list[Any]]]:
    """Columns and rows of the table, with as many parameters of their own as any row has."""
    from elocute.evaluation.wild_experiments import PAPER

    first = max((len(figures.first) for figures in rows.values()), default=0)
    names = [f"c{k + 1}" for k in range(first)]
    columns = ["concordance", "clips", "mean", "paper's mean", "weighted", *names]
    return columns, [
        [name, f.clips, f.mean, PAPER.get(name), f.weighted, *f.first] for name, f in rows.items()
    ]


def _show(table: dict[str, ConcordanceScore], report: dict[str, Any]) -> None:
    print(f"{'concordance':28} {'clips':>6} {'mean':>20} paper {'weighted':>8}  c1 … c5")
    for name, scores in table.items():
        mean, paper = scores.mean, report["paper"].get(name)
        first = " ".join(f"{interval.value:5.2f}" for interval in scores.first)
        print(
            f"{name:28} {scores.clips:6} {mean.value:6.3f} [{mean.low:5.3f}, {mean.high:5.3f}] "
            f"{'' if paper is None else f'{paper:.3f}':5} {scores.weighted.value:8.3f}  {first}"
        )
    for name, row in report["bases_mm"].items():
        print(f"{name:20} {row['components']:6} shapes leave {row['mean_mm']:.4f} mm")
    for name, row in report["talker"].items():
        shown = ("opening_best_r", "width_best_r", "closure_recall", "false_closure")
        print(f"{name:20}", ", ".join(f"{what} {row[what]:.3f}" for what in shown))
