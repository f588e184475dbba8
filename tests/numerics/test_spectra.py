"""Windows, cosine transform and mel filters, against SciPy and librosa."""

import librosa
import numpy as np
import pytest
from scipy.fft import dct
from scipy.signal.windows import hann as scipy_hann

from elocute.numerics.spectra import (
    MelScale,
    dct_matrix,
    hann,
    hz_to_mel,
    mel_points,
    mel_to_hz,
    triangles,
)


@pytest.mark.parametrize("length", [7, 400, 882])
def test_hann(length: int):
    assert np.allclose(hann(length), scipy_hann(length, sym=False), atol=1e-15)


@pytest.mark.parametrize("size", [5, 26])
def test_dct(size: int):
    rows = np.random.default_rng(0).normal(size=(4, size))
    assert np.allclose(rows @ dct_matrix(size), np.asarray(dct(rows, norm="ortho")))


@pytest.mark.parametrize("scale", ["htk", "slaney"])
def test_mel(scale: MelScale):
    hz, htk = np.array([0.0, 40, 999, 1000, 7800, 22050]), scale == "htk"
    assert np.allclose(hz_to_mel(hz, scale), librosa.hz_to_mel(hz, htk=htk))
    assert np.allclose(mel_to_hz(hz_to_mel(hz, scale), scale), hz)
    theirs = librosa.mel_frequencies(n_mels=10, fmin=40, fmax=7800, htk=htk)
    assert np.allclose(mel_points(40, 7800, 10, scale), theirs)


def test_triangles_overlap_to_one():
    corners = np.array([0.0, 1.0, 2.5, 4.0, 8.0])
    places = np.linspace(0, 8, 81)
    found = triangles(corners, places)
    for row, peak in zip(found, corners[1:-1], strict=True):
        assert row.max() <= 1 and triangles(corners, np.array([peak])).max() == 1
        assert places[row.argmax()] == pytest.approx(peak, abs=0.1)
    inner = (places >= 1) & (places <= 4)
    assert np.allclose(found.sum(axis=0)[inner], 1)


def test_a_side_of_no_width_is_a_step():
    found = triangles(np.array([2.0, 2.0, 4.0, 4.0]), np.arange(6))
    assert found.tolist() == [[0, 0, 1, 0.5, 0, 0], [0, 0, 0, 0.5, 0, 0]]
