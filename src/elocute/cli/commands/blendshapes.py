"""`elocute blendshapes`: speech blendshapes, learned from registered meshes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.capture.blendshapes.settings import BlendshapeConfig
from elocute.cli import format_options, options
from elocute.cli.command_group import CommandGroup
from elocute.cli.name_lists import names_of_part
from elocute.cli.outputs import check_file_suffix, nothing_to_do, plan_files, write_json_report
from elocute.cli.progress import progress_bar
from elocute.cli.settings_options import options_of
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from elocute.capture.blendshapes.basis_comparison import BasisProjection, ReconstructionErrors
    from elocute.corpus.corpus_store import Corpus
    from elocute.motion.motion import Motion

app = CommandGroup("Learn, compare and show speech blendshapes.")
PARTS = ("train", "validation", "test", "all")
ARKIT = "arkit"


@app.command("learn")
def learn_command(
    corpus: Path = options.Corpus,
    output: Path = typer.Option(
        ..., "-o", "--output", help="Basis to write (.npz), or its shapes as morph targets (.glb)."
    ),
    config: BlendshapeConfig = options_of(BlendshapeConfig, flags={"sparsity": "--sparse"}),
    split: str = options.Split,
    part: str = typer.Option("train", help="Part to learn from: train, validation, test or all."),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Learn speech blendshapes: principal components of meshes minus their neutral faces."""
    from elocute.capture.blendshapes.blendshape_learning import learn_blendshapes, sweep_shapes
    from elocute.corpus.corpus_store import open_corpus
    from elocute.export.registry import check_suffix, write

    check_suffix(output)
    plan = OutputPlan()
    plan.add(output, corpus)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    opened = open_corpus(corpus)
    with progress_bar("learning", as_json) as progress:
        learned = learn_blendshapes(
            opened, names_of_part(opened, split, part, PARTS), config, progress
        )
    with plan.writing(output):
        write(sweep_shapes(learned.head), output)
    explained = [round(float(share), 6) for share in learned.explained]
    if as_json:
        print(
            json.dumps(
                {"components": len(explained), "frames": learned.frames, "explained": explained}
            )
        )
        return
    for name, share in zip(learned.head.expression_names, explained, strict=True):
        print(f"{name:12} {share:9.4%}")


@app.command("show")
def show_command(
    basis: Path = typer.Argument(..., help="Basis that `blendshapes learn` wrote (.npz)."),
    output: Path = typer.Option(..., "-o", "--output", help="Contact sheet to write (.png)."),
    view: str = typer.Option("mouth", help="Camera position: mouth, front, three-quarter or side."),
    size: str = format_options.Size,
    backend: str = format_options.Backend,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
) -> None:
    """Draw every shape of a basis at plus and minus two standard deviations."""
    from elocute.capture.blendshapes.blendshape_learning import extreme_shapes
    from elocute.export.pictures import contact_sheet
    from elocute.files.atomic import write_atomically
    from elocute.motion.store import load_motion
    from elocute.render import open_renderer, portrait

    check_file_suffix(output, ".png")
    plan = OutputPlan()
    plan.add(output, basis)
    if nothing_to_do(plan, overwrite, no_clobber):
        return
    motion = load_motion(basis).dressed()
    side = max(32, 2 * format_options.parse_size(size)[0] // 8)
    camera, pictures, labels = portrait(motion.head, view), [], []
    with open_renderer(motion.head, (side, side), backend=backend, camera=camera) as renderer:
        for label, single in extreme_shapes(motion):
            pictures.append(renderer.frame(single.vertices()[0]))
            labels.append(label)
    with plan.writing(output), write_atomically(output) as draft:
        contact_sheet(pictures, labels, 8).save(draft)


@app.command("compare")
def compare_command(
    corpus: Path = typer.Argument(..., help="Corpus folder whose meshes are projected."),
    basis: list[Path] = typer.Argument(
        ..., help="Bases that `blendshapes learn` wrote (.npz), one or more."
    ),
    against: str = typer.Option(
        ARKIT, help="Basis to compare with: arkit (the built-in head's shapes), or a .npz."
    ),
    split: str = options.Split,
    part: str = typer.Option("test", help="Part to project: train, validation, test or all."),
    output: Path | None = options.JsonReport,
    plot: Path | None = typer.Option(None, "--plot", help="Plot the errors over frames (.png)."),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Project held-out meshes onto bases, and report the mean distance of vertices in mm.

    The basis that is compared with is used whole, and cut to as many shapes as the first one has:
    those that explain the training part best.
    """
    from elocute.capture.blendshapes.basis_comparison import reconstruction_errors
    from elocute.corpus.corpus_store import open_corpus

    check_file_suffix(output, ".json")
    check_file_suffix(plot, ".png")
    plan = plan_files([corpus, *basis, against], (output, plot), overwrite, no_clobber)
    opened = open_corpus(corpus)
    bases = _bases(opened, basis, against, split)
    with progress_bar("projecting", as_json) as progress:
        projections = reconstruction_errors(
            opened, names_of_part(opened, split, part, PARTS), bases, progress
        )
    if plot is not None and plan.wants(plot):
        with plan.writing(plot):
            _plot(projections, opened.fps, plot)
    record = {
        "corpus": corpus.name,
        "part": part,
        "frames": len(projections[0].errors_mm),
        "bases": {p.name: {"components": p.components, "mean_mm": p.mean_mm} for p in projections},
    }
    text = json.dumps(record)
    if output is not None and plan.wants(output):
        with plan.writing(output):
            write_json_report(output, text)
    if as_json:
        print(text)
        return
    for projection in projections:
        print(f"{projection.name:24} {projection.components:4} shapes {projection.mean_mm:8.4f} mm")


def _bases(corpus: Corpus, learned: list[Path], against: str, split: str) -> list[BasisProjection]:
    """The learned bases, the other one whole, and as many of its shapes as the first one has."""
    from elocute.capture.blendshapes.basis_comparison import BasisProjection, strongest_shapes
    from elocute.motion.store import load_motion

    ours = [BasisProjection(path.stem, load_motion(path).head.expression_basis) for path in learned]
    name, shapes = _other(against)
    count = len(ours[0].flat)
    bases = [*ours, BasisProjection(f"{name}, all {len(shapes)}", shapes)]
    if count < len(shapes) and shapes.shape[1] == corpus.vertex_count:
        best = strongest_shapes(corpus, corpus.split(split).train, shapes, count)
        bases.append(BasisProjection(f"{name}, best {count}", shapes[best]))
    return bases


def _other(against: str) -> tuple[str, NDArray[np.float32]]:
    from elocute.head.builtin import load_builtin_head
    from elocute.motion.store import load_motion

    if against == ARKIT:
        return ARKIT, load_builtin_head().expression_basis
    motion: Motion = load_motion(against)
    return Path(against).stem, motion.head.expression_basis


def _plot(bases: list[ReconstructionErrors], fps: float, path: Path) -> None:
    import numpy as np

    from elocute.motion.curves import Curves
    from elocute.plots.curves import plot_overlay

    values = np.stack([p.errors_mm for p in bases], axis=1).astype(np.float32)
    curves = Curves(values, tuple(p.name for p in bases), fps)
    plot_overlay(curves, path, title="projection error over frames", unit="mm", shade=False)
