"""What an open sound offers, whichever library decodes it, and how its faults are worded."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from elocute.audio.waveform import check_rate
from elocute.errors import AudioError

Array = NDArray[np.float32]

FORMATS = "wav, flac, mp3, ogg, opus, m4a, mp4, mkv, webm"
AGAIN = "copy or export it again"
CHANNELS_MAX = 1024
BLOCK_VALUES_MAX = 20_000_000  # samples times channels held at once: 80 MB
# Lossy streams count whole packets; one that ends earlier than this was cut off.
SHORTFALL_S = 0.1


@dataclass(frozen=True)
class AudioInfo:
    """What a header says. duration_s is None where it does not."""

    format: str
    codec: str
    sample_rate: int
    channels: int
    duration_s: float | None


class Source(Protocol):
    """An open sound. `promised` samples per channel, give or take `slack`; None if unknown."""

    info: AudioInfo
    promised: int | None
    slack: int

    def blocks(self, size: int) -> Iterator[Array]:
        """(sample, channel) blocks of about `size` samples."""
        ...

    def close(self) -> None: ...


def system_name(path: Path) -> Any:
    """A path as libsndfile's binding takes every name, those too that are no UTF-8."""
    return str(path) if os.name == "nt" else os.fsencode(path)


def check_format(path: Path, sample_rate: int, channels: int) -> None:
    """Raise AudioError for a rate or a number of channels that no recording has."""
    check_rate(path, sample_rate)
    if not 1 <= channels <= CHANNELS_MAX:
        raise AudioError.about(
            path, found=f"{channels} channels", allowed=f"1 to {CHANNELS_MAX}", remedy=AGAIN
        )


def cut_off(path: Path, found: str) -> AudioError:
    return AudioError.about(
        path, found=f"{found}: it was cut off", allowed="a whole file", remedy=AGAIN
    )


def damaged(path: Path, reason: object) -> AudioError:
    return AudioError.about(
        path,
        found=f"damaged sound ({str(reason).rstrip('.')})",
        allowed="a whole file",
        remedy=AGAIN,
    )
