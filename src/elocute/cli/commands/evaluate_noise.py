"""`elocute evaluate noise`: the mouth under disturbed speech (VOCA 2019, section 7.2)."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.outputs import check_file_suffix, plan_files
from elocute.cli.progress import progress_bar
from elocute.cli.tables import check_tables, write_tables
from elocute.errors import InputError

if TYPE_CHECKING:
    from elocute.array_types import Float32Array, Float64Array
    from elocute.audio.waveform import Waveform
    from elocute.evaluation.mouth_studies import Disturbance, NoiseScore, Opening
    from elocute.motion.curves import Curves

CLIPS_MOST = 20
Plot = typer.Option(None, "--plot", help="Plot the distance between the lips over time (.png).")
LEVELS = "-36,-24,-18,-12"  # the paper's: low, medium, slightly high, high
FPS = 60.0
Models = typer.Option(
    ["talkers"],
    "--model",
    help="Speech model: talkers, articulation (the rules), voca, crnn, or a trained model (.onnx). "
    "Can be repeated.",
)


def noise_command(
    speech: Path = typer.Argument(
        ..., help="Sound file, or a corpus folder, whose test part is used."
    ),
    model: list[str] = Models,
    style: str = options.StyleName,
    contacts: str = options.ContactsMeasured,
    noise: list[str] = typer.Option(
        ["street"],
        help="Noise: street (simulated traffic), white, babble, or a sound file; telephone, for "
        "its band alone; gain, for speech that is too quiet. Can be repeated.",
    ),
    levels: str = typer.Option(
        LEVELS, help="Levels against the speech in dB, separated by commas."
    ),
    plot: Path | None = Plot,
    table: list[Path] | None = options.Table,
    seed: int = typer.Option(0, min=0, help="Seed of the noise."),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Measure how noise under the speech damps and changes the motion of the mouth."""
    tables = check_tables(table)
    check_file_suffix(plot, ".png")
    plan = plan_files((speech, *model, *noise), [plot, *tables], overwrite, no_clobber)
    steps = _levels(levels)
    kinds = {kind: _disturbances(kind, steps, seed) for kind in noise}
    ways = list(product(dict.fromkeys(model), options.contacts_measured(contacts)))
    sounds = _sounds(speech)
    studies: list[NoiseStudy] = []
    with progress_bar("animating", as_json) as progress:
        for done, (name, way) in enumerate(ways):
            share = partial(_progress_of_part, progress, done, len(ways))
            studies += _studies(
                sounds, kinds, _opening(name, style, way), Path(name).name, way, share
            )
    if plot is not None and plan.wants(plot):
        from elocute.plots.curves import plot_panels

        with plan.writing(plot):
            plot_panels([(s.title, s.first) for s in studies], plot, unit="mm", shade=False)
    write_tables(plan, tables, NOISE_COLUMNS, [row for study in studies for row in study.rows()])
    if as_json:
        record = {"speech": speech.name, "style": style, "clips": len(sounds)}
        print(json.dumps({**record, "studies": [study.record() for study in studies]}))
    else:
        _show_noise(studies)


def _progress_of_part(progress: Callable[[float], None], part: int, of: int, share: float) -> None:
    progress((part + share) / of)


def _studies(
    sounds: list[Waveform],
    kinds: dict[str, dict[str, Disturbance]],
    opening: Opening,
    model: str,
    contacts: str,
    progress: Callable[[float], None],
) -> list[NoiseStudy]:
    """One model, one way, under each kind of noise."""
    from elocute.evaluation.mouth_studies import mean_noise_scores, noise_scores

    every = [disturb for levels in kinds.values() for disturb in levels.values()]
    clips, first = [], []
    for done, sound in enumerate(sounds, 1):
        scores, openings = noise_scores(sound, every, opening, FPS)
        clips.append(scores)
        first = first or openings
        progress(done / len(sounds))
    means, curves = iter(mean_noise_scores(clips)), iter(first[1:])
    studies = []
    for kind, levels in kinds.items():
        scores = {level: next(means) for level in levels}
        moved = _curves({"clean": first[0], **{level: next(curves) for level in levels}})
        studies.append(NoiseStudy(model, contacts, Path(kind).name, scores, moved))
    return studies


NOISE_COLUMNS = (
    "model",
    "contacts",
    "noise",
    "level",
    "opening mm",
    "of clean",
    "r to clean",
    "closures kept",
    "closures right",
)


@dataclass(frozen=True)
class NoiseStudy:
    """One model, one way, under one kind of noise.

    Scores by the name of each level; `first` holds the openings of the first clip, clean and at
    each level.
    """

    model: str
    contacts: str
    noise: str
    scores: dict[str, NoiseScore]
    first: Curves

    @property
    def title(self) -> str:
        return f"distance between the lips, {self.model}, contacts {self.contacts}, {self.noise}"

    def rows(self) -> list[list[str | float]]:
        return [
            [
                self.model,
                self.contacts,
                self.noise,
                level,
                score.amplitude_mm,
                score.amplitude_share,
                score.correlation,
                score.closure_recall,
                score.closure_precision,
            ]
            for level, score in self.scores.items()
        ]

    def record(self) -> dict[str, Any]:
        levels = [{"level": level, **asdict(score)} for level, score in self.scores.items()]
        about = {"model": self.model, "contacts": self.contacts, "noise": self.noise}
        return {**about, "levels": levels}


def _opening(model: str, style: str, contacts: str) -> Opening:
    import numpy as np

    from elocute.animation import animate
    from elocute.motion.mouth_measures import measure_mouth

    def opening(sound: Waveform) -> Float64Array:
        motion = animate(sound, model=model, style=style, contacts=contacts, fps=FPS, life=0).motion
        return measure_mouth(motion)["opening_mm"].astype(np.float64)

    return opening


def _curves(openings: dict[str, Float64Array]) -> Curves:
    import numpy as np

    from elocute.motion.curves import Curves

    table = np.stack(list(openings.values()), axis=1).astype(np.float32)
    return Curves(table, tuple(openings), FPS)


def _show_noise(studies: list[NoiseStudy]) -> None:
    print(
        f"{'model':14} {'contacts':>8} {'noise':>12} {'level':>7} {'opening mm':>11} "
        f"{'of clean':>9} {'r to clean':>11} {'kept':>6} {'right':>6}"
    )
    for model, contacts, noise, level, *values in (row for s in studies for row in s.rows()):
        opening, share, r, kept, right = values
        print(
            f"{model:14} {contacts:>8} {noise:>12} {level:>7} {opening:11.2f} {share:9.2f} "
            f"{r:11.3f} {kept:6.2f} {right:6.2f}"
        )
    if any(study.noise == "street" for study in studies):
        print(
            "street is simulated traffic: Elocute ships no recording of a street; "
            "--noise FILE takes yours"
        )


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


def _disturbances(kind: str, levels: list[float], seed: int) -> dict[str, Disturbance]:
    """What a kind of noise does to speech, by the name of each level."""
    from elocute.audio.noise import telephone_band, with_gain, with_noise

    if kind == "telephone":
        return {"band": telephone_band}
    if kind == "gain":
        return {f"{level:g} dB": partial(with_gain, gain_db=level) for level in levels}
    noise = _noise_source(kind, seed)
    return {
        f"{level:g} dB": lambda sound, level=level: with_noise(sound, noise(sound), level)
        for level in levels
    }


def _noise_source(kind: str, seed: int) -> Callable[[Waveform], Float32Array]:
    """Noise for a sound, at its rate and, unless repeated, of its length. Raises InputError."""
    from elocute.audio.noise import babble, street_noise, white_noise
    from elocute.audio.read import read_audio

    sources: dict[str, Callable[[Waveform], Float32Array]] = {
        "street": lambda sound: street_noise(len(sound.samples), sound.sample_rate, seed),
        "white": lambda sound: white_noise(len(sound.samples), seed),
        "babble": lambda sound: babble(sound, seed),
    }
    if kind in sources:
        return sources[kind]
    if not Path(kind).is_file():
        raise InputError.about(
            f"--noise {kind}",
            found="no such file",
            allowed=f"{', '.join(sources)}, telephone, gain or a sound file",
        )
    recorded = read_audio(kind)
    return lambda sound: recorded.resample(sound.sample_rate).samples
