"""Spectral features against librosa and python_speech_features."""

import librosa
import numpy as np
import pytest
import python_speech_features as psf

from elocute.audio.read import read_audio
from elocute.audio.spectral import (
    fbank,
    filterbank_energies,
    log_mel,
    mel_filterbank,
    mfcc,
)


@pytest.fixture(scope="module")
def samples(speech_wav):
    return read_audio(speech_wav, sample_rate=16000).samples[:48000].astype(float)


@pytest.mark.parametrize("scale", ["htk", "slaney"])
@pytest.mark.parametrize("unit_area", [True, False])
def test_filterbank_equals_librosa(scale, unit_area):
    ours = mel_filterbank(16000, 512, 40, 50, 7600, scale, unit_area)
    theirs = librosa.filters.mel(
        sr=16000,
        n_fft=512,
        n_mels=40,
        fmin=50,
        fmax=7600,
        htk=scale == "htk",
        norm="slaney" if unit_area else None,
        dtype=np.float64,
    )
    assert np.allclose(ours, theirs, atol=1e-9)


def test_log_mel_equals_librosa(samples):
    theirs = librosa.feature.melspectrogram(
        y=samples.astype(float),
        sr=16000,
        n_fft=512,
        win_length=400,
        hop_length=160,
        n_mels=64,
        htk=True,
        norm=None,
        pad_mode="constant",
        dtype=np.float64,
    )
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
