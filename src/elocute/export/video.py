"""Video with its sound in step with the lips: H.264, VP9 or ProRes.

.webm and .mov can leave out what lies behind the head: VP9 and ProRes 4444 carry alpha, straight.
"""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import OutputError
from elocute.export.drawn_character import drawn
from elocute.export.options import PictureOptions
from elocute.export.pictures import open_pictures
from elocute.export.soundtrack import RATE, Sound, sound_blocks
from elocute.files.atomic import write_atomically
from elocute.motion.motion import Motion

ALPHA_CELL = 8  # pixels a side
WAITING = 8  # frames between drawing and encoding


@dataclass(frozen=True)
class Coding:
    """How a format of video is coded."""

    # FFmpeg's names of the container, the codec, its pixels, and the codec of the sound
    container: str
    video: str
    pixels: str
    audio: str
    options: dict[str, str]  # of the codec of the picture
    audio_bits: int = 0  # a second of sound; 0 where the codec knows


# Visually lossless for a face on a plain ground.
_H264 = {"crf": "18", "preset": "veryfast", "tune": "animation"}
_VP9 = {"crf": "20", "b": "0", "deadline": "good", "cpu-used": "5", "row-mt": "1"}
_CLEAR_VP9 = _VP9 | {"auto-alt-ref": "0"}  # frames that are not shown would have no alpha
CODINGS = {
    (".mp4", False): Coding("mp4", "libx264", "yuv420p", "aac", _H264, 128_000),
    (".webm", False): Coding("webm", "libvpx-vp9", "yuv420p", "libopus", _VP9, 96_000),
    (".webm", True): Coding("webm", "libvpx-vp9", "yuva420p", "libopus", _CLEAR_VP9, 96_000),
    (".mov", False): Coding("mov", "prores_ks", "yuv422p10le", "pcm_s16le", {"profile": "hq"}),
    (".mov", True): Coding("mov", "prores_ks", "yuva444p10le", "pcm_s16le", {"profile": "4444"}),
}
"""By suffix, and whether the background is transparent."""


def write_video(
    motion: Motion,
    path: str | Path,
    *,
    sound: Sound | None = None,
    options: PictureOptions | None = None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Draw a motion as video with its sound, in the format of the suffix.

    .mp4 is H.264 and AAC, .webm VP9 and Opus, .mov ProRes and linear PCM. Frame i is shown at i /
    fps, where sample i · rate / fps is heard. Odd sides lose a pixel, as codecs demand.

    Raises OutputError for a place that cannot be written, and a background that cannot be read;
    MachineError where no renderer works.
    """
    options = options or PictureOptions()
    wide, high = options.size
    motion = drawn(motion, wide / high)
    size = (wide - wide % 2, high - high % 2)
    coding = CODINGS[Path(path).suffix.lower(), options.transparent]
    with (
        write_atomically(path) as draft,
        open_pictures(motion.head, size, options) as renderer,
        _Encoder(draft, coding, motion, size, sound) as encoder,
    ):
        for done, picture in enumerate(renderer.frames(motion.faces()), 1):
            encoder.add(picture)
            if progress:
                progress(done / motion.frame_count)


@contextlib.contextmanager
def _as_output_errors() -> Iterator[None]:
    """Errors of the system stay what they are; any other of the encoder is an OutputError."""
    from av.error import FFmpegError

    try:
        yield
    except FFmpegError as error:
        if isinstance(error, OSError):
            raise
        raise OutputError(f"video encoder: {error}") from error


class _Encoder:
    """Encodes in a thread of its own while the next frame is drawn."""

    def __init__(
        self,
        path: Path,
        coding: Coding,
        motion: Motion,
        size: tuple[int, int],
        sound: Sound | None,
    ) -> None:
        import av

        self._rate = Fraction(motion.fps).limit_denominator(1001)
        self._coding = coding
        flags = {} if coding.container == "webm" else {"movflags": "+faststart"}
        self._file = av.open(f"file:{path}", "w", format=coding.container, options=flags)
        self._video: Any = self._file.add_stream(coding.video, rate=self._rate)
        self._video.width, self._video.height = size
        self._video.pix_fmt = coding.pixels
        self._video.time_base = 1 / self._rate
        self._video.options = coding.options
        context = self._video.codec_context
        context.color_primaries = context.color_trc = context.colorspace = 1  # BT.709
        context.color_range = 1
        self._audio: Any = None
        if sound is not None:
            self._audio = self._file.add_stream(coding.audio, rate=RATE)
            self._audio.layout = "mono"
            if coding.audio_bits:
                self._audio.bit_rate = coding.audio_bits
            self._blocks: Iterator[NDArray[np.float32]] = sound_blocks(sound)
        self._samples = self._frames = 0
        self._pictures: queue.Queue[NDArray[np.uint8] | None] = queue.Queue(WAITING)
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._work, daemon=True)

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Hand over the next frame; raises what the encoder raised."""
        while True:
            if self._failure:
                raise self._failure
            try:
                return self._pictures.put(picture, timeout=1)
            except queue.Full:
                continue

    def __enter__(self) -> _Encoder:
        self._thread.start()
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self._pictures.put(None) if kind is None else self._abandon()
        self._thread.join()
        whole = kind is None and not self._failure
        try:
            with _as_output_errors():
                if whole:
                    self._finish()
                self._file.close()
        except (OSError, OutputError):
            if whole:
                raise
        if self._failure and kind is None:
            raise self._failure

    def _abandon(self) -> None:
        """Leave nothing for the thread to do but to end."""
        with self._pictures.mutex:
            self._pictures.queue.clear()
            self._pictures.not_full.notify_all()
        self._pictures.put(None)

    def _work(self) -> None:
        import av

        try:
            while (picture := self._pictures.get()) is not None:
                with _as_output_errors():
                    clear = picture.shape[2] == 4
                    pixels = spread_colours(picture) if clear else picture
                    frame = av.VideoFrame.from_ndarray(pixels, format="rgba" if clear else "rgb24")
                    frame = frame.reformat(format=self._coding.pixels, dst_colorspace="ITU709")
                    frame.pts, frame.time_base = self._frames, 1 / self._rate
                    self._frames += 1
                    for packet in self._video.encode(frame):
                        self._file.mux(packet)
                    self._catch_up(self._frames / self._rate)
        except BaseException as error:
            self._failure = error

    def _catch_up(self, seconds: Fraction) -> None:
        """Encode sound up to the picture's time, so that neither piles up."""
        import av

        while self._audio is not None and self._samples < seconds * RATE:
            block = next(self._blocks, None)
            if block is None:
                self._end_sound()
                return
            if not len(block):
                continue
            frame = av.AudioFrame.from_ndarray(block[None], format="fltp", layout="mono")
            frame.sample_rate, frame.pts = RATE, self._samples
            frame.time_base = Fraction(1, RATE)
            self._samples += len(block)
            for packet in self._audio.encode(frame):
                self._file.mux(packet)

    def _end_sound(self) -> None:
        if self._audio is not None:
            for packet in self._audio.encode(None):
                self._file.mux(packet)
            self._audio = None

    def _finish(self) -> None:
        self._catch_up(self._frames / self._rate)
        self._end_sound()
        for packet in self._video.encode(None):
            self._file.mux(packet)


def spread_colours(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """sRGB with straight alpha whose transparent pixels have the colour of what lies next to them.

    Codecs keep colours at half the size and blur them over edges: black beside hair would show as a
    dark seam wherever the video is laid over something light.

    Parameters
    ----------
    picture : (height, width, 4) uint8
        With straight alpha.

    Returns
    -------
    (height, width, 4) uint8
    """
    height, width = picture.shape[:2]
    rows, columns = -(-height // ALPHA_CELL), -(-width // ALPHA_CELL)
    padded = np.zeros((rows * ALPHA_CELL, columns * ALPHA_CELL, 4), np.float32)
    padded[:height, :width] = picture
    padded[..., :3] *= padded[..., 3:]
    sums = padded.reshape(rows, ALPHA_CELL, columns, ALPHA_CELL, 4).sum(axis=(1, 3))
    near = np.pad(sums, ((1, 1), (1, 1), (0, 0)))
    nine = [near[d : d + rows, r : r + columns] for d in range(3) for r in range(3)]
    around = np.sum(nine, axis=0)
    colours = around[..., :3] / np.maximum(around[..., 3:], 1)
    cells = np.clip(colours + 0.5, 0, 255).astype(np.uint8)
    fill = cells.repeat(ALPHA_CELL, axis=0).repeat(ALPHA_CELL, axis=1)[:height, :width]
    spread = picture.copy()
    empty = picture[..., 3] == 0
    spread[empty, :3] = fill[empty]
    return spread
