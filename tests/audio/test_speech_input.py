"""Sound as Python programs have it: arrays, bytes, open files."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import soundfile

import elocute
from elocute.audio import speech_input
from elocute.audio.speech_input import resolve_speech
from elocute.audio.waveform import Waveform
from elocute.errors import AudioError


def test_it_is_heard_as_the_file_is(speech_wav: Path) -> None:
    samples, rate = soundfile.read(speech_wav, dtype="float32")
    whole, _ = soundfile.read(speech_wav, dtype="int16")
    wide, _ = soundfile.read(speech_wav, dtype="int32")
    known = elocute.animate(speech_wav).motion.weights
    stereo = np.stack([samples, samples], axis=1)
    with speech_wav.open("rb") as file:
        ways = [
            elocute.animate(speech_wav.read_bytes()),
            elocute.animate(file),
            elocute.animate(io.BytesIO(speech_wav.read_bytes())),
            elocute.animate(samples, rate=rate),
            elocute.animate(whole, rate=rate),
            elocute.animate(wide, rate=rate),
            elocute.animate(stereo, rate=rate),
        ]
    for take in ways:
        assert isinstance(take.sound, Waveform)
        assert np.abs(take.motion.weights - known).max() < 1e-6


def test_bytes_of_eight_bits_are_unsigned() -> None:
    found = resolve_speech(np.array([0, 128, 255], np.uint8), 8000)
    assert isinstance(found, Waveform) and found.samples.tolist() == [-1, 0, 127 / 128]


def test_one_channel_is_heard() -> None:
    both = np.array([[0.5, -0.25]] * 4)
    assert resolve_speech(both, 8000, 1).samples.tolist() == [-0.25] * 4  # pyright: ignore
    assert resolve_speech(both, 8000).samples.tolist() == [0.125] * 4  # pyright: ignore


@pytest.mark.parametrize(
    ("speech", "rate", "says"),
    [
        (np.zeros(99), None, "without a rate"),
        (np.zeros(99), -5, "sample rate"),
        (np.zeros((2, 99)), 8000, "samples.T"),
        (np.zeros((3, 3, 3)), 8000, "shape"),
        (np.zeros(99, np.int64), 8000, "int64"),
        (np.zeros(99, complex), 8000, "complex"),
        (np.zeros(99, bool), 8000, "bool"),
        (np.full(99, np.nan), 8000, "NaN"),
        (np.zeros(0), 8000, "shape"),
        ([[1.0], [2.0, 3.0]], 8000, "list"),
        (None, 8000, "NoneType"),
        (b"", None, "nothing"),
        (b"no sound", None, "no sound"),
        (b"x", 8000, "rate"),
        (io.StringIO("x"), None, "mode 'rb'"),
        ("a.wav", 8000, "rate"),
    ],
)
def test_what_is_no_sound_is_refused_in_one_line(speech: object, rate: int, says: str) -> None:
    with pytest.raises(AudioError) as refused:
        resolve_speech(speech, rate)  # pyright: ignore[reportArgumentType]
    assert says in str(refused.value) and "\n" not in str(refused.value)


def test_sizes_are_limited(speech_wav: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Endless:
        def read(self, size: int) -> bytes:
            return bytes(size)

    monkeypatch.setattr(speech_input, "BYTES_MAX", 5_000_000)
    with pytest.raises(AudioError, match="more than 5 MB"):
        resolve_speech(Endless())
    monkeypatch.setattr(speech_input, "SAMPLES_MAX", 100_000)
    with pytest.raises(AudioError, match="give its path"):
        resolve_speech(speech_wav.read_bytes())
