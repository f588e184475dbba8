"""Pictures and their times out of a video file, by FFmpeg's libraries through PyAV."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import CaptureError
from elocute.files.media import open_media
from elocute.files.reading import FileKind, open_regular

SIDE_MAX = 1280
"""Larger pictures are reduced: a detector looks at a face in some 200 pixels."""
PIXELS_MAX = 40_000_000
"""Of a picture, 8K and a little more: a decoder holds several of them."""
ALLOWED = "a video: .mp4 .mov .mpg .mkv .webm .avi"
VIDEO_FILE = FileKind(ALLOWED, 2**40, CaptureError)


class Video:
    """An open video; iterate `pictures()` once. Use as a context manager.

    expected_pictures and rate (per second) are what the file says, or None; note says why the
    pictures ended early, or "". Raises CaptureError for a file that is missing, empty or no video.
    """

    def __init__(self, path: str | Path) -> None:
        import av.error

        self.path = Path(path)
        _check_file(self.path)
        try:
            self._file: Any = open_media(path, pixels_max=PIXELS_MAX)
        except (av.error.FFmpegError, OSError, ValueError) as error:
            raise CaptureError.about(
                path,
                found="no video that can be read",
                allowed=ALLOWED,
                remedy="was it cut off? record or convert it again",
            ) from error
        if not self._file.streams.video:
            self._file.close()
            raise CaptureError.about(path, found="no picture in it, only sound", allowed=ALLOWED)
        self._stream = self._file.streams.video[0]
        context = self._stream.codec_context
        wide, high = (context.width, context.height) if context is not None else (0, 0)
        if wide * high > PIXELS_MAX:
            self._file.close()
            raise CaptureError.about(
                path,
                found=f"pictures of {wide} × {high}",
                allowed=f"up to {PIXELS_MAX // 1_000_000} million pixels (8K)",
                remedy="reduce them",
            )
        self._stream.thread_type = "AUTO"
        if context is not None:  # pictures may grow later
            context.options = {**context.options, "max_pixels": str(PIXELS_MAX)}
        self._zero_s = max(0.0, (self._file.start_time or 0) / 1e6)
        self.has_sound = bool(self._file.streams.audio)
        self.rate = float(self._stream.average_rate) if self._stream.average_rate else None
        seconds = (self._file.duration or 0) / 1e6
        self.expected_pictures = self._stream.frames or round(seconds * (self.rate or 0)) or None
        self.note = ""

    def __enter__(self) -> Video:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(Exception):
            self._file.close()

    def pictures(self) -> Iterator[tuple[float, NDArray[np.uint8]]]:
        """Pictures in order, each with its time in s since the start of the container.

        (height, width, 3) uint8 sRGB, upright, with square pixels, at most SIDE_MAX on the longer
        side. Sound read from the same file (`audio.read`) starts at the same zero. Raises
        CaptureError where nothing can be decoded. A file that breaks off later ends there, and
        `note` says so.
        """
        import av.error

        before = -np.inf
        try:
            for frame in self._file.decode(self._stream):
                if frame.pts is None or frame.is_corrupt:
                    continue
                time_s = float(frame.pts * frame.time_base) - self._zero_s
                if time_s <= before:
                    continue
                before = time_s
                yield time_s, self._upright(frame)
        except (av.error.FFmpegError, ValueError) as error:
            self.note = f"the pictures break off at {max(before, 0.0):.2f} s"
            if before < 0:
                raise CaptureError.about(
                    self.path,
                    found="pictures that cannot be decoded",
                    allowed=ALLOWED,
                    remedy="record or convert it again",
                ) from error

    def _upright(self, frame: Any) -> NDArray[np.uint8]:
        # Known only now: containers guess what the first picture says.
        aspect = float(self._stream.codec_context.sample_aspect_ratio or 1)
        wide, high = frame.width * aspect, float(frame.height)
        scale = min(1.0, SIDE_MAX / max(wide, high))
        size = {"width": round(wide * scale), "height": round(high * scale)}
        picture = frame.reformat(format="rgb24", **size).to_ndarray()
        quarter = round(float(getattr(frame, "rotation", 0) or 0) / 90) % 4
        return np.ascontiguousarray(np.rot90(picture, quarter)) if quarter else picture


def _check_file(path: Path) -> None:
    fault = ""
    if path.is_dir():
        fault = "a folder"
    elif not path.is_file():
        fault = "no such file"
    elif not path.stat().st_size:
        fault = "an empty file"
    if fault:
        raise CaptureError.about(path, found=fault, allowed=ALLOWED)
    with open_regular(path, VIDEO_FILE):
        pass
