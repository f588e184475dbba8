"""`elocute solve --flame`: FLAME's parameters behind vertices on its mesh, or behind a corpus."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elocute.cli.outputs import nothing_to_do
from elocute.cli.progress import counted, progress_bar
from elocute.errors import HeadError, OutputError
from elocute.files.output_plan import OutputPlan
from elocute.files.reading import ANY_BYTES, FileKind

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from elocute.files.array_file import ArrayFile
    from elocute.head.flame import FlameModel
    from elocute.head.flame_parameters import FlameParameters

    Solved = tuple[FlameParameters, NDArray[np.float64]]

VERTEX_FILE = FileKind("a .npy of (frame, vertex, 3) metres", ANY_BYTES, HeadError)

SUFFIX = ".npz"


@dataclass(frozen=True)
class FlameSettings:
    """How parameters are solved: frames per second of a .npy, the jaw alone, cost in mm²."""

    fps: float
    zero_pose: bool
    regularisation: float


@dataclass(frozen=True)
class Replacing:
    """What happens to files that are there, and how results are told."""

    overwrite: bool
    no_clobber: bool
    as_json: bool


def solve_flame_command(
    vertices: Path, output: Path, flame: Path, settings: FlameSettings, replacing: Replacing
) -> None:
    """Write the parameters of a file, or of every clip of a corpus."""
    if vertices.is_dir():
        _solve_corpus(vertices, output, flame, settings, replacing)
        return
    if output.suffix.lower() != SUFFIX:
        raise OutputError.about(output, found=f"suffix {output.suffix!r}", allowed=SUFFIX)
    plan = OutputPlan([flame])
    plan.add(output, vertices)
    if nothing_to_do(plan, replacing.overwrite, replacing.no_clobber, replacing.as_json):
        return
    points, fps = _vertices(vertices, settings.fps)
    settings = replace(settings, fps=fps)
    solved = _solved(_model(flame), points, settings, None, vertices.name, replacing.as_json)
    with plan.writing(output):
        _write(output, vertices, solved, replacing.as_json)


def _solve_corpus(
    folder: Path, output: Path, flame: Path, settings: FlameSettings, replacing: Replacing
) -> None:
    """One file for each clip; shape comes from the subject's neutral face, and the jaw turns."""
    from elocute.corpus.corpus_store import open_corpus

    corpus = open_corpus(folder)
    model = _model(flame)
    if corpus.vertex_count != model.vertex_count:
        raise HeadError.about(
            folder,
            found=f"{corpus.vertex_count} vertices",
            allowed=f"{model.vertex_count}, those of {flame.name}",
        )
    plan = OutputPlan([flame])
    plan.make_folder(output)
    targets = {clip.name: output / f"{clip.name}{SUFFIX}" for clip in corpus.entries}
    for target in targets.values():
        plan.add(target, folder)
    if nothing_to_do(plan, replacing.overwrite, replacing.no_clobber, replacing.as_json):
        return
    wanted = plan.wanted(targets.values())
    still = FlameSettings(corpus.fps, True, settings.regularisation)
    with counted(len(wanted)) as one_done:
        for clip in corpus.entries:
            target = targets[clip.name]
            if target not in wanted:
                continue
            solved = _solved(
                model,
                corpus.vertices(clip.name),
                still,
                corpus.template(clip.subject),
                clip.name,
                replacing.as_json,
            )
            with plan.writing(target):
                _write(target, folder, solved, replacing.as_json)
            one_done()


def _solved(
    model: FlameModel,
    given: Any,
    settings: FlameSettings,
    neutral: NDArray[np.float32] | None,
    name: str,
    quiet: bool,
) -> Solved:
    from elocute.head.flame_solver import solve_flame

    with progress_bar(f"solving {name}", quiet) as progress:
        return solve_flame(
            model,
            given,
            fps=settings.fps,
            neutral=neutral,
            zero_pose=settings.zero_pose,
            regularisation=settings.regularisation,
            progress=progress,
        )


def _write(target: Path, source: Path, solved: Solved, as_json: bool) -> None:
    from elocute.head.flame_parameters import save_flame_parameters

    parameters, residual_mm = solved
    save_flame_parameters(target, parameters)
    mean, worst = float(residual_mm.mean()), float(residual_mm.max())
    if as_json:
        record = {"input": str(source), "output": str(target), "frames": len(residual_mm)}
        print(json.dumps(record | {"residual_mean_mm": mean, "residual_max_mm": worst}))
    else:
        print(target)
        print(f"residual {mean:.4f} mm on average, {worst:.4f} mm in the worst frame")


def _model(path: Path) -> FlameModel:
    from elocute.head.flame import load_flame

    return load_flame(path)


def _vertices(path: Path, fps: float) -> tuple[NDArray[np.float32] | ArrayFile, float]:
    """Vertices of a .npy, left on disk, or of a motion; and their frame rate."""
    from elocute.files.array_file import ArrayFile
    from elocute.motion.store import load_motion

    if path.suffix.lower() == SUFFIX:
        motion = load_motion(path)
        return motion.vertices(), motion.fps
    return ArrayFile(path, VERTEX_FILE), fps
