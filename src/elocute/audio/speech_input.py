"""Resolves speech as callers give it: a path, samples with a rate, bytes, or an open file."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.audio.decoders import CHANNELS_MAX, FORMATS
from elocute.audio.read import (
    CANCELLING,
    loudest_of_cancelling,
    open_audio,
    resampled_blocks,
)
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.errors import AudioError
from elocute.files.reading import bytes_text, path_of
from elocute.numerics.input_checks import NUMBERS_MAX, array_of, whole_number
from elocute.one_line_repr import brief


class BinaryFile(Protocol):
    """What a file object has to offer."""

    def read(self, size: int, /) -> bytes: ...


SpeechInput = str | os.PathLike[str] | Waveform | bytes | BinaryFile | ArrayLike
"""What `resolve_speech` takes."""

BYTES_MAX = 1_000_000_000
SAMPLES_MAX = NUMBERS_MAX
"""Limit of sound that is not read from a path, so is held in memory whole: 87 min at 48 kHz."""
CHUNK = 1 << 20
BLOCK = 60 * SPEECH_RATE
READS_FREE, READ_BYTES = 100_000, 256
"""How many reads are free before they must give READ_BYTES on average: a file that gives less would
be read for hours."""


def resolve_speech(
    speech: SpeechInput,
    rate: int | None = None,
    channel: int | None = None,
    *,
    track: int | None = None,
    partial: bool = False,
    notes: list[str] | None = None,
) -> Path | Waveform:
    """The sound that a caller means, for functions that take a path or a Waveform.

    Parameters
    ----------
    speech : str, Path, Waveform, bytes, binary file or array
        A path or a Waveform is returned as it is. Otherwise the bytes of a sound file, a binary
        file that gives them, or samples: (sample,) or (sample, channel), floats within ±1 or
        integers of 8, 16 or 32 bits.
    rate : int, optional
        Sample rate of an array, Hz; not allowed for anything else.
    channel : int, optional
        The channel to take of bytes, a file or an array, instead of their mean.
    track : int, optional
        The audio track to take of a file or of bytes, from 0.
    partial : bool
        Whether a file that was cut off is read as far as it goes.
    notes : list of str, optional
        Takes what is to be known about the sound.

    Returns
    -------
    Path or Waveform
        A Waveform of a path, too, where a track is chosen or a part taken.

    Raises
    ------
    AudioError
        For anything that is not sound, or more of it than is held in memory.
    """
    notes = [] if notes is None else notes
    has_rate = isinstance(speech, str | os.PathLike | Waveform | bytes | bytearray | memoryview)
    if not has_rate and not hasattr(speech, "read"):
        if track is not None or partial:
            raise AudioError.about("array", found="`track` or `partial`", allowed="for files")
        return _waveform(speech, rate, channel, notes)
    if rate is not None:
        raise AudioError.about(
            "rate",
            found=f"{brief(rate)} with a sound that has its own",
            allowed="a rate with an array of samples",
        )
    if isinstance(speech, Waveform):
        return speech
    choice = SoundChoice(channel, track, partial)
    if isinstance(speech, str | os.PathLike):
        path = path_of(speech, AudioError)
        if track is None and not partial:
            return path
        return _read_whole(path, str(path), choice, notes)
    return _decoded(speech, choice, notes)


def speech_blocks(
    sound: Path | Waveform, channel: int | None = None, notes: list[str] | None = None
) -> Iterator[NDArray[np.float32]]:
    """What `resolve_speech` gave, block by block: (sample,) float32, mono at 16 kHz.

    notes: takes what is to be known about it. Raises AudioError as `AudioStream.blocks`.
    """
    if not isinstance(sound, Waveform):
        yield from resampled_blocks(sound, SPEECH_RATE, channel, notes=notes)
        return
    samples = sound.resample(SPEECH_RATE).samples
    for first in range(0, len(samples), BLOCK):
        yield samples[first : first + BLOCK]


@dataclass(frozen=True)
class SoundChoice:
    """What of a file is taken; see `resolve_speech`."""

    channel: int | None
    track: int | None
    partial: bool


def _waveform(samples: Any, rate: int | None, channel: int | None, notes: list[str]) -> Waveform:
    array: NDArray[Any] = array_of(samples, "array", error=AudioError, allowed="samples")
    if array.dtype.kind not in "fiu" or array.dtype in (np.int64, np.uint32, np.uint64, np.uint16):
        found = f"samples of type {array.dtype}" if array.ndim else type(samples).__name__
        raise AudioError.about(
            "array",
            found=found,
            allowed="floats within ±1, or integers of 8, 16 or 32 bits as .wav files have them",
            remedy="or give a path, a Waveform, bytes or a binary file",
        )
    if array.size > SAMPLES_MAX:
        raise AudioError.about(
            "array",
            found=f"{array.size} samples",
            allowed=f"up to {SAMPLES_MAX}",
            remedy="give a path",
        )
    if rate is None:
        raise AudioError.about(
            "array",
            found="samples without a rate",
            allowed="a rate in Hz",
            remedy="animate(samples, rate=16000)",
        )
    if array.ndim not in (1, 2) or (array.ndim == 2 and not _has_channels(*array.shape)):
        raise AudioError.about(
            "array",
            found=f"shape {array.shape}",
            allowed=f"(sample,) or (sample, channel) with up to {CHANNELS_MAX} channels",
            remedy="turn (channel, sample) round: samples.T",
        )
    columns = array[:, None] if array.ndim == 1 else array
    if channel is not None and whole_number(channel) not in range(columns.shape[1]):
        raise AudioError.about(
            "array", found=f"no channel {brief(channel)}", allowed=f"0 to {columns.shape[1] - 1}"
        )
    if channel is None and columns.shape[1] > 1:
        floats = _floats(columns).astype(np.float64)
        with np.errstate(all="ignore"):  # what is not finite is refused below
            energies, mixed = (floats**2).sum(axis=0), float((floats.mean(axis=1) ** 2).sum())
        channel = loudest_of_cancelling(energies, mixed)
        notes += [] if channel is None else [CANCELLING.format(channel)]
    chosen = _floats(columns if channel is None else columns[:, channel, None])
    return Waveform(chosen[:, 0] if chosen.shape[1] == 1 else chosen.mean(axis=1), rate)


def _has_channels(samples: int, channels: int) -> bool:
    return 1 <= channels <= min(samples, CHANNELS_MAX)


def _floats(samples: NDArray) -> NDArray:
    """Full scale is ±1; integers are as wide as .wav files have them, those of 8 bits unsigned."""
    if samples.dtype.kind == "f":
        return samples
    middle = 128 if samples.dtype == np.uint8 else 0
    scale = np.float32(2.0 ** (8 * samples.dtype.itemsize - 1))
    return (samples.astype(np.float32) - middle) / scale


def _decoded(source: Any, choice: SoundChoice, notes: list[str]) -> Waveform:
    """Through a temporary file, so that bytes are read and checked as files are."""
    subject = (
        "sound" if not hasattr(source, "read") else str(getattr(source, "name", "file object"))
    )
    with tempfile.TemporaryDirectory(prefix="elocute-") as folder:
        path = Path(folder) / "sound"
        _spool(source, path, subject)
        try:
            return _read_whole(path, subject, choice, notes)
        except AudioError as error:
            raise AudioError(str(error).replace(str(path), subject)) from None


def _spool(source: Any, path: Path, subject: str) -> None:
    try:
        with path.open("wb") as file:
            if isinstance(source, bytes | bytearray | memoryview):
                _check_bytes(subject, len(memoryview(source).cast("B")))
                file.write(source)
                return
            count = reads = 0
            while chunk := source.read(CHUNK):
                if not isinstance(chunk, bytes | bytearray | memoryview):
                    raise AudioError.about(
                        subject,
                        found=f"a file of {type(chunk).__name__}",
                        allowed="a binary file",
                        remedy="open it with mode 'rb'",
                    )
                count, reads = count + memoryview(chunk).nbytes, reads + 1
                _check_bytes(subject, count)
                if reads > READS_FREE + count // READ_BYTES:
                    raise AudioError.about(
                        subject,
                        found=f"{bytes_text(count)} in {reads} reads",
                        allowed=f"{READ_BYTES} bytes a read or more, where there is much to read",
                        remedy="give it as bytes, or through io.BufferedReader",
                    )
                file.write(chunk)
            _check_bytes(subject, count)
    except AudioError:
        raise
    except ValueError as error:  # of a closed file
        raise AudioError.about(subject, found=str(error), allowed="an open binary file") from error
    except OSError as error:
        free = shutil.disk_usage(path.parent).free
        raise AudioError.about(
            subject,
            found=f"cannot be kept in {path.parent.parent} ({error.strerror})",
            allowed=f"at most the {bytes_text(free)} free there",
            remedy="set TMPDIR",
        ) from error


def _check_bytes(subject: str, count: int) -> None:
    if not 0 < count <= BYTES_MAX:
        raise AudioError.about(
            subject,
            found="nothing" if not count else f"more than {bytes_text(BYTES_MAX)}",
            allowed=f"the bytes of a sound file: {FORMATS}",
            remedy="give the path of a larger one" if count else "check where it comes from",
        )


def _read_whole(path: Path, subject: str, choice: SoundChoice, notes: list[str]) -> Waveform:
    with open_audio(path, choice.channel, track=choice.track, partial=choice.partial) as stream:
        pieces, count = [], 0
        for piece in stream.blocks():
            count += len(piece)
            if count > SAMPLES_MAX:
                raise AudioError.about(
                    subject,
                    found=f"more than {SAMPLES_MAX / stream.sample_rate / 60:.0f} minutes",
                    allowed="less, where the sound is held in memory",
                    remedy="give its path, or cut it",
                )
            pieces.append(piece)
        notes += stream.notes
        return Waveform(np.concatenate(pieces), stream.sample_rate)
