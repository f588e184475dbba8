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
    evaluate_benchmark,
    evaluate_corpus,
    evaluate_features,
    evaluate_mouth,
    evaluate_noise,
    evaluate_wild,
)
from elocute.cli.contacts import Finished, contacts_shown
from elocute.cli.name_lists import read_names
from elocute.cli.progress import progress_bar

if TYPE_CHECKING:
    from elocute.evaluation.tracked_mouth_scores import MeanMouthScore, MouthScore
    from elocute.motion.curves import Curves

app = CommandGroup("Evaluate speech models, and alignments of recordings.")
app.command("alignment")(evaluate_alignment.alignment_command)
app.command("benchmark")(evaluate_benchmark.benchmark_command)
app.command("corpus")(evaluate_corpus.corpus_command)
app.command("features")(evaluate_features.features_command)
app.command("wild")(evaluate_wild.wild_command)
app.command("noise")(evaluate_noise.noise_command)
app.command("styles")(evaluate_mouth.styles_command)
app.command("identities")(evaluate_mouth.identities_command)


@app.command("real")
def real_command(
    folder: Path = typer.Argument(..., help="Folder of NAME.npz (tracked mouth) and NAME.ogg."),
    names: Path | None = typer.Option(None, help="Text file of the names to use; all by default."),
    style: str = options.StyleName,
    strength: float = options.Strength,
    model: str = options.Model,
    contacts: str = Finished,
    mix: str = options.Mix,
    per_clip: bool = typer.Option(False, help="Also print every clip."),
    as_json: bool = options.Json,
) -> None:
    """Compare predicted lips with those of a real talker: correlation and closures."""
    from elocute.animation import animate
    from elocute.evaluation.tracked_mouth_scores import evaluate_tracked_mouths
    from elocute.head.builtin import load_builtin_head
    from elocute.motion.mouth_measures import measure_mouth

    wanted, shown = read_names(names), contacts_shown(contacts)
    eye_distance_mm = 1000 * load_builtin_head().eye_distance_m

    def predict(sound: Path, contacts: str) -> Curves:
        settings = {"style": style, "strength": strength, "model": model, "mix": mix}
        return measure_mouth(animate(sound, contacts=contacts, life=0, **settings).motion)

    found = {}
    for each in shown:
        with progress_bar(f"measuring, contacts {each}", as_json) as progress:
            found[each] = evaluate_tracked_mouths(
                folder,
                lambda sound, each=each: predict(sound, each),
                eye_distance_mm,
                names=wanted,
                progress=progress,
            )
    if as_json:
        for each, (summary, scores) in found.items():
            record = {"contacts": each, "summary": asdict(summary)}
            print(json.dumps(record | ({"clips": list(map(asdict, scores))} if per_clip else {})))
        return
    if per_clip:
        for each, (_, scores) in found.items():
            _show_clips(scores, f"contacts {each}" if len(found) > 1 else "")
    _show_summaries({each: summary for each, (summary, _) in found.items()})


def _show_clips(scores: list[MouthScore], title: str) -> None:
    for score in scores:
        print(
            f"{score.name:12} opening r {score.opening_best_r:5.2f}"
            f" at {score.opening_lag_s:+.2f} s  closures {score.closures_met}/{score.closures}"
            f"  false {score.false_met}/{score.others}  {title}".rstrip()
        )


def _show_summaries(found: dict[str, MeanMouthScore]) -> None:
    """A line for each measure, a column for each of --contacts."""
    if len(found) > 1:
        print(f"{'contacts':22}", *(f"{each:>8}" for each in found))
    columns = [asdict(summary) for summary in found.values()]
    for name in columns[0]:
        values = [column[name] for column in columns]
        cells = [f"{value:.3f}" if isinstance(value, float) else f"{value}" for value in values]
        print(f"{name:22}", *(f"{cell:>8}" if len(cells) > 1 else cell for cell in cells))
