"""wav, flac, ogg, aiff … by libsndfile, which removes encoder delays itself."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import cast

from elocute.audio.source import (
    BLOCK_VALUES_MAX,
    SHORTFALL_S,
    Array,
    AudioInfo,
    damaged,
    system_name,
)

# Only these come here. libsndfile would search anything named .mp3 for MPEG frames, and its MP3
# decoder prints its doubts to stderr.
HEADS = (b"RIFF", b"RF64", b"riff", b"FORM", b"fLaC", b"OggS", b"caff", b".snd")
LOSSLESS = ("WAV", "WAVEX", "RF64", "W64", "FLAC", "AIFF", "CAF", "AU")


class SoundFileSource:
    """Raises soundfile.LibsndfileError for a format that libsndfile does not know."""

    def __init__(self, path: Path) -> None:
        import soundfile

        self._file = soundfile.SoundFile(system_name(path))
        self._path = path
        rate, frames = self._file.samplerate, self._file.frames
        known = 0 <= frames < 2**62 and rate > 0
        self.promised = frames if known else None
        self.slack = 0 if self._file.format in LOSSLESS else round(SHORTFALL_S * rate)
        self.info = AudioInfo(
            self._file.format,
            self._file.subtype,
            rate,
            self._file.channels,
            frames / rate if known else None,
        )

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
            yield cast(Array, block)

    def close(self) -> None:
        self._file.close()
