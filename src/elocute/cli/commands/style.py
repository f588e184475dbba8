"""`elocute style`: the speaking style behind a motion."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.command_group import CommandGroup
from elocute.cli.outputs import check_file_suffix, plan_files
from elocute.errors import InputError

if TYPE_CHECKING:
    from elocute.models.protocol import SpeechModel
    from elocute.models.style_fit import ObservedMotion, StyleFit

app = CommandGroup("Estimate speaking styles.")


@app.command("fit")
def fit_command(
    motion: list[Path] = typer.Argument(
        ..., help="Motions (.npz), or clips of a corpus as CORPUS/SUBJECT.SENTENCE."
    ),
    model: str = options.Model,
    sound: list[Path] = typer.Option(
        [], help="Sound of each motion, in the same order; clips of a corpus have theirs."
    ),
    output: Path | None = typer.Option(
        None, "-o", "--output", help="Also write the mix (.json), for --style."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Estimate the mix of a model's styles that best explains a few seconds of motion."""
    from elocute.models.registry import open_model
    from elocute.models.style_fit import fit_style
    from elocute.models.style_mixes import write_mix

    check_file_suffix(output, ".json")
    plan = plan_files([*motion, *sound, model], [output], overwrite, no_clobber)
    learned = open_model(model)
    fit = fit_style(learned, _takes(motion, sound, learned))
    record = {"model": Path(model).name, **fit.record()}
    if output is not None and plan.wants(output):
        with plan.writing(output):
            write_mix(output, fit.mix, record)
    if as_json:
        print(json.dumps({"mix": fit.mix, "style": fit.text, **record}))
    else:
        _show(fit)


def _show(fit: StyleFit) -> None:
    for name, error in sorted(fit.styles.items(), key=lambda item: item[1]):
        print(f"{name:16} {error:7.3f} mm")
    print(f"{'mix':16} {fit.error_mm:7.3f} mm  over {fit.seconds:.1f} s")
    print(fit.text)


def _takes(motions: list[Path], sounds: list[Path], model: SpeechModel) -> list[ObservedMotion]:
    """Every take with the features of its speech."""
    stored = [path for path in motions if path.suffix.lower() == ".npz"]
    if len(stored) != len(sounds):
        raise InputError.about(
            "--sound",
            found=f"{len(sounds)} for {len(stored)} motions",
            allowed="the sound of every .npz, in the same order",
        )
    given = iter(sounds)
    return [
        _of_motion(path, next(given), model) if path in stored else _of_clip(path, model)
        for path in motions
    ]


def _of_motion(path: Path, sound: Path, model: SpeechModel) -> ObservedMotion:
    """Joint rotations are left out, as measures do: a nod is no style."""
    from elocute.audio.read import read_audio
    from elocute.models.feature_extraction import extract_features
    from elocute.models.style_fit import ObservedMotion
    from elocute.motion.store import load_motion
    from elocute.motion.vertex_motion import VertexMotion

    motion = load_motion(path)
    head = motion.head
    track = VertexMotion(motion.weights, head.template, motion.fps, head.expression_basis)
    return ObservedMotion(extract_features(model, read_audio(sound), contacts=False)[0], track)


def _of_clip(path: Path, model: SpeechModel) -> ObservedMotion:
    from elocute.corpus.corpus_store import open_corpus
    from elocute.evaluation.model_predictions import recorded_motion
    from elocute.models.feature_extraction import extract_features
    from elocute.models.style_fit import ObservedMotion

    if not (path.parent / "corpus.json").is_file():
        raise InputError.about(
            path,
            found="neither a motion nor a clip",
            allowed="a motion (.npz), or CORPUS/SUBJECT.SENTENCE",
        )
    corpus = open_corpus(path.parent)
    track = recorded_motion(corpus, path.name)
    return ObservedMotion(
        extract_features(model, corpus.sound(path.name), contacts=False)[0], track
    )
