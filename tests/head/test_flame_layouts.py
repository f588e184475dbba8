"""FLAME's parameters as trackers leave them: frames they lost, two faces, units, their names."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

from elocute.errors import ElocuteWarning, HeadError
from elocute.head.flame_layouts import read_layout


def emoca(folder, names):
    """Folders of frames whose jaw opens by 0.01 radians with each frame's number."""
    for name in names:
        each = folder / name
        each.mkdir(parents=True)
        jaw = 0.01 * int(name.split("_")[-2])
        np.save(each / "exp.npy", np.zeros(50))
        np.save(each / "pose.npy", np.array([0, 0, 0, jaw, 0, 0]))
    return folder


def test_frames_without_a_face_are_interpolated_and_told(tmp_path):
    given = emoca(tmp_path, [f"clip2_{n:06}_000" for n in (1, 2, 3, 8, 9)])
    with pytest.warns(ElocuteWarning, match="4 frames missing between others"):
        parts, _, _ = read_layout(given)
    assert np.allclose(parts["pose"][:, 6], 0.01 * np.arange(1, 10))
    assert parts["expression"].shape == (9, 50)


@pytest.mark.parametrize("step", [1, 2])
def test_frames_that_are_evenly_apart_are_all_there(tmp_path, step):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parts, _, _ = read_layout(emoca(tmp_path, [f"{n:06}_000" for n in range(1, 12, step)]))
    assert len(parts["pose"]) == len(range(1, 12, step))


@pytest.mark.parametrize(
    ("names", "says"),
    [
        (["000001_000", "000001_001", "000002_000"], "000001_000 and 000001_001, of one frame"),
        (["1_000", "2_000", "900000000_000"], "frames to 899999999"),
    ],
)
def test_two_faces_and_frames_too_far_are_refused(tmp_path, names, says):
    with pytest.raises(HeadError, match=says):
        read_layout(emoca(tmp_path, names))


def test_names_and_units_of_trackers(tmp_path):
    jaw = np.linspace(0, 0.3, 4)[:, None] * [1, 0, 0]
    body = np.zeros((4, 165))
    body[:, 66:69] = jaw
    exp, path = np.zeros((4, 50)), tmp_path / "a.npz"
    layouts: list[dict[str, Any]] = [{"jawpose": jaw, "globalpose": 0 * jaw}, {"poses": body}]
    for given in layouts:
        np.savez(path, expcode=exp, **given)
        parts, _, left_out = read_layout(path)
        assert np.allclose(parts["pose"][:, 6:9], jaw) and not left_out
    np.savez(path, expcode=exp + 1e30)
    with pytest.raises(HeadError, match=r"an expression of 1e\+30; allowed: standard deviations"):
        read_layout(path)
    np.savez(path, expcode=exp, jaw_pose=np.degrees(jaw))
    with pytest.raises(HeadError, match=r"a jaw that turns by 17\.2; allowed: radians"):
        read_layout(path)


def test_gaps_that_nobody_can_fill_are_refused_with_their_frames(tmp_path):
    given = emoca(tmp_path / "short", [f"{n:06}_000" for n in (1, 2, 3, 10, 11)])
    with pytest.raises(HeadError, match=r"frames 3 to 8 missing or NaN.*up to 0\.2 s at 25 a sec"):
        read_layout(given, 25)
    with pytest.warns(ElocuteWarning, match="6 frames missing"):
        assert len(read_layout(given)[0]["pose"]) == 11  # 0.2 s at 30 a second


@pytest.mark.parametrize("name", ["exp", "jaw_pose", "fps"])
def test_empty_arrays_are_refused(tmp_path, name):
    given: dict[str, Any] = {"exp": np.zeros((2, 50)), "jaw_pose": np.zeros((2, 3)), "fps": 30.0}
    given[name] = np.zeros((0, 3))
    np.savez(tmp_path / "a.npz", **given)
    with pytest.raises(HeadError, match=f"no usable {name}"):
        read_layout(tmp_path / "a.npz")


@pytest.mark.parametrize("lost", [slice(4, 9), slice(0, 5), slice(15, 20)])
def test_frames_of_nan_are_filled_where_they_are_few(tmp_path, lost):
    jaw = np.linspace(0, 0.19, 20)[:, None] * [1, 0, 0]
    path, exp = tmp_path / "a.npz", np.zeros((20, 50))
    exp[lost] = np.nan
    np.savez(path, exp=exp, jaw_pose=jaw, fps=30)
    with pytest.warns(ElocuteWarning, match="5 frames missing"):
        parts, _, _ = read_layout(path)
    assert np.allclose(parts["pose"][:, 6:9], jaw) and not parts["expression"].any()
    exp[7:15] = np.nan
    np.savez(path, exp=exp, jaw_pose=jaw, fps=30)
    with pytest.raises(HeadError, match=r"frames \d+ to \d+ missing or NaN, counted from 0"):
        read_layout(path)


def test_a_whole_body_turns_its_head(tmp_path):
    body, path = np.zeros((4, 165)), tmp_path / "beat.npz"
    turns = np.random.default_rng(2).normal(0, 0.2, (4, 15))
    for joint, place in ((12, 0), (15, 3), (22, 6), (23, 9), (24, 12)):
        body[:, 3 * joint : 3 * joint + 3] = turns[:, place : place + 3]
    np.savez(path, poses=body, expressions=np.zeros((4, 100)), mocap_frame_rate=30)
    parts, fps, _ = read_layout(path)
    assert np.allclose(parts["pose"], turns) and fps == 30
