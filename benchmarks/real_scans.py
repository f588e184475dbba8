"""Registration of real scans: surface, held-out landmarks, and the same answer however they lie.

    python -m benchmarks.real_scans SCAN.ply:MARKS.json … [--unit m]

Prepare a scan by `elocute capture landmarks`. Every second landmark is withheld from the fit and
measured; neither is the truth, since a detector errs by millimetres. `same` is the mean distance of
the skin within 70 mm of the nose from the fit of the scan as it stands; `strange` and `dev.` are
what tells a face in a wrong place (`Registration.lost`).
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import ElocuteError
from elocute.head.builtin import load_builtin_head
from elocute.numerics.quaternions import from_axis_angle, to_matrices
from elocute.registration.accuracy import scan_distances
from elocute.registration.landmarks import Landmarks, no_landmarks, read_landmarks
from elocute.registration.register import Registration, register_neutral
from elocute.registration.scan import Scan
from elocute.registration.scan_file import read_scan, unit_m
from elocute.registration.template import Template

NEAR_M, JAW = 0.07, 17
TURNS_DEG = ((0, 30, 0), (0, 90, 0), (0, 180, 0), (180, 0, 0))


@dataclass(frozen=True, eq=False)
class Variant:
    """A scan in another state, and the rotation (3, 3) that it has."""

    name: str
    scan: Scan
    landmarks: Landmarks
    rotation: Float64Array


def variants(scan: Scan, marks: Landmarks) -> Iterator[Variant]:
    """As it is, turned, cut out, wound inside out, and without landmarks."""
    still = np.eye(3)
    yield Variant("as it stands", scan, marks, still)
    for turn in TURNS_DEG:
        rotation = np.asarray(to_matrices(from_axis_angle(np.radians([turn])))[0], np.float64)
        told = "turned by {}, {}, {} degrees".format(*turn)
        for way, known in ((told, marks), (f"{told}, no landmarks", no_landmarks())):
            moved = Landmarks(known.points @ rotation.T, known.confidence)
            yield Variant(way, replace(scan, points=scan.points @ rotation.T), moved, rotation)
    middle = np.nanmedian(marks.points[JAW:], axis=0)
    near = np.linalg.norm(scan.points - middle, axis=1) < NEAR_M + 0.015
    cut = scan.triangles[near[scan.triangles].all(axis=1)]
    yield Variant("cut to the face", replace(scan, triangles=cut), marks, still)
    inside = scan.triangles[:, ::-1].copy()
    yield Variant("inside out", replace(scan, triangles=inside), marks, still)
    yield Variant("no landmarks", scan, no_landmarks(), still)


def row(
    template: Template, variant: Variant, scan: Scan, held: Landmarks, first: Registration | None
) -> tuple[str, Registration | None]:
    try:
        _, found = register_neutral(template.head, variant.scan, variant.landmarks)
    except ElocuteError as error:
        return f"{variant.name:44} refused: {error}", None
    places = found.vertices @ variant.rotation
    apart = scan_distances(template, places, scan)
    nose = places[template.nose_tip]
    apart = apart[(np.linalg.norm(scan.points - nose, axis=1) < NEAR_M) & np.isfinite(apart)]
    marks = np.flatnonzero(held.good)
    off = np.linalg.norm(places[template.head.landmarks[marks]] - held.points[marks], axis=1)
    numbers = [np.median(apart), apart.mean(), np.percentile(apart, 95), 1000 * np.mean(off)]
    numbers += [1000 * np.median(off)]
    numbers += [found.surface.strange, found.parameters.deviation]
    if first is not None:
        face = template.open_face
        numbers.append(1000 * np.linalg.norm(places - first.vertices, axis=1)[face].mean())
    told = "".join(f"{number:9.2f}" for number in numbers) + f"{found.seconds:7.1f} s"
    return f"{variant.name:44}{told}  {found.lost}", found


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("scans", nargs="+", help="SCAN:LANDMARKS")
    parser.add_argument("--unit", default="m")
    arguments = parser.parse_args()
    template = Template(load_builtin_head())
    for pair in arguments.scans:
        mesh, marks = pair.rsplit(":", 1)
        scan = read_scan(mesh, arguments.unit)
        known = read_landmarks(marks, unit_m(arguments.unit))
        odd = np.arange(len(known.confidence)) % 2 == 1
        held = Landmarks(known.points, known.confidence * odd * (np.arange(68) >= JAW))
        led = Landmarks(known.points, known.confidence * ~odd)
        if not led.enough:  # few are sure: half of them would be too few to start from
            held = led = known
        print(f"{Path(mesh).name}: {len(scan.points)} points, {led.good.sum()} landmarks used")
        print(
            f"{'mm':44}{'median':>9}{'mean':>9}{'p95':>9}{'held':>9}{'median':>9}{'strange':>9}{'dev.':>9}{'same':>9}"
        )
        first = None
        for variant in variants(scan, led):
            told, found = row(template, variant, scan, held, first)
            first = first or found
            print(told, flush=True)


if __name__ == "__main__":
    main()
