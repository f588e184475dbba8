"""`elocute capture`: scans registered, checked and simulated."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.capture.settings import BatchSettings, Scanner
from elocute.cli import options
from elocute.cli.command_group import CommandGroup
from elocute.cli.commands import capture_landmarks, capture_video
from elocute.cli.flags import in_flags
from elocute.cli.outputs import check_file_suffix, nothing_to_do
from elocute.cli.progress import progress_bar, resumable
from elocute.cli.scans import known_landmarks, need_scipy
from elocute.cli.settings_options import option, options_of
from elocute.errors import InputError
from elocute.files.output_plan import OutputPlan
from elocute.numerics.frame_rates import frame_rate

if TYPE_CHECKING:
    from elocute.capture.sequence_tracking import SequenceResult
    from elocute.head.model import HeadModel
    from elocute.registration.landmarks import Landmarks
    from elocute.registration.register import Registration
    from elocute.registration.scan import Scan

app = CommandGroup("Capture motion in one topology, from scans or video.")

HeadChoice, Fps, Unit = (option(BatchSettings, name) for name in ("head", "fps", "unit"))


@app.command("scan")
def scan_command(
    file: Path = typer.Argument(..., help="A scan of a head (.ply or .obj)."),
    output: Path = typer.Option(
        ..., "-o", "--output", help="Registered mesh to write (.ply or .obj)."
    ),
    landmarks: Path | None = options.Landmarks,
    template: Path | None = typer.Option(
        None,
        help="The person's neutral face in the topology of --head, as --zero-pose writes it.",
    ),
    method: str = typer.Option(
        "model",
        help="Method: model (fit the head model, then deform it freely) or nicp (non-rigid ICP).",
    ),
    head: str = HeadChoice,
    unit: str = typer.Option("m", help="Unit of the scan: m, mm, cm, dm or inch."),
    zero_pose: bool = typer.Option(
        False,
        help="Write the mesh in zero pose and metres, not in the pose and unit of the scan; "
        "without --template it is the person's neutral face, its expression taken out.",
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Register one scan: lay the head's mesh over it."""
    need_scipy()
    from elocute.files.atomic import write_atomically
    from elocute.head.registry import open_head
    from elocute.registration.scan_file import read_scan, unit_m

    check_file_suffix(output, ".ply", ".obj")
    if method not in ("model", "nicp"):
        raise InputError.about(f"method {method!r}", found="unknown", allowed="model, nicp")
    plan = OutputPlan([given for given in (landmarks, template, head) if given is not None])
    plan.add(output, file)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    model = open_head(head)
    scan = read_scan(file, unit)
    known = known_landmarks(model, scan, landmarks, unit)
    registration, neutral = _registered(model, scan, known, template, method)
    points = neutral if zero_pose else registration.vertices / unit_m(unit)
    with plan.writing(output), write_atomically(output) as draft:
        draft.write_bytes(_mesh_bytes(model, output.suffix.lower(), points))
    _report(file, output, registration, as_json)


def _registered(
    model: HeadModel, scan: Scan, known: Landmarks, template: Path | None, method: str
) -> tuple[Registration, Any]:
    """The registration, and the mesh in zero pose (vertex, 3) m: a new person's at rest."""
    from elocute.head.mesh import read_mesh, with_template
    from elocute.registration.register import (
        register_neutral,
        register_nonrigid,
        register_scan,
    )
    from elocute.registration.template import Template

    if template is not None:
        model = with_template(model, read_mesh(template)[0], model.name)
    if template is None and method == "model":
        own, registration = register_neutral(model, scan, known)
        return registration, own.vertices
    if method == "nicp":
        registration, _ = register_nonrigid(Template(model), scan, known)
    else:
        registration = register_scan(Template(model), scan, known)
    return registration, registration.zero


def _mesh_bytes(head: HeadModel, suffix: str, points: Any) -> bytes:
    from elocute.export.meshes import MESH_FORMATS

    # The images are not of the person who was scanned.
    bare = replace(head, surfaces={})
    return MESH_FORMATS[suffix](bare).mesh(points.astype("float32"))


def _report(file: Path, output: Path, registration: Registration, as_json: bool) -> None:
    apart = None if registration.landmark_mm is None else round(registration.landmark_mm, 4)
    record = {"scan": str(file), "output": str(output), "surface_mm": registration.surface.record()}
    record |= {"landmark_mm": apart, "seconds": round(registration.seconds, 3)}
    record |= {"lost": registration.lost, "notes": list(registration.notes)}
    if as_json:
        print(json.dumps(record))
    else:
        print(output)
        error = registration.surface
        print(
            f"surface {error.median:.3f} mm median, {error.mean:.3f} mean, {error.p95:.3f} at the "
            f"95th percentile; {registration.seconds:.1f} s"
        )
        if apart is not None:
            print(f"landmarks {apart:.2f} mm")
        for note in registration.notes:
            print(f"note: {note}")
    if registration.lost:
        typer.echo(f"elocute: {file}: {registration.lost}", err=True)
        raise typer.Exit(1)


@app.command("scans")
def scans_command(
    folder: Path = typer.Argument(..., help="A folder of scans, or a folder of such folders."),
    output: Path = typer.Option(
        ..., "-o", "--output", help="Output folder; what it holds already is not computed again."
    ),
    settings: BatchSettings = options_of(BatchSettings, defaults={"jobs": 0}),
    as_json: bool = options.Json,
) -> None:
    """Register sequences of scans, and make a corpus of those with sound."""
    need_scipy()
    from elocute.capture.scans_to_corpus import capture_scans

    with (
        resumable("run it again to continue"),
        progress_bar(f"registering {folder.name}", as_json) as progress,
    ):
        results = [
            replace(result, failed=in_flags(result.failed))
            for result in capture_scans(folder, output, settings, progress)
        ]
    _tell_results(output, results, as_json)


def _tell_results(output: Path, results: list[SequenceResult], as_json: bool) -> None:
    failed = [result for result in results if result.failed]
    if as_json:
        record = {"output": str(output), "failed": len(failed)}
        print(json.dumps(record | {"sequences": [asdict(result) for result in results]}))
    else:
        for result in results:
            print(f"{result.name:28} {result.failed or _told(result)}")
        if any(result.in_corpus for result in results):
            print(output / "corpus")
    if failed:
        raise typer.Exit(1)


def _told(result: SequenceResult) -> str:
    parts = [f"{result.frames} frames, {result.median_mm:.3f} mm median"]
    if result.flagged or result.missing:
        parts.append(f"{len(result.flagged)} flagged and {len(result.missing)} missing filled in")
    if not result.in_corpus:
        parts.append("no sound: not in the corpus")
    return ", ".join(parts)


@app.command("check")
def check_command(
    folder: Path = typer.Argument(..., help="A folder of scans, or a folder of such folders."),
    fps: float | None = Fps,
    unit: str | None = Unit,
    every: int = typer.Option(1, min=1, help="Check only every n-th scan."),
    as_json: bool = options.Json,
) -> None:
    """Check scans before they are registered; the exit code is 1 where errors are found."""
    need_scipy()
    from elocute.capture.scans.scan_checks import check_scans

    with progress_bar(f"checking {folder.name}", as_json) as progress:
        findings = check_scans(folder, fps=fps, unit=unit, every=every, progress=progress)
    errors = sum(finding.level == "error" for finding in findings)
    if as_json:
        record = {"folder": str(folder), "errors": errors, "warnings": len(findings) - errors}
        print(json.dumps(record | {"findings": [asdict(finding) for finding in findings]}))
    else:
        for finding in findings:
            place = "" if finding.frame is None else f"  (frame {finding.frame})"
            print(f"{finding.level:8} {finding.about}  {finding.what}{place}")
        print(f"{errors} errors, {len(findings) - errors} warnings")
    if errors:
        raise typer.Exit(1)


@app.command("simulate")
def simulate_command(
    speech: Path = typer.Argument(..., help="Sound file of the speech."),
    output: Path = typer.Option(..., "-o", "--output", help="A new folder of scans."),
    identity: str = options.Identity,
    fps: float = typer.Option(60.0, help="Scans per second.", parser=frame_rate, metavar="RATE"),
    seconds: float | None = typer.Option(
        None, min=0.05, help="Scan only this many seconds from the start."
    ),
    scanner: Scanner = options_of(Scanner),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Simulate scans of the built-in head while it speaks, with known ground truth."""
    need_scipy()
    from elocute.animation import animate
    from elocute.audio.read import read_audio
    from elocute.capture.scans.scan_sequence import SequenceMetadata
    from elocute.capture.simulation.scan_simulator import simulate_scans
    from elocute.motion.edits import cut

    plan = OutputPlan()
    plan.add(output, speech)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    motion = animate(speech, model="articulation", fps=fps, identity=identity, life=0).motion
    if seconds is not None:
        motion = cut(motion, 0.0, min(seconds, motion.duration_s))
    metadata = SequenceMetadata(subject=f"sim{scanner.seed}", sentence="speech")
    with plan.writing(output), progress_bar(f"scanning {output.name}", as_json) as progress:
        simulate_scans(
            motion,
            output,
            scanner=scanner,
            metadata=metadata,
            sound=read_audio(speech),
            progress=progress,
        )
    if as_json:
        print(json.dumps({"output": str(output), "frames": motion.frame_count, "fps": fps}))
    else:
        print(output)


app.command("landmarks")(capture_landmarks.landmarks_command)
app.command("video")(capture_video.video_command)
