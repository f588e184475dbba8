"""What is heard with a stimulus: one level for all, in noise where the condition says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.noise import with_noise
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.errors import StudyError

RATE = 48_000
PEAK = 0.98
SILENT = 1e-5
SECONDS_MAX = 120.0
"""Longer than any sentence: a clip is shown again and again."""


def read_part(path: Path, start_s: float = 0.0, end_s: float = 0.0) -> Waveform:
    """A sound, or of a sound or video the part from `start_s` to `end_s`, where 0 is its end.

    Raises StudyError for a part that is not there, silence, and what is too long for a stimulus,
    and AudioError for a file that cannot be read.
    """
    whole = read_audio(path)
    last = end_s or whole.duration_s
    if not start_s < last <= whole.duration_s + 0.05:
        raise StudyError.about(
            path,
            found=f"{whole.duration_s:.2f} s",
            allowed=f"a sound that has {start_s:g} to {end_s:g} s",
        )
    first, stop = (round(each * whole.sample_rate) for each in (start_s, last))
    part = Waveform(whole.samples[first:stop], whole.sample_rate)
    if part.duration_s > SECONDS_MAX:
        raise StudyError.about(
            path,
            found=f"{part.duration_s:.0f} s",
            allowed=f"up to {SECONDS_MAX:g} s of a stimulus",
            remedy="name a part by start_s and end_s",
        )
    if float(np.abs(part.samples).max(initial=0)) < SILENT:
        raise StudyError.about(path, found="silence", allowed="speech")
    return part


def voice_noise(sound: Waveform, seed: int) -> Float32Array:
    """Noise with a voice's own spectrum: its random phases.

    Parameters
    ----------
    sound : Waveform
        The voice.
    seed : int
        Of the phases.

    Returns
    -------
    (sample,) float32
    """
    spectrum = np.abs(np.fft.rfft(sound.samples.astype(np.float64)))
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(spectrum))
    return np.fft.irfft(spectrum * np.exp(1j * phases), len(sound.samples)).astype(np.float32)


def heard(
    sound: Waveform,
    *,
    level_db: float,
    snr_db: float | None = None,
    pad_s: float = 0.0,
    seconds: float,
    seed: int = 0,
) -> Float32Array:
    """The sound of a video.

    Parameters
    ----------
    sound : Waveform
        The voice.
    level_db : float
        Root mean square of what is heard, dB of full scale; less where peaks would be cut off.
    snr_db : float, optional
        Voice to noise, dB; None is no noise.
    pad_s : float
        Silence before, s.
    seconds : float
        Length of the whole.
    seed : int
        Of the noise.

    Returns
    -------
    (sample,) float32
        At `RATE`.
    """
    voice = sound.resample(RATE)
    length = round(seconds * RATE)
    samples = np.zeros(length, np.float32)
    start = round(pad_s * RATE)
    part = voice.samples[: length - start]
    samples[start : start + len(part)] = part
    if snr_db is not None:
        # The noise is as long as the video, and its level that of the voice where it speaks.
        noisy = with_noise(Waveform(part, RATE), voice_noise(voice, seed), -snr_db)
        noise = np.resize(noisy.samples - part, length)
        samples += noise
    level = float(np.sqrt(np.mean(np.square(samples[start : start + len(part)], dtype=np.float64))))
    gain = 10 ** (level_db / 20) / max(level, SILENT)
    peak = float(np.abs(samples).max(initial=0)) * gain
    return (samples * (gain * min(1.0, PEAK / max(peak, SILENT)))).astype(np.float32)
