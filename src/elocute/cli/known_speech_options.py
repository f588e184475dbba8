"""Options that say what is known of a speech beside its sound."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.audio.voice_settings import VoiceSettings
from elocute.cli.flags import in_flags
from elocute.cli.settings_options import option
from elocute.errors import InputError

if TYPE_CHECKING:
    from elocute.audio.speech_time_files import TimedSpeech

TEXT_MAX_BYTES = 1_000_000
Phones = typer.Option(
    None,
    "--phones",
    help="File of known times of phones or words, used instead of the recognised phones: "
    "TextGrid, CTM, CSV, or JSON of a speech engine.",
)
PhoneSet = typer.Option(
    "auto",
    "--phone-set",
    help="How the phones of that file are written: arpabet, ipa, x-sampa, espeak, pinyin or "
    "romaji; auto takes the one that knows them.",
)
Tier = typer.Option("", "--tier", help="Tier of that file to read, by its name or number from 1.")
Speaker = typer.Option("", "--speaker", help="Whose tiers of that file to read.")
Text = typer.Option(None, "--text", help="What is said: sharpens the phones, in their times.")
TextFile = typer.Option(
    None, "--text-file", help="File that holds what is said: a text, a script, .srt or .vtt."
)
Language = option(VoiceSettings, "language")


@dataclass(frozen=True)
class KnownSpeechOptions:
    """--phones and what belongs to it, --text, --text-file and --language as they were given."""

    phones: Path | None
    phone_set: str
    text: str | None
    text_file: Path | None
    language: str
    tier: str = ""
    speaker: str = ""

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
        for name in ("tier", "speaker"):
            if getattr(self, name) and self.phones is None:
                raise InputError.about(
                    f"--{name}", found="no --phones", allowed="a file of phones beside it"
                )
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
            phones = read_speech_times(
                self.phones, self.phone_set, sound.stem, tier=self.tier, speaker=self.speaker
            )
        return {"phones": phones, "text": self._given_text, "language": self.language}

    def find_phones(self, sound: Path, **taken: Any) -> TimedSpeech:
        """When each phone of a recording is said; notes go to standard error. Raises
        ElocuteError. taken: channel, track and whether a part is taken."""
        from elocute.timed_speech import find_phones

        known = self.read(sound)
        found = find_phones(
            sound,
            text=known["text"],
            times=known["phones"],
            language=self.language,
            **taken,
        )
        for note in found.notes:
            print(f"elocute: {sound}: {in_flags(note)}", file=sys.stderr)
        return found

    @property
    def written_text(self) -> str:
        """What is said with its marks, "" where no text was given. Raises InputError for a file
        that is no text."""
        from elocute.audio.captions import said_text

        return said_text(self._given_text or "")[0]

    @cached_property
    def _given_text(self) -> str | None:
        if self.text_file is None:
            return self.text
        from elocute.audio.script_text import read_transcript

        return read_transcript(self.text_file, max_bytes=TEXT_MAX_BYTES)
