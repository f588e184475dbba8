"""Registration of simulated scans: this package against trimesh's non-rigid ICP, in one run.

    python -m benchmarks.registration [--frames 6] [--points 120000] [--skip-trimesh]
    python -m benchmarks.registration --detected     landmarks found in pictures (extra `video`)

Needs trimesh's own extra `rtree`. CPU seconds of one thread, without reading files and measuring.
The same scans, landmarks, template and rigid start go to everybody; trimesh runs with the settings
of its own documentation. "cold" knows nothing but the person's neutral face; "warm" has the frame
before (factors only, for non-rigid ICP). GroundTruth is the simulated head: see
`elocute.capture.simulation.scan_simulator` for what it holds that no model explains.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np

import elocute
from elocute.animation import animate
from elocute.array_types import Float64Array
from elocute.capture.simulation.range_scanner import phong_tessellation
from elocute.capture.simulation.scan_simulator import Scanner, ScanSimulator
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion
from elocute.registration.accuracy import correspondence_mm, scan_distances, surface_error
from elocute.registration.closest_points import CoarseMesh, sample_triangles
from elocute.registration.correspondences import sample_scan
from elocute.registration.head_search import initial_poses
from elocute.registration.landmarks import Landmarks
from elocute.registration.nonrigid_icp import NonrigidIcp
from elocute.registration.register import register_neutral, register_nonrigid, register_scan
from elocute.registration.scan import Scan, checked_scan
from elocute.registration.template import Template
from elocute.registration.zero_pose import apply_pose

REGIONS = ("face", "lips", "eye_area_left", "scalp")


@dataclass(frozen=True, eq=False)
class Case:
    """One frame: its scan, landmarks, true vertices (vertex, 3) m and opening of the jaw 0…1."""

    scan: Scan
    landmarks: Landmarks
    truth: Float64Array
    opening: float


@dataclass
class Column:
    """What one method did on all frames."""

    name: str
    seconds: list[float] = field(default_factory=list)
    median: list[float] = field(default_factory=list)
    mean: list[float] = field(default_factory=list)
    p95: list[float] = field(default_factory=list)
    landmark: list[float] = field(default_factory=list)
    regions: list[dict[str, float]] = field(default_factory=list)
    steps: list[int] = field(default_factory=list)
    open_mouth: list[float] = field(default_factory=list)

    def add(self, template: Template, case: Case, vertices: Float64Array, seconds: float) -> None:
        head = template.head
        error = surface_error(scan_distances(template, vertices, case.scan))
        apart = vertices[head.landmarks] - case.truth[head.landmarks]
        self.seconds.append(seconds)
        self.median.append(error.median)
        self.mean.append(error.mean)
        self.p95.append(error.p95)
        self.landmark.append(float(1000 * np.linalg.norm(apart, axis=1).mean()))
        self.regions.append(correspondence_mm(head, vertices, case.truth))
        if case.opening > 0.15:
            self.open_mouth.append(correspondence_mm(head, vertices, case.truth)["lips"])

    def row(self) -> str:
        places = [np.mean([region[name] for region in self.regions]) for name in REGIONS]
        numbers = [
            np.mean(self.seconds),
            *map(np.mean, (self.median, self.mean, self.p95)),
            np.mean(self.landmark),
            *places,
        ]
        told = f"{self.name:34}" + "".join(f"{number:9.3f}" for number in numbers)
        if self.open_mouth:
            told += f"{np.mean(self.open_mouth):9.3f}"
        return told + (f"{np.mean(self.steps):7.1f}" if self.steps else "")


def cases_of(motion: Motion, scanner: Scanner, count: int) -> tuple[Case, list[Case], float, float]:
    """The neutral case, frames that follow one another from the widest opening, noise floors."""
    stage = ScanSimulator(motion, scanner)
    jaw = motion.weights[:, motion.names.index("jawOpen")]
    first = int(np.clip(jaw.argmax() - count // 2, 0, motion.frame_count - count))
    floors, cases = [], []
    for frame in (0, *range(first, first + count)):
        taken = stage.frame(frame)
        scan, _ = checked_scan(Scan(f"frame {frame}", taken.points, taken.triangles))
        cases.append(Case(scan, taken.landmarks, taken.truth.posed, float(jaw[frame])))
        fine = phong_tessellation(taken.truth.posed, stage.triangles, stage.refinement)
        triangles = stage.refinement.triangles
        surface = CoarseMesh(fine, triangles, sample_triangles(fine, triangles, 0.001))
        apart = 1000 * np.sqrt(surface.closest(scan.points, near=4).squared)
        floors.append((np.median(apart), apart.mean()))
    median, mean = np.mean(floors[1:], axis=0)
    return cases[0], cases[1:], float(median), float(mean)


def ours(head: HeadModel, template: Template, cases: list[Case]) -> list[Column]:
    """Cold and warm fits, and non-rigid ICP with either template."""
    cold, warm = Column("elocute model, cold"), Column("elocute model, warm")
    before = register_scan(template, cases[0].scan, cases[0].landmarks)
    for case in cases:
        found = register_scan(template, case.scan, case.landmarks)
        cold.add(template, case, found.vertices, found.seconds)
    for case in cases[1:]:
        before = register_scan(template, case.scan, case.landmarks, before)
        warm.add(template, case, before.vertices, before.seconds)
    alone = Column("elocute model, one unknown person")
    for case in cases[:2]:
        _, found = register_neutral(head, case.scan, case.landmarks)
        alone.add(template, case, found.vertices, found.seconds)
    return [
        cold,
        warm,
        alone,
        *(_nonrigid(template, cases, adapted) for adapted in (True, False)),
        _nonrigid(template, cases, True, again=True),
    ]


def _nonrigid(template: Template, cases: list[Case], adapted: bool, again: bool = False) -> Column:
    told = f"elocute NICP, {'adaptive' if adapted else 'fixed'}{', warm' if again else ''}"
    column, icp, before = Column(told), NonrigidIcp(template), None
    if again:
        before, _ = register_nonrigid(template, cases[0].scan, cases[0].landmarks, icp=icp)
    for case in cases[1:] if again else cases:
        found, steps = register_nonrigid(
            template,
            case.scan,
            case.landmarks,
            adapted=adapted,
            icp=icp if again else None,
            before=before,
        )
        before = found if again else None
        column.add(template, case, found.vertices, found.seconds)
        column.steps.append(steps)
    return column


def detected(head: HeadModel, neutral: Case, cases: list[Case]) -> Column:
    """The model fit with landmarks that a detector found, for the neutral face too."""
    from elocute.capture.scans.landmark_detection import detect_landmarks, mediapipe_landmarks

    column, off = Column("elocute model, landmarks found"), []
    with mediapipe_landmarks() as detector:
        template, _ = register_neutral(head, neutral.scan, detect_landmarks(neutral.scan, detector))
        for case in cases:
            marks = detect_landmarks(case.scan, detector)
            apart = np.linalg.norm(marks.points - case.truth[head.landmarks], axis=1)
            off += list(1000 * apart[marks.good])
            found = register_scan(template, case.scan, marks)
            column.add(template, case, found.vertices, found.seconds)
    print(
        f"landmarks found: {len(off) / len(cases):.0f} of 68 good, {np.median(off):.2f} mm off "
        f"in the median, {np.mean(off):.2f} mm in the mean"
    )
    return column


def theirs(template: Template, cases: list[Case]) -> list[Column]:
    """trimesh's two methods from the neutral face, laid over the scan by the landmarks."""
    import trimesh
    from trimesh import registration

    methods: dict[str, Callable[..., Any]] = {
        "trimesh nricp_amberg": registration.nricp_amberg,
        "trimesh nricp_sumner": registration.nricp_sumner,
    }
    place = template.skin_index
    triangles = place[template.head.triangles]
    triangles = triangles[(triangles >= 0).all(axis=1)]
    columns = []
    for name, method in methods.items():
        column = Column(name)
        for case in cases:
            pose = initial_poses(template, sample_scan(case.scan), case.landmarks)[0]
            start = apply_pose(template.head, template.vertices, pose)
            source = trimesh.Trimesh(start[template.skin], triangles, process=False)
            target = trimesh.Trimesh(case.scan.points, case.scan.triangles, process=False)
            vertices, places, _ = template.landmark_weights(case.landmarks)
            marks = {"source_landmarks": place[vertices], "target_positions": places}
            started = time.thread_time()
            found = np.asarray(method(source, target, **marks))
            seconds = time.thread_time() - started
            start[template.skin] = found
            column.add(template, case, start, seconds)
        columns.append(column)
    return columns


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--frames", type=int, default=6)
    parser.add_argument("--trimesh-frames", type=int, default=2)
    parser.add_argument("--points", type=int, default=120_000)
    parser.add_argument("--noise-mm", type=float, default=0.1)
    parser.add_argument("--skip-trimesh", action="store_true")
    parser.add_argument("--detected", action="store_true", help="only that")
    arguments = parser.parse_args()
    head = load_builtin_head()
    speech = Path(elocute.__file__).parent / "assets" / "example.flac"
    motion = animate(speech, model="articulation", fps=30, identity="7", life=0).motion
    scanner = Scanner(points=arguments.points, noise_mm=arguments.noise_mm)
    neutral, cases, floor_median, floor_mean = cases_of(motion, scanner, arguments.frames)
    template, _ = register_neutral(head, neutral.scan, neutral.landmarks)
    _ = template.triangle_samples, template.rim  # prepared once, not timed
    _ = template.bend_matrix, template.basis
    print(
        f"{len(cases)} frames, {len(cases[0].scan.points)} points, noise {arguments.noise_mm} mm; "
        f"noise floor {floor_median:.3f} mm median, {floor_mean:.3f} mm mean"
    )
    print(
        f"{'':34}{'CPU s':>9}{'median':>9}{'mean':>9}{'p95':>9}{'landmark':>9}"
        + "".join(f"{name[:8]:>9}" for name in REGIONS)
        + f"{'open lip':>9}{'steps':>7}"
    )
    if arguments.detected:
        print(detected(head, neutral, cases).row())
        return
    for column in ours(head, template, cases):
        print(column.row(), flush=True)
    if not arguments.skip_trimesh:
        for column in theirs(template, cases[: arguments.trimesh_frames]):
            print(column.row(), flush=True)


if __name__ == "__main__":
    main()
