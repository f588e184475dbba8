"""Features against independent oracles."""

import librosa
import numpy as np
import pytest
import python_speech_features as psf

from elocute.audio.features import Features
from elocute.audio.front_end import encoder_features
from elocute.audio.mel import (
    fbank,
    filterbank_energies,
    hz_to_mel,
    log_mel,
    mel_filterbank,
    mel_to_hz,
    mfcc,
)
from elocute.audio.mel3 import derivative, mel3_frames, mel3_windows
from elocute.audio.read import read_audio
from elocute.errors import InputError


@pytest.fixture(scope="module")
def samples(speech_wav):
    return read_audio(speech_wav, sample_rate=16000).samples[:48000]


@pytest.mark.parametrize("scale", ["htk", "slaney"])
@pytest.mark.parametrize("unit_area", [True, False])
def test_filterbank_equals_librosa(scale, unit_area):
    ours = mel_filterbank(16000, 512, 40, 50, 7600, scale, unit_area)
    theirs = librosa.filters.mel(
        sr=16000, n_fft=512, n_mels=40, fmin=50, fmax=7600, htk=scale == "htk",
        norm="slaney" if unit_area else None, dtype=np.float64,
    )  # fmt: skip
    assert np.allclose(ours, theirs, atol=1e-9)


@pytest.mark.parametrize("scale", ["htk", "slaney"])
def test_mel_and_back(scale):
    hz = np.linspace(0, 8000, 50)
    assert np.allclose(mel_to_hz(hz_to_mel(hz, scale), scale), hz)


def test_log_mel_equals_librosa(samples):
    theirs = librosa.feature.melspectrogram(
        y=samples.astype(float), sr=16000, n_fft=512, win_length=400, hop_length=160, n_mels=64,
        htk=True, norm=None, pad_mode="constant", dtype=np.float64,
    )  # fmt: skip
    ours = log_mel(samples, 16000)
    assert np.allclose(ours, np.log(np.maximum(theirs, 1e-10)).T[: len(ours)], atol=1e-6)


def test_mfcc_equals_python_speech_features(samples):
    ours = mfcc(samples, 16000, coefficients=26)
    assert np.allclose(ours, psf.mfcc(samples, 16000, numcep=26), atol=1e-6)


def test_mfcc_with_deepspeech_windows(samples):
    ours = mfcc(samples, 16000, 26, window_s=0.032, step_s=0.02)
    theirs = psf.mfcc(samples, 16000, winlen=0.032, winstep=0.02, numcep=26)
    assert np.allclose(ours, theirs, atol=1e-6)


def test_filterbank_energies_equal_python_speech_features(samples):
    ours, energy = filterbank_energies(samples, 16000)
    theirs, their_energy = psf.fbank(samples, 16000)
    assert np.allclose(ours, theirs) and np.allclose(energy, their_energy)
    assert np.allclose(fbank(samples, 16000), psf.logfbank(samples, 16000))


def test_silence_gives_finite_features():
    assert np.isfinite(mfcc(np.zeros(1600), 16000)).all()
    assert np.isfinite(log_mel(np.zeros(1600), 16000)).all()
    assert np.isfinite(encoder_features(np.zeros(1600, np.float32))).all()


def test_mel3_static_part_equals_librosa(speech_wav):
    sound = read_audio(speech_wav)
    samples = sound.resample(44100).samples.astype(float)
    samples = samples - samples.mean()
    samples /= np.abs(samples).max()
    theirs = librosa.feature.melspectrogram(
        y=samples, sr=44100, n_fft=1024, win_length=882, hop_length=441, n_mels=128, htk=True,
        norm=None, pad_mode="constant", dtype=np.float64,
    ).T  # fmt: skip
    ours = mel3_frames(sound)
    assert np.allclose(ours[:, :, 0], np.log(np.maximum(theirs, 1e-10))[: len(ours)], atol=1e-4)


def test_mel3_derivatives_equal_the_regression_slope(samples):
    values = np.random.default_rng(0).normal(size=(60, 5))
    theirs = psf.delta(values, 2)
    assert np.allclose(derivative(values), theirs)


def test_mel3_windows_have_the_papers_shape(speech_wav):
    sound = read_audio(speech_wav)
    windows = mel3_windows(sound, 30)
    assert windows.shape == (round(sound.duration_s * 30), 41, 128, 3)
    assert np.array_equal(windows[30, 20], mel3_frames(sound)[100])


def test_windows_cover_eight_frames_before_and_seven_after():
    values = np.arange(1, 41, dtype=np.float32)[:, None]
    windows = Features(values, 60, "test").windows(16)
    assert windows.shape == (40, 16, 1)
    assert windows[20, :, 0].tolist() == list(range(13, 29))
    assert windows[0, :8, 0].tolist() == [0] * 8 and windows[0, 8, 0] == 1


def test_resampling_keeps_time():
    features = Features(np.arange(50, dtype=np.float32)[:, None], 50, "test").resample(60)
    assert len(features.values) == 60
    assert features.values[30, 0] == pytest.approx(25)


def test_features_refuse_what_is_not_finite():
    with pytest.raises(InputError, match="finite"):
        Features(np.array([[np.nan]]), 50, "test")
