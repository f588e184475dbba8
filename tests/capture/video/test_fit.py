"""From points to motion: what was filmed comes back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from elocute.capture.video.camera_fit import fit_poses, initial_poses
from elocute.capture.video.face_mesh_points import builtin_face_points
from elocute.capture.video.lip_and_lid_contact import lid_openness
from elocute.capture.video.person_fit import resting_frames
from elocute.capture.video.video_to_motion import fit_track, resample_motion
from elocute.head.builtin import load_builtin_head
from elocute.head.looks import face_look
from elocute.head.mediapipe_face_mesh import EYE_CORNERS, GAP_PAIRS, LIPS
from elocute.motion.mouth_measures import TRACKED_RESTING, measure_mouth
from elocute.numerics.quaternions import multiply, to_axis_angle


def test_the_mouth_opens_as_it_did(filmed, captured):
    true, found = (measure_mouth(m)["opening_mm"] for m in (filmed.motion, captured.motion))
    assert np.corrcoef(true, found)[0, 1] > 0.97
    # A gap that detectors see between lips that touch is taken off; this film has none.
    seen = true - 1000 * TRACKED_RESTING * filmed.motion.head.eye_distance_m
    assert np.abs(np.maximum(seen, 0) - found).mean() < 0.6


def test_lips_tracked_as_closed_are_closed(filmed, captured):
    closed = filmed.track.lip_gap < 0.02
    assert 5 < closed.sum() < len(closed) - 5
    assert measure_mouth(captured.motion)["opening_mm"][closed].max() < 0.1


def test_points_fall_where_they_were_seen(captured):
    assert captured.lip_miss < 0.01
    assert not captured.flagged.any()


def test_weights_are_arkits(captured):
    assert captured.motion.weights.min() >= 0
    assert captured.motion.weights.max() <= 1
    assert captured.motion.names == load_builtin_head().expression_names


def test_the_head_turns_as_it_did(filmed, captured):
    back = filmed.turns * [1, -1, -1, -1]
    apart = np.degrees(to_axis_angle(multiply(back, captured.fitted.poses.turns)))
    # A constant turn is hard to tell from a face; what moves is not.
    assert np.abs(apart - apart.mean(axis=0)).max() < 1.5
    assert np.abs(apart.mean(axis=0)).max() < 4
    neck, head = captured.motion.rotations[:, 0], captured.motion.rotations[:, 1]
    np.testing.assert_allclose(
        np.abs((multiply(neck, head) * captured.fitted.poses.turns).sum(axis=1)), 1, atol=1e-4
    )


def test_a_blink_shuts_the_lids_and_lets_them_open(filmed, captured):
    blink = captured.motion.weights[:, captured.motion.names.index("eyeBlinkLeft")]
    true = filmed.motion.weights[:, filmed.motion.names.index("eyeBlinkLeft")]
    assert blink[true > 0.99].min() > 0.8
    assert blink[true < 0.01].mean() < 0.1


def test_lids_do_not_part_in_the_midst_of_a_blink(filmed):
    shut = np.flatnonzero((lid_openness(filmed.track) <= 0).all(axis=1))
    before, amid, after = shut[0], shut[0] + 1, shut[0] + 2
    points = filmed.track.points.copy()
    points[after] = points[before]
    points[amid] = points[before - 8]  # open
    openness = lid_openness(replace(filmed.track, points=points))
    assert (openness[before : after + 1] == 0).all()
    assert (openness[before - 8] > 0.8).all()


def test_eyes_look_to_the_side_they_looked_to(filmed, captured):
    looking = filmed.motion.times_s > 2.6
    out = captured.motion.weights[:, captured.motion.names.index("eyeLookOutLeft")]
    true = filmed.motion.weights[:, filmed.motion.names.index("eyeLookOutLeft")]
    assert np.abs(out - true)[looking].mean() < 0.15
    assert out[~looking & (filmed.motion.times_s < 1.9)].mean() < 0.1


def test_the_face_is_more_his_than_the_mean_is(filmed, captured):
    def apart_mm(template):
        """Mean distance of the face's points, laid over one another and scaled."""
        a, b = (builtin_face_points().on(t) for t in (template, filmed.motion.head.template))
        a, b = a - a.mean(axis=0), b - b.mean(axis=0)
        left, values, right = np.linalg.svd(b.T @ a)
        return (
            1000
            * np.linalg.norm(a @ (left @ right).T * values.sum() / (a**2).sum() - b, axis=1).mean()
        )

    own, mean = apart_mm(captured.person.head.template), apart_mm(load_builtin_head().template)
    assert own < 0.7 * mean


def test_he_is_drawn_as_somebody_of_his_age_sex_and_tone(captured):
    look = captured.motion.head.look
    assert look == face_look(captured.person.identity)
    assert captured.motion.dressed().head.surfaces


def test_the_resting_face_keeps_its_lips_sealed(captured):
    head = captured.person.head
    gap = head.template[head.inner_lip_upper, 1] - head.template[head.inner_lip_lower, 1]
    assert 1000 * gap.max() < 0.05


def test_points_that_fit_no_face_are_bridged(filmed):
    points = filmed.track.points.copy()
    points[40] += np.random.default_rng(1).normal(0, 25, points[40].shape)
    captured = fit_track(replace(filmed.track, points=points))
    assert captured.flagged[40]
    assert captured.flagged.sum() <= 3
    around = captured.motion.weights[[39, 41]].mean(axis=0)
    if not captured.flagged[[39, 41]].any():
        np.testing.assert_allclose(captured.motion.weights[40], around, atol=1e-6)
    assert "fit no face" in " ".join(captured.notes)


def test_a_mouth_that_never_closes_stays_open(filmed, film):
    opened = filmed.motion.weights.copy()
    opened[:, filmed.motion.names.index("mouthClose")] = 0
    jaw = filmed.motion.names.index("jawOpen")
    opened[:, jaw] = np.clip(opened[:, jaw] + 0.25, 0, 1)
    track = film(replace(filmed.motion, weights=opened)).track
    assert track.lip_gap.min() > 0.02
    found = measure_mouth(fit_track(track).motion)["opening_mm"]
    assert found.min() > 1.0


def test_another_frame_rate_keeps_lips_closed(filmed, captured):
    faster = resample_motion(captured.motion, 60.0)
    assert faster.fps == 60
    assert faster.frame_count == round(captured.motion.duration_s * 60)
    opening = measure_mouth(captured.motion)["opening_mm"]
    both = np.flatnonzero((opening[:-1] < 0.05) & (opening[1:] < 0.05))
    within = np.isin(np.floor(faster.times_s * captured.motion.fps).astype(int), both)
    assert within.sum() > 10
    assert measure_mouth(faster)["opening_mm"][within].max() < 0.1


def test_resting_frames_are_the_closed_ones(filmed):
    assert (filmed.track.lip_gap[resting_frames(filmed.track)] < 0.02).all()


def test_poses_come_back(filmed):
    table, motion = builtin_face_points(), filmed.motion
    model = table.on(motion.vertices())
    start = initial_poses(filmed.camera, model[0], filmed.track.points)
    poses = fit_poses(filmed.camera, model, filmed.track.points[..., :2], np.ones(478), start)
    apart = np.degrees(to_axis_angle(multiply(filmed.turns * [1, -1, -1, -1], poses.turns)))
    assert np.abs(apart).max() < 0.3  # the noise of the points is left


class TestTable:
    def test_it_is_symmetric(self):
        points = builtin_face_points().on(load_builtin_head().template)
        right, left = points[list(EYE_CORNERS)]
        np.testing.assert_allclose(right * [-1, 1, 1], left, atol=2e-4)

    def test_inner_lips_touch_and_part_with_the_jaw(self):
        head, table, pairs = load_builtin_head(), builtin_face_points(), np.array(GAP_PAIRS)
        shut = table.on(head.template)
        assert np.abs(shut[pairs[:, 0]] - shut[pairs[:, 1]])[:, 1].max() < 1e-3
        jaw = table.on(head.expression_basis[head.expression_index("jawOpen")])
        assert (jaw[pairs[:, 0], 1] - jaw[pairs[:, 1], 1]).min() > 0.015

    def test_lips_lie_on_lips(self):
        head, table = load_builtin_head(), builtin_face_points()
        around = np.concatenate(
            [
                head.outer_lip_upper,
                head.outer_lip_lower,
                head.inner_lip_upper,
                head.inner_lip_lower,
                head.outer_corners,
                head.inner_corners,
            ]
        )
        used = table.vertices[list(LIPS)][table.shares[list(LIPS)] > 0]
        assert np.isin(used, around).all()
