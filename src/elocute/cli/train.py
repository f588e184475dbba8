"""`elocute train`: from a corpus to a model."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.commands import Commands
from elocute.cli.progress import Lines
from elocute.cli.work_folder import prepare_training
from elocute.errors import needs_extra

if TYPE_CHECKING:
    from elocute.corpus.corpus_store import Corpus

app = Commands("Train models on a corpus.")


@app.command("voca")
def voca_command(
    corpus: Path = typer.Argument(..., help="A corpus folder (elocute corpus convert makes one)."),
    output: Path = typer.Option(..., "-o", "--output", help="Folder for checkpoint, log, model."),
    encoder: str = typer.Option(
        "phones", help="What hears: phones, fbank, deepspeech:FILE.pb, wav2vec2:FOLDER, …"
    ),
    split: str = typer.Option("default", help="Which split of the corpus."),
    epochs: int = typer.Option(50, help="Passes over the training part."),
    batch: int = typer.Option(64, help="Pairs of neighbouring frames in a batch."),
    learning_rate: float = typer.Option(1e-4, help="Of Adam."),
    velocity: float = typer.Option(10.0, help="Weight of the velocity term."),
    seed: int = typer.Option(0, min=0, max=options.SEED_MAX, help="Of everything random."),
    full_decoder: bool = typer.Option(False, help="Train vertex by vertex: same loss, far slower."),
    device: str = typer.Option("auto", help="auto, cpu, cuda, cuda:N or mps; auto: cuda, or cpu."),
    resume: bool = typer.Option(False, help="Go on from the checkpoint in the output folder."),
    as_json: bool = options.Json,
) -> None:
    """Train VOCA; leaves model.onnx, checkpoint.safetensors, log.csv and TensorBoard events."""
    from elocute.corpus.corpus_store import open_corpus

    opened = open_corpus(corpus)
    with needs_extra("training", "train"):
        from elocute.training.device import resolve_device
        from elocute.training.voca.config import TrainConfig
        from elocute.training.voca.run import MODEL, train_voca
    config = TrainConfig(
        epochs=epochs,
        batch_pairs=batch,
        learning_rate=learning_rate,
        velocity_weight=velocity,
        seed=seed,
        reduced=not full_decoder,
        encoder=encoder,
    )
    resolve_device(device)
    prepare_training(output, resume)
    with Lines(as_json) as report:
        trained = train_voca(
            opened, config, output, split, resume=resume, report=report, device=device
        )
    sample = _sample(opened, split, output)
    record = {
        "model": str(output / MODEL),
        "styles": trained.styles,
        "sample": sample,
        **(trained.log[-1] if trained.log else {}),
    }
    print(json.dumps(record) if as_json else output / MODEL)


@app.command("crnn")
def crnn_command(
    shards: Path = typer.Argument(..., help="A folder of shards (elocute propagate makes one)."),
    sounds: Path = typer.Argument(..., help="The folder that their sounds are in."),
    output: Path = typer.Option(..., "-o", "--output", help="Folder for checkpoint, log, model."),
    epochs: int = typer.Option(50, help="Passes over the training part."),
    batch: int = typer.Option(50, help="Clips in a batch."),
    learning_rate: float = typer.Option(5e-4, help="Of Adam."),
    last_rate: float = typer.Option(1.0, help="Share of it that the last epoch has left."),
    loss: str = typer.Option("concordance", help="concordance, or mse."),
    weight_power: float = typer.Option(
        1.0, help="Parameters weigh as their variance to this power; 0: all the same."
    ),
    keep: float = typer.Option(0.5, help="Share of a clip kept when it is cut at random."),
    augment: float = typer.Option(
        0.0, help="Share of clips made worse: noise, room, voice, tempo."
    ),
    highest_hz: float = typer.Option(22050.0, help="Do not hear above: 8000 for 16 kHz sounds."),
    seed: int = typer.Option(0, min=0, max=options.SEED_MAX, help="Of everything random."),
    device: str = typer.Option("auto", help="auto, cpu, cuda, cuda:N or mps; auto: cuda, or cpu."),
    resume: bool = typer.Option(False, help="Go on from the checkpoint in the output folder."),
    as_json: bool = options.Json,
) -> None:
    """Train the recurrent model; leaves model.onnx, checkpoint, log.csv and TensorBoard events.

    Shards and sounds that cannot be used are named and left out; then it ends with 1.
    """
    from elocute.corpus.shards import open_shards

    with needs_extra("training", "train"):
        from elocute.training.crnn.config import CrnnTrainConfig
        from elocute.training.crnn.run import MODEL, train_crnn
        from elocute.training.device import resolve_device
    config = CrnnTrainConfig(
        epochs=epochs,
        batch_clips=batch,
        learning_rate=learning_rate,
        last_rate=last_rate,
        loss=loss,
        weight_power=weight_power,
        keep=keep,
        augment=augment,
        highest_hz=highest_hz,
        seed=seed,
    )
    opened = open_shards(shards, sounds)
    resolve_device(device)
    prepare_training(output, resume)
    with Lines(as_json) as report:
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
    name_broken(broken, len(opened))


def name_broken(broken: list[tuple[str, str]], clips: int) -> None:
    """Say what was left out, and end with 1 if anything was."""
    for name, why in broken[:20]:
        typer.echo(f"elocute: left out {name}: {why}", err=True)
    if broken:
        typer.echo(f"elocute: {len(broken)} left out; {clips} clips in sound shards", err=True)
        raise typer.Exit(1)


def _sample(corpus: Corpus, split: str, folder: Path) -> str | None:
    """A contact sheet of the new model saying a sentence that it was not trained on."""
    from elocute.animation import animate
    from elocute.head.builtin import load_builtin_head

    parts = corpus.split(split)
    names = parts.validation or parts.test
    if corpus.topology != load_builtin_head().name or not names:
        return None
    path = folder / "sample.png"
    model, style = folder / "model.onnx", "even"
    animate(corpus.sound(names[0]), model=model, style=style).write(path)
    return str(path)
