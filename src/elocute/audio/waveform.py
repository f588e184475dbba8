"""Mono sound in memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.errors import AudioError
from elocute.numerics.input_checks import NUMBERS_MAX, array_of, real_number
from elocute.one_line_repr import brief

RATE_RANGE = (4000, 768_000)
SPEECH_RATE = 16000
"""Hz at which speech encoders and aligners hear, and corpora of speech are kept."""
LOUDEST = 100.0
"""1.0 is full scale. Float files may go over it (nothing is clipped), but not by 40 dB: such
numbers are 16-bit integers written as floats, or damage."""


@dataclass(frozen=True, eq=False)
class Waveform:
    """Mono sound in memory.

    Parameters
    ----------
    samples : (sample,) float32
        Full scale is ±1.
    sample_rate : int
        Hz, 4000 to 768000.

    Raises
    ------
    AudioError
        Where the samples are not floats, not one-dimensional, fewer than two, not finite or beyond
        ±100, or the rate is out of range.
    """

    samples: NDArray[np.float32]
    sample_rate: int

    def __post_init__(self) -> None:
        values = array_of(self.samples, "waveform", error=AudioError, allowed="samples")
        if values.dtype.kind != "f":
            raise AudioError.about(
                "waveform",
                found=f"samples of type {values.dtype}",
                allowed="floats within ±1",
                remedy="divide 16-bit integers by 32768",
            )
        with np.errstate(over="ignore"):
            samples = np.ascontiguousarray(values, dtype=np.float32)
        if values.ndim != 1 or len(samples) < 2:
            raise AudioError.about(
                "waveform",
                found=f"samples of shape {values.shape}",
                allowed="(sample,), two or more",
                remedy="mix channels down first",
            )
        check_samples("waveform", samples, check_rate("waveform", self.sample_rate))
        object.__setattr__(self, "samples", samples)
        object.__setattr__(self, "sample_rate", check_rate("waveform", self.sample_rate))

    def __repr__(self) -> str:
        return f"Waveform({self.duration_s:.2f} s at {self.sample_rate} Hz)"

    @property
    def duration_s(self) -> float:
        return len(self.samples) / self.sample_rate

    def resample(self, sample_rate: int) -> Waveform:
        """The same sound at another rate (soxr, high quality).

        Parameters
        ----------
        sample_rate : int
            Hz, 4000 to 768000.

        Returns
        -------
        Waveform

        Raises
        ------
        AudioError
            For a rate out of range, or more samples than fit in memory.
        """
        sample_rate = check_rate("waveform", sample_rate)
        if sample_rate == self.sample_rate:
            return self
        count = len(self.samples) * sample_rate // self.sample_rate
        if count > max(NUMBERS_MAX, len(self.samples)):
            raise AudioError.about(
                "waveform",
                found=f"{count} samples at {sample_rate} Hz",
                allowed=f"up to {NUMBERS_MAX}",
                remedy="choose a lower rate",
            )
        import soxr

        return Waveform(soxr.resample(self.samples, self.sample_rate, sample_rate), sample_rate)


def check_rate(subject: object, rate: float) -> int:
    """The rate as an integer. Raises AudioError for a sample rate that no speech has."""
    low, high = RATE_RANGE
    number = real_number(rate)
    whole = 0 if number is None else int(number)
    if not low <= whole <= high or whole != number:
        raise AudioError.about(
            str(subject),
            found=f"sample rate {rate if isinstance(rate, str) else brief(rate)} Hz",
            allowed=f"{low} to {high} Hz, whole",
            remedy="export the sound at 16000 or 48000 Hz",
        )
    return whole


def check_samples(
    subject: object, samples: NDArray[np.float32], rate: float, offset: int = 0
) -> None:
    """Raise AudioError for the first sample out of range; `offset` samples came before.

    samples: (sample,) or (sample, channel).
    """
    # Comparing with NaN is false, so one reduction each way finds everything.
    if not len(samples) or (samples.max() <= LOUDEST and samples.min() >= -LOUDEST):
        return
    with np.errstate(invalid="ignore"):
        wrong = ~(np.abs(samples) <= LOUDEST)
    where = np.unravel_index(int(wrong.argmax()), wrong.shape)
    value, place = samples[where], offset + int(where[0])
    if np.isfinite(value):
        loudest = np.abs(samples[np.isfinite(samples)]).max()
        found = f"value {value:g} (largest {loudest:g})"
    else:
        found = "NaN" if np.isnan(value) else "infinity"
    raise AudioError.about(
        str(subject),
        found=f"{found} at sample {place} ({place / rate:.3f} s)",
        allowed=f"finite samples within ±{LOUDEST:g}, full scale being ±1",
        remedy="export the sound again",
    )
