"""Reading sound from files: libsndfile first, PyAV for formats that it cannot read.

There is one way through, the stream of blocks; `read_audio` is a stream read to its end. What
a header says is checked before anything is decoded.
"""

from __future__ import annotations

import math
import mmap
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np

from elocute.array_types import Float64Array
from elocute.audio.decoders import (
    AGAIN,
    FORMATS,
    HEADS,
    AudioInfo,
    ContainerDecoder,
    Decoder,
    Float32Array,
    SoundFileDecoder,
    check_format,
    check_track,
    cut_off,
    damaged,
)
from elocute.audio.wav_header import (
    CHUNKS_MAX,
    LONG_UNKNOWN_FROM,
    UNKNOWN_FROM,
    WavHeader,
    WavPart,
    read_wav_header,
)
from elocute.audio.waveform import Waveform, check_rate, check_samples
from elocute.errors import AudioError
from elocute.files.reading import FileKind, open_regular, path_of, stored_bytes
from elocute.numerics.input_checks import whole_number
from elocute.one_line_repr import brief

__all__ = [
    "AudioInfo",
    "AudioStream",
    "open_audio",
    "probe_audio",
    "read_audio",
    "resampled_blocks",
]

START_BYTES = 1 << 16
DURATION_MAX_S = 24 * 3600.0
DURATIONS_ALLOWED = f"{DURATION_MAX_S / 3600:g} hours"
BLOCK_S = 10.0
WHOLE_MAX_BYTES = 400_000_000
WHOLE_TIMES = 100
"""A sound read whole may take as much memory as WHOLE_MAX_BYTES or this many times its file."""
FILE_MAX_BYTES = 2**40
OGG_PAGE_MAX = 27 + 255 + 255 * 255


class AudioStream:
    """An open sound file; iterate `blocks()` once. Use it as a context manager.

    Parameters
    ----------
    path : str or Path
        A sound or video file.
    channel : int, optional
        The channel to take, from 0; all of them are averaged otherwise, but for channels that
        cancel each other, of which the loudest is taken.
    track : int, optional
        The audio track to take, from 0; the first otherwise.
    partial : bool
        Whether a file that was cut off is read as far as it goes.

    Attributes
    ----------
    notes : list of str
        What to know about the sound; grows while it is read.

    Raises
    ------
    AudioError
        For a file that is missing, damaged, cut off, too long or no sound.
    """

    def __init__(
        self,
        path: str | Path,
        channel: int | None = None,
        *,
        track: int | None = None,
        partial: bool = False,
    ) -> None:
        self.path = path_of(path, AudioError)
        self._channel, self._track, self._partial = channel, track, partial
        self.notes: list[str] = []
        self._decoder = open_decoder(self.path, track, partial)
        self.info = self._decoder.info
        try:
            self._check_header()
        except BaseException:
            self.close()
            raise

    @property
    def sample_rate(self) -> int:
        return self.info.sample_rate

    @property
    def channels(self) -> int:
        return self.info.channels

    @property
    def duration_s(self) -> float | None:
        """As the header declares; None where it does not."""
        return self.info.duration_s

    def __enter__(self) -> AudioStream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._decoder.close()

    def _check_header(self) -> None:
        info, channel = self.info, self._channel
        check_format(self.path, info.sample_rate, info.channels)
        if channel is not None and whole_number(channel) not in range(info.channels):
            raise AudioError.about(
                self.path,
                found=f"no channel {brief(channel)}",
                allowed=f"0 to {info.channels - 1}",
                remedy="choose one of these, or none to mix all of them",
            )
        if info.duration_s is not None and info.duration_s > DURATION_MAX_S:
            raise _too_long(self.path, info.duration_s)
        if self._decoder.promised is not None:
            _check_length(self.path, self._decoder.promised)

    def blocks(self, block_s: float = BLOCK_S) -> Iterator[Float32Array]:
        """Decode the sound block by block.

        Parameters
        ----------
        block_s : float
            About how long a block is, s.

        Yields
        ------
        (sample,) float32
            Mono: the mean of all channels, or the one chosen.

        Raises
        ------
        AudioError
            For samples that are not finite or beyond ±100, an early end, or more than 24 hours.
        """
        done, channel = 0, self._channel
        if self.info.tracks and self._track is None:
            self.notes.append(SEVERAL.format(len(self.info.tracks)))
        header = read_wav_header(self.path)
        if header is not None and header.followers:
            self.notes.append(FOLLOWED.format("WAVE", header.followers))
        if channel is None and self.channels > 1:
            channel = self._loudest_of_cancelling()
        for block in self._decoder.blocks(max(1, round(block_s * self.sample_rate))):
            if (channel or 0) >= block.shape[1]:
                raise damaged(self.path, f"{block.shape[1]} channels of {self.channels}")
            chosen = block if channel is None else block[:, channel, None]
            check_samples(self.path, chosen, self.sample_rate, done)
            done += len(chosen)
            if done > DURATION_MAX_S * self.sample_rate:
                raise _too_long(self.path, done / self.sample_rate)
            mono = chosen[:, 0] if chosen.shape[1] == 1 else chosen.mean(axis=1)
            yield np.ascontiguousarray(mono, np.float32)
        self.notes += self._decoder.notes
        promised = self._decoder.promised
        if promised is not None and done < promised - self._decoder.slack:
            if not self._partial:
                raise cut_off(self.path, f"{done} of the {promised} samples promised")
            self._tell_cut_off(done, promised)
        _check_length(self.path, done)

    def _tell_cut_off(self, done: int, promised: int) -> None:
        there, whole = done / self.sample_rate, promised / self.sample_rate
        self.notes.append(f"cut off: {there:.2f} of {whole:.2f} s are there")

    def _loudest_of_cancelling(self) -> int | None:
        """The channel to take in place of a mix in which they cancel; None where they do not."""
        size = max(1, round(BLOCK_S * self.sample_rate))
        scan = open_decoder(self.path, self._track, self._partial)
        energies, mixed, heard = np.zeros(self.channels), 0.0, 0
        try:
            for block in scan.blocks(size):
                if block.shape[1] != self.channels or not np.isfinite(block).all():
                    return None  # told where it is read
                powers = (block.astype(np.float64) ** 2).sum(axis=0)
                energies += powers
                mixed += float((block.mean(axis=1, dtype=np.float64) ** 2).sum())
                heard += len(block) if powers.any() else 0
                if heard > CANCEL_S * self.sample_rate:
                    break
        except AudioError:
            return None
        finally:
            scan.close()
        channel = loudest_of_cancelling(energies, mixed)
        if channel is not None:
            self.notes.append(CANCELLING.format(channel))
        return channel


FOLLOWED = "{} parts behind the first, {}, are left out: join their sounds, not the files"
SEVERAL = "of {} audio tracks the first is taken: `track` takes another"
CANCEL_S = 60.0
"""Seconds of sound, without silence, from which it is judged whether channels cancel."""
CANCELLED = 0.05
"""Channels cancel where their mix has less than this share of the energy of unrelated channels."""
CANCELLING = "its channels cancel each other; the loudest, {}, is taken: `channel` chooses another"


def loudest_of_cancelling(energies: Float64Array, mixed: float) -> int | None:
    """The loudest of channels (channel,) that cancel each other where they are mixed; else None.

    `energies` are those of the channels, `mixed` is that of their mean.
    """
    unrelated = float(energies.sum()) / len(energies) ** 2
    return int(energies.argmax()) if unrelated > 0 and mixed < CANCELLED * unrelated else None


def open_audio(
    path: str | Path,
    channel: int | None = None,
    *,
    track: int | None = None,
    partial: bool = False,
) -> AudioStream:
    """Open a sound file for reading in blocks; parameters and errors as `AudioStream`."""
    return AudioStream(path, channel, track=track, partial=partial)


def probe_audio(path: str | Path) -> AudioInfo:
    """What the header of a sound file says; nothing is decoded.

    Parameters
    ----------
    path : str or Path
        A sound or video file.

    Returns
    -------
    AudioInfo
        Format, codec, sample rate, channels and duration; what tracks there are.

    Raises
    ------
    AudioError
        For a file that is missing or no sound.
    """
    with open_audio(path) as stream:
        return stream.info


def resampled_blocks(
    path: str | Path,
    rate: int,
    channel: int | None = None,
    block_s: float = BLOCK_S,
    notes: list[str] | None = None,
) -> Iterator[Float32Array]:
    """A sound file as mono blocks at another rate.

    Parameters
    ----------
    path : str or Path
        A sound or video file.
    rate : int
        Of the result, Hz.
    channel : int, optional
        The channel to take, from 0; all of them are averaged otherwise.
    block_s : float
        About how long a block is, s. The samples are the same bit for bit however long it is.
    notes : list of str, optional
        Takes what is to be known about the sound.

    Yields
    ------
    (sample,) float32
        Mono.

    Raises
    ------
    AudioError
        As `AudioStream.blocks`.
    """
    import soxr

    rate = check_rate("sample_rate", rate)
    with open_audio(path, channel) as stream:
        if notes is not None:
            stream.notes = notes
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
    """Read a whole sound file.

    It is held in memory whole, up to 400 MB or a hundred times the size of its file; read hours
    with `resampled_blocks`.

    Parameters
    ----------
    path : str or Path
        A sound or video file.
    channel : int, optional
        The channel to take, from 0; all of them are averaged otherwise.
    sample_rate : int, optional
        Resample to this rate, Hz; None keeps the file's own.

    Returns
    -------
    Waveform

    Raises
    ------
    AudioError
        For a file that is missing, damaged, cut off, too long or no sound.
    """
    if sample_rate is None:
        sample_rate = probe_audio(path).sample_rate
    samples = np.concatenate(list(_within_budget(path, sample_rate, channel)))
    _check_length(Path(path), len(samples))
    return Waveform(samples, sample_rate)


def _within_budget(path: str | Path, rate: int, channel: int | None) -> Iterator[Float32Array]:
    taken, budget = 0, None
    for block in resampled_blocks(path, rate, channel):
        taken += block.nbytes
        budget = budget or max(WHOLE_MAX_BYTES, WHOLE_TIMES * _stored(path))
        if taken > budget:
            raise AudioError.about(
                path,
                found=f"more than {budget / 4 / rate / 60:.0f} minutes of sound",
                allowed="as much in memory at once",
                remedy="cut it into parts",
            )
        yield block


def _stored(path: str | Path) -> int:
    with open_regular(path, FileKind("a sound", FILE_MAX_BYTES, AudioError)) as file:
        return stored_bytes(file)


def _check_length(path: Path, count: int) -> None:
    if count < 2:
        raise AudioError.about(
            path,
            found="1 sample" if count == 1 else f"{count} samples",
            allowed="sound of at least 2 samples",
            remedy="record or export it again",
        )


def _too_long(path: Path, seconds: float) -> AudioError:
    return AudioError.about(
        path,
        found=f"{seconds / 3600:.1f} hours",
        allowed=DURATIONS_ALLOWED,
        remedy="cut it into parts",
    )


def open_decoder(path: Path, track: int | None = None, partial: bool = False) -> Decoder:
    """Check the header of a file and open it; nothing is decoded. Raises AudioError."""
    _check_file(path)
    header, part = read_wav_header(path), None
    if header:
        cut = _check_wav(path, header, partial)
        if header.promised_bytes is None or cut or not (header.orderly and header.plain):
            # libsndfile would believe a size of 0, and loops forever in lists whose parts point
            # backwards.
            part = WavPart(path, header)
    with path.open("rb") as file:
        head = file.read(24)
    if not partial:
        _check_outer_size(path, head)
    _check_start(path)
    joined = part is None and _is_joined(path, head)
    if (joined and head.startswith(b"OggS")) or (part is None and not head.startswith(HEADS)):
        return ContainerDecoder(path, track, partial, joined)
    import soundfile

    try:
        opened = SoundFileDecoder(path, cast(BinaryIO | None, part), partial)
    except soundfile.LibsndfileError:
        return ContainerDecoder(path, track, partial)
    if joined:  # FFmpeg would leave out some of it where they meet
        opened.notes.append(FOLLOWED.format("FLAC", "one or more"))
    if header and part is not None and header.promised_bytes is not None:
        opened.promised = header.promised_bytes // part.frame_bytes
    if track is not None:
        check_track(path, track, 1)
    return opened


def _check_start(path: Path) -> None:
    """Refuse what begins with nothing but zeros: decoders would look for sound to its very end."""
    with path.open("rb") as file:
        start = file.read(START_BYTES)
    if len(start) == START_BYTES and not any(start):
        raise AudioError.about(
            path, found="nothing but zeros at its start", allowed=f"a file: {FORMATS}", remedy=AGAIN
        )


def _check_file(path: Path) -> None:
    """Refuse pipes (reading would block), folders and empty files."""
    allowed = f"a file: {FORMATS}"
    with open_regular(
        path, FileKind(allowed, FILE_MAX_BYTES, AudioError, "check the name")
    ) as file:
        if file.read(1):
            return
    raise AudioError.about(path, found="an empty file", allowed=allowed, remedy=AGAIN)


def _check_wav(path: Path, header: WavHeader, partial: bool) -> bool:
    """Refuse what libsndfile would guess, or allocate memory for; whether sound is missing."""
    check_format(path, header.sample_rate, header.channels)
    promised, present = header.promised_bytes, header.present_bytes
    cut = promised is not None and promised > present
    if cut and not partial:
        raise cut_off(path, f"{present} of the {promised} bytes of sound promised")
    return cut


def _check_outer_size(path: Path, head: bytes) -> None:
    """Refuse what libsndfile would not say of many kinds of files: that they were cut short."""
    present, start = path.stat().st_size, 0
    known = UNKNOWN_FROM
    if head[:4] in (b"RIFX", b"FORM"):
        start, size = 8, int.from_bytes(head[4:8], "big")
    elif head.startswith(b".snd"):
        start, size = (int.from_bytes(head[at : at + 4], "big") for at in (4, 8))
    elif head.startswith(b"riff") and len(head) == 24:
        size, known = int.from_bytes(head[16:24], "little"), LONG_UNKNOWN_FROM
    elif head.startswith(b"OggS"):
        size, known = present + _missing_of_last_page(path), LONG_UNKNOWN_FROM
    elif head.startswith(b"caff"):
        size, known = _caf_bytes(path), LONG_UNKNOWN_FROM
    elif head.startswith(b"NIST"):
        size = _sphere_bytes(path)
    else:
        return
    if size < known and start + size > present + 1:  # one byte of padding may lack
        raise cut_off(path, f"{present} of the {start + size} bytes promised")


def _caf_bytes(path: Path) -> int:
    """Where the last chunk of a CAF file ends; beyond any file where its size is unknown."""
    at, end = 8, path.stat().st_size
    with path.open("rb") as file:
        for _ in range(CHUNKS_MAX):
            if at + 12 > end:
                break
            file.seek(at)
            head = file.read(12)
            at += 12 + int.from_bytes(head[4:], "big")
    return at


def _sphere_bytes(path: Path) -> int:
    """How long a SPHERE file is by its header; 0 where that does not say."""
    with path.open("rb") as file:
        head = file.read(1024)
    fields = dict(re.findall(rb"^(\w+) -i (\d{1,9})\s*$", head, re.MULTILINE))
    parts = (b"sample_count", b"channel_count", b"sample_n_bytes")
    if b"shorten" in head or not fields.keys() >= {*parts}:
        return 0
    length = re.match(rb"NIST_1A\s+(\d{1,9})\s", head)
    return math.prod(int(fields[part]) for part in parts) + (int(length[1]) if length else 0)


def _is_joined(path: Path, head: bytes) -> bool:
    """Whether several Ogg or FLAC files stand one behind the other: libsndfile reads the first."""
    begins = {b"OggS": b"OggS\0\2", b"fLaC": b"fLaC\0\0\0\x22"}.get(head[:4])
    if begins is None:
        return False
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        # Ogg's streams that play together begin all together, before any other page.
        first = data.find(b"OggS\0\0") if begins[:1] == b"O" else 0
        return data.rfind(begins) > first >= 0


def _missing_of_last_page(path: Path) -> int:
    """Bytes missing from the last Ogg page; each page states its length."""
    with path.open("rb") as file:
        file.seek(0, os.SEEK_END)
        file.seek(-min(file.tell(), OGG_PAGE_MAX), os.SEEK_END)
        tail = file.read()
    page = tail[tail.rfind(b"OggS\0") :]
    segments = page[26] if len(page) > 26 else 1
    return max(0, 27 + segments + sum(page[27 : 27 + segments]) - len(page))
