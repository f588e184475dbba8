"""`elocute evaluate`: speech models and alignments measured."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.command_group import CommandGroup
from elocute.cli.commands import (
    evaluate_alignment,
    evaluate_corpus,
    evaluate_features,
    evaluate_mouth,
    evaluate_wild,
)
from elocute.cli.name_lists import read_names
from elocute.cli.progress import progress_bar

if TYPE_CHECKING:
    from elocute.motion.curves import Curves

app = CommandGroup("Evaluate speech models, and alignments of recordings.")
app.command("alignment")(evaluate_alignment.alignment_command)
app.command("corpus")(evaluate_corpus.corpus_command)
app.command("features")(evaluate_features.features_command)
app.command("wild")(evaluate_wild.wild_command)
app.command("noise")(evaluate_mouth.noise_command)
app.command("styles")(evaluate_mouth.styles_command)
app.command("identities")(evaluate_mouth.identities_command)


@app.command("real")
def real_command(
    folder: Path = typer.Argument(..., help="Folder of NAME.npz (tracked mouth) and NAME.ogg."),
    names: Path | None = typer.Option(None, help="Text file of the names to use; all by default."),
    style: str = options.StyleName,
    strength: float = options.Strength,
    model: str = options.Model,
    per_clip: bool = typer.Option(False, help="Also print every clip."),
    as_json: bool = options.Json,
) -> None:
    """Compare predicted lips with those of a real talker: correlation and closures."""
    from elocute.animation import animate
    from elocute.evaluation.tracked_mouth_scores import evaluate_tracked_mouths
    from elocute.head.builtin import load_builtin_head
    from elocute.motion.mouth_measures import measure_mouth

    wanted = read_names(names)
    eye_distance_mm = 1000 * load_builtin_head().eye_distance_m

    def predict(sound: Path) -> Curves:
        return measure_mouth(animate(sound, style=style, strength=strength, model=model).motion)

    with progress_bar("measuring", as_json) as progress:
        summary, scores = evaluate_tracked_mouths(
            folder, predict, eye_distance_mm, names=wanted, progress=progress
        )
    if as_json:
        record = {"summary": asdict(summary)}
        print(json.dumps(record | ({"clips": list(map(asdict, scores))} if per_clip else {})))
        return
    if per_clip:
        for score in scores:
            print(
                f"{score.name:12} opening r {score.opening_best_r:5.2f}"
                f" at {score.opening_lag_s:+.2f} s  closures {score.closures_met}/{score.closures}"
                f"  false {score.false_met}/{score.others}"
            )
    for name, value in asdict(summary).items():
        print(f"{name:22} {value:.3f}" if isinstance(value, float) else f"{name:22} {value}")
