"""`elocute evaluate wild`: the second paper's experiments as tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.report import save_report
from elocute.errors import InputError, needs_extra

if TYPE_CHECKING:
    from elocute.corpus.shards import Shards
    from elocute.evaluation.concordance import Figures

PAPER = {"speaker": 0.621, "word": 0.502, "sentences": 0.463}  # µ28 on test, Table 2


def wild_command(
    shards: Path = typer.Argument(..., help="A folder of shards."),
    sounds: Path = typer.Argument(..., help="The folder that their sounds are in."),
    output: Path = typer.Option(..., "-o", "--output", help="Folder for trainings and report."),
    sentences: Path | None = typer.Option(None, help="A corpus of sentences: continuous speech."),
    subject: str | None = typer.Option(None, help="Only sentences by this subject of the corpus."),
    real: Path | None = typer.Option(None, help="Tracked talker (grid_s1/clips): the mouth."),
    names: Path | None = typer.Option(None, help="A text file of the talker's clips; else all."),
    clips: int = typer.Option(50, min=1, help="Sentences measured, evenly taken."),
    epochs: int = typer.Option(50, help="Epochs of each training."),
    learning_rate: float = typer.Option(5e-4, help="Adam's learning rate."),
    last_rate: float = typer.Option(1.0, help="Share of it left in the last epoch."),
    weight_power: float = typer.Option(
        1.0, help="Parameters weigh as their variance to this power; 0: all the same."
    ),
    augment: float = typer.Option(0.0, help="Share of clips made worse in training."),
    highest_hz: float = typer.Option(22050.0, help="Ignore higher frequencies: 8000 for 16 kHz."),
    trainings: str = typer.Option("speaker,word,mse", help="Which trainings, for trials."),
    seed: int = typer.Option(0, min=0, max=options.SEED_MAX, help="Seed of all random numbers."),
    resume: bool = typer.Option(False, help="Resume the trainings in the output folder."),
    tables: list[Path] | None = options.Table,
    as_json: bool = options.Json,
) -> None:
    """Train and measure: other speakers, other words, sentences, losses, noise, bases, a talker.

    ρc is over all frames of the clips together, with 95 % by drawing clips again. Trainings go on
    where they were left; report.json is written last.
    """
    from elocute.cli.outputs import plan_files
    from elocute.cli.progress import Lines
    from elocute.cli.tables import check_tables, write_tables
    from elocute.cli.train import name_broken
    from elocute.cli.work_folder import prepare_trainings
    from elocute.corpus.shards import open_shards

    with needs_extra("training", "train"):
        from elocute.evaluation import wild_experiments
        from elocute.training.crnn.config import CrnnTrainConfig
        from elocute.training.crnn.feature_cache import cache_features
    chosen = [name.strip() for name in trainings.split(",") if name.strip()]
    if "speaker" not in chosen or not set(chosen) <= set(wild_experiments.TRAININGS):
        raise InputError.about(
            f"--trainings {trainings!r}",
            found="speaker is missing, or one is unknown",
            allowed=", ".join(wild_experiments.TRAININGS),
        )
    config = CrnnTrainConfig(
        epochs=epochs,
        learning_rate=learning_rate,
        last_rate=last_rate,
        weight_power=weight_power,
        augment=augment,
        highest_hz=highest_hz,
        seed=seed,
    )
    files = check_tables(tables)
    plan = plan_files([shards], files, False, False)
    opened = open_shards(shards, sounds)
    corpus, taken = _sentences(sentences, opened, subject, clips)
    prepare_trainings(output, chosen, resume)
    heard = cache_features(opened, output, config.fps)
    for name in chosen:
        wild_experiments.rows_of(heard, name)
    table, shares = {}, wild_experiments.shares_of(opened)
    for name in chosen:
        trained = wild_experiments.train_one(
            opened, heard, name, config, output / name, Lines(as_json)
        )
        for part, found in wild_experiments.judge(trained, heard, name, shares).items():
            table[f"{name} {part}"] = found
        if name == "speaker":
            for kind in ("white", "babble"):
                for snr in (0.0, 10.0, 20.0):
                    table[f"{kind} {snr:.0f} dB"] = wild_experiments.judge_noise(
                        trained.network, opened, heard, kind, snr, shares
                    )
    model = output / "speaker" / wild_experiments.MODEL
    bases: dict[str, Any] = {}
    if corpus is not None:
        table |= _continuous(corpus, taken, model, opened, shares)
        bases = _bases(corpus, taken, opened)
    report = {
        "shards": shards.name,
        "clips": len(opened),
        "parameters": opened.components,
        "epochs": epochs,
        "config": config.record(),
        "paper": PAPER,
        "concordance": {name: found.record() for name, found in table.items()},
        "bases_mm": bases,
        "talker": _talker(real, names, model) if real else {},
    }
    text = save_report(output / "report.json", report)
    first = max((len(found.first) for found in table.values()), default=0)
    write_tables(
        plan,
        files,
        ["concordance", "clips", "mean", "weighted", *(f"c{k + 1}" for k in range(first))],
        [[name, f.clips, f.mean, f.weighted, *f.first] for name, f in table.items()],
    )
    if as_json:
        print(text)
    else:
        _show(table, report)
    name_broken([*opened.broken, *heard.missing], len(opened))


def _sentences(
    path: Path | None, shards: Shards, subject: str | None, count: int
) -> tuple[Any, list[str]]:
    """The corpus of sentences and the names of those that are judged."""
    if path is None:
        return None, []
    from elocute.corpus.corpus_store import open_corpus
    from elocute.errors import CorpusError

    corpus = open_corpus(path)
    vertices = shards.basis.head.vertex_count
    if corpus.vertex_count != vertices:
        raise CorpusError.about(
            path, found=f"{corpus.vertex_count} vertices", allowed=f"{vertices}, as the basis has"
        )
    if subject is not None and subject not in corpus.subjects:
        raise CorpusError.about(
            path, found=f"no subject {subject}", allowed=", ".join(corpus.subjects)
        )
    names = [entry.name for entry in corpus.entries if subject in (None, entry.subject)]
    return corpus, names[:: max(1, len(names) // count)][:count]


def _continuous(
    corpus: Any, names: list[str], model: Path, shards: Shards, shares: Any
) -> dict[str, Figures]:
    """With the state going on, and in pieces of 15 frames as the paper does."""
    from elocute.evaluation.wild_experiments import judge_sentences
    from elocute.models.crnn_network import JOINS, CrnnNetwork, stream_weights

    opened, basis = CrnnNetwork(model), shards.basis.head.expression_basis
    return {
        f"sentences {joins}": judge_sentences(
            corpus,
            names,
            basis,
            opened.record.fps,
            shares,
            lambda sound, joins=joins: stream_weights(opened, sound, joins),
        )
        for joins in JOINS
    }


def _bases(corpus: Any, names: list[str], shards: Shards) -> dict[str, dict[str, float]]:
    from elocute.evaluation.wild_experiments import compare_bases
    from elocute.head.builtin import load_builtin_head
    from elocute.motion.curves import ARKIT_NAMES

    head = load_builtin_head()
    if corpus.vertex_count != head.vertex_count:
        return {}
    places = [head.expression_names.index(n) for n in ARKIT_NAMES if n in head.expression_names]
    found = compare_bases(
        corpus, names, shards.basis.head.expression_basis, head.expression_basis[places]
    )
    return {p.name: {"components": p.components, "mean_mm": p.mean_mm} for p in found}


def _talker(folder: Path, names: Path | None, model: Path) -> dict[str, Any]:
    """The real talker: the recurrent model beside VOCA and the rules."""
    from dataclasses import asdict

    from elocute.animation import animate
    from elocute.cli.evaluate import read_names
    from elocute.evaluation.real_talker import evaluate_real
    from elocute.head.builtin import load_builtin_head
    from elocute.motion.mouth_measures import measure_mouth

    eye_mm, wanted = 1000 * load_builtin_head().eye_distance_m, read_names(names)
    found = {}
    for name, chosen in (("crnn", model), ("voca", "voca"), ("articulation", "articulation")):
        summary, _ = evaluate_real(
            folder,
            lambda sound, chosen=chosen: measure_mouth(animate(sound, model=chosen).motion),
            eye_mm,
            names=wanted,
        )
        found[name] = {k: v if v == v else None for k, v in asdict(summary).items()}
    return found


def _show(table: dict[str, Figures], report: dict[str, Any]) -> None:
    print(f"{'concordance':20} {'clips':>6} {'mean':>20} {'weighted':>8}  c1 … c5")
    for name, found in table.items():
        mean = found.mean
        first = " ".join(f"{interval.value:5.2f}" for interval in found.first)
        print(
            f"{name:20} {found.clips:6} {mean.value:6.3f} [{mean.low:5.3f}, {mean.high:5.3f}] "
            f"{found.weighted.value:8.3f}  {first}"
        )
    print("paper, test, µ28:", ", ".join(f"{name} {value}" for name, value in PAPER.items()))
    for name, row in report["bases_mm"].items():
        print(f"{name:20} {row['components']:6} shapes leave {row['mean_mm']:.4f} mm")
    for name, row in report["talker"].items():
        shown = ("opening_best_r", "width_best_r", "closure_recall", "false_closure")
        print(f"{name:20}", ", ".join(f"{what} {row[what]:.3f}" for what in shown))
