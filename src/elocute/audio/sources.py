"""What opens and decodes a sound file: libsndfile, or FFmpeg's libraries for the rest."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from elocute.audio import wav_header
from elocute.audio.waveform import check_rate
from elocute.errors import AudioError

Array = NDArray[np.float32]

CHANNELS_MAX = 1024
FORMATS = "wav, flac, mp3, ogg, opus, m4a, mp4, mkv, webm"
AGAIN = "copy or export it again"
BLOCK_VALUES_MAX = 20_000_000  # samples times channels held at once: 80 MB
# Lossy streams count whole packets; one that ends earlier than this was cut off.
SHORTFALL_S = 0.1
# Only these go to libsndfile: it would search anything else named .mp3 for MPEG frames.
SNDFILE_HEADS = (b"RIFF", b"RF64", b"riff", b"FORM", b"fLaC", b"OggS", b"caff", b".snd", b"ID3")
LOSSLESS = ("WAV", "WAVEX", "RF64", "W64", "FLAC", "AIFF", "CAF", "AU")
# Only sound and video: FFmpeg would also follow playlists, which name other files.
DEMUXERS = (
    "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,ogg,mp3,aac,ac3,eac3,amr,wav,w64,aiff,flac,avi,flv,asf,"
    "mpegts,mpeg,caf,au,wv,ape,tta,mxf,gsm,mpegvideo"
)
OGG_PAGE_MAX = 27 + 255 + 255 * 255


@dataclass(frozen=True)
class AudioInfo:
    """What a header says. duration_s is None where it does not."""

    format: str
    codec: str
    sample_rate: int
    channels: int
    duration_s: float | None


class Source(Protocol):
    """An open sound. `promised` samples per channel, give or take `slack`; None if unknown."""

    info: AudioInfo
    promised: int | None
    slack: int

    def blocks(self, size: int) -> Iterator[Array]:
        """(sample, channel) blocks of about `size` samples."""
        ...

    def close(self) -> None: ...


def open_source(path: Path) -> Source:
    """Check the header of `path` and open it; nothing is decoded. Raises AudioError."""
    _check_file(path)
    header = wav_header.read_wav_header(path)
    if header:
        _check_wav(path, header)
        if header.promised_bytes is None:
            return ContainerSource(path)  # libsndfile would take a size of 0 at its word
    with path.open("rb") as file:
        head = file.read(24)
    _check_outer_size(path, head)
    mpeg_frame = head[:1] == b"\xff" and head[1] >= 0xE0 if len(head) > 1 else False
    if not (head.startswith(SNDFILE_HEADS) or mpeg_frame):
        return ContainerSource(path)
    import soundfile

    try:
        return SoundFileSource(path)
    except soundfile.LibsndfileError:
        return ContainerSource(path)


def check_format(path: Path, sample_rate: int, channels: int) -> None:
    """Raise AudioError for a rate or a number of channels that no recording has."""
    check_rate(path, sample_rate)
    if not 1 <= channels <= CHANNELS_MAX:
        raise AudioError.about(
            path, found=f"{channels} channels", allowed=f"1 to {CHANNELS_MAX}", remedy=AGAIN
        )


def _check_file(path: Path) -> None:
    found = None
    try:
        if path.is_dir():
            found = "a folder"
        elif not path.exists():
            found = "no such file"
        elif not path.is_file():
            found = "no regular file"
        else:
            with path.open("rb") as file:
                found = None if file.read(1) else "an empty file"
    except OSError as error:
        raise AudioError.about(
            path, found=f"cannot be read ({error.strerror})", allowed="a file you may read",
            remedy="check its permissions",
        ) from error  # fmt: skip
    if found:
        remedy = AGAIN if found == "an empty file" else "check the name"
        raise AudioError.about(path, found=found, allowed=f"a file: {FORMATS}", remedy=remedy)


def _check_wav(path: Path, header: wav_header.WavHeader) -> None:
    """What libsndfile would guess about, or take memory for."""
    check_format(path, header.sample_rate, header.channels)
    if header.promised_bytes is not None and header.promised_bytes > header.present_bytes:
        raise cut_off(
            path, f"{header.present_bytes} of the {header.promised_bytes} bytes of sound promised"
        )


def _check_outer_size(path: Path, head: bytes) -> None:
    """AIFF, Wave64 and Ogg: what libsndfile would read silently although its end is missing."""
    present = path.stat().st_size
    if head.startswith(b"FORM") and head[8:11] == b"AIF":
        promised = int.from_bytes(head[4:8], "big") + 8
        if promised - 8 in wav_header.UNKNOWN_SIZES:
            return
    elif head.startswith(b"riff") and len(head) == 24:
        promised = int.from_bytes(head[16:24], "little")
    elif head.startswith(b"OggS"):
        promised = present + _missing_of_last_page(path)
    else:
        return
    if promised > present + 1:  # one byte of padding may lack
        raise cut_off(path, f"{present} of the {promised} bytes promised")


def _missing_of_last_page(path: Path) -> int:
    """Bytes that the last Ogg page lacks: each page says how long it is."""
    with path.open("rb") as file:
        file.seek(0, os.SEEK_END)
        file.seek(-min(file.tell(), OGG_PAGE_MAX), os.SEEK_END)
        tail = file.read()
    page = tail[tail.rfind(b"OggS\0") :]
    segments = page[26] if len(page) > 26 else 1
    return max(0, 27 + segments + sum(page[27 : 27 + segments]) - len(page))


def cut_off(path: Path, found: str) -> AudioError:
    return AudioError.about(
        path, found=f"{found}: it was cut off", allowed="a whole file", remedy=AGAIN
    )


def damaged(path: Path, reason: object) -> AudioError:
    return AudioError.about(
        path, found=f"damaged sound ({str(reason).rstrip('.')})", allowed="a whole file",
        remedy=AGAIN,
    )  # fmt: skip


class SoundFileSource:
    """wav, flac, ogg, mp3, aiff … by libsndfile, which removes encoder delays itself."""

    def __init__(self, path: Path) -> None:
        import soundfile

        self._file = soundfile.SoundFile(path)
        self._path = path
        rate, frames = self._file.samplerate, self._file.frames
        known = 0 <= frames < 2**62 and rate > 0
        self.promised = frames if known else None
        self.slack = 0 if self._file.format in LOSSLESS else round(SHORTFALL_S * rate)
        self.info = AudioInfo(
            self._file.format, self._file.subtype, rate, self._file.channels,
            frames / rate if known else None,
        )  # fmt: skip

    def blocks(self, size: int) -> Iterator[Array]:
        import soundfile

        size = max(1, min(size, BLOCK_VALUES_MAX // self.info.channels))
        while True:
            try:
                block = self._file.read(size, dtype="float32", always_2d=True)
            except soundfile.LibsndfileError as error:
                raise damaged(self._path, error.error_string) from error
            if not len(block):
                return
            yield block

    def close(self) -> None:
        self._file.close()


class ContainerSource:
    """m4a, mp4, mkv, webm … by FFmpeg's libraries through PyAV; the first audio track.

    FFmpeg removes encoder delays that the container states. Time zero is the start of the
    container: where sound begins after the picture, silence goes before it.
    """

    def __init__(self, path: Path) -> None:
        import av

        self._path = path
        options = {"format_whitelist": DEMUXERS, "protocol_whitelist": "file"}
        try:
            self._file = av.open(f"file:{path}", metadata_errors="ignore", options=options)
        except (av.FFmpegError, OSError, ValueError) as error:
            raise _unreadable(path) from error
        streams = self._file.streams.audio
        if not streams:
            self._file.close()
            raise AudioError.about(
                path, found="no audio track", allowed="a file with sound",
                remedy="add the sound or give its .wav",
            )  # fmt: skip
        self._stream: Any = streams[0]
        context = self._stream.codec_context
        rate, seconds = context.sample_rate or 0, self._seconds()
        self._zero_s = max(0.0, (self._file.start_time or 0) / 1e6)
        self.info = AudioInfo(
            self._file.format.name, context.name, rate, context.channels or 0, seconds
        )
        promised_s = self._promised_s(seconds)
        self.promised = round(promised_s * rate) if promised_s else None
        self.slack = round((SHORTFALL_S + 0.002 * (seconds or 0)) * rate)

    def _seconds(self) -> float | None:
        if self._stream.duration is not None and self._stream.time_base:
            return float(self._stream.duration * self._stream.time_base)
        return self._file.duration / 1e6 if self._file.duration else None

    def _promised_s(self, seconds: float | None) -> float | None:
        """How long the audio track says it is; elsewhere FFmpeg guesses from the bit rate."""
        if self._file.format.name.startswith("mov"):
            return seconds
        if not self._file.format.name.startswith("matroska"):
            return None
        with contextlib.suppress(KeyError, ValueError):
            hours, minutes, rest = self._stream.metadata["DURATION"].split(":")
            return int(hours) * 3600 + int(minutes) * 60 + float(rest)
        return seconds if len(self._file.streams) == 1 else None

    def blocks(self, size: int) -> Iterator[Array]:
        size = max(1, min(size, BLOCK_VALUES_MAX // self.info.channels))
        waiting: list[Array] = []
        count = 0
        for piece in self._pieces(size):
            waiting.append(piece)
            count += len(piece)
            if count >= size:
                yield np.concatenate(waiting)
                waiting, count = [], 0
        if count:
            yield np.concatenate(waiting)

    def _pieces(self, size: int) -> Iterator[Array]:
        """Decoded frames as (sample, channel), placed so that the first sample is at time zero."""
        import av

        resampler = av.AudioResampler(format="fltp", rate=self.info.sample_rate)
        early = None
        try:
            for frame in self._file.decode(self._stream):
                if early is None:
                    early = self._early(frame)
                    yield from self._silence(-early, size)
                for ready in resampler.resample(frame):
                    piece = ready.to_ndarray().T.astype(np.float32, copy=False)
                    yield piece[max(0, early) :]
                    early = max(0, early - len(piece))
        except (av.FFmpegError, ValueError) as error:
            raise damaged(self._path, "its packets cannot be decoded") from error

    def _early(self, frame: Any) -> int:
        """Samples of `frame` that lie before time zero; negative where it starts after it."""
        if frame.pts is None or not frame.time_base:
            return 0
        seconds = self._zero_s - float(frame.pts * frame.time_base)
        return math.floor(seconds * self.info.sample_rate + 0.5)

    def _silence(self, count: int, size: int) -> Iterator[Array]:
        for start in range(0, count, size):
            yield np.zeros((min(size, count - start), self.info.channels), np.float32)

    def close(self) -> None:
        with contextlib.suppress(Exception):
            self._file.close()


def _unreadable(path: Path) -> AudioError:
    with path.open("rb") as file:
        head = file.read(12)
    if head[4:8] == b"ftyp":
        return cut_off(path, "an MP4 file without its index")
    return AudioError.about(
        path, found="no sound that can be read", allowed=FORMATS, remedy="convert it to .wav"
    )
