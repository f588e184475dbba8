"""Samples of 16 bits that come as bytes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

INT16 = 1 / 32768
"""Full scale of samples of 16 bits."""
CHANNELS_MAX = 64


class PcmBytes:
    """Interleaved little-endian samples of 16 bits, in bytes that are cut anywhere."""

    def __init__(self, channels: int = 1) -> None:
        self._channels, self._cut = channels, b""

    def push(self, data: bytes) -> NDArray[np.int16]:
        """(sample, channel) that are whole now; what is left begins the next ones."""
        data, width = self._cut + data, 2 * self._channels
        whole = len(data) // width * width
        self._cut = data[whole:]
        return np.frombuffer(data[:whole], "<i2").reshape(-1, self._channels)
