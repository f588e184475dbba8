"""Pictures far larger than any camera's are refused before one is decoded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import av
import pytest

from elocute.capture.video.video_frames import Video
from elocute.errors import CaptureError


def test_pictures_of_64_million_pixels(tmp_path: Path):
    """A few kilobytes on disk; each would take 100 MB, and a decoder holds several."""
    path, side = tmp_path / "large.mkv", 8000
    with av.open(str(path), "w") as file:
        film: Any = file.add_stream("libx264", rate=25, options={"preset": "ultrafast"})
        film.width, film.height, film.pix_fmt = side, side, "yuv420p"
        file.mux(film.encode(av.VideoFrame(side, side, "yuv420p")))
        file.mux(film.encode(None))
    with pytest.raises(CaptureError, match=f"pictures of {side} × {side}; allowed: up to 40 mill"):
        Video(path)
