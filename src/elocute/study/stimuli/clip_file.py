"""Writing the videos of a study: H.264 and AAC, which every browser plays."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.errors import OutputError
from elocute.study.stimuli.stimulus_sound import RATE

AUDIO_BITS = 160_000
CODEC = {"crf": "16", "preset": "veryfast", "tune": "animation", "threads": "1"}
LUMA = np.array([0.2126, 0.7152, 0.0722], np.float32)


def write_clip(
    path: Path,
    pictures: Iterable[NDArray[np.uint8]],
    fps: float,
    samples: Float32Array | None,
) -> tuple[int, float]:
    """Write one video.

    Parameters
    ----------
    path : Path
        Where; what is there is replaced.
    pictures : iterable of (height, width, 3) uint8
        sRGB, all of one even size.
    fps : float
        Frames per second.
    samples : (sample,) float32, optional
        Sound at `RATE`; None is a video without sound.

    Returns
    -------
    frames : int
        How many there were.
    luma : float
        Mean brightness, 0 to 255.

    Raises
    ------
    OutputError
        Where it cannot be encoded.
    """
    import av
    from av.error import FFmpegError

    lumas: list[float] = []
    try:
        with av.open(f"file:{path}", "w", format="mp4", options={"movflags": "+faststart"}) as file:
            sound: Any = None
            video: Any = None
            rate = Fraction(fps).limit_denominator(1001)
            for picture in pictures:
                if video is None:
                    video = _video_stream(file, picture, rate)
                    sound = _sound_stream(file) if samples is not None else None
                lumas.append(float((picture[::4, ::4] @ LUMA).mean()))
                frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
                frame = frame.reformat(format="yuv420p", dst_colorspace="ITU709")
                frame.pts, frame.time_base = len(lumas) - 1, 1 / rate
                for packet in video.encode(frame):
                    file.mux(packet)
            for packet in video.encode(None) if video else ():
                file.mux(packet)
            if sound is not None and samples is not None:
                _write_sound(file, sound, samples)
    except FFmpegError as error:
        if isinstance(error, OSError):
            raise
        raise OutputError(f"{path}: video encoder: {error}") from error
    return len(lumas), float(np.mean(lumas)) if lumas else 0.0


def _video_stream(file: Any, picture: NDArray[np.uint8], rate: Fraction) -> Any:
    video = file.add_stream("libx264", rate=rate)
    video.height, video.width = picture.shape[:2]
    video.pix_fmt = "yuv420p"
    video.time_base = 1 / rate
    video.options = CODEC
    context = video.codec_context
    context.color_primaries = context.color_trc = context.colorspace = 1  # BT.709
    context.color_range = 1
    return video


def _sound_stream(file: Any) -> Any:
    sound = file.add_stream("aac", rate=RATE)
    sound.layout = "stereo"  # a browser that plays one channel may play it on one side
    sound.bit_rate = AUDIO_BITS
    return sound


def _write_sound(file: Any, sound: Any, samples: Float32Array) -> None:
    import av

    both = np.ascontiguousarray(np.stack([samples, samples]))
    for start in range(0, both.shape[1], RATE):
        part = np.ascontiguousarray(both[:, start : start + RATE])
        frame = av.AudioFrame.from_ndarray(part, format="fltp", layout="stereo")
        frame.sample_rate, frame.pts, frame.time_base = RATE, start, Fraction(1, RATE)
        for packet in sound.encode(frame):
            file.mux(packet)
    for packet in sound.encode(None):
        file.mux(packet)
