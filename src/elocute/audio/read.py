"""Reading sound from files: soundfile first, PyAV for what it does not know.

There is one way through, the stream of blocks; `read_audio` is a stream read to its end.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.audio import wav_header
from elocute.audio.waveform import Waveform, check_rate, check_samples
from elocute.errors import AudioError

Array = NDArray[np.float32]

CHANNELS_MAX = 1024
DURATION_MAX_S = 24 * 3600.0
BLOCK_S = 10.0
FORMATS = "wav, flac, mp3, ogg, opus, m4a, mp4, mkv, webm"
# A compressed stream may end a little before its header says; more is missing than this, it was cut.
SHORTFALL_S = 0.25


@dataclass(frozen=True)
class AudioInfo:
    """What a header says. duration_s is None where it does not."""

    format: str
    codec: str
    sample_rate: int
    channels: int
    duration_s: float | None


class AudioStream:
    """An open sound; iterate `blocks()` once. Use as a context manager."""

    def __init__(self, path: str | Path, channel: int | None = None) -> None:
        self.path = Path(path)
        _check_file(self.path)
        self._source = _open(self.path)
        try:
            self.info = self._source.info
            self._check(channel)
        except BaseException:
            self.close()
            raise
        self._channel = channel

    @property
    def sample_rate(self) -> int:
        return self.info.sample_rate

    @property
    def channels(self) -> int:
        return self.info.channels

    @property
    def duration_s(self) -> float | None:
        return self.info.duration_s

    def __enter__(self) -> AudioStream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._source.close()

    def _check(self, channel: int | None) -> None:
        info = self.info
        check_rate(self.path, info.sample_rate)
        if not 1 <= info.channels <= CHANNELS_MAX:
            raise AudioError.about(
                self.path, found=f"{info.channels} channels", allowed=f"1 to {CHANNELS_MAX}"
            )
        if channel is not None and not 0 <= channel < info.channels:
            raise AudioError.about(
                self.path, found=f"no channel {channel}", allowed=f"0 to {info.channels - 1}"
            )
        if info.duration_s is not None and info.duration_s > DURATION_MAX_S:
            raise _too_long(self.path, info.duration_s)

    def blocks(self, block_s: float = BLOCK_S) -> Iterator[Array]:
        """Mono float32 blocks: the mean of all channels, or the one chosen.

        Raises AudioError for samples that are no sound, an early end, or more than a day.
        """
        done = 0
        for block in self._source.blocks(max(1, round(block_s * self.sample_rate))):
            mono = block.mean(axis=1) if self._channel is None else block[:, self._channel]
            check_samples(self.path, block.max(axis=1), self.sample_rate, done)
            check_samples(self.path, block.min(axis=1), self.sample_rate, done)
            done += len(mono)
            if done > DURATION_MAX_S * self.sample_rate:
                raise _too_long(self.path, done / self.sample_rate)
            yield np.ascontiguousarray(mono, np.float32)
        self._check_end(done)

    def _check_end(self, done: int) -> None:
        if done < 2:
            raise AudioError.about(
                self.path, found=f"{done} samples" if done != 1 else "1 sample",
                allowed="sound of at least 2 samples", remedy="record or export it again",
            )  # fmt: skip
        promised = self._source.promised
        if promised is not None and done < promised - self._source.slack:
            raise AudioError.about(
                self.path,
                found=f"{done} samples where its header promises {promised}: it was cut off",
                allowed="a whole file", remedy="copy or export it again",
            )  # fmt: skip


def open_audio(path: str | Path, channel: int | None = None) -> AudioStream:
    """Open a sound for reading in blocks. Raises AudioError."""
    return AudioStream(path, channel)


def probe_audio(path: str | Path) -> AudioInfo:
    """What the header says, nothing decoded. Raises AudioError."""
    with open_audio(path) as stream:
        return stream.info


def resampled_blocks(
    path: str | Path, rate: int, channel: int | None = None, block_s: float = BLOCK_S
) -> Iterator[Array]:
    """Mono blocks at `rate` Hz; the same samples however long the blocks are."""
    import soxr

    with open_audio(path, channel) as stream:
        if stream.sample_rate == rate:
            yield from stream.blocks(block_s)
            return
        resampler = soxr.ResampleStream(stream.sample_rate, rate, 1, dtype="float32")
        for block in stream.blocks(block_s):
            yield resampler.resample_chunk(block)
        yield resampler.resample_chunk(np.zeros(0, np.float32), last=True)


def read_audio(
    path: str | Path, *, channel: int | None = None, sample_rate: int | None = None
) -> Waveform:
    """A whole sound, mixed down or one channel of it, at its own rate or another.

    Raises AudioError with what was found, what is allowed and what to do.
    """
    if sample_rate is None:
        with open_audio(path, channel) as stream:
            return Waveform(np.concatenate(list(stream.blocks())), stream.sample_rate)
    check_rate("sample_rate", sample_rate)
    return Waveform(np.concatenate(list(resampled_blocks(path, sample_rate, channel))), sample_rate)


def _check_file(path: Path) -> None:
    try:
        if path.is_dir():
            raise AudioError.about(path, found="a folder", allowed=f"a file: {FORMATS}")
        if not path.exists():
            raise AudioError.about(path, found="no such file", allowed=f"a file: {FORMATS}")
        with path.open("rb") as file:
            if not file.read(1):
                raise AudioError.about(
                    path, found="an empty file", allowed=FORMATS, remedy="record or export it again"
                )
    except OSError as error:
        raise AudioError.about(path, found=f"cannot be read ({error.strerror})") from error


def _too_long(path: Path, seconds: float) -> AudioError:
    return AudioError.about(
        path, found=f"{seconds / 3600:.1f} hours", allowed="24 hours", remedy="cut it into parts"
    )


def _open(path: Path) -> _SoundFile | _Container:
    header = wav_header.read_wav_header(path)
    if header:
        _check_wav(path, header)
    import soundfile

    try:
        return _SoundFile(path, header)
    except soundfile.LibsndfileError:
        return _Container(path)


def _check_wav(path: Path, header: wav_header.WavHeader) -> None:
    """What soundfile would guess about, or take memory for."""
    check_rate(path, header.sample_rate)
    if not 1 <= header.channels <= CHANNELS_MAX:
        raise AudioError.about(
            path, found=f"{header.channels} channels", allowed=f"1 to {CHANNELS_MAX}"
        )
    if header.promised_bytes is not None and header.promised_bytes > header.present_bytes:
        size = max(header.frame_bytes, 1)
        raise AudioError.about(
            path,
            found=f"{header.present_bytes // size} samples where its header promises "
            f"{header.promised_bytes // size}: it was cut off",
            allowed="a whole file", remedy="copy or export it again",
        )  # fmt: skip


class _SoundFile:
    """wav, flac, ogg, mp3, aiff … by libsndfile."""

    def __init__(self, path: Path, header: wav_header.WavHeader | None) -> None:
        import soundfile

        self._file = soundfile.SoundFile(path)
        self._path = path
        frames = self._file.frames
        known = 0 < frames < 2**62 and not (header and header.promised_bytes is None)
        self.promised = frames if known else None
        # Lossy streams count whole packets.
        lossless = self._file.format in ("WAV", "WAVEX", "FLAC", "AIFF", "RF64", "W64", "CAF", "AU")
        self.slack = 0 if lossless else round(SHORTFALL_S * self._file.samplerate)
        rate = self._file.samplerate
        duration_s = frames / rate if known and rate > 0 else None
        self.info = AudioInfo(
            self._file.format, self._file.subtype, rate, self._file.channels, duration_s
        )

    def blocks(self, size: int) -> Iterator[Array]:
        import soundfile

        size = min(size, max(1, 20_000_000 // self.info.channels))
        while True:
            try:
                block = self._file.read(size, dtype="float32", always_2d=True)
            except soundfile.LibsndfileError as error:
                raise AudioError.about(
                    self._path, found=f"damaged sound ({error.error_string.rstrip('.')})",
                    allowed="a whole file", remedy="copy or export it again",
                ) from error  # fmt: skip
            if not len(block):
                return
            yield block

    def close(self) -> None:
        self._file.close()


class _Container:
    """m4a, mp4, mkv, webm … by FFmpeg's libraries through PyAV."""

    def __init__(self, path: Path) -> None:
        import av

        self._path = path
        try:
            self._file = av.open(str(path), metadata_errors="ignore")
        except (av.FFmpegError, OSError, ValueError) as error:
            raise AudioError.about(
                path, found="no sound that can be read", allowed=FORMATS,
                remedy="convert it to .wav",
            ) from error  # fmt: skip
        streams = self._file.streams.audio
        if not streams:
            self._file.close()
            raise AudioError.about(
                path, found="no audio track", allowed="a file with sound",
                remedy="add the sound or give its .wav",
            )  # fmt: skip
        self._stream: Any = streams[0]
        context = self._stream.codec_context
        seconds = None
        if self._stream.duration is not None and self._stream.time_base:
            seconds = float(self._stream.duration * self._stream.time_base)
        elif self._file.duration:
            seconds = self._file.duration / 1e6
        self.info = AudioInfo(
            self._file.format.name, context.name, context.sample_rate or 0,
            context.channels or 0, seconds,
        )  # fmt: skip
        rate = self.info.sample_rate
        self.promised = round(seconds * rate) if seconds else None
        self.slack = round(max(SHORTFALL_S, 0.01 * (seconds or 0)) * rate)

    def blocks(self, size: int) -> Iterator[Array]:
        """Decoded frames gathered into blocks; priming samples before time 0 are dropped."""
        import av

        resampler = av.AudioResampler(format="fltp", rate=self.info.sample_rate)
        waiting: list[Array] = []
        count = 0
        try:
            for frame in self._file.decode(self._stream):
                early = 0
                if frame.pts is not None and frame.pts < 0 and frame.time_base:
                    early = math.ceil(-float(frame.pts * frame.time_base) * self.info.sample_rate)
                for ready in resampler.resample(frame):
                    block = ready.to_ndarray().T[early:].astype(np.float32, copy=False)
                    waiting.append(block)
                    count += len(block)
                if count >= size:
                    yield np.concatenate(waiting)
                    waiting, count = [], 0
        except (av.FFmpegError, ValueError) as error:
            raise AudioError.about(
                self._path, found="damaged sound", allowed="a whole file",
                remedy="copy or export it again",
            ) from error  # fmt: skip
        if waiting and count:
            yield np.concatenate(waiting)

    def close(self) -> None:
        with contextlib.suppress(Exception):
            self._file.close()
