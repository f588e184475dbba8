"""Writing sound: FLAC."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def write_flac(path: Path, samples: NDArray[np.floating], sample_rate: int) -> None:
    """Write mono sound as 16-bit FLAC, clipped to full scale.

    It is encoded in memory first, as libsndfile does not report why a write failed. Raises OSError.
    """
    import soundfile

    packed = io.BytesIO()
    soundfile.write(packed, np.clip(samples, -1, 1), sample_rate, "PCM_16", format="FLAC")
    path.write_bytes(packed.getbuffer())
