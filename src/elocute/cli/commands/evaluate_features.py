"""`elocute evaluate features`: one training per speech encoder (VOCA 2019, section 7.2)."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.errors import CorpusError, InputError, needs_extra

if TYPE_CHECKING:
    from elocute.corpus.corpus_store import Corpus
    from elocute.evaluation.corpus_scores import MetricConfig, SubjectScore

SHOWN = ("lve_mm", "mve_mm", "velocity_mm", "closure_recall", "closure_precision")


def features_command(
    corpus: Path = options.Corpus,
    output: Path = typer.Option(..., "-o", "--output", help="Output folder for models and report."),
    encoders: str = typer.Option(
        "phones,fbank", help="Speech encoders to compare, separated by commas."
    ),
    epochs: int = typer.Option(50, help="Epochs of each training."),
    split: str = options.Split,
    contacts: str = options.ContactsOff,
    resume: bool = typer.Option(False, help="Resume the trainings in the output folder."),
    table: list[Path] | None = options.Table,
    overwrite: bool = options.OverwriteTable,
    no_clobber: bool = options.KeepTable,
    as_json: bool = options.Json,
) -> None:
    """Train VOCA once per speech encoder, all else equal, and measure each on the test part.

    The output folder receives a folder for each encoder, report.json and, on the built-in head,
    mouth.png: mouth opening in the first test clip, as recorded and as each model predicts it.
    """
    from elocute.articulation.settings import lays_contacts
    from elocute.cli.commands.evaluate_corpus import cell, measure_of
    from elocute.cli.outputs import plan_files, write_json_report
    from elocute.cli.tables import check_tables, write_tables
    from elocute.corpus.corpus_store import open_corpus

    names = list(dict.fromkeys(name.strip() for name in encoders.split(",") if name.strip()))
    if not names:
        raise InputError.about(f"--encoders {encoders!r}", found="none", allowed="phones,fbank,…")
    files = check_tables(table)
    plan = plan_files([corpus], files, overwrite, no_clobber)
    opened = open_corpus(corpus)
    clips = list(opened.split(split).test)
    if not clips:
        raise CorpusError.about(opened.folder, found=f"no clip in test of split {split}")
    measure, finished = measure_of(opened, None, None), lays_contacts(contacts)
    if finished and not measure.mouth:
        raise InputError.about(
            "`contacts` auto",
            found="a corpus of another head",
            allowed="off",
            remedy="leave it out",
        )
    models = _train(opened, names, output, epochs, split, resume, as_json)
    rows = {
        name: _measured(opened, clips, model, measure, finished) for name, model in models.items()
    }
    if measure.mouth:
        _plot(opened, clips[0], models, output / "mouth.png", finished)
    report = {
        "corpus": corpus.name,
        "epochs": epochs,
        "contacts": contacts,
        "clips": len(clips),
        "confidence": 0.95,
        "encoders": {name: row.record() for name, row in rows.items()},
    }
    text = json.dumps(report, allow_nan=False)
    write_json_report(output / "report.json", text)
    cells = [[name, *(row.intervals[column] for column in SHOWN)] for name, row in rows.items()]
    write_tables(plan, files, ["encoder", *SHOWN], cells)
    if as_json:
        print(text)
        return
    print(f"{'encoder':16}", *(f"{name:>24}" for name in SHOWN))
    for name, row in rows.items():
        shown = (cell(row.intervals[column]) for column in SHOWN)
        print(f"{name:16}", *(f"{text:>24}" for text in shown))


def _train(
    corpus: Corpus,
    encoders: list[str],
    output: Path,
    epochs: int,
    split: str,
    resume: bool,
    quiet: bool,
) -> dict[str, Path]:
    """Encoder to its model; all settings are checked before the first hour is spent."""
    from elocute.cli.progress import EpochLines
    from elocute.encoders.registry import resolve_encoder
    from elocute.files.work_folder import MODEL, no_empty_folder, prepare_trainings

    with needs_extra("training", "train"):
        from elocute.training.voca.run import train_voca
        from elocute.training.voca.settings import VocaTrainConfig
    configs = {name: VocaTrainConfig(epochs=epochs, encoder=name) for name in encoders}
    for name in encoders:
        resolve_encoder(name)
    folders = {name: output / re.sub(r"\W+", "_", name) for name in encoders}
    with no_empty_folder(output):
        prepare_trainings(output, [folder.name for folder in folders.values()], resume)
        models = {}
        for name, config in configs.items():
            train_voca(
                corpus, config, folders[name], split, resume=resume, report=EpochLines(quiet)
            )
            models[name] = folders[name] / MODEL
    return models


def _measured(
    corpus: Corpus, clips: list[str], model: Path, measure: MetricConfig, contacts: bool
) -> SubjectScore:
    """Every clip in the style that fits its subject best."""
    from elocute.evaluation.corpus_scores import best_style_scores, score_clips
    from elocute.evaluation.model_predictions import clip_predictor
    from elocute.models.registry import open_model

    opened = open_model(model)
    predict = clip_predictor(opened, corpus, contacts=contacts)
    scores = score_clips(corpus, clips, opened.styles, predict, measure)
    return best_style_scores(scores)[-1]


def _plot(corpus: Corpus, clip: str, models: dict[str, Path], path: Path, contacts: bool) -> None:
    import numpy as np

    from elocute.evaluation.lip_closures import lip_opening
    from elocute.evaluation.model_predictions import clip_predictor, recorded_motion
    from elocute.models.registry import open_model
    from elocute.models.style_mixes import EVEN
    from elocute.motion.curves import Curves
    from elocute.plots.curves import plot_overlay

    tracks = {"recorded": recorded_motion(corpus, clip)}
    for name, model in models.items():
        tracks[name] = clip_predictor(open_model(model), corpus, contacts=contacts)(clip, EVEN)
    values = np.stack([lip_opening(track) for track in tracks.values()], axis=1)
    curves = Curves(values.astype(np.float32), tuple(tracks), corpus.fps)
    plot_overlay(curves, path, title=f"mouth opening, {clip}", unit="mm", shade=False)
