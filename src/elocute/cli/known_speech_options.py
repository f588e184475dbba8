"""Options that say what is known of a speech beside its sound."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from elocute.errors import InputError

TEXT_MAX_BYTES = 1_000_000


@dataclass(frozen=True)
class KnownSpeechOptions:
    """--phones, --phone-set, --text, --text-file and --language as they were given."""

    phones: Path | None
    phone_set: str
    text: str | None
    text_file: Path | None
    language: str

    @property
    def files(self) -> list[Path]:
        """Files that are read."""
        return [path for path in (self.phones, self.text_file) if path is not None]

    def check(self, single: bool) -> None:
        """Raise InputError for several of them, or one for several recordings."""
        given = {"--phones": self.phones, "--text": self.text, "--text-file": self.text_file}
        named = [name for name, value in given.items() if value is not None]
        if len(named) > 1:
            raise InputError.about(named[0], found=f"{named[1]} too", allowed="one of them")
        if named and not single:
            raise InputError.about(
                named[0],
                found="several recordings",
                allowed="one recording",
                remedy="elocute say --table takes a text for each of many",
            )

    def read(self, sound: Path) -> dict[str, Any]:
        """As `animate` takes them. Raises InputError."""
        from elocute.audio.speech_times import read_speech_times

        phones = None
        if self.phones is not None:
            phones = read_speech_times(self.phones, self.phone_set, sound.stem)
        return {"phones": phones, "text": self._text(), "language": self.language}

    def _text(self) -> str | None:
        if self.text_file is None:
            return self.text
        from elocute.files.reading import read_text

        return read_text(
            self.text_file, max_bytes=TEXT_MAX_BYTES, allowed="the text that is said, in UTF-8"
        )
