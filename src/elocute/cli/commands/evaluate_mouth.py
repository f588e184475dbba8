"""`elocute evaluate styles` and `identities` (VOCA 2019, section 7.2)."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.outputs import check_file_suffix, plan_files
from elocute.cli.progress import progress_bar
from elocute.files.atomic import write_atomically

if TYPE_CHECKING:
    from elocute.array_types import Float32Array
    from elocute.files.output_plan import OutputPlan
    from elocute.head.model import HeadModel
    from elocute.motion.motion import Motion

FAULTS_SHOWN = 5
FPS = 60.0
MIXES = 24  # of styles, where what they reach is measured
Plot = typer.Option(None, "--plot", help="Plot mouth opening over time (.png).")


def styles_command(
    speech: Path = typer.Argument(..., help="A sound or video file."),
    model: str = options.Model,
    contacts: str = options.Contacts,
    mix: str = options.Mix,
    plot: Path | None = Plot,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Compare mouth opening in every style, and the range that mixes of styles reach.

    Mixes of outputs reach everything between the styles. Of other mixes it is measured on some.
    """
    from elocute.animation import animate
    from elocute.articulation.settings import mixes_outputs
    from elocute.evaluation.mouth_studies import sample_mixes, style_openings
    from elocute.models.registry import open_model
    from elocute.models.style_mixes import MixedStyle

    plan = _planned(plot, (speech, model), overwrite, no_clobber)
    opened, outputs = open_model(model), mixes_outputs(mix)
    names = opened.styles or ("plain",)

    def moved(style: str) -> Motion:
        take = animate(
            speech, model=model, style=style, fps=FPS, contacts=contacts, mix=mix, life=0
        )
        return take.motion

    curves = style_openings(names, moved)
    between = outputs and isinstance(opened.style(names[0]), MixedStyle)
    mixes = () if between or len(names) == 1 else sample_mixes(names, MIXES)
    reached = style_openings((*names, *mixes), moved) if mixes else curves
    if plot is not None and plan.wants(plot):
        from elocute.plots.curves import plot_overlay

        title = "distance between the lips; shaded: what mixes of the styles reach"
        with plan.writing(plot):
            plot_overlay(curves, plot, title=title, unit="mm", reach=reached)
    table = {
        name: {"mean_mm": float(curves[name].mean()), "peak_mm": float(curves[name].max())}
        for name in names
    }
    reach = float((reached.values.max(axis=1) - reached.values.min(axis=1)).mean())
    if as_json:
        record = {"speech": speech.name, "model": Path(model).name, "fps": FPS}
        record |= {"contacts": contacts, "mix": mix}
        print(json.dumps({**record, "reach_mm": reach, "styles": table}))
        return
    for name, row in table.items():
        print(f"{name:16} opening mean {row['mean_mm']:5.2f} mm  peak {row['peak_mm']:5.2f} mm")
    print(f"{'range of mixes':16} {reach:.2f} mm on average")


def identities_command(
    speech: Path = typer.Argument(..., help="A sound or video file, or a stored motion (.npz)."),
    model: str = options.Model,
    style: str = options.StyleName,
    contacts: str = options.ContactsMeasured,
    count: int = typer.Option(20, help="Number of random faces."),
    seed: int = typer.Option(0, help="The same seed draws the same faces."),
    identity: list[str] | None = typer.Option(
        None,
        help="A face to take instead of random ones: a name, a seed, or a .json file. "
        "Can be repeated.",
    ),
    output: Path | None = typer.Option(
        None,
        "-o",
        "--output",
        help="Write the worst face to this file (.json), for `animate --identity`.",
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Put the same motion on many faces: whether each face's own lips close and stay apart."""
    from elocute.evaluation.face_study import face_score_spread, face_scores, faces_of

    check_file_suffix(output, ".json")
    plan = plan_files((speech, model, *(identity or ())), [output], overwrite, no_clobber)
    takes = _takes(speech, model, style, contacts)
    coefficients, names = _coefficients(identity, count, seed)
    record: dict[str, Any] = {"speech": speech.name, "count": len(names), "seed": seed, "takes": []}
    ranked = []
    for label, motion, closures in takes:
        with progress_bar(f"measuring {label}", as_json) as progress:
            faces = _counted(faces_of(motion, coefficients), len(names), progress)
            scores = face_scores(motion, faces, closures)
        faulty = {
            name: score.faults for name, score in zip(names, scores, strict=True) if score.faults
        }
        ranked += [(score.severity, place) for place, score in enumerate(scores)]
        spread = face_score_spread(scores)
        record["takes"].append({"take": label, "faulty": faulty, "spread": spread})
        if not as_json:
            _show_faces(label, len(names), faulty, spread)
    if output is not None and plan.wants(output):
        numbers = [round(float(value), 6) for value in coefficients[max(ranked)[1]]]
        with plan.writing(output), write_atomically(output) as draft:
            draft.write_text(json.dumps({"identity": numbers}) + "\n", encoding="utf-8")
    if as_json:
        print(json.dumps(record))


def _counted(
    faces: Iterable[HeadModel], count: int, progress: Callable[[float], None]
) -> Iterator[HeadModel]:
    for done, face in enumerate(faces):
        progress(done / count)
        yield face


def _takes(
    speech: Path, model: str, style: str, contacts: str
) -> list[tuple[str, Motion, list[tuple[float, float]]]]:
    """Label, motion and times of sealed lips: of a stored motion, or of a model's each way."""
    from elocute.animation import animate
    from elocute.audio.read import read_audio
    from elocute.evaluation.face_study import heard_closures, own_closures
    from elocute.motion.store import load_motion

    if speech.suffix.lower() == ".npz":
        motion = load_motion(speech)
        return [(speech.name, motion, own_closures(motion))]
    sound = read_audio(speech)
    closures = heard_closures(sound)
    return [
        (
            f"{Path(model).name}, contacts {way}",
            animate(sound, model=model, style=style, contacts=way, fps=FPS, life=0).motion,
            closures,
        )
        for way in options.contacts_measured(contacts)
    ]


def _coefficients(
    identities: list[str] | None, count: int, seed: int
) -> tuple[Float32Array, list[str]]:
    """(face, identity) of the faces named, or of random ones, and what to call each."""
    import numpy as np

    from elocute.head.builtin import load_builtin_head
    from elocute.head.identity import resolve_identity, sample_identities

    if identities:
        return np.stack([resolve_identity(name) for name in identities]), list(identities)
    return sample_identities(load_builtin_head(), count, seed), [str(n) for n in range(count)]


def _show_faces(
    label: str, count: int, faulty: dict[str, tuple[str, ...]], table: dict[str, dict[str, float]]
) -> None:
    print(f"{label}: {count} faces, {len(faulty)} with a fault")
    for name, faults in list(faulty.items())[:FAULTS_SHOWN]:
        print(f"  face {name}: {', '.join(faults)}")
    if len(faulty) > FAULTS_SHOWN:
        print(f"  and {len(faulty) - FAULTS_SHOWN} more; --json lists all")
    print(f"{'':16} {'mean':>8} {'deviation':>10} {'least':>8} {'greatest':>9}")
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
