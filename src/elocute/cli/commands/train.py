"""`elocute train`: from a corpus to a model."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.command_group import CommandGroup
from elocute.cli.progress import EpochLines
from elocute.cli.settings_options import options_of
from elocute.errors import needs_extra
from elocute.files.work_folder import MODEL, no_empty_folder, prepare_training
from elocute.training.crnn.settings import CrnnTrainConfig
from elocute.training.karras.settings import KarrasTrainConfig
from elocute.training.voca.settings import VocaTrainConfig

if TYPE_CHECKING:
    from elocute.corpus.corpus_store import Corpus
    from elocute.training.karras.fit import TrainedKarras
    from elocute.training.settings import TrainingSettings
    from elocute.training.voca.fit import TrainedVoca

app = CommandGroup("Train models on a corpus.")

Output = typer.Option(..., "-o", "--output", help="Output folder for checkpoint, log and model.")
Device = typer.Option(
    "auto", help="Device: auto (cuda where there is one, else cpu), cpu, cuda, cuda:N or mps."
)
Resume = typer.Option(False, help="Resume from the checkpoint in the output folder.")


@app.command("voca")
def voca_command(
    corpus: Path = typer.Argument(..., help="Corpus folder, as `corpus convert` writes it."),
    output: Path = Output,
    split: str = options.Split,
    config: VocaTrainConfig = options_of(
        VocaTrainConfig,
        flags={
            "batch_pairs": "--batch",
            "velocity_weight": "--velocity",
            "reduced": "--reduced/--full-decoder",
        },
        presets=VocaTrainConfig.presets,
    ),
    device: str = Device,
    resume: bool = Resume,
    as_json: bool = options.Json,
) -> None:
    """Train VOCA on a corpus.

    The output folder receives model.onnx, checkpoint.safetensors, log.csv and TensorBoard events.
    """
    from elocute.corpus.corpus_store import open_corpus

    opened = open_corpus(corpus)
    with needs_extra("training", "train"):
        from elocute.training.voca.run import train_voca
    _train_on_corpus(train_voca, opened, split, config, output, device, resume, as_json)


@app.command("karras")
def karras_command(
    corpus: Path = typer.Argument(..., help="Corpus folder, as `corpus convert` writes it."),
    output: Path = Output,
    split: str = options.Split,
    config: KarrasTrainConfig = options_of(
        KarrasTrainConfig,
        flags={
            "batch_runs": "--batch",
            "noise": "--noise/--no-noise",
            "reduced": "--reduced/--full-decoder",
        },
        presets=KarrasTrainConfig.presets,
    ),
    device: str = Device,
    resume: bool = Resume,
    as_json: bool = options.Json,
) -> None:
    """Train the network of Karras et al. 2017, with which VOCA's paper compares.

    The output folder receives model.onnx, checkpoint.safetensors, log.csv and TensorBoard events.
    The styles of the model are the emotion vectors learned for each subject, and `neutral`.
    """
    from elocute.corpus.corpus_store import open_corpus

    opened = open_corpus(corpus)
    with needs_extra("training", "train"):
        from elocute.training.karras.run import train_karras
    _train_on_corpus(train_karras, opened, split, config, output, device, resume, as_json)


@app.command("crnn")
def crnn_command(
    shards: Path = typer.Argument(..., help="Folder of shards, as `propagate` writes it."),
    sounds: Path = options.SoundsOfShards,
    output: Path = Output,
    config: CrnnTrainConfig = options_of(
        CrnnTrainConfig, flags={"batch_clips": "--batch"}, presets=CrnnTrainConfig.presets
    ),
    device: str = Device,
    resume: bool = Resume,
    as_json: bool = options.Json,
) -> None:
    """Train the recurrent model on shards.

    The output folder receives model.onnx, checkpoint.safetensors, log.csv and TensorBoard events.
    Shards and sounds that cannot be used are reported and left out; the exit code is then 1.
    """
    from elocute.corpus.shards import open_shards

    with needs_extra("training", "train"):
        from elocute.training.crnn.run import train_crnn
        from elocute.training.device import resolve_device
    opened = open_shards(shards, sounds)
    resolve_device(device)
    with no_empty_folder(output), EpochLines(as_json) as report:
        prepare_training(output, resume)
        trained, missing = train_crnn(
            opened, config, output, resume=resume, report=report, device=device
        )
    broken = [*opened.broken, *missing]
    record = {
        "model": str(output / MODEL),
        "clips": len(opened),
        "broken": [{"name": name, "why": why} for name, why in broken],
        **{k: None if v != v else v for k, v in (trained.log[-1] if trained.log else {}).items()},
    }
    print(json.dumps(record) if as_json else output / MODEL)
    report_left_out(broken, len(opened))


def report_left_out(broken: list[tuple[str, str]], clips: int) -> None:
    """Say what was left out, and exit with code 1 if anything was."""
    for name, why in broken[:20]:
        typer.echo(f"elocute: left out {name}: {why}", err=True)
    if broken:
        typer.echo(f"elocute: {len(broken)} left out; {clips} clips in sound shards", err=True)
        raise typer.Exit(1)


def _train_on_corpus(
    train: Callable[..., TrainedVoca | TrainedKarras],
    corpus: Corpus,
    split: str,
    config: TrainingSettings,
    output: Path,
    device: str,
    resume: bool,
    as_json: bool,
) -> None:
    """Train, and say where the new model is; with JSON, what it can do too."""
    from elocute.training.device import resolve_device

    resolve_device(device)
    with no_empty_folder(output), EpochLines(as_json) as report:
        prepare_training(output, resume)
        trained = train(corpus, config, output, split, resume=resume, report=report, device=device)
    model, sample = output / MODEL, _sample(corpus, split, output)
    record = {"model": str(model), "styles": trained.styles, "sample": sample}
    print(json.dumps({**record, **(trained.log[-1] if trained.log else {})}) if as_json else model)


def _sample(corpus: Corpus, split: str, folder: Path) -> str | None:
    """A contact sheet of the new model saying a sentence that it was not trained on."""
    from elocute.animation import animate
    from elocute.head.builtin import load_builtin_head

    parts = corpus.split(split)
    names = parts.validation or parts.test
    if corpus.topology != load_builtin_head().name or not names:
        return None
    path = folder / "sample.png"
    model, style = folder / MODEL, "even"
    animate(corpus.sound(names[0]), model=model, style=style).write(path)
    return str(path)
