"""Video: H.264 and AAC, the sound in step with the lips."""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import OutputError
from elocute.export.options import PictureOptions
from elocute.export.render import open_renderer, portrait
from elocute.export.soundtrack import RATE, Sound, sound_blocks
from elocute.files.atomic import write_atomically
from elocute.motion.motion import Motion

CRF = 18  # visually lossless for a face on a plain ground
WAITING = 8  # frames between drawing and encoding


def write_mp4(
    motion: Motion,
    path: str | Path,
    *,
    sound: Sound | None = None,
    options: PictureOptions | None = None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Draw a motion as video with its sound: H.264 and AAC.

    Parameters
    ----------
    motion : Motion
        What is drawn. Frame i is shown at i / fps, where sample i · rate / fps is heard.
    path : str or Path
        The file; one of that name is replaced.
    sound : str, Path or Waveform, optional
        The sound that belongs to the motion.
    options : PictureOptions, optional
        Size, renderer and view. Odd sides lose a pixel, as H.264 demands.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Raises
    ------
    OutputError
        For a place that cannot be written.
    MachineError
        Where no renderer works.
    """
    motion, options = motion.dressed(), options or PictureOptions()
    wide, high = options.size
    size = (wide - wide % 2, high - high % 2)
    camera = portrait(motion.head, options.view)
    with (
        write_atomically(path) as draft,
        open_renderer(motion.head, size, backend=options.backend, camera=camera) as renderer,
        _Encoder(draft, motion, size, sound) as encoder,
    ):
        done = 0
        for block in motion.blocks(60):
            for points in block:
                encoder.add(renderer.frame(points))
                done += 1
                if progress:
                    progress(done / motion.frame_count)


@contextlib.contextmanager
def _told() -> Iterator[None]:
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
        self, path: Path, motion: Motion, size: tuple[int, int], sound: Sound | None
    ) -> None:
        import av

        self._rate = Fraction(motion.fps).limit_denominator(1001)
        self._file = av.open(f"file:{path}", "w", options={"movflags": "+faststart"})
        self._video: Any = self._file.add_stream("libx264", rate=self._rate)
        self._video.width, self._video.height = size
        self._video.pix_fmt = "yuv420p"
        self._video.time_base = 1 / self._rate
        self._video.options = {"crf": str(CRF), "preset": "veryfast", "tune": "animation"}
        context = self._video.codec_context
        context.color_primaries = context.color_trc = context.colorspace = 1  # BT.709
        context.color_range = 1
        self._audio: Any = None
        if sound is not None:
            self._audio = self._file.add_stream("aac", rate=RATE)
            self._audio.layout = "mono"
            self._audio.bit_rate = 128_000
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
            with _told():
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
                with _told():
                    frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                    frame = frame.reformat(format="yuv420p", dst_colorspace="ITU709")
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
