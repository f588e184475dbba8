"""Following one face through real video files, with a detector whose points are known."""

from __future__ import annotations

import numpy as np
import pytest

from elocute.capture.video.face_detector import DetectedFaces, no_faces
from elocute.capture.video.face_tracking import track_face
from elocute.errors import CaptureError

FRAMES = 30


def steady_times(fps: float = 25.0, count: int = FRAMES) -> list[float]:
    return [frame / fps for frame in range(count)]


class Detector:
    """Gives the filmed points picture by picture; counts the pictures it is shown."""

    def __init__(self, filmed, *shifts: float, lost: tuple[int, ...] = (), scale: float = 1.0):
        self.points = filmed.track.points.astype(np.float32)
        self.shifts, self.lost, self.scale, self.count = shifts or (0.0,), lost, scale, 0

    def __call__(self, picture: np.ndarray) -> DetectedFaces:
        number, self.count = self.count, self.count + 1
        if number in self.lost:
            return no_faces()
        one = self.points[min(number, len(self.points) - 1)]
        scales = [1.0] + [self.scale] * (len(self.shifts) - 1)
        faces = [
            s * one + np.array([x, 0, 0], np.float32)
            for x, s in zip(self.shifts, scales, strict=True)
        ]
        return DetectedFaces(np.array(faces), np.ones(len(faces), np.float32))


@pytest.fixture
def video(make_video, tmp_path):
    return make_video(tmp_path / "clip.mp4", steady_times())


def test_points_of_every_picture_come_in_order(video, filmed):
    track = track_face(video, Detector(filmed))
    assert track.fps == pytest.approx(25)
    assert track.frame_count == FRAMES
    assert track.seen.all()
    assert track.notes == ()
    np.testing.assert_allclose(track.points, filmed.track.points[:FRAMES], atol=1e-3)


def test_a_lost_face_is_bridged_and_flagged(video, filmed):
    track = track_face(video, Detector(filmed, lost=(10, 11)))
    assert np.flatnonzero(~track.seen).tolist() == [10, 11]
    before, after = filmed.track.points[9], filmed.track.points[12]
    np.testing.assert_allclose(track.points[10], before + (after - before) / 3, atol=1e-3)
    assert "2 of 30 frames without a face" in track.notes[0]


def test_lost_at_both_ends_is_held(video, filmed):
    track = track_face(video, Detector(filmed, lost=(0, 1, 28, 29)))
    assert track.frame_count == FRAMES
    assert np.flatnonzero(~track.seen).tolist() == [0, 1, 28, 29]
    np.testing.assert_allclose(track.points[0], filmed.track.points[2], atol=1e-3)
    np.testing.assert_allclose(track.points[29], filmed.track.points[27], atol=1e-3)


def test_no_face_is_one_line(video, filmed):
    with pytest.raises(CaptureError, match="no face in 30 pictures"):
        track_face(video, Detector(filmed, lost=tuple(range(FRAMES))))


def test_a_face_that_hardly_shows_is_refused(video, filmed):
    with pytest.raises(CaptureError, match="a face in only 4 of 30 pictures"):
        track_face(video, Detector(filmed, lost=tuple(range(4, FRAMES))))


def test_two_faces_ask_which(video, filmed):
    with pytest.raises(CaptureError, match=r"2 faces; allowed: `face` left, right, 1, 2"):
        track_face(video, Detector(filmed, 0.0, 300.0))


@pytest.mark.parametrize(("face", "shift"), [("left", 0), ("right", 300), (1, 0), ("2", 300)])
def test_the_face_asked_for_is_followed(video, filmed, face, shift):
    # The right one comes first in every picture: order says nothing.
    track = track_face(video, Detector(filmed, 300.0, 0.0), face=face)
    np.testing.assert_allclose(
        track.points[..., 0], filmed.track.points[:FRAMES, :, 0] + shift, atol=1e-3
    )


@pytest.mark.parametrize("face", ["3", "0", "middle", ""])
def test_a_face_that_is_not_there_is_refused(video, filmed, face):
    with pytest.raises(CaptureError, match=r"2 face\(s\)"):
        track_face(video, Detector(filmed, 0.0, 300.0), face=face)


def test_somebody_far_behind_does_not_count(video, filmed):
    track = track_face(video, Detector(filmed, 0.0, 300.0, scale=0.2))
    np.testing.assert_allclose(track.points, filmed.track.points[:FRAMES], atol=1e-3)


def test_a_variable_frame_rate_is_laid_on_a_clock(make_video, tmp_path, filmed):
    """Pictures come at uneven times; the detector sees the face as it is at those times."""
    times = np.cumsum([0, *np.repeat([0.02, 0.06, 0.03], 20)])  # as a telephone in dim light
    clip = make_video(tmp_path / "uneven.mp4", times)
    clock = np.arange(filmed.track.frame_count) / filmed.track.fps
    flat = filmed.track.points.reshape(len(clock), -1)
    there = np.stack([np.interp(times, clock, column) for column in flat.T], axis=1)
    shown = there.reshape(len(times), -1, 3).astype(np.float32)
    pictures = iter(shown)
    track = track_face(
        clip, lambda _: DetectedFaces(next(pictures)[None], np.ones(1, np.float32)), fps=25.0
    )
    assert "variable frame rate" in track.notes[0]
    assert track.frame_count == pytest.approx(times[-1] * 25, abs=2)
    assert track.seen.all()
    count = track.frame_count - 2
    true = filmed.track.points[:count]
    apart = np.linalg.norm(track.points[:count] - true, axis=2).mean()
    # Taken for 25 pictures a second, the face would be elsewhere by pixels.
    assert apart < 0.4
    assert np.linalg.norm(shown[:count] - true, axis=2).mean() > 5 * apart


def test_no_sound_is_said(make_video, tmp_path, filmed):
    silent = make_video(tmp_path / "silent.mp4", steady_times(), sound=False)
    track = track_face(silent, Detector(filmed))
    assert not track.has_sound
    assert track.notes == ("no sound in it: motion only",)


def test_a_video_cut_off_gives_what_there_is(make_video, tmp_path, filmed):
    whole = make_video(tmp_path / "whole.mkv", steady_times(count=60), size=(320, 240))
    cut = tmp_path / "cut.mkv"
    cut.write_bytes(whole.read_bytes()[: int(whole.stat().st_size * 0.6)])
    track = track_face(cut, Detector(filmed))
    assert 2 <= track.frame_count < 60


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [("empty.mp4", b"", "an empty file"), ("words.mp4", b"no video " * 99, "no video that can")],
)
def test_what_is_no_video_is_one_line(tmp_path, filmed, name, content, said):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(CaptureError, match=said) as raised:
        track_face(path, Detector(filmed))
    assert "\n" not in str(raised.value)


def test_a_folder_a_missing_file_and_sound_alone_are_refused(tmp_path, filmed, speech_wav):
    for path, said in (
        (tmp_path, "a folder"),
        (tmp_path / "gone.mp4", "no such file"),
        (speech_wav, "no picture in it"),
    ):
        with pytest.raises(CaptureError, match=said):
            track_face(path, Detector(filmed))


@pytest.mark.parametrize("fps", [0.0, -1.0, float("nan"), 1e9])
def test_senseless_rates_are_refused(video, filmed, fps):
    with pytest.raises(CaptureError, match="fps"):
        track_face(video, Detector(filmed), fps=fps)


def test_a_detector_of_another_shape_is_told_so():
    with pytest.raises(CaptureError, match="478"):
        DetectedFaces(np.zeros((1, 68, 2), np.float32), np.ones(1, np.float32))
