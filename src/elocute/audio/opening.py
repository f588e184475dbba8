"""Opening a sound file: everything its header can tell is checked before anything is decoded."""

from __future__ import annotations

import os
from pathlib import Path

from elocute.audio import sndfile, wav_header
from elocute.audio.container import ContainerSource
from elocute.audio.source import AGAIN, FORMATS, Source, check_format, cut_off
from elocute.errors import AudioError
from elocute.files.reading import open_regular

FILE_MAX_BYTES = 2**40
OGG_PAGE_MAX = 27 + 255 + 255 * 255


def open_source(path: Path) -> Source:
    """Check the header of `path` and open it; nothing is decoded. Raises AudioError."""
    _check_file(path)
    header = wav_header.read_wav_header(path)
    if header:
        _check_wav(path, header)
        if header.promised_bytes is None or not header.orderly:
            # libsndfile would take a size of 0 at its word, and runs in circles in lists whose
            # parts lead backwards.
            return ContainerSource(path)
    with path.open("rb") as file:
        head = file.read(24)
    _check_outer_size(path, head)
    if not head.startswith(sndfile.HEADS):
        return ContainerSource(path)
    import soundfile

    try:
        return sndfile.SoundFileSource(path)
    except soundfile.LibsndfileError:
        return ContainerSource(path)


def _check_file(path: Path) -> None:
    """No pipe, which would be waited for, no folder, nothing empty."""
    allowed = f"a file: {FORMATS}"
    with open_regular(
        path, max_bytes=FILE_MAX_BYTES, allowed=allowed, error=AudioError, remedy="check the name"
    ) as file:
        if file.read(1):
            return
    raise AudioError.about(path, found="an empty file", allowed=allowed, remedy=AGAIN)


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
