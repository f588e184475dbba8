"""Decoders of sound: libsndfile, or FFmpeg's libraries through PyAV."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Protocol, cast

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.wav_header import tag_bytes
from elocute.audio.waveform import check_rate
from elocute.errors import AudioError
from elocute.files.media import open_media
from elocute.numerics.input_checks import whole_number
from elocute.one_line_repr import brief

FORMATS = "wav, flac, mp3, ogg, opus, m4a, mp4, mkv, webm"
AGAIN = "copy or export it again"
CHANNELS_MAX = 1024
BLOCK_VALUES_MAX = 20_000_000  # samples times channels held at once: 80 MB
PIECE = 1024  # samples at a time of a file that was cut off
# Lossy streams count whole packets; one that ends earlier than this was cut off.
SHORTFALL_S = 0.1
# Only these go to libsndfile. It would search anything named .mp3 for MPEG frames, and its MP3
# decoder prints warnings to stderr.
HEADS = (b"RIFF", b"RIFX", b"RF64", b"riff", b"FORM", b"fLaC", b"OggS", b"caff", b".snd")
HEADS += (b"NIST",)  # SPHERE, as TIMIT has it
JOINED = (
    "several files, one behind the other: each but the first may begin some hundredths of a second "
    "late; join their sounds, not the files"
)
GAP_S = 0.1
"""Times of packets that lie further behind the sound before them are a gap in it."""
GAPS = "of the sound {:.2f} s are missing in between, and are silence"
LOSSLESS = ("WAV", "WAVEX", "RF64", "W64", "FLAC", "AIFF", "CAF", "AU")
# FFmpeg decodes a picture or two to find where they start; 8K is 33 million.
PIXELS_MAX = 40_000_000
# Silence before the first sample: a few bytes can declare a day of it.
SILENCE_MAX_S = 600.0
SILENCE_VALUES_MAX = 200_000_000


@dataclass(frozen=True)
class AudioInfo:
    """What the header of a sound file declares; duration_s is None where it does not.

    tracks: what each audio track is, where there are several.
    """

    format: str
    codec: str
    sample_rate: int
    channels: int
    duration_s: float | None
    tracks: tuple[str, ...] = ()


class Decoder(Protocol):
    """An open sound. `promised` samples per channel, give or take `slack`; None if unknown.

    notes: what to know of its sound, complete when the last block was given.
    """

    info: AudioInfo
    promised: int | None
    slack: int
    notes: list[str]

    def blocks(self, size: int) -> Iterator[Float32Array]:
        """(sample, channel) blocks of about `size` samples."""
        ...

    def close(self) -> None: ...


def system_name(path: Path) -> Any:
    """A path as libsndfile's binding takes it, also where the name is not UTF-8."""
    return str(path) if os.name == "nt" else os.fsencode(path)


def check_format(path: Path, sample_rate: int, channels: int) -> None:
    """Raise AudioError for a rate or a number of channels that no recording has."""
    check_rate(path, sample_rate)
    if not 1 <= channels <= CHANNELS_MAX:
        raise AudioError.about(
            path, found=f"{channels} channels", allowed=f"1 to {CHANNELS_MAX}", remedy=AGAIN
        )


def cut_off(path: Path, length: str) -> AudioError:
    return AudioError.about(
        path,
        found=f"{length}: it was cut off",
        allowed="a whole file",
        remedy=f"{AGAIN}, or take what is there with `partial`",
    )


def damaged(path: Path, reason: object) -> AudioError:
    return AudioError.about(
        path,
        found=f"damaged sound ({str(reason).rstrip('.')})",
        allowed="a whole file",
        remedy=f"{AGAIN}, or take what is there with `partial`",
    )


class SoundFileDecoder:
    """A decoder of libsndfile; LibsndfileError where it does not support the format.

    part: what to read in the file's place, where its header does not say what is there.
    """

    def __init__(self, path: Path, part: BinaryIO | None = None, partial: bool = False) -> None:
        import soundfile

        self._file = soundfile.SoundFile(system_name(path) if part is None else part)
        self._path, self._partial = path, partial
        self.notes: list[str] = []
        rate, frames = self._file.samplerate, self._file.frames
        known = 0 <= frames < 2**62 and rate > 0
        self.promised = frames if known else None
        exact = self._file.format in LOSSLESS and not self._file.subtype.startswith("MPEG")
        self.slack = 0 if exact else round(SHORTFALL_S * rate)
        self.info = AudioInfo(
            format=self._file.format,
            codec=self._file.subtype,
            sample_rate=rate,
            channels=self._file.channels,
            duration_s=frames / rate if known else None,
        )

    def blocks(self, size: int) -> Iterator[Float32Array]:
        import soundfile

        size = max(1, min(size, BLOCK_VALUES_MAX // self.info.channels))
        if self._partial:
            size = min(size, PIECE)  # a block that fails is lost whole
        while True:
            try:
                block = self._file.read(size, dtype="float32", always_2d=True)
            except soundfile.LibsndfileError as error:
                if self._partial:
                    return
                raise damaged(self._path, error.error_string) from error
            if not len(block):
                return
            yield cast(Float32Array, block)

    def close(self) -> None:
        self._file.close()


class ContainerDecoder:
    """An audio track of a container, the first unless another is named. Raises AudioError.

    FFmpeg removes encoder delays that the container states. Time zero is the start of the
    container: where sound begins after the picture, silence goes before it.
    """

    def __init__(
        self, path: Path, track: int | None = None, partial: bool = False, joined: bool = False
    ) -> None:
        self._path, self._track, self._partial = path, track or 0, partial
        self.notes = [JOINED] if joined else []
        try:
            self._file = open_media(path, pixels_max=PIXELS_MAX)
        except ImportError:
            raise  # PyAV itself is broken, not the file
        except Exception as error:  # PyAV has no common base for what a file makes it raise
            raise _unreadable(path) from error
        try:
            self._look()
        except BaseException:
            self.close()
            raise

    def _look(self) -> None:
        """Find the audio track and read what it declares. Raises AudioError."""
        path = self._path
        streams = self._file.streams.audio
        if not streams:
            raise AudioError.about(
                path,
                found="no audio track",
                allowed="a file with sound",
                remedy="add the sound or give its .wav",
            )
        check_track(path, self._track, len(streams))
        self._stream: Any = streams[self._track]
        context = self._stream.codec_context
        if context is None:
            raise AudioError.about(
                path,
                found="sound in a codec that FFmpeg does not support",
                allowed=FORMATS,
                remedy="convert it to .wav",
            )
        self._zero_s = max(0.0, (self._file.start_time or 0) / 1e6)
        self._is_matroska = self._file.format.name.startswith("matroska")
        rate, seconds = context.sample_rate or 0, self._seconds()
        self.info = AudioInfo(
            format=self._file.format.name,
            codec=context.name,
            sample_rate=rate,
            channels=context.channels or 0,
            duration_s=None if self.notes else seconds,  # that of the first
            tracks=tuple(map(_told, streams)) if len(streams) > 1 else (),
        )
        promised_s = self._promised_s(seconds)
        self.promised = round(promised_s * rate) if promised_s else None
        self.slack = round((SHORTFALL_S + 0.002 * (seconds or 0)) * rate)

    def _seconds(self) -> float | None:
        """How long the sound is from time zero on, silence before it included."""
        stream = self._stream
        if stream.duration is not None and stream.time_base:
            late_s = float((stream.start_time or 0) * stream.time_base) - self._zero_s
            return float(stream.duration * stream.time_base) + max(0.0, late_s)
        end_s = self._file.duration / 1e6 if self._file.duration else None
        return self._from_zero(end_s) if end_s and self._is_matroska else end_s

    def _from_zero(self, end_s: float) -> float:
        """When something of Matroska ends, which counts from 0 whenever it begins."""
        return max(0.0, end_s - self._zero_s)

    def _promised_s(self, seconds: float | None) -> float | None:
        """The length that the track declares; elsewhere FFmpeg guesses it from the bit rate."""
        kind = self._file.format.name
        if kind.startswith("mov") or (kind == "mp3" and _has_frame_count(self._path)):
            return seconds
        if not self._is_matroska:
            return None
        with contextlib.suppress(KeyError, ValueError):
            hours, minutes, rest = self._stream.metadata["DURATION"].split(":")
            stated = float(hours) * 3600 + float(minutes) * 60 + float(rest)
            if 0 <= stated < 1e9:
                return self._from_zero(stated)
        return seconds if len(self._file.streams) == 1 else None

    def blocks(self, size: int) -> Iterator[Float32Array]:
        size = max(1, min(size, BLOCK_VALUES_MAX // self.info.channels))
        waiting: list[Float32Array] = []
        count = 0
        for piece in self._pieces(size):
            waiting.append(piece)
            count += len(piece)
            if count >= size:
                yield np.concatenate(waiting)
                waiting, count = [], 0
        if count:
            yield np.concatenate(waiting)

    def _pieces(self, size: int) -> Iterator[Float32Array]:
        """Decoded frames as (sample, channel), placed so that the first sample is at time zero."""
        import av

        # Packed samples: PyAV reads planes of more than eight channels from where none are.
        resampler = av.AudioResampler(format="flt", rate=self.info.sample_rate)
        early, place, gaps = None, 0.0, 0
        is_timed = self._file.format.name != "avi"  # which counts packets
        try:
            for frame in self._frames():
                channels = frame.layout.nb_channels
                if early is None:
                    early = self._early(frame)
                    place = float(-early)
                    yield from self._silence(-early, channels, size)
                late = round(-self._early(frame) - place)
                if late > GAP_S * self.info.sample_rate and is_timed and not self.notes:
                    yield from self._silence(late, channels, size)
                    gaps, place = gaps + late, place + late
                place += frame.samples * self.info.sample_rate / frame.sample_rate
                for ready in resampler.resample(frame):
                    piece = ready.to_ndarray().reshape(-1, channels).astype(np.float32, copy=False)
                    yield piece[max(0, early) :]
                    early = max(0, early - len(piece))
            if gaps:
                self.notes.append(GAPS.format(gaps / self.info.sample_rate))
        except AudioError:
            raise
        except Exception as error:  # PyAV has no common base for what a damaged file makes it raise
            if self._partial and early is not None:
                return
            raise damaged(self._path, "its packets cannot be decoded") from error

    def _frames(self) -> Iterator[Any]:
        """Decoded frames; of MP3 files that were joined, without the tags between them."""
        for packet in self._file.demux(self._stream):
            if self.info.codec.startswith("mp3") and bytes(packet)[:3] == b"ID3":
                self.notes, self.promised = [JOINED], None
            else:
                yield from packet.decode()

    def _early(self, frame: Any) -> int:
        """Samples of `frame` that lie before time zero; negative where it starts after it."""
        if frame.pts is None or not frame.time_base:
            return 0
        seconds = self._zero_s - float(frame.pts * frame.time_base)
        early = math.floor(seconds * self.info.sample_rate + 0.5)
        # Matroska's clock has milliseconds: what ends within one of time zero ends there.
        tick = float(frame.time_base) * self.info.sample_rate
        ends_at_zero = abs(early - frame.samples) <= tick < frame.samples / 2
        return frame.samples if ends_at_zero else early

    def _silence(self, count: int, channels: int, size: int) -> Iterator[Float32Array]:
        seconds = count / self.info.sample_rate
        if seconds > SILENCE_MAX_S or count * channels > SILENCE_VALUES_MAX:
            raise AudioError.about(
                self._path,
                found=f"sound that begins after {seconds:.0f} s of nothing",
                allowed=f"{SILENCE_MAX_S:.0f} s",
                remedy=AGAIN,
            )
        for start in range(0, count, size):
            yield np.zeros((min(size, count - start), channels), np.float32)

    def close(self) -> None:
        with contextlib.suppress(Exception):
            self._file.close()


def check_track(path: Path, track: int | None, count: int) -> None:
    """Raise AudioError for a track that a file does not have."""
    if track is not None and whole_number(track) not in range(count):
        raise AudioError.about(
            path,
            found=f"no track {brief(track)}",
            allowed=f"0 to {count - 1}" if count > 1 else "0, the only one",
            remedy="`elocute info` lists them",
        )


def _told(stream: Any) -> str:
    """What an audio track is, in words."""
    context, metadata = stream.codec_context, stream.metadata
    if context is None:
        return "a codec that FFmpeg does not support"
    channels = f"{context.channels} channel{'s' if context.channels != 1 else ''}"
    description = f"{context.name}, {context.sample_rate} Hz, {channels}"
    more = [metadata[key][:60] for key in ("language", "title") if metadata.get(key)]
    return f"{description} ({', '.join(more)})" if more else description


def _has_frame_count(path: Path) -> bool:
    """Whether the first frame of an MP3 file counts the others (a Xing or Info header)."""
    with path.open("rb") as file:
        file.seek(tag_bytes(file))
        first = file.read(2048)
    return b"Xing" in first or b"Info" in first


def _unreadable(path: Path) -> AudioError:
    with path.open("rb") as file:
        head = file.read(12)
    if head[4:8] == b"ftyp":
        return AudioError.about(
            path,
            found="an MP4 file whose index is missing: was it cut off?",
            allowed="a whole file",
            remedy=AGAIN,
        )
    return AudioError.about(
        path, found="no sound that can be read", allowed=FORMATS, remedy="convert it to .wav"
    )
