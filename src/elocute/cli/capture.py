"""`elocute capture`: from raw scans to registered motion."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.progress import progress_bar
from elocute.errors import OutputError

if TYPE_CHECKING:
    from elocute.capture.register import Registration
    from elocute.head.model import HeadModel

app = typer.Typer(help="Turn raw scans into motion of one topology.", no_args_is_help=True)

HeadChoice = typer.Option(
    "builtin", "--head", help="The topology to register: builtin, a FLAME model or a head file."
)
Unit = typer.Option(None, "--unit", help="Of the coordinates: m, mm, cm, dm or inch.")


@app.callback()
def _group() -> None:
    """Turn raw scans into motion of one topology."""


@app.command("scan")
def scan_command(
    file: Path = typer.Argument(..., help="A scan of a head (.ply or .obj)."),
    output: Path = typer.Option(..., "-o", "--output", help="The registered mesh, .ply or .obj."),
    landmarks: Path | None = typer.Option(
        None, help="Its 68 landmarks (.json, .ljson or .pts), in the scan's unit."
    ),
    template: Path | None = typer.Option(
        None, help="The person's resting face in the topology of --head, as `capture` writes it."
    ),
    head: str = HeadChoice,
    unit: str = typer.Option("m", help="Of the scan: m, mm, cm, dm or inch."),
    zero_pose: bool = typer.Option(
        False, help="Without turn of head and neck, in metres; else as and where the scan is."
    ),
    as_json: bool = options.Json,
) -> None:
    """Register one scan: the head's mesh, laid over it."""
    from elocute.capture.landmarks import no_landmarks, read_landmarks
    from elocute.capture.scan_file import read_scan, unit_m
    from elocute.head.choice import open_head
    from elocute.motion.atomic import check_output, write_atomically

    if output.suffix.lower() not in (".ply", ".obj"):
        raise OutputError.about(output, found=f"suffix {output.suffix!r}", allowed=".ply .obj")
    check_output(output)
    model = open_head(head)
    scan = read_scan(file, unit)
    known = no_landmarks() if landmarks is None else read_landmarks(landmarks, unit_m(unit))
    found = _registered(model, scan, known, template)
    points = found.zero if zero_pose else found.vertices / unit_m(unit)
    with write_atomically(output) as draft:
        draft.write_bytes(_mesh_bytes(model, output.suffix.lower(), points))
    _report(file, output, found, as_json)


def _registered(model: HeadModel, scan: Any, known: Any, template: Path | None) -> Registration:
    from elocute.capture.register import register_neutral, register_scan
    from elocute.capture.template import Template
    from elocute.head.mesh import read_mesh, with_template

    if template is None:
        return register_neutral(model, scan, known)[1]
    points, _ = read_mesh(template)
    return register_scan(Template(with_template(model, points, model.name)), scan, known)


def _mesh_bytes(head: HeadModel, suffix: str, points: Any) -> bytes:
    from elocute.export.faces import MESHES

    return MESHES[suffix](head)(points.astype("float32"))


def _report(file: Path, output: Path, found: Registration, as_json: bool) -> None:
    apart = None if found.landmark_mm is None else round(found.landmark_mm, 4)
    record = {"scan": str(file), "output": str(output), "surface_mm": found.surface.record()}
    record |= {"landmark_mm": apart, "seconds": round(found.seconds, 3)}
    record |= {"lost": found.lost, "notes": list(found.notes)}
    if as_json:
        print(json.dumps(record))
    else:
        print(output)
        error = found.surface
        print(
            f"surface {error.median:.3f} mm median, {error.mean:.3f} mean, {error.p95:.3f} at the "
            f"95th percentile; {found.seconds:.1f} s"
        )
        if apart is not None:
            print(f"landmarks {apart:.2f} mm")
        for note in found.notes:
            print(f"note: {note}")
    if found.lost:
        typer.echo(f"elocute: {file}: {found.lost}", err=True)
        raise typer.Exit(1)


_ = progress_bar
