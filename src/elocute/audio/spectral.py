"""Spectral features: log-mel, MFCC, mel-filterbank energies.

Conventions that differ between toolkits are parameters, so each feature can be checked against
the toolkit it comes from.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Float64Array = NDArray[np.float64]
Scale = Literal["htk", "slaney"]

SLANEY_KNEE_HZ, SLANEY_STEP_HZ = 1000.0, 200.0 / 3  # linear below the knee, logarithmic above
SLANEY_LOG_STEP = np.log(6.4) / 27.0


def hz_to_mel(hz: Float64Array | float, scale: Scale = "htk") -> Float64Array:
    """Mel of a frequency: HTK's formula, or Slaney's auditory toolbox."""
    hz = np.asarray(hz, float)
    if scale == "htk":
        return 2595.0 * np.log10(1 + hz / 700.0)
    knee = SLANEY_KNEE_HZ / SLANEY_STEP_HZ
    above = knee + np.log(np.maximum(hz, 1e-9) / SLANEY_KNEE_HZ) / SLANEY_LOG_STEP
    return np.where(hz < SLANEY_KNEE_HZ, hz / SLANEY_STEP_HZ, above)


def mel_to_hz(mel: Float64Array | float, scale: Scale = "htk") -> Float64Array:
    """The inverse of `hz_to_mel`."""
    mel = np.asarray(mel, float)
    if scale == "htk":
        return 700.0 * (10 ** (mel / 2595.0) - 1)
    knee = SLANEY_KNEE_HZ / SLANEY_STEP_HZ
    above = SLANEY_KNEE_HZ * np.exp(SLANEY_LOG_STEP * (mel - knee))
    return np.where(mel < knee, mel * SLANEY_STEP_HZ, above)


def mel_filterbank(
    sample_rate: float,
    fft: int,
    bands: int,
    low_hz: float = 0.0,
    high_hz: float | None = None,
    scale: Scale = "htk",
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
    low_mel, high_mel = hz_to_mel(low_hz, scale), hz_to_mel(high_hz, scale)
    edges = mel_to_hz(np.linspace(low_mel, high_mel, bands + 2), scale)
    hz = np.linspace(0, sample_rate / 2, fft // 2 + 1)
    low, middle, high = edges[:-2, None], edges[1:-1, None], edges[2:, None]
    filters = np.maximum(0, np.minimum((hz - low) / (middle - low), (high - hz) / (high - middle)))
    return filters * (2.0 / (high - low)) if unit_area else filters


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


def hann(length: int) -> Float64Array:
    """A periodic Hann window."""
    return 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length)


def log_mel(
    samples: NDArray[np.floating],
    sample_rate: int,
    bands: int = 64,
    window_s: float = 0.025,
    hop_s: float = 0.010,
    fft: int = 512,
    low_hz: float = 0.0,
    high_hz: float | None = None,
    scale: Scale = "htk",
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
    mels = np.linspace(hz_to_mel(0.0), hz_to_mel(sample_rate / 2), bands + 2)
    bins = np.floor((fft + 1) * mel_to_hz(mels) / sample_rate)
    place = np.arange(fft // 2 + 1)
    low, middle, high = bins[:-2, None], bins[1:-1, None], bins[2:, None]
    rising = (place - low) / np.maximum(middle - low, 1)
    falling = (high - place) / np.maximum(high - middle, 1)
    rises = (place >= np.floor(low)) & (place < middle)
    falls = (place >= middle) & (place < high)
    return np.where(rises, rising, 0) + np.where(falls, falling, 0)


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
    cepstrum = np.log(energies) @ _dct(bands)[:, :coefficients]
    if lifter > 0:
        n = np.arange(coefficients)
        cepstrum *= 1 + lifter / 2 * np.sin(np.pi * n / lifter)
    cepstrum[:, 0] = np.log(total)
    return cepstrum


def _dct(size: int) -> Float64Array:
    """(input, output) orthonormal DCT-II."""
    n = np.arange(size)
    matrix = np.cos(np.pi * (2 * n[:, None] + 1) * n / (2 * size)) * np.sqrt(2 / size)
    matrix[:, 0] /= np.sqrt(2)
    return matrix
