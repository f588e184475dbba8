"""Encoded pictures to arrays and back, with PyAV."""

from __future__ import annotations

import io
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

JPEG_QUALITY = 2
"""FFmpeg's scale, 2 (best) to 31."""


def decoded(encoded: bytes) -> NDArray[np.uint8]:
    """(row, column, 3) sRGB of one of our own pictures (JPEG, WebP, PNG)."""
    import av

    with av.open(io.BytesIO(encoded)) as container:
        frame = next(container.decode(video=0))
    return frame.to_ndarray(format="rgb24")


def jpeg(values: NDArray[np.uint8]) -> bytes:
    """(row, column, 3) sRGB as JPEG without subsampled colour."""
    import av

    height, width = values.shape[:2]
    codec = av.CodecContext.create("mjpeg", "w")
    codec.width, codec.height, codec.pix_fmt = width, height, "yuvj444p"
    codec.time_base = Fraction(1, 25)
    codec.options = {"qscale": str(JPEG_QUALITY)}
    codec.qmin = codec.qmax = JPEG_QUALITY
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(values), format="rgb24")
    packets = [*codec.encode(frame.reformat(format="yuvj444p")), *codec.encode(None)]
    return b"".join(bytes(packet) for packet in packets)
