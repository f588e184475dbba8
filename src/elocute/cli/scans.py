"""What commands that take a scan have in common: its landmarks, and the package they need."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.errors import MachineError

if TYPE_CHECKING:
    from elocute.head.model import HeadModel
    from elocute.registration.landmarks import Landmarks
    from elocute.registration.scan import Scan


def need_scipy() -> None:
    """Raises MachineError where the extra is not installed."""
    if importlib.util.find_spec("scipy") is None:
        raise MachineError("registration needs scipy; install it: pip install 'elocute[capture]'")


def known_landmarks(head: HeadModel, scan: Scan, file: Path | None, unit: str) -> Landmarks:
    """Those of a file, or as a detector sees them; none are known where there is no detector.

    Raises CaptureError for a file that holds none.
    """
    from elocute.capture.scanned_head import detected_landmarks
    from elocute.registration.landmarks import read_landmarks
    from elocute.registration.scan_file import unit_m

    if file is not None:
        return read_landmarks(file, unit_m(unit))
    seen = detected_landmarks(head, scan)
    if seen.enough:
        typer.echo(f"elocute: {int(seen.good.sum())} of 68 landmarks seen in pictures", err=True)
    return seen
