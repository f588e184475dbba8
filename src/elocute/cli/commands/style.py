"""`elocute style`: the speaking style behind a motion."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.command_group import CommandGroup
from elocute.cli.outputs import check_file_suffix, plan_files
from elocute.cli.progress import progress_bar
from elocute.errors import InputError

if TYPE_CHECKING:
    from elocute.audio.waveform import Waveform
    from elocute.models.protocol import SpeechModel
    from elocute.models.style_fit import StyleFit
    from elocute.models.style_targets import ObservedMotion
    from elocute.motion.motion import Motion

VIDEO_SUFFIXES = (".mp4", ".mov", ".mkv", ".webm", ".avi", ".mpg", ".mpeg", ".m4v")
app = CommandGroup("Estimate speaking styles.")


@app.command("fit")
def fit_command(
    motion: list[Path] = typer.Argument(
        ...,
        help="Motions (.npz), videos of the person talking, or clips of a corpus as "
        "CORPUS/SUBJECT.SENTENCE.",
    ),
    model: str = options.Model,
    sound: list[Path] = typer.Option(
        [], help="Sound of each .npz, in the same order; videos and clips of a corpus have theirs."
    ),
    new: bool = typer.Option(
        False,
        "--new",
        help="Also fit a new style beyond the mix: a vector at the network's input, or "
        "how far the person moves, in numbers of the rules.",
    ),
    output: Path | None = typer.Option(
        None, "-o", "--output", help="Also write the mix, or the new style (.json), for --style."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Estimate the mix of a model's styles that best explains a few seconds of motion.

    A video is captured first, as `elocute capture video` does.
    """
    from elocute.models.registry import open_model
    from elocute.models.style_fit import fit_style
    from elocute.models.style_mixes import write_mix

    check_file_suffix(output, ".json")
    plan = plan_files([*motion, *sound, model], [output], overwrite, no_clobber)
    learned = open_model(model)
    fit = fit_style(learned, _takes(motion, sound, learned, as_json), new=new)
    record = {"model": Path(model).name, **fit.record()}
    if fit.vector is not None:
        record["vector"] = fit.vector
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
    if fit.vector is not None:
        print(f"{'new style':16} {fit.vector_error_mm:7.3f} mm")
        print(",".join(f"{name}:{share:.3f}" for name, share in fit.vector.items()))


def _takes(
    motions: list[Path], sounds: list[Path], model: SpeechModel, quiet: bool
) -> list[ObservedMotion]:
    """Every take with the features of its speech."""
    stored = [path for path in motions if path.suffix.lower() == ".npz"]
    if len(stored) != len(sounds):
        raise InputError.about(
            "--sound",
            found=f"{len(sounds)} for {len(stored)} motions",
            allowed="the sound of every .npz, in the same order",
        )
    next_sound = iter(sounds)
    return [
        _of_motion(path, next(next_sound), model)
        if path in stored
        else _of_video(path, model, quiet)
        if path.suffix.lower() in VIDEO_SUFFIXES
        else _of_clip(path, model)
        for path in motions
    ]


def _of_video(path: Path, model: SpeechModel, quiet: bool) -> ObservedMotion:
    """As `capture video` finds it, with the sound of the same file."""
    from elocute.audio.read import read_audio
    from elocute.capture.video.video_to_motion import capture_video

    sound = read_audio(path)  # before minutes of tracking
    with progress_bar(f"tracking {path.name}", quiet) as progress:
        captured = capture_video(path, progress=progress)
    return _observed(captured.motion, sound, model)


def _of_motion(path: Path, sound: Path, model: SpeechModel) -> ObservedMotion:
    from elocute.audio.read import read_audio
    from elocute.motion.store import load_motion

    return _observed(load_motion(path), read_audio(sound), model)


def _observed(motion: Motion, sound: Waveform, model: SpeechModel) -> ObservedMotion:
    """Joint rotations are left out, as measures do: a nod is no style."""
    from elocute.models.feature_extraction import extract_features
    from elocute.models.style_targets import ObservedMotion
    from elocute.motion.vertex_motion import VertexMotion

    head = motion.head
    track = VertexMotion(motion.weights, head.template, motion.fps, head.expression_basis)
    return ObservedMotion(extract_features(model, sound)[0], track)


def _of_clip(path: Path, model: SpeechModel) -> ObservedMotion:
    from elocute.corpus.corpus_store import open_corpus
    from elocute.evaluation.model_predictions import recorded_motion
    from elocute.models.feature_extraction import extract_features
    from elocute.models.style_targets import ObservedMotion

    if not (path.parent / "corpus.json").is_file():
        raise InputError.about(
            path,
            found="neither a motion nor a clip",
            allowed=f"a motion (.npz), a video ({' '.join(VIDEO_SUFFIXES)}), or "
            "CORPUS/SUBJECT.SENTENCE",
        )
    corpus = open_corpus(path.parent)
    track = recorded_motion(corpus, path.name)
    return ObservedMotion(extract_features(model, corpus.sound(path.name))[0], track)
