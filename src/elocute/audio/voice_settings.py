"""The voice that a text is spoken with."""

from __future__ import annotations

import re
from dataclasses import dataclass

from elocute.errors import InputError
from elocute.settings import check_settings, described, setting

TEXT_MAX = 20_000
"""Letters of one text: twenty minutes or more."""
LANGUAGE = re.compile(r"[A-Za-z]{2,8}(-[A-Za-z0-9]{1,8}){0,4}")
VOICE = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,40}|")


@described
@dataclass(frozen=True)
class VoiceSettings:
    """The voice that a text is spoken with.

    Raises
    ------
    InputError
        For a number outside its range, or a name that no voice can have.
    """

    language: str = setting("en-us", help="Language of the text, as espeak-ng names it: de, fr.")
    voice: str = setting("", help="Voice of espeak-ng: f2, m3, Annie; its own for each language.")
    words_per_minute: int = setting(165, low=80, high=450, help="How fast the text is spoken.")
    pitch: int = setting(50, low=0, high=99, help="Pitch of the voice.")

    def __post_init__(self) -> None:
        check_settings(self)
        for name, pattern, allowed in (
            ("language", LANGUAGE, "a code such as en-us, de or pt-br"),
            ("voice", VOICE, "a name such as f2, m3 or Annie"),
        ):
            if pattern.fullmatch(getattr(self, name)) is None:
                given = getattr(self, name)
                raise InputError.about(f"`{name}`", found=repr(given[:60]), allowed=allowed)
