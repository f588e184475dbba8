"""A built-in head filmed by a known camera: points without a detector, so the truth is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import elocute
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.capture.video.camera_fit import HeadPoses, PinholeCamera
from elocute.capture.video.face_mesh_points import builtin_face_points
from elocute.capture.video.face_tracking import FaceTrack
from elocute.capture.video.video_to_motion import VideoCapture, fit_track
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import sample_identity
from elocute.motion.edits import with_blinks, with_gaze
from elocute.motion.motion import Motion
from elocute.numerics.quaternions import from_axis_angle

FPS = 25.0
SIZE = (480, 360)
CAMERA = PinholeCamera(1.4 * max(SIZE), (SIZE[0] / 2, SIZE[1] / 2))


@dataclass(frozen=True)
class Filmed:
    """What is filmed, and what a perfect detector sees of it."""

    motion: Motion
    turns: NDArray[np.float64]
    track: FaceTrack
    camera: PinholeCamera = CAMERA


@pytest.fixture(scope="session")
def filmed(speech_wav: Path) -> Filmed:
    """Four seconds of the example's speech by somebody else than the mean, nodding and turning."""
    speech = read_audio(speech_wav).resample(16000)
    sound = Waveform(speech.samples[:64000], 16000)
    talk = elocute.animate(sound, model="articulation", fps=FPS, life=0).motion
    head = load_builtin_head().with_identity(0.7 * sample_identity(5))
    motion = with_blinks(Motion(head, talk.weights, FPS), [1.6], replace=True)
    motion = with_gaze(motion, [(0.0, (0, 0)), (2.0, (0, 0)), (2.4, (0, 12)), (4.0, (0, 12))])
    return _filmed(motion)


@pytest.fixture(scope="session")
def film() -> Callable[[Motion], Filmed]:
    """Films another motion."""
    return _filmed


@pytest.fixture(scope="session")
def captured(filmed: Filmed) -> VideoCapture:
    return fit_track(filmed.track)


def _filmed(motion: Motion, seed: int = 0) -> Filmed:
    """A head that nods and turns, and its points with a detector's noise."""
    time_s = motion.times_s
    wave = np.stack([0.06 * np.sin(2 * time_s), 0.12 * np.sin(time_s + 0.4), 0.04 * np.cos(time_s)])
    turns = from_axis_angle(wave.T)
    places = np.stack([0.01 * np.sin(time_s), 0.03 + 0 * time_s, -0.7 + 0.01 * time_s], axis=1)
    poses = HeadPoses(turns, places)
    stands = poses.apply(builtin_face_points().on(motion.vertices()))
    pixels = CAMERA.project(stands)
    depth = (places[:, None, 2:] - stands[..., 2:]) / poses.pixel_mm(CAMERA)[:, None, None] * 1000
    points = np.concatenate([pixels, depth], axis=2)
    noise = np.random.default_rng(seed).normal(0, 0.15, points.shape)
    seen = np.ones(len(points), bool)
    return Filmed(motion, turns, FaceTrack(points + noise, seen, motion.fps, SIZE))


@pytest.fixture(scope="session")
def make_video() -> Callable[..., Path]:
    """Writes a small video of plain pictures at given times, with a tone or without."""
    import av

    def make(
        path: Path,
        times_s: NDArray[np.float64] | list[float],
        *,
        sound: bool = True,
        size: tuple[int, int] = (64, 48),
    ) -> Path:
        with av.open(str(path), "w") as file:
            video: Any = file.add_stream("libx264", rate=100)
            video.width, video.height, video.pix_fmt = *size, "yuv420p"
            video.time_base = video.codec_context.time_base = Fraction(1, 1000)
            tone: Any = file.add_stream("aac", rate=16000, layout="mono") if sound else None
            for number, time_s in enumerate(times_s):
                gray = np.full((size[1], size[0], 3), 40 + number % 150, np.uint8)
                frame = av.VideoFrame.from_ndarray(gray, format="rgb24")
                frame.pts, frame.time_base = round(1000 * time_s), Fraction(1, 1000)
                file.mux(video.encode(frame))
            file.mux(video.encode(None))
            if tone is not None:
                count = int(16000 * (times_s[-1] + 0.04))
                samples = 0.2 * np.sin(np.arange(count) * 0.1, dtype=np.float32)[None]
                frame = av.AudioFrame.from_ndarray(samples, format="fltp", layout="mono")
                frame.sample_rate, frame.pts = 16000, 0
                frame.time_base = Fraction(1, 16000)
                file.mux(tone.encode(frame))
                file.mux(tone.encode(None))
        return path

    return make
