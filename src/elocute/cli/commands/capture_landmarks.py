"""`elocute capture landmarks`: the 68 landmarks of scans, detected, or set by hand on a page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.flags import in_flags
from elocute.cli.outputs import check_file_suffix, nothing_to_do
from elocute.cli.progress import progress_bar
from elocute.errors import CaptureError, InputError, OutputError
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    from elocute.capture.scans.landmark_detection import LandmarkDetector
    from elocute.registration.scan import Scan

FOLDER = "landmarks"


def landmarks_command(
    scans: Path = typer.Argument(..., help="A scan, or a folder as `capture scans` takes it."),
    output: Path | None = typer.Option(
        None,
        "-o",
        "--output",
        help="For one scan: the .json to write, or an .html to set landmarks by hand. A folder's "
        "go to FOLDER/landmarks/.",
    ),
    unit: str | None = typer.Option(None, help="Unit of the coordinates: m, mm, cm, dm or inch."),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Detect the 68 landmarks of scans in renders from several sides, or set them by hand.

    Detection needs the extra `video`. With `-o FILE.html` a page is written instead: it shows the
    scan in any browser, asks for one landmark after another, shows where each is to be expected,
    and saves FILE.json in the scan's own unit.

    Heads that are upright and face +Z are seen at once, others are turned so. Scans of a folder
    that have landmarks already are left alone, so an interrupted run can be repeated.
    """
    if scans.is_dir() == (output is not None):
        raise OutputError.about(
            scans,
            found="a folder, and -o" if output else "one scan, and no -o",
            allowed="-o FILE.json for one scan, none for a folder",
        )
    if output is not None and output.suffix.lower() == ".html":
        _page(scans, output, unit, OutputPlan(), overwrite, no_clobber, as_json)
        return
    check_file_suffix(output, ".json")
    plan = OutputPlan()
    if output is not None:
        plan.add(output, scans)
        if nothing_to_do(plan, overwrite, no_clobber, as_json):
            return
    from elocute.capture.scans.landmark_detection import mediapipe_landmarks

    with mediapipe_landmarks() as detector:
        if output is not None:
            with plan.writing(output):
                written, failed = _of_file(scans, output, unit or "m", detector)
        else:
            written, failed = _of_folder(scans, unit, detector, as_json)
    if as_json:
        print(json.dumps({"scans": str(scans), "found": written, "failed": failed}))
    else:
        print(f"{written} scans with landmarks, {len(failed)} without")
        for line in failed:
            typer.echo(f"elocute: {line}", err=True)
    if failed:
        raise typer.Exit(1)


def _page(
    scan: Path,
    output: Path,
    unit: str | None,
    plan: OutputPlan,
    overwrite: bool,
    no_clobber: bool,
    as_json: bool,
) -> None:
    if unit is not None:
        raise InputError.about(
            "--unit", found=f"with {output.name}", allowed="for detection: a page keeps the unit"
        )
    plan.add(output, scan)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    from elocute.capture.scans.landmark_page import write_landmark_page
    from elocute.registration.scan_file import read_scan

    with plan.writing(output):
        write_landmark_page(output, read_scan(scan))
    if as_json:
        print(json.dumps({"scans": str(scan), "output": str(output)}))
    else:
        print(f"{output}: open it in a browser; it saves {output.with_suffix('.json').name}")


def _of_file(
    scan: Path, output: Path, unit: str, detector: LandmarkDetector
) -> tuple[int, list[str]]:
    from elocute.registration.scan_file import read_scan

    fault = _written(read_scan(scan, unit), unit, output, detector)
    return int(not fault), [f"{scan}: {fault}"] if fault else []


def _of_folder(
    folder: Path, unit: str | None, detector: LandmarkDetector, quiet: bool
) -> tuple[int, list[str]]:
    """How many were found now, and a line for each that was not."""
    from elocute.capture.scans.scan_sequence import find_sequences, open_sequence

    sequences = [open_sequence(place, unit=unit) for place in find_sequences(folder)]
    waiting = [
        (sequence, number)
        for sequence in sequences
        for number in sequence.numbers
        if sequence.landmark_file(number) is None
    ]
    written, failed = 0, []
    with progress_bar(f"detecting landmarks in {folder.name}", quiet) as progress:
        for done, (sequence, number) in enumerate(waiting, start=1):
            place = sequence.folder / FOLDER / f"{sequence.file(number).stem}.json"
            try:
                fault = _written(sequence.scan(number), sequence.metadata.unit, place, detector)
            except CaptureError as error:
                fault = in_flags(str(error))
            written += not fault
            failed += [f"{sequence.file(number)}: {fault}"] if fault else []
            progress(done / len(waiting))
    return written, failed


def _written(scan: Scan, unit: str, path: Path, detector: LandmarkDetector) -> str:
    """Why there are no landmarks, or "". They are written in the scan's unit."""
    from elocute.capture.scans.landmark_detection import find_landmarks
    from elocute.head.builtin import load_builtin_head
    from elocute.registration.landmarks import Landmarks, write_landmarks
    from elocute.registration.scan_file import unit_m

    seen = find_landmarks(load_builtin_head(), scan, detector)
    if not seen.enough:
        return f"{int(seen.good.sum())} landmarks seen; is there a whole face in it?"
    path.parent.mkdir(exist_ok=True)
    write_landmarks(path, Landmarks(seen.points / unit_m(unit), seen.confidence))
    return ""
