"""Converts a motion to the parameters of another standard, and says what they leave."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from elocute.array_types import Float64Array
from elocute.errors import OutputError
from elocute.export.curves_json import FORMAT, VERSION
from elocute.export.fitted_shapes import farthest_mm
from elocute.export.shape_profiles import target_shapes
from elocute.files.atomic import write_atomically
from elocute.motion.curves import Curves
from elocute.motion.motion import Motion

STANDARDS = ("arkit", "oculus", "vrm")


@dataclass(frozen=True, eq=False)
class Conversion:
    """Curves of another standard.

    Attributes
    ----------
    curves : Curves
        (frame, target), 0 to 1 but where a curve that is taken over is beyond.
    residual_mm : (frame,) float64
        The farthest that a vertex of the face's skin is from where the motion has it. What the
        tongue does is not in it: no standard has all of that.
    report : dict
        What the targets cannot show, as the profiles of a .glb tell it.
    """

    curves: Curves
    residual_mm: Float64Array
    report: dict[str, Any]


def convert_curves(motion: Motion, standard: str) -> Conversion:
    """The curves of a standard that show a motion best.

    Parameters
    ----------
    motion : Motion
        Of a head with the built-in head's shapes.
    standard : str
        "arkit": its 52 shapes, the speech shapes folded in. "oculus": fifteen visemes and what is
        not of the mouth. "vrm": the expressions of VRM 1.0. Visemes and vowels are fitted to the
        mouth, from 0 to 1, few at a time, and lips that meet weigh most.

    Returns
    -------
    Conversion

    Raises
    ------
    OutputError
        For another standard, and a head without the shapes.
    """
    if standard not in STANDARDS:
        raise OutputError.about("standard", found=repr(standard), allowed=", ".join(STANDARDS))
    targets = target_shapes(motion.head, standard)
    curves = Curves(targets.weights(motion), targets.names, motion.fps)
    face = motion.head.regions.get("face", slice(None))
    left = farthest_mm(motion, targets.shown(motion), face)
    return Conversion(curves, left, targets.report(motion))


def write_curves(curves: Curves, path: str | Path) -> None:
    """Write curves: .json as `curves_json` lays them out, .csv with the time of each frame.

    Raises OutputError for another suffix, and a place that cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".csv", ".json"):
        raise OutputError.about(path, found=f"suffix {suffix!r}", allowed=".csv or .json")
    rows = [[round(float(value), 6) for value in row] for row in curves.values]
    with write_atomically(path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        if suffix == ".csv":
            table = csv.writer(file)
            table.writerow(["time_s", *curves.names])
            table.writerows([f"{frame / curves.fps:.4f}", *row] for frame, row in enumerate(rows))
        else:
            facts = {"format": FORMAT, "version": VERSION, "fps": curves.fps}
            json.dump(facts | {"names": list(curves.names), "frames": rows}, file)
            file.write("\n")
