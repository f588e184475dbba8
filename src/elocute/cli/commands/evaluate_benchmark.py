"""`elocute evaluate benchmark`: predictions of any method by the published protocol."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.progress import progress_bar
from elocute.errors import InputError, needs_extra

if TYPE_CHECKING:
    from elocute.evaluation.benchmark import BenchmarkScore, SequenceScore
    from elocute.evaluation.benchmark_files import Benchmark, Truth
    from elocute.evaluation.vertex_regions import VertexRegion

COLUMNS = (
    ("lve", "LVE²"),
    ("lve_distance", "LVE"),
    ("mve", "MVE"),
    ("fdd", "FDD² (code)"),
    ("fdd_absolute", "|FDD²| (code)"),
    ("fdd_paper", "FDD (paper)"),
)
TIMING = ("mtm", "MTM, frames")


def benchmark_command(
    dataset: str = typer.Argument(
        ..., help="Whose protocol: vocaset, biwi, or own for a data set of your own."
    ),
    predictions: list[Path] = typer.Argument(
        ..., help="Folders of SUBJECT_SENTENCE_condition_SUBJECT.npy, one for each method."
    ),
    truth: Path = typer.Option(
        ..., help="Recorded motion: a corpus, or the folder vertices_npy or the one around it."
    ),
    templates: Path | None = typer.Option(
        None, help="Neutral faces; by default templates.pkl in or beside vertices_npy."
    ),
    lips: list[Path] | None = typer.Option(
        None,
        help="A list of lip vertices (.json, .txt, .npy, .npz, MeshLab's .pp, or FLAME_masks.pkl, "
        "of which FILE:NAME takes a region) beside the published one. Can be repeated.",
    ),
    upper_face: Path | None = typer.Option(
        None, help="Upper-face vertices of FDD in place of the published list, likewise."
    ),
    condition: str = typer.Option(
        "all",
        help="Files to score: all, own (conditioned on the clip's own subject), or a subject.",
    ),
    every: int = typer.Option(
        0,
        min=0,
        max=100,
        help="Compare every Nth frame of the truth; 0 derives N from the lengths.",
    ),
    timing: bool = typer.Option(
        False, help="Count MTM too, mean temporal misalignment, on FLAME's mesh."
    ),
    partial: bool = typer.Option(False, help="Score the test clips that are there."),
    seed: int = typer.Option(0, min=0, help="Seed of the confidence intervals."),
    table: list[Path] | None = options.Table,
    overwrite: bool = options.OverwriteTable,
    no_clobber: bool = options.KeepTable,
    as_json: bool = options.Json,
) -> None:
    """Score predictions of any method as published tables do: LVE, MVE and FDD.

    The figures are in the data's own unit, as the published code prints them: metres for vocaset.
    LVE² is the squared distance of the worst lip vertex in each frame, LVE the distance; FDD² is
    counted from squared distances, as CodeTalker's code does, and FDD from distances, as its paper
    writes. MTM is how many frames openings and closures are from the true ones.

    With `own` every clip of the truth is compared (of a corpus with a test part, that part), on any
    mesh; where it is not FLAME's or BIWI's, --lips and --upper-face are needed.
    """
    from elocute.cli.outputs import plan_files
    from elocute.cli.tables import check_tables, write_tables
    from elocute.evaluation.benchmark import benchmark_scores, score_predictions
    from elocute.evaluation.benchmark_files import (
        OWN_DATA,
        benchmark_named,
        find_predictions,
        frames_apart,
        open_benchmark_truth,
    )

    benchmark = None if dataset == OWN_DATA else benchmark_named(dataset)
    names = _method_names(predictions)
    files = check_tables(table)
    lists = [path for path in (*(lips or ()), upper_face, templates) if path is not None]
    plan = plan_files([*predictions, truth, *lists], files, overwrite, no_clobber)
    recorded = open_benchmark_truth(benchmark, truth, templates)
    benchmark = recorded.benchmark
    regions, upper = _regions(recorded, lips or [], upper_face)
    matches = [
        find_predictions(recorded, folder, condition=condition, partial=partial)
        for folder in predictions
    ]
    steps = [every or frames_apart(recorded, files) for files in matches]
    middles = _middles(recorded) if timing else None
    columns = (*COLUMNS, TIMING) if timing else COLUMNS
    rows: list[BenchmarkScore] = []
    notes: list[str] = []
    with progress_bar("measuring", as_json) as progress:
        for place, (name, files_, step) in enumerate(zip(names, matches, steps, strict=True)):
            scores = score_predictions(
                recorded,
                files_,
                regions,
                upper,
                step,
                lambda share, place=place: progress((place + share) / len(names)),
                middles,
            )
            rows += benchmark_scores(name, scores, regions, seed)
            notes.append(_note(name, scores, len(recorded.clips), step))
    write_tables(plan, files, *_table(rows, columns))
    if as_json:
        record = {
            "benchmark": benchmark.name,
            "unit": benchmark.unit,
            "upper_face": upper.record(),
            "every": dict(zip(names, steps, strict=True)),
            "rows": [row.record() for row in rows],
            "notes": notes,
        }
        print(json.dumps(record, allow_nan=False))
        return
    _show(rows, columns, notes, upper, benchmark)


def _middles(truth: Truth) -> tuple[int, int]:
    """Between which vertices MTM is counted. Raises InputError, and MachineError without Numba."""
    with needs_extra("MTM", "wild"):
        import numba  # noqa: F401 - what aligns both courses needs it
    topology = truth.benchmark.topology
    if topology.lip_middles is None:
        raise InputError.about(
            f"{truth.source}, {topology.title}",
            found="no published middles of both lips",
            allowed="FLAME's mesh",
            remedy="leave `timing` out",
        )
    return topology.lip_middles


def _method_names(folders: list[Path]) -> list[str]:
    """Names of folders; with their parents where two are called alike."""
    names = [folder.resolve().name for folder in folders]
    if len(set(names)) < len(names):
        names = [f"{folder.resolve().parent.name}/{folder.resolve().name}" for folder in folders]
    if len(set(names)) < len(names):
        raise InputError.about("predictions", found="a folder twice", allowed="each once")
    return names


def _regions(
    truth: Truth, lips: list[Path], upper_face: Path | None
) -> tuple[list[VertexRegion], VertexRegion]:
    """The published list of lips and those of files; the upper face."""
    from elocute.evaluation.vertex_regions import published_region, read_vertex_region

    topology, face = truth.benchmark.topology, next(iter(truth.clips.values()))().template
    if not topology.published and (not lips or upper_face is None):
        raise InputError.about(
            f"{truth.source}, a mesh of {topology.vertices} vertices",
            found="no published lists",
            allowed="--lips FILE and --upper-face FILE",
        )

    def read(path: Path, which: str) -> VertexRegion:
        return read_vertex_region(path, topology.vertices, region=which, template=face)

    more = [read(path, "lips") for path in lips]
    if topology.published:
        more.insert(0, published_region(topology, "lips"))
    if upper_face is None:
        return more, published_region(topology, "upper_face")
    return more, read(upper_face, "upper_face")


def _note(method: str, scores: list[SequenceScore], clips: int, step: int) -> str:
    """What was compared, and what was cut."""
    conditions = {score.prediction.condition for score in scores}
    heard = {score.prediction.clip for score in scores}
    longer = [score.longer_by for score in scores if score.longer_by > 0]
    shorter = [-score.longer_by for score in scores if score.longer_by < 0]
    note = f"{method}: {len(scores)} files of {len(heard)} of {clips} test clips"
    if conditions != {""}:
        note += f" in {len(conditions)} conditions"
    note += f", every {step}. frame of the truth" if step > 1 else ", every frame of the truth"
    if longer:
        note += f"; {len(longer)} predictions cut by up to {max(longer)} frames"
    if shorter:
        note += f"; the truth cut for {len(shorter)} by up to {max(shorter)} frames"
    return note


def _table(
    rows: list[BenchmarkScore], measures: tuple[tuple[str, str], ...]
) -> tuple[list[str], list[list[Any]]]:
    columns = ["method", "lips", "lip vertices", "hash", "sequences", "frames"]
    cells = [
        [
            row.method,
            row.lips.name,
            len(row.lips.indices),
            row.lips.digest,
            row.sequences,
            row.frames,
            *(row.intervals.get(name) for name, _ in measures),
        ]
        for row in rows
    ]
    return [*columns, *(title for _, title in measures)], cells


def _show(
    rows: list[BenchmarkScore],
    measures: tuple[tuple[str, str], ...],
    notes: list[str],
    upper: VertexRegion,
    benchmark: Benchmark,
) -> None:
    print(f"{'method':16} {'lips':30} {'hash':12}", *(f"{title:>14}" for _, title in measures))
    for row in rows:
        found = (row.intervals.get(name) for name, _ in measures)
        cells = (f"{'none':>14}" if each is None else f"{each.value:>14.4e}" for each in found)
        print(f"{row.method:16} {row.lips.name:30} {row.lips.digest}", *cells)
    for line in notes:
        print(line)
    print(f"upper face: {upper.name}, {len(upper.indices)} vertices, {upper.digest}")
    print(f"lengths in {benchmark.unit}; ² in its square, as the published code prints them")
