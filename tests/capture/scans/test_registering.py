"""Registration of simulated scans against their truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from elocute.capture.simulation.scan_simulator import ScanSimulator
from elocute.errors import CaptureError
from elocute.head.model import HeadModel
from elocute.numerics.quaternions import from_axis_angle
from elocute.registration.accuracy import correspondence_mm, surface_error
from elocute.registration.closest_points import (
    CoarseMesh,
    DenseMesh,
    closest_on_triangles,
    sample_triangles,
)
from elocute.registration.landmarks import Landmarks, no_landmarks
from elocute.registration.nonrigid_icp import NonrigidIcp
from elocute.registration.register import (
    Registration,
    register_neutral,
    register_nonrigid,
    register_scan,
)
from elocute.registration.scan import Scan
from elocute.registration.template import Template, adaptive_template
from elocute.registration.zero_pose import HeadPose, apply_pose, remove_pose


def apart_mm(head: HeadModel, vertices: np.ndarray, truth: np.ndarray) -> float:
    """Mean landmark distance."""
    return float(1000 * np.linalg.norm((vertices - truth)[head.landmarks], axis=1).mean())


def test_neutral_face_and_its_landmarks(
    head: HeadModel, stage: ScanSimulator, neutral: tuple[Template, Registration]
):
    found, truth = neutral[1], stage.truth(0)
    assert not found.lost and found.surface.median < 0.09 and found.surface.mean < 0.13
    assert apart_mm(head, found.vertices, truth.posed) < 1.0
    own = neutral[0].head
    assert correspondence_mm(head, own.template.astype(float), truth.zero)["face"] < 1.5


def test_frames_that_follow_stay_on_track(
    head: HeadModel, stage: ScanSimulator, scans: list[Scan], neutral: tuple[Template, Registration]
):
    before = neutral[1]
    template = neutral[0]
    before = register_scan(template, scans[0], stage.frame(0).landmarks)
    for number in (3, 5):  # some frames left out: a fast motion
        before = register_scan(template, scans[number], stage.frame(number).landmarks, before)
        truth = stage.truth(number)
        assert before.surface.median < 0.09 and before.surface.mean < 0.14, number
        assert apart_mm(head, before.vertices, truth.posed) < 1.0, number
        assert correspondence_mm(head, before.vertices, truth.posed)["lips"] < 1.2, number
    assert before.parameters.expression[head.expression_index("jawOpen")] > 0.4


def test_a_lost_frame_is_found_again(
    stage: ScanSimulator, scans: list[Scan], neutral: tuple[Template, Registration]
):
    good = register_scan(neutral[0], scans[1], stage.frame(1).landmarks)
    away = HeadPose(good.parameters.pose.translation + 0.15, good.parameters.pose.turns)
    wrong = replace(good, parameters=replace(good.parameters, pose=away))
    found = register_scan(neutral[0], scans[2], stage.frame(2).landmarks, wrong)
    assert not found.lost and found.surface.median < 0.1


def test_rough_landmarks_lead_to_the_place_and_not_away_from_it(
    head: HeadModel, stage: ScanSimulator, scans: list[Scan], neutral: tuple[Template, Registration]
):
    """As far off as a detector's: 2.5 mm in every coordinate."""
    noise = np.random.default_rng(0).normal(0, 0.0025, (68, 3))
    rough = Landmarks(stage.frame(3).landmarks.points + noise, np.ones(68))
    found = register_scan(neutral[0], scans[3], rough)
    assert not found.lost
    assert apart_mm(head, found.vertices, stage.truth(3).posed) < 1.5
    assert correspondence_mm(head, found.vertices, stage.truth(3).posed)["lips"] < 2.0


@pytest.mark.slow
def test_a_scan_that_shows_no_face_is_lost(
    stage: ScanSimulator, scans: list[Scan], neutral: tuple[Template, Registration]
):
    good = register_scan(neutral[0], scans[1], stage.frame(1).landmarks)
    assert good.surface.face > 0.8
    behind = scans[1].points[:, 2] < scans[1].points[:, 2].mean() - 0.02
    back = replace(scans[1], triangles=scans[1].triangles[behind[scans[1].triangles].all(axis=1)])
    for before in (good, None):
        found = register_scan(neutral[0], back, no_landmarks(), before)
        assert "of the face is in the scan" in found.lost
    with pytest.raises(CaptureError, match="identity"):
        register_scan(neutral[0], scans[1], no_landmarks(), neutral[1])


def test_without_landmarks(head: HeadModel, stage: ScanSimulator, unaided: Registration):
    assert not unaided.lost and unaided.landmark_mm is None
    assert apart_mm(head, unaided.vertices, stage.truth(0).posed) < 1.5


def test_mirrored_scan_and_foreign_landmarks_are_refused(
    head: HeadModel, stage: ScanSimulator, scans: list[Scan]
):
    marks = stage.frame(0).landmarks
    flipped = Landmarks(marks.points * [-1, 1, 1], marks.confidence)
    mirrored = replace(
        scans[0], points=scans[0].points * [-1, 1, 1], triangles=scans[0].triangles[:, ::-1].copy()
    )
    with pytest.raises(CaptureError, match="mirrored"):
        register_neutral(head, mirrored, flipped)
    with pytest.raises(CaptureError, match="off the scan"):
        register_neutral(head, scans[0], Landmarks(1000 * marks.points, marks.confidence))


def test_adaptive_template_shows_the_landmarks_expression(
    stage: ScanSimulator, neutral: tuple[Template, Registration]
):
    template, truth = neutral[0], stage.truth(5)
    marks = Landmarks(truth.zero[template.head.landmarks], np.ones(68))
    adapted, coefficients = adaptive_template(template, marks)
    lips = template.head.regions["lips"]
    before = np.linalg.norm(template.vertices[lips] - truth.zero[lips], axis=1).mean()
    after = np.linalg.norm(adapted[lips] - truth.zero[lips], axis=1).mean()
    assert after < 0.5 * before and coefficients.shape == (len(template.basis),)


@pytest.mark.slow
def test_nonrigid_icp_wins_by_the_adaptive_template(
    head: HeadModel, stage: ScanSimulator, scans: list[Scan], neutral: tuple[Template, Registration]
):
    marks, truth = stage.frame(5).landmarks, stage.truth(5).posed
    icp = NonrigidIcp(neutral[0])
    lips = {}
    for adapted in (True, False):
        found, steps = register_nonrigid(neutral[0], scans[5], marks, adapted=adapted, icp=icp)
        assert found.surface.median < 0.25 and 3 <= steps <= 20
        lips[adapted] = correspondence_mm(head, found.vertices, truth)["lips"]
    assert lips[True] < 1.5 and lips[True] < lips[False]
    first, _ = register_nonrigid(neutral[0], scans[3], stage.frame(3).landmarks, icp=icp)
    after, steps = register_nonrigid(neutral[0], scans[5], marks, icp=icp, before=first)
    assert steps <= 4 and not after.lost and after.surface.median < 0.2
    assert correspondence_mm(head, after.vertices, truth)["lips"] < 1.5


def test_unposing_undoes_posing(head: HeadModel):
    rng = np.random.default_rng(0)
    turns = from_axis_angle(rng.normal(0, 0.3, (len(head.joint_names), 3)))
    pose = HeadPose(rng.normal(0, 0.1, 3), turns)
    vertices = head.template + rng.normal(0, 1e-3, head.template.shape)
    moved = apply_pose(head, vertices, pose)
    assert np.abs(moved - vertices).max() > 0.01
    assert np.abs(remove_pose(head, moved, pose) - vertices).max() < 1e-12


def test_closest_points_agree_with_all_triangles(head: HeadModel):
    used, places = np.unique(head.triangles[:400], return_inverse=True)
    vertices = head.template[used].astype(float)
    triangles = places.reshape(-1, 3)
    rng = np.random.default_rng(1)
    middle = vertices[triangles].mean(axis=1)
    query = middle[rng.integers(400, size=200)] + rng.normal(0, 1e-3, (200, 3))
    exact = np.full(200, np.inf)
    for triangle in triangles:
        corners = [np.tile(vertices[vertex], (200, 1)) for vertex in triangle]
        bary = closest_on_triangles(query, *corners)
        points = sum(bary[:, k, None] * corners[k] for k in range(3))
        exact = np.minimum(exact, np.linalg.norm(query - points, axis=1))
    coarse = CoarseMesh(vertices, triangles, sample_triangles(vertices, triangles, 0.001))
    fine = DenseMesh(vertices, triangles)
    for found in (coarse.closest(query, near=6), fine.closest(query)):
        apart = np.sqrt(found.squared)
        assert (apart >= exact - 1e-12).all()  # never closer than the closest
        assert np.median(apart - exact) < 1e-9 and np.quantile(apart - exact, 0.95) < 1e-4


def test_surface_error_leaves_out_what_is_no_head():
    error = surface_error(np.array([0.1, 0.2, 0.3, np.inf]))
    assert error.median == pytest.approx(0.2) and error.covered == 0.75
