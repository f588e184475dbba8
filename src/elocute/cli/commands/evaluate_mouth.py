"""`elocute evaluate noise`, `styles` and `identities` (VOCA 2019, section 7.2)."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.outputs import check_file_suffix, plan_files
from elocute.cli.progress import progress_bar
from elocute.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from elocute.audio.waveform import Waveform
    from elocute.evaluation.mouth_studies import NoiseScore
    from elocute.files.output_plan import OutputPlan

KINDS = ("white", "babble", "gain")
CLIPS_MOST = 20
LEVELS = "-36,-24,-18,-12"  # the paper's: low, medium, slightly high, high
FPS = 60.0
Plot = typer.Option(None, "--plot", help="Plot mouth opening over time (.png).")


def noise_command(
    speech: Path = typer.Argument(
        ..., help="Sound file, or a corpus folder, whose test part is used."
    ),
    model: str = options.Model,
    style: str = options.StyleName,
    noise: str = typer.Option(
        "babble",
        help="Noise: white, babble or a sound file; or gain, for speech that is too quiet.",
    ),
    levels: str = typer.Option(
        LEVELS, help="Levels against the speech in dB, separated by commas."
    ),
    plot: Path | None = Plot,
    seed: int = typer.Option(0, min=0, help="Seed of the noise."),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Measure how noise under the speech damps and changes the motion of the mouth."""
    import numpy as np

    from elocute.animation import animate
    from elocute.evaluation.mouth_studies import mean_noise_scores, noise_scores
    from elocute.motion.mouth_measures import measure_mouth

    plan = _planned(plot, (speech, model, noise), overwrite, no_clobber)
    steps = _levels(levels)
    sounds = _sounds(speech)

    def opening(sound: Waveform) -> NDArray[np.float64]:
        motion = animate(sound, model=model, style=style, fps=FPS).motion
        return measure_mouth(motion)["opening_mm"].astype(np.float64)

    clips, first = [], []
    with progress_bar("animating", as_json) as progress:
        for done, sound in enumerate(sounds, 1):
            scores, openings = noise_scores(sound, _noise(noise, sound, seed), steps, opening)
            clips.append(scores)
            first = first or openings
            progress(done / len(sounds))
    means = mean_noise_scores(clips)
    if plot is not None and plan.wants(plot):
        with plan.writing(plot):
            _plot_levels(first, steps, plot, f"mouth opening, {noise}")
    record = {
        "speech": speech.name,
        "model": Path(model).name,
        "style": style,
        "noise": noise,
        "clips": len(clips),
        "levels": [asdict(score) for score in means],
    }
    if as_json:
        print(json.dumps(record))
    else:
        _show_levels(means)


def _plot_levels(
    openings: list[NDArray[np.float64]], levels: list[float], path: Path, title: str
) -> None:
    """Mouth openings over time: of clean speech, then at each level of noise."""
    import numpy as np

    from elocute.export.overlay_plot import plot_overlay
    from elocute.motion.curves import Curves

    names = ("clean", *(f"{level:g} dB" for level in levels))
    curves = Curves(np.stack(openings, axis=1).astype(np.float32), names, FPS)
    plot_overlay(curves, path, title=title, unit="mm", shade=False)


def _show_levels(scores: list[NoiseScore]) -> None:
    print(f"{'level':>8} {'opening mm':>11} {'of clean':>9} {'r to clean':>11}")
    for s in scores:
        print(
            f"{s.level_db:5.0f} dB {s.amplitude_mm:11.2f} {s.amplitude_share:9.2f} "
            f"{s.correlation:11.3f}"
        )


def styles_command(
    speech: Path = typer.Argument(..., help="A sound or video file."),
    model: str = options.Model,
    plot: Path | None = Plot,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Compare mouth opening in every style, and the range that mixes of styles reach."""
    from elocute.animation import animate
    from elocute.evaluation.mouth_studies import style_openings
    from elocute.models.registry import open_model
    from elocute.motion.motion import Motion

    plan = _planned(plot, (speech, model), overwrite, no_clobber)
    names = open_model(model).styles or ("plain",)

    def moved(style: str) -> Motion:
        return animate(speech, model=model, style=style, fps=FPS).motion

    curves = style_openings(names, moved)
    if plot is not None and plan.wants(plot):
        from elocute.export.overlay_plot import plot_overlay

        title = "distance between the lips; shaded: convex combinations of the styles"
        with plan.writing(plot):
            plot_overlay(curves, plot, title=title, unit="mm")
    table = {
        name: {"mean_mm": float(curves[name].mean()), "peak_mm": float(curves[name].max())}
        for name in names
    }
    reach = float((curves.values.max(axis=1) - curves.values.min(axis=1)).mean())
    if as_json:
        record = {"speech": speech.name, "model": Path(model).name, "fps": FPS}
        print(json.dumps({**record, "reach_mm": reach, "styles": table}))
        return
    for name, row in table.items():
        print(f"{name:16} opening mean {row['mean_mm']:5.2f} mm  peak {row['peak_mm']:5.2f} mm")
    print(f"{'range of mixes':16} {reach:.2f} mm on average")


def identities_command(
    speech: Path = typer.Argument(..., help="A sound or video file."),
    model: str = options.Model,
    style: str = options.StyleName,
    count: int = typer.Option(20, help="Number of random faces."),
    seed: int = typer.Option(0, help="The same seed draws the same faces."),
    as_json: bool = options.Json,
) -> None:
    """Put the same speech on random faces: how far their lips differ, and whether they close."""
    from elocute.animation import animate
    from elocute.evaluation.mouth_studies import face_score_spread, face_scores

    motion = animate(speech, model=model, style=style, fps=FPS).motion
    scores = face_scores(motion, count, seed)
    table = face_score_spread(scores)
    if as_json:
        record: dict[str, Any] = {"speech": speech.name, "model": Path(model).name, "count": count}
        print(json.dumps({**record, "seed": seed, "spread": table}))
        return
    head = f"{count} faces"
    print(f"{head:16} {'mean':>8} {'deviation':>10} {'least':>8} {'greatest':>9}")
    for name, row in table.items():
        print(
            f"{name:16} {row['mean']:8.2f} {row['deviation']:10.2f} {row['least']:8.2f} "
            f"{row['greatest']:9.2f}"
        )


def _planned(
    plot: Path | None, inputs: tuple[Path | str, ...], overwrite: bool, no_clobber: bool
) -> OutputPlan:
    check_file_suffix(plot, ".png")
    return plan_files(inputs, [plot], overwrite, no_clobber)


def _levels(text: str) -> list[float]:
    try:
        levels = list(dict.fromkeys(float(part) for part in text.split(",")))
    except ValueError:
        levels = []
    if not levels or not all(-120 <= level <= 60 for level in levels):
        raise InputError.about(
            f"--levels {text}",
            found="not a list of levels",
            allowed=f"dB from -120 to 60, such as {LEVELS}",
        )
    return levels


def _sounds(speech: Path) -> list[Waveform]:
    """The file, or at most CLIPS_MOST clips of a corpus's test part, evenly taken."""
    from elocute.audio.read import read_audio
    from elocute.corpus.corpus_store import open_corpus

    if not speech.is_dir():
        return [read_audio(speech)]
    corpus = open_corpus(speech)
    names = corpus.split().test or tuple(entry.name for entry in corpus.entries)
    step = max(1, len(names) // CLIPS_MOST)
    return [corpus.sound(name) for name in names[::step][:CLIPS_MOST]]


def _noise(kind: str, speech: Waveform, seed: int) -> NDArray[np.float32] | None:
    from elocute.audio.noise import babble, white_noise
    from elocute.audio.read import read_audio

    if kind == "gain":
        return None
    if kind == "white":
        return white_noise(len(speech.samples), seed)
    if kind == "babble":
        return babble(speech, seed)
    if not Path(kind).is_file():
        raise InputError.about(
            f"--noise {kind}", found="no such file", allowed=", ".join(KINDS) + " or a sound file"
        )
    return read_audio(kind).resample(speech.sample_rate).samples
