"""A waveform is checked when it is made."""

from typing import Any

import numpy as np
import pytest

import elocute.audio
from elocute.audio import Waveform
from elocute.errors import AudioError
from tests.support.commands import run_python


def test_it_holds_contiguous_float32_samples_and_knows_its_length():
    of_doubles: Any = np.linspace(-1, 1, 16000)[::2]
    waveform = Waveform(of_doubles, 8000)
    assert waveform.samples.dtype == np.float32
    assert waveform.samples.flags.c_contiguous
    assert waveform.duration_s == 1.0


def test_a_rate_given_as_another_kind_of_number_becomes_an_integer():
    rates: list[Any] = [16000.0, np.int64(16000), np.float32(16000)]
    for rate in rates:
        assert type(Waveform(np.zeros(10, np.float32), rate).sample_rate) is int


@pytest.mark.parametrize(
    ("samples", "found"),
    [
        (np.zeros((10, 2)), r"shape \(10, 2\)"),
        (np.zeros(0), r"shape \(0,\)"),
        (np.zeros(1), r"shape \(1,\)"),
        (np.float64(0.5), r"shape \(\)"),
        (np.zeros(10, np.int16), "type int16.*divide 16-bit integers by 32768"),
        (["a", "b"], "type <U1"),
        ([0.0, 0.1, np.nan], r"NaN at sample 2 \(0\.000 s\)"),
        ([0.0, -np.inf], "infinity at sample 1"),
        ([0.0, 1e300], "infinity at sample 1"),
        ([0.0, 1e38], r"value 1e\+38"),
        ([0.0, -100.5, 300.0], r"value -100\.5 \(largest 300\) at sample 1"),
    ],
)
def test_samples_that_are_no_sound_are_refused(samples, found):
    with pytest.raises(AudioError, match=found):
        Waveform(samples, 16000)


@pytest.mark.parametrize("rate", [0, -16000, 3999, 768001, 16000.5, np.nan, np.inf, "16000", None])
def test_absurd_rates_are_refused(rate):
    with pytest.raises(AudioError, match=f"sample rate {rate} Hz; allowed: 4000 to 768000 Hz"):
        Waveform(np.zeros(10, np.float32), rate)


def test_a_tone_survives_resampling():
    time = np.arange(48000) / 48000
    tone = (0.5 * np.sin(2 * np.pi * 440 * time)).astype(np.float32)
    there = Waveform(tone, 48000).resample(16000)
    expected = 0.5 * np.sin(2 * np.pi * 440 * np.arange(16000) / 16000)
    assert there.sample_rate == 16000
    np.testing.assert_allclose(there.samples[500:-500], expected[500:-500], atol=1e-4)
    assert there.resample(16000) is there


def test_every_public_name_is_there():
    for name in elocute.audio.__all__:
        assert getattr(elocute.audio, name).__name__ == name
    assert dir(elocute.audio) == sorted(elocute.audio.__all__)
    with pytest.raises(AttributeError, match="nothing"):
        elocute.audio.nothing  # noqa: B018


def test_importing_needs_neither_decoders_nor_resampler():
    code = (
        "import sys, elocute.audio, elocute.audio.read, elocute.audio.mel_with_deltas;"
        "import elocute.audio.features;"
        "print([m for m in ('soundfile', 'soxr', 'av', 'scipy', 'torch') if m in sys.modules])"
    )
    out = run_python("-c", code, check=True)
    assert out.stdout.strip() == "[]"
