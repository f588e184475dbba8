"""Sound as numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.errors import AudioError

RATE_RANGE = (4000, 768_000)
LOUDEST = 100.0  # 1.0 is full scale; float files may go over it, but not to 1e38


@dataclass(frozen=True, eq=False)
class Waveform:
    """samples (sample,) float32, full scale ±1; sample_rate in Hz.

    Raises AudioError where the samples are not one-dimensional, fewer than two, not finite, or
    the rate is absurd.
    """

    samples: NDArray[np.float32]
    sample_rate: int

    def __post_init__(self) -> None:
        samples = np.ascontiguousarray(self.samples, dtype=np.float32)
        if samples.ndim != 1 or len(samples) < 2:
            raise AudioError(
                f"waveform: found shape {samples.shape}; allowed: (samples,), two or more"
            )
        check_samples("waveform", samples, self.sample_rate)
        check_rate("waveform", self.sample_rate)
        object.__setattr__(self, "samples", samples)

    @property
    def duration_s(self) -> float:
        return len(self.samples) / self.sample_rate

    def resample(self, sample_rate: int) -> Waveform:
        """The same sound at another rate (soxr, high quality)."""
        if sample_rate == self.sample_rate:
            return self
        import soxr

        check_rate("waveform", sample_rate)
        return Waveform(soxr.resample(self.samples, self.sample_rate, sample_rate), sample_rate)


def check_rate(subject: object, rate: float) -> None:
    """Raise AudioError for a sample rate that no speech has."""
    low, high = RATE_RANGE
    if not low <= rate <= high:
        raise AudioError.about(
            str(subject), found=f"sample rate {rate:g} Hz", allowed=f"{low} to {high} Hz"
        )


def check_samples(
    subject: object, samples: NDArray[np.float32], rate: float, offset: int = 0
) -> None:
    """Raise AudioError at the first sample that is no sound; `offset` samples came before."""
    with np.errstate(invalid="ignore", over="ignore"):
        wrong = ~(np.abs(samples) <= LOUDEST)
    if not wrong.any():
        return
    first = int(wrong.argmax())
    value = samples[first]
    found = f"value {value:g}" if np.isfinite(value) else ("NaN" if np.isnan(value) else "infinity")
    place = offset + first
    raise AudioError.about(
        str(subject), found=f"{found} at sample {place} ({place / rate:.3f} s)",
        allowed=f"finite samples within ±{LOUDEST:g}", remedy="export the sound again",
    )  # fmt: skip
