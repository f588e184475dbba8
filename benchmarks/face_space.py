"""How near the head's identities come to faces that it was not made from, place by place.

    python -m benchmarks.face_space ../shared/data/ict_facekit/FaceXModel [SCAN.ply …] [--head NPZ]

ICT-FaceKit's mean face and what its first identity makes of it at -2 to 2 standard deviations, led
by its own 68 landmarks, and scans in metres without landmarks. Each is registered as a neutral
face, then fitted on by its surface alone, as somebody else's landmarks lie elsewhere.
Measured is the model, before anything free is added: distance of the scan's points that are seen
from the front or the sides within 85 mm of the nose from the model's surface, median and mean, mm,
by the place of the nearest vertex.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from elocute.array_types import Float64Array
from elocute.errors import ElocuteError
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.head.store import load_head
from elocute.numerics.rigid_alignment import rigid_alignment
from elocute.registration.accuracy import scan_distances
from elocute.registration.closest_points import sample_triangles
from elocute.registration.correspondences import sample_scan
from elocute.registration.landmarks import Landmarks, no_landmarks
from elocute.registration.model_fit import FitStage, ModelFit
from elocute.registration.register import MODEL_POINTS, register_neutral
from elocute.registration.scan import Scan
from elocute.registration.scan_file import read_scan
from elocute.registration.template import Template, seen_from_front, with_size
from recipes.heads_speak import ict_parts

AMOUNTS = (-2, -1, 0, 1, 2)
"""Standard deviations of ICT-FaceKit's first identity."""
NEAR_M, PIXEL_M = 0.085, 0.002
SURFACE_ALONE = FitStage(10, 0.006, 0.3, 0.0, 5e-4, 0.2)
PLACES = (
    "nose wings", "nose", "philtrum", "lips", "chin", "orbits", "brow, forehead", "cheeks", "jaw",
)  # fmt: skip
NOSE, NOSE_TIP, WINGS, EYES = range(27, 34), 30, (31, 35), (range(36, 42), range(42, 48))


def places(head: HeadModel) -> np.ndarray:
    """(vertex,) index into PLACES: by distance from landmarks on the mean face."""
    at, marks = head.template.astype(np.float64), head.template[head.landmarks].astype(np.float64)
    y, side = at[:, 1], np.abs(at[:, 0])
    found = np.full(len(at), PLACES.index("cheeks"))
    found[y > marks[19, 1] - 0.012] = PLACES.index("brow, forehead")
    found[y < marks[48, 1]] = PLACES.index("jaw")
    found[(y < marks[57, 1] - 0.003) & (side < 0.024)] = PLACES.index("chin")
    for eye in EYES:
        off = np.linalg.norm(at - marks[list(eye)].mean(axis=0), axis=1)
        found[off < 0.021] = PLACES.index("orbits")
    for mark in NOSE:
        found[np.linalg.norm(at - marks[mark], axis=1) < 0.013] = PLACES.index("nose")
    for mark in WINGS:
        wing = (np.linalg.norm(at - marks[mark], axis=1) < 0.014) & (side > 0.009)
        found[wing] = PLACES.index("nose wings")
    below = (y < marks[33, 1]) & (y > marks[51, 1] - 0.002) & (side < 0.012)
    found[below & (at[:, 2] > marks[48, 2])] = PLACES.index("philtrum")
    found[head.regions["lips"]] = PLACES.index("lips")
    return found


def ict_faces(folder: Path) -> Iterator[tuple[str, Scan, Landmarks]]:
    """The skin of ICT-FaceKit's faces, and their landmarks."""
    points, faces, marks = ict_parts(folder)
    lines = (folder / "identity000.obj").read_text(encoding="utf-8").splitlines()
    other = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float64)
    used, corners = np.unique(faces["M_Face"], return_inverse=True)
    triangles = corners.reshape(-1, 3).astype(np.int32)
    for amount in AMOUNTS:
        moved = 0.01 * (points + amount * (other - points))
        known = Landmarks(moved[marks], np.ones(68))
        yield f"ICT {amount:+d}", Scan("ict", moved[used], triangles), known


def left_by_the_model(
    template: Template, scan: Scan, marks: Landmarks
) -> tuple[Float64Array, NDArray[np.intp]]:
    """Distances mm of the scan's points near the nose, and the index of each one's vertex."""
    _, found = register_neutral(template.head, scan, marks)
    fit = ModelFit(Template(with_size(template.head), mouth_shut=True), True)
    samples = sample_scan(scan).subset(MODEL_POINTS)
    posed = fit.posed_vertices(fit.fit(samples, marks, found.parameters, (SURFACE_ALONE,)))
    off = scan_distances(template, posed, scan)
    nose = posed[template.nose_tip]
    near = np.isfinite(off) & (np.linalg.norm(scan.points - nose, axis=1) < NEAR_M)
    near &= seen(template, posed, scan)
    _, vertex = KDTree(posed[template.open_face]).query(scan.points[near])
    return off[near], template.open_face[np.asarray(vertex)]


def seen(template: Template, posed: Float64Array, scan: Scan) -> np.ndarray:
    """(point,) whether a point of the scan is seen from the front or the sides of the head."""
    rotation, _ = rigid_alignment(posed[template.still], template.vertices[template.still])
    turned = scan.points @ rotation.T
    fine = sample_triangles(turned, scan.triangles, PIXEL_M / 2)
    return seen_from_front(turned, fine.points(turned, scan.triangles), PIXEL_M)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path, help="FaceXModel of ICT-FaceKit")
    parser.add_argument("scans", nargs="*", type=Path)
    parser.add_argument("--head", type=Path, help="another version of the built-in head")
    given = parser.parse_args()
    template = Template(load_head(given.head) if given.head else load_builtin_head())
    place_of = places(template.head)
    scans = ((path.stem, read_scan(path, "m"), no_landmarks()) for path in given.scans)
    print(f"| mm, median, mean | {' | '.join(PLACES)} | all |")
    print("|---" * (len(PLACES) + 2) + "|")
    for name, scan, marks in (*ict_faces(given.folder), *scans):
        try:
            off, vertex = left_by_the_model(template, scan, marks)
        except ElocuteError as error:
            print(f"| {name} | {error} |")
            continue
        parts = [off[place_of[vertex] == number] for number in range(len(PLACES))]
        told = (f"{np.median(part):.2f}, {part.mean():.2f}" for part in (*parts, off))
        print(f"| {name} | {' | '.join(told)} |", flush=True)


if __name__ == "__main__":
    main()
