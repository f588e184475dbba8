"""Spectral features: log-mel, MFCC, mel-filterbank energies.

Conventions that differ between toolkits are parameters, so each feature can be checked against
the toolkit it comes from.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.numerics.spectra import MelScale, dct_matrix, hann, mel_points, triangles


def mel_filterbank(
    sample_rate: float,
    fft: int,
    bands: int,
    low_hz: float = 0.0,
    high_hz: float | None = None,
    scale: MelScale = "htk",
    unit_area: bool = False,
) -> Float64Array:
    """Triangular filters evenly spaced in mel.

    Parameters
    ----------
    sample_rate : float
        Hz.
    fft : int
        FFT length, samples.
    bands : int
        How many filters.
    low_hz, high_hz : float
        Where the lowest begins and the highest ends; half the sample rate by default.
    scale : "htk" or "slaney"
        The mel formula.
    unit_area : bool
        Area 1 per hertz instead of peak 1.

    Returns
    -------
    (band, fft / 2 + 1) float64
    """
    high_hz = sample_rate / 2 if high_hz is None else high_hz
    edges = mel_points(low_hz, high_hz, bands + 2, scale)
    filters = triangles(edges, np.linspace(0, sample_rate / 2, fft // 2 + 1))
    return filters * (2.0 / (edges[2:] - edges[:-2]))[:, None] if unit_area else filters


def frames_of(samples: NDArray[np.floating], window: int, hop: int) -> NDArray[np.floating]:
    """(frame, window) views of a signal, zero-padded at its end to a whole frame."""
    count = 1 + max(0, -(-(len(samples) - window) // hop))
    padded = np.zeros((count - 1) * hop + window, samples.dtype)
    padded[: len(samples)] = samples[: len(padded)]
    return np.lib.stride_tricks.sliding_window_view(padded, window)[::hop]


def power_spectrum(
    samples: NDArray[np.floating],
    window: NDArray[np.floating],
    hop: int,
    fft: int,
    centred: bool = True,
) -> Float64Array:
    """Squared magnitudes of a short-time Fourier transform.

    Parameters
    ----------
    samples : (sample,)
        The sound.
    window : (length,)
        The window.
    hop, fft : int
        Hop and FFT length, samples.
    centred : bool
        Frame t is centred on t · hop, with zeros beyond both ends (as librosa); it begins there
        otherwise.

    Returns
    -------
    (frame, fft / 2 + 1) float64
    """
    if not centred:
        views = frames_of(samples, len(window), hop)
        return np.abs(np.fft.rfft(views * window, fft)) ** 2
    # As librosa: the window stands in the middle of the FFT frame.
    padded = np.pad(samples, fft // 2)
    left = (fft - len(window)) // 2
    whole = np.pad(window, (left, fft - len(window) - left))
    views = np.lib.stride_tricks.sliding_window_view(padded, fft)[::hop]
    return np.abs(np.fft.rfft(views * whole, fft)) ** 2


def log_mel(
    samples: NDArray[np.floating],
    sample_rate: int,
    bands: int = 64,
    window_s: float = 0.025,
    hop_s: float = 0.010,
    fft: int = 512,
    low_hz: float = 0.0,
    high_hz: float | None = None,
    scale: MelScale = "htk",
    floor: float = 1e-10,
) -> Float64Array:
    """Natural logarithms of mel powers; frame t is centred on t · hop.

    Parameters
    ----------
    samples : (sample,)
        The sound.
    sample_rate : int
        Hz.
    bands : int
        How many mel bands.
    window_s, hop_s : float
        Length of the Hann window and hop, s.
    fft : int
        FFT length, samples.
    low_hz, high_hz, scale
        As `mel_filterbank` takes them.
    floor : float
        Powers below it count as this.

    Returns
    -------
    (frame, band) float64
    """
    window = hann(round(window_s * sample_rate))
    power = power_spectrum(samples, window, round(hop_s * sample_rate), fft)
    filters = mel_filterbank(sample_rate, fft, bands, low_hz, high_hz, scale)
    return np.log(np.maximum(power @ filters.T, floor))


def _bin_filterbank(sample_rate: float, fft: int, bands: int) -> Float64Array:
    """(band, fft / 2 + 1) filters with corners on whole FFT bins, as python_speech_features."""
    bins = np.floor((fft + 1) * mel_points(0.0, sample_rate / 2, bands + 2) / sample_rate)
    return triangles(bins, np.arange(fft // 2 + 1))


def filterbank_energies(
    samples: NDArray[np.floating],
    sample_rate: int,
    bands: int = 26,
    window_s: float = 0.025,
    step_s: float = 0.010,
    fft: int = 512,
    preemphasis: float = 0.97,
    hamming: bool = False,
) -> tuple[Float64Array, Float64Array]:
    """Mel-filterbank energies, not logarithms, as python_speech_features has them.

    Frame t begins at t · step.

    Parameters
    ----------
    samples : (sample,)
        The sound.
    sample_rate : int
        Hz.
    bands : int
        How many mel bands.
    window_s, step_s : float
        Length of the window and step, s.
    fft : int
        FFT length, samples.
    preemphasis : float
        Of the first-order high-pass filter.
    hamming : bool
        A Hamming window instead of none.

    Returns
    -------
    energies : (frame, band) float64
    total : (frame,) float64
        Energy of each frame.

    References
    ----------
    VOCA 2019, section 6 (ablation) takes their logarithm.
    """
    samples = np.asarray(samples, float)
    emphasised = np.append(samples[:1], samples[1:] - preemphasis * samples[:-1])
    length = int(window_s * sample_rate + 0.5)
    window = np.hamming(length) if hamming else np.ones(length)
    hop = int(step_s * sample_rate + 0.5)
    power = power_spectrum(emphasised, window, hop, fft, centred=False) / fft
    tiny = np.finfo(float).eps
    energies = power @ _bin_filterbank(sample_rate, fft, bands).T
    total = power.sum(axis=1)
    return np.where(energies == 0, tiny, energies), np.where(total == 0, tiny, total)


def fbank(samples: NDArray[np.floating], sample_rate: int, bands: int = 26) -> Float64Array:
    """(frame, band) log mel-filterbank energies at 100 Hz."""
    return np.log(filterbank_energies(samples, sample_rate, bands)[0])


def mfcc(
    samples: NDArray[np.floating],
    sample_rate: int,
    coefficients: int = 13,
    bands: int = 26,
    window_s: float = 0.025,
    step_s: float = 0.010,
    fft: int = 512,
    lifter: int = 22,
) -> Float64Array:
    """Mel-frequency cepstral coefficients, the first replaced by the log energy.

    Equal to python_speech_features, the front end of DeepSpeech (26 coefficients there).

    Parameters
    ----------
    samples, sample_rate, bands, window_s, step_s, fft
        As `filterbank_energies` takes them.
    coefficients : int
        How many.
    lifter : int
        Of sinusoidal liftering; 0 for none.

    Returns
    -------
    (frame, coefficient) float64
    """
    energies, total = filterbank_energies(samples, sample_rate, bands, window_s, step_s, fft)
    cepstrum = np.log(energies) @ dct_matrix(bands)[:, :coefficients]
    if lifter > 0:
        n = np.arange(coefficients)
        cepstrum *= 1 + lifter / 2 * np.sin(np.pi * n / lifter)
    cepstrum[:, 0] = np.log(total)
    return cepstrum
