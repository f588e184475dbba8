"""FLAC as bytes, written by ordinary writes."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def write_flac(path: Path, samples: NDArray[np.floating], sample_rate: int) -> None:
    """Mono sound of 16 bits, cut to full scale.

    It is packed in memory: libsndfile does not say why a disk refuses. Raises OSError.
    """
    import soundfile

    packed = io.BytesIO()
    soundfile.write(packed, np.clip(samples, -1, 1), sample_rate, "PCM_16", format="FLAC")
    path.write_bytes(packed.getbuffer())
