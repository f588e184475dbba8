"""Neutral scans of faces that the model does not span, however they lie and are cropped."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.array_types import Float64Array, FloatArray
from elocute.capture.simulation.scan_simulator import Scanner, ScanSimulator
from elocute.errors import CaptureError
from elocute.head.mesh import read_mesh
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion
from elocute.numerics.quaternions import from_axis_angle, to_matrices
from elocute.registration import register
from elocute.registration.accuracy import scan_distances, scan_noise_mm
from elocute.registration.head_search import initial_poses
from elocute.registration.landmarks import Landmarks, no_landmarks, write_landmarks
from elocute.registration.register import Registration, register_neutral
from elocute.registration.scan import Scan, checked_scan
from elocute.registration.scan_file import write_scan
from elocute.registration.template import Template
from elocute.registration.zero_pose import HeadPose
from tests.support.commands import run_here

POINTS = 15_000
NOSE_TIP = 30
FACE = np.clip(np.random.default_rng(5).normal(0, 0.85, 50), -2.5, 2.5).astype(np.float32)
"""Identity coefficients of the person whom the bounds were measured on."""


@dataclass(frozen=True)
class Case:
    """A scan, its landmarks, and where the head's vertices truly are in it."""

    scan: Scan
    landmarks: Landmarks
    truth: Float64Array

    def turned(self, rotation: Float64Array) -> Case:
        marks = Landmarks(self.landmarks.points @ rotation.T, self.landmarks.confidence)
        scan = replace(self.scan, points=self.scan.points @ rotation.T)
        return Case(scan, marks, self.truth @ rotation.T)

    def cropped(self, head: HeadModel, radius_m: float) -> Case:
        """What is near the tip of the nose."""
        nose = self.truth[head.landmarks[NOSE_TIP]]
        near = np.linalg.norm(self.scan.points - nose, axis=1) < radius_m
        kept = self.scan.triangles[near[self.scan.triangles].all(axis=1)]
        return replace(self, scan=checked_scan(replace(self.scan, triangles=kept))[0])


def scanned(
    head: HeadModel,
    shape: Float64Array,
    weights: dict[str, float] | None = None,
    noise_mm: float = 0.1,
) -> Case:
    """A scan of a face of another shape (vertex, 3) m, at rest but for some weights."""
    values = np.zeros((1, len(head.expression_names)), np.float32)
    for name, weight in (weights or {}).items():
        values[0, head.expression_index(name)] = weight
    person = replace(head, template=shape.astype(np.float32))
    scanner = Scanner(points=POINTS, seed=2, noise_mm=noise_mm)
    taken = ScanSimulator(Motion(person, values, 25.0), scanner).frame(0)
    scan, _ = checked_scan(Scan("stranger", taken.points, taken.triangles, taken.colors))
    return Case(scan, taken.landmarks, taken.truth.posed)


def warped(shape: FloatArray, seed: int, size_m: float) -> Float64Array:
    """Another face: broad waves, some centimetres long, in every direction."""
    rng = np.random.default_rng(seed)
    moved = shape.astype(np.float64).copy()
    for _ in range(12):
        along, phase = rng.normal(0, 2 * np.pi / 0.12, 3), rng.uniform(0, 2 * np.pi)
        wave = np.sin(shape @ along + phase)[:, None] * rng.normal(0, 1, 3)
        moved += size_m / np.sqrt(12) * wave
    return moved


@pytest.fixture(scope="module")
def stranger(head: HeadModel) -> Case:
    """A person 8 % larger than average, of a shape outside the model."""
    return scanned(head, 1.08 * warped(head.with_identity(FACE).template, 3, 0.003))


@pytest.fixture(scope="module")
def found(head: HeadModel, stranger: Case) -> tuple[Template, Registration]:
    return register_neutral(head, stranger.scan, stranger.landmarks)


def rotation_of(turn: tuple[float, float, float]) -> Float64Array:
    return np.asarray(to_matrices(from_axis_angle(np.array([turn])))[0], np.float64)


def apart_mm(places: FloatArray, truth: Float64Array, where: object = slice(None)) -> float:
    return float(1000 * np.linalg.norm(places - truth, axis=1)[where].mean())


def test_a_stranger_is_found_with_features_in_place(
    head: HeadModel, stranger: Case, found: tuple[Template, Registration]
):
    registration = found[1]
    assert not registration.lost and registration.surface.median < 0.22  # of the truth: 0.175
    assert apart_mm(registration.vertices, stranger.truth, head.landmarks[17:]) < 2.0


def test_a_resting_face_has_no_gaze_and_no_tongue(
    head: HeadModel, found: tuple[Template, Registration]
):
    weights = np.abs(found[1].parameters.expression)
    unseen = [n.startswith(("eyeLook", "tongue")) for n in head.expression_names]
    assert weights[unseen].max() < 0.01 and weights.max() < 0.5


@pytest.mark.slow
@pytest.mark.parametrize("turn", [(0, 0.5, 0), (0, 1.6, 0), (0, 3.14, 0), (1.2, 0.7, -2)])
def test_every_orientation_gives_the_same_face(
    head: HeadModel,
    stranger: Case,
    found: tuple[Template, Registration],
    turn: tuple[float, float, float],
):
    rotation = rotation_of(turn)
    case = stranger.turned(rotation)
    _, again = register_neutral(head, case.scan, case.landmarks)
    assert apart_mm(again.vertices @ rotation, found[1].vertices) < 0.05
    assert again.parameters.identity == pytest.approx(found[1].parameters.identity, abs=0.01)


def test_a_cropped_face_keeps_its_neck(head: HeadModel, stranger: Case):
    case = stranger.cropped(head, 0.085)
    _, registration = register_neutral(head, case.scan, case.landmarks)
    rim = head.regions["neck_rim"]
    # A neck that is not seen is a guess: that of the mean head would be 20 mm off.
    assert apart_mm(registration.vertices, stranger.truth, rim) < 40
    assert registration.surface.median < 0.22
    inner = np.linalg.norm(stranger.truth - stranger.truth[head.landmarks[NOSE_TIP]], axis=1) < 0.07
    inner &= np.isin(np.arange(head.vertex_count), head.regions["face"])
    assert apart_mm(registration.vertices, stranger.truth, inner) < 2.8


def test_zero_pose_is_the_neutral_face(head: HeadModel, tmp_path: Path):
    """A face that is scanned with the jaw open comes out with the jaw as at rest."""
    shape = head.with_identity(FACE).template.astype(np.float64)
    case = scanned(head, shape, {"jawOpen": 0.3})
    write_scan(tmp_path / "a.ply", case.scan.points, case.scan.triangles)
    write_landmarks(tmp_path / "a.json", case.landmarks)
    result = run_here(
        "capture",
        "scan",
        tmp_path / "a.ply",
        "--landmarks",
        tmp_path / "a.json",
        "--zero-pose",
        "-o",
        tmp_path / "b.ply",
    )
    assert result.returncode == 0
    written = read_mesh(tmp_path / "b.ply")[0]
    template, _ = register_neutral(head, case.scan, case.landmarks)
    assert apart_mm(written, template.vertices) < 0.1
    lips = head.regions["lips"]
    assert apart_mm(template.vertices, shape, lips) < 0.6 * apart_mm(case.truth, shape, lips)


def halved(case: Case) -> Case:
    """The right half of a head alone."""
    side = case.scan.points[:, 0] < case.truth[:, 0].mean()
    kept = case.scan.triangles[side[case.scan.triangles].all(axis=1)]
    return replace(case, scan=checked_scan(replace(case.scan, triangles=kept))[0])


@pytest.mark.slow
def test_half_a_face_is_no_face(head: HeadModel, stranger: Case):
    case = halved(stranger)
    with_marks = register_neutral(head, case.scan, case.landmarks)[1]
    assert "of the face is in the scan" in with_marks.lost
    assert register_neutral(head, case.scan, no_landmarks())[1].lost


def test_what_is_inside_the_mouth_is_no_surface_of_a_resting_face(head: HeadModel):
    """A scan that lies across the mouth, as that of a head fitted sideways, is not near it."""
    inside = head.template[head.regions["inner_mouth"]].astype(np.float64)
    scan = Scan("inside", inside, np.array([[0, 1, 2]], np.int32))
    shut = Template(head, mouth_shut=True)
    middle = np.abs(inside[:, 0]) < 0.015
    for template, near in ((Template(head), True), (shut, False)):
        apart = scan_distances(template, template.vertices, scan)[middle]
        assert (np.median(apart) < 0.5) == near


@pytest.mark.parametrize(
    ("noise_mm", "limit_mm"), [pytest.param(0.1, 0.4, marks=pytest.mark.slow), (1.5, 4.0)]
)
def test_limits_go_with_the_noise(head: HeadModel, noise_mm: float, limit_mm: float):
    shape = head.with_identity(FACE).template.astype(np.float64)
    case = scanned(head, shape, noise_mm=noise_mm)
    assert 0.4 * noise_mm < scan_noise_mm(case.scan) < 1.1 * noise_mm
    found = register_neutral(head, case.scan, case.landmarks)[1]
    assert not found.lost and found.surface.limit <= limit_mm
    assert (found.surface.face_median > 0.6) is (noise_mm > 1)


@pytest.mark.slow
@pytest.mark.parametrize("turn", [(0, 0, 3.1), (1.5, 0, 0), (-0.4, 2.6, 1.0)])
def test_a_face_is_found_without_landmarks(
    head: HeadModel, stranger: Case, turn: tuple[float, float, float]
):
    """However it lies: upside down, on its back."""
    case = stranger.turned(rotation_of(turn))
    found = register_neutral(head, case.scan, no_landmarks())[1]
    assert not found.lost
    assert apart_mm(found.vertices, case.truth, head.landmarks[17:]) < 6


@pytest.mark.slow
def test_a_face_cut_out_is_found_without_landmarks_or_told_lost(head: HeadModel, stranger: Case):
    case = stranger.cropped(head, 0.085).turned(rotation_of((0.5, 2.0, 0.2)))
    found = register_neutral(head, case.scan, no_landmarks())[1]
    apart = apart_mm(found.vertices, case.truth, head.landmarks[17:])
    assert apart < 9
    if not found.lost and apart >= 6:
        pytest.xfail(f"{apart:.1f} mm off and not told as lost; 6 is wanted")


@pytest.mark.slow
@pytest.mark.parametrize("place", range(3))
@pytest.mark.parametrize("frame", range(3))
def test_a_face_laid_over_a_wrong_place_is_lost(
    head: HeadModel,
    stage: ScanSimulator,
    scans: list[Scan],
    monkeypatch: pytest.MonkeyPatch,
    frame: int,
    place: int,
) -> None:
    """Free to bend, the head lies close to nearly anything, but is then no face that it knows."""

    def elsewhere(*about: Any) -> list[HeadPose]:
        poses = initial_poses(*about)
        away = [np.linalg.norm(pose.translation - poses[0].translation) for pose in poses]
        wrong = [pose for pose, far in zip(poses, away, strict=True) if far > 0.05]
        return wrong[place : place + 1]

    monkeypatch.setattr(register, "initial_poses", elsewhere)
    try:
        found = register_neutral(head, scans[frame], no_landmarks())[1]
    except CaptureError as error:
        assert "no head" in str(error)
        return
    assert apart_mm(found.vertices, stage.truth(frame).posed, head.landmarks) > 50
    assert found.lost
    if found.surface.face_median < found.surface.limit:
        assert found.surface.strange > register.LOST_NOBODY_MM


def test_a_face_that_nobody_has_is_lost_sooner(found: tuple[Template, Registration]):
    """Alike strange, one person's numbers are usual and the other's are not."""
    right = replace(found[1], landmark_mm=None)
    right = replace(right, surface=replace(right.surface, strange=2.6))
    identity = right.parameters.identity
    for deviation, told in ((1.7, False), (2.0, True)):
        drawn = replace(right.parameters, identity=np.full_like(identity, deviation))
        assert ("any that the model knows" in replace(right, parameters=drawn).lost) is told


@pytest.mark.slow
def test_a_scan_that_is_wound_inside_out_is_turned(
    head: HeadModel, stranger: Case, found: tuple[Template, Registration]
):
    turned = replace(stranger.scan, triangles=stranger.scan.triangles[:, ::-1].copy())
    again = register_neutral(head, turned, stranger.landmarks)[1]
    assert "inside out" in again.notes[0]
    assert apart_mm(again.vertices, found[1].vertices) < 0.05
