"""Files for the tests of sound, made with the real encoders."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
import soundfile
import soxr
from av.audio.stream import AudioStream
from av.video.stream import VideoStream


def write_track(
    path: Path,
    samples: np.ndarray,
    rate: int,
    codec: str,
    *,
    picture: str | None = None,
    start_s: float = 0.0,
    gap: tuple[float, float] = (0.0, 0.0),
    options: dict[str, str] | None = None,
) -> Path:
    """Write mono `samples`, with a picture track of the same length if wanted.

    gap: from when on, s, packets come how much later, s.
    """
    with av.open(str(path), "w", options=options or {}) as container:
        film = container.add_stream(picture, rate=25) if picture else None
        sound = container.add_stream(codec, rate=rate, layout="mono")
        assert isinstance(sound, AudioStream)
        if film is not None:
            assert isinstance(film, VideoStream)
            film.width = film.height = 64
            film.pix_fmt = "yuv420p"
            _write_black(container, film, round(len(samples) / rate * 25))
        frame = av.AudioFrame.from_ndarray(samples[None], format="fltp", layout="mono")
        frame.sample_rate, frame.time_base = rate, Fraction(1, rate)
        frame.pts = round(start_s * rate)
        context = sound.codec_context
        packer = av.AudioResampler(
            context.format.name, "mono", rate, frame_size=context.frame_size or 1024
        )
        for piece in [*packer.resample(frame), *packer.resample(None), None]:
            for packet in sound.encode(piece):
                assert packet.pts is not None and packet.time_base is not None
                if packet.pts * packet.time_base >= gap[0]:
                    packet.pts = packet.dts = packet.pts + int(gap[1] / packet.time_base)
                container.mux(packet)
    return path


def _write_black(container, film, frames: int) -> None:
    for index in range(frames):
        frame = av.VideoFrame.from_ndarray(np.zeros((64, 64, 3), np.uint8), format="rgb24")
        frame.pts = index
        container.mux(film.encode(frame))
    container.mux(film.encode(None))


@pytest.fixture(scope="session")
def speech(speech_wav: Path) -> Callable[..., np.ndarray]:
    """The first seconds of real speech, at any rate."""
    samples, own_rate = soundfile.read(speech_wav, dtype="float32")

    def at(rate: int, seconds: float = 3.0) -> np.ndarray:
        return soxr.resample(samples[: round(seconds * own_rate)], own_rate, rate)

    return at


def measure_lag(heard: np.ndarray, original: np.ndarray) -> tuple[int, float]:
    """By how many samples `heard` comes late, and the correlation once that is undone."""
    size = 1 << (len(heard) + len(original)).bit_length()
    spectrum = np.fft.rfft(heard, size) * np.fft.rfft(original, size).conj()
    lag = int(np.fft.irfft(spectrum).argmax())
    lag = lag - size if lag > size // 2 else lag
    ours, theirs = heard[max(0, lag) :], original[max(0, -lag) :]
    common = min(len(ours), len(theirs))
    return lag, float(np.corrcoef(ours[:common], theirs[:common])[0, 1])


@pytest.fixture(scope="session")
def encode() -> Callable[..., Path]:
    """Write samples as a track of a container: encode(path, samples, rate, codec)."""
    return write_track


@pytest.fixture(scope="session")
def lag_and_likeness() -> Callable[[np.ndarray, np.ndarray], tuple[int, float]]:
    """By how many samples the first sound comes late, and how like the second it is."""
    return measure_lag


@pytest.fixture(scope="session")
def silent_film() -> Callable[[Path], Path]:
    """Write a video without a sound track."""

    def write(path: Path) -> Path:
        with av.open(str(path), "w") as container:
            film = container.add_stream("mpeg4", rate=25)
            film.width = film.height = 64
            film.pix_fmt = "yuv420p"
            _write_black(container, film, 10)
        return path

    return write
