"""Options that say what is known of a speech beside its sound."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elocute.cli.flags import in_flags
from elocute.cli.settings_options import options_of
from elocute.errors import InputError
from elocute.settings import setting

if TYPE_CHECKING:
    from elocute.speech.times.write import TimedSpeech

TEXT_MAX_BYTES = 1_000_000


@dataclass(frozen=True)
class KnownSpeechOptions:
    """--phones and what belongs to it, --text, --text-file, --transcribe and --language."""

    phones: Path | None = setting(
        None,
        help="File of known times of phones or words, used instead of the recognised phones: "
        "TextGrid, CTM, CSV, or JSON of a speech engine.",
    )
    phone_set: str = setting(
        "auto",
        help="How the phones of that file are written: arpabet, ipa, x-sampa, espeak, pinyin, "
        "romaji, or as visemes of azure, polly, oculus, rhubarb or blair; auto takes the one that "
        "knows them.",
    )
    tier: str = setting("", help="Tier of that file to read, by its name or number from 1.")
    speaker: str = setting("", help="Whose tiers of that file to read.")
    text: str | None = setting(None, help="What is said: sharpens the phones, in their times.")
    text_file: Path | None = setting(
        None, help="File that holds what is said: a text, a script, .srt or .vtt."
    )
    transcribe: bool = setting(
        False,
        help="Recognise the words, and take them as a text that is known; where it is unsure, the "
        "sound decides.",
    )
    recogniser: str | None = setting(
        None,
        help="Whisper model that does it: a folder, or a name whose model this machine has. "
        "[default: base]",
    )
    language: str = setting(
        "auto",
        help="Language of what is said: de, fr, en-GB, zh-CN; auto is the one that is recognised, "
        "for a text en-us.",
    )

    @property
    def files(self) -> list[Path]:
        """Files that are read."""
        return [path for path in (self.phones, self.text_file) if path is not None]

    def check(self, single: bool) -> None:
        """Raise InputError for several of them, or one for several recordings; MachineError where
        there is no model that recognises words."""
        flags = {"--phones": self.phones, "--text": self.text, "--text-file": self.text_file}
        named = [name for name, value in flags.items() if value is not None]
        if len(named) > 1 or (named and self.transcribe):
            other = "--transcribe" if self.transcribe else named[1]
            raise InputError.about(named[0], found=f"{other} too", allowed="one of them")
        if self.recogniser is not None and not self.transcribe:
            raise InputError.about(
                "--recogniser", found="no --transcribe", allowed="a model beside it"
            )
        if self.transcribe:
            from elocute.speech.text.recogniser import DEFAULT_RECOGNISER, recogniser_folder

            recogniser_folder(self.recogniser or DEFAULT_RECOGNISER)
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
        from elocute.speech.times.read import read_speech_times

        phones = None
        if self.phones is not None:
            phones = read_speech_times(
                self.phones, self.phone_set, sound.stem, tier=self.tier, speaker=self.speaker
            )
        known = {"phones": phones, "text": self._given_text, "language": self.language}
        return {**known, **self.recognised}

    @property
    def recognised(self) -> dict[str, Any]:
        """What recognises the words, as `animate` takes it; nothing where they are known."""
        return {"transcribe": self.recogniser or True} if self.transcribe else {}

    def find_phones(self, sound: Path, **taken: Any) -> TimedSpeech:
        """When each phone of a recording is said; notes go to standard error. Raises
        ElocuteError. taken: channel, track and whether a part is taken."""
        from elocute.speech.timed_phones import find_phones

        known = self.read(sound)
        speech = find_phones(sound, times=known.pop("phones"), **known, **taken)
        for note in speech.notes:
            print(f"elocute: {sound}: {in_flags(note)}", file=sys.stderr)
        return speech

    @cached_property
    def _given_text(self) -> str | None:
        if self.text_file is None:
            return self.text
        from elocute.speech.text.script_text import read_transcript

        return read_transcript(self.text_file, max_bytes=TEXT_MAX_BYTES)


def options_of_known_speech(without: Iterable[str] = ()) -> Any:
    """The default of a parameter that stands for all of them, but for those in `without`."""
    return options_of(KnownSpeechOptions, without=without, flags={"transcribe": "--transcribe"})
