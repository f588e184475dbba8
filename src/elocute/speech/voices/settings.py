"""Settings of the voice that speaks a text."""

from __future__ import annotations

import re
from dataclasses import dataclass

from elocute.errors import InputError
from elocute.settings import check_settings, described, setting

ENGINES = ("espeak",)
"""Speech synthesisers: modules beside this one, each with a function `speak` (a `Voice`)."""
TEXT_MAX = 20_000
"""Letters of one text: twenty minutes or more."""
LANGUAGE = re.compile(r"[A-Za-z]{2,8}([-_][A-Za-z0-9]{1,8}){0,4}([.@][A-Za-z0-9-]{1,16})?")
# As operating systems, browsers and speech engines call languages that espeak-ng calls otherwise.
_OTHER_NAMES = {
    "zh": "cmn",
    "zh-hk": "yue",
    "zh-yue": "yue",
    "zh-hant-hk": "yue",
    "jp": "ja",
    "cn": "cmn",
    "no": "nb",
    "nn": "nb",
    "iw": "he",
    "in": "id",
    "kr": "ko",
    "cz": "cs",
    "pt-pt": "pt",
    "en-au": "en-gb",
    "en-nz": "en-gb",
    "en-in": "en-gb",
    "en-za": "en-gb",
    "en-ie": "en-gb",
    "en-uk": "en-gb",
    "en-ca": "en-us",
    "es-es": "es",
    "fr-ca": "fr-fr",
    "sh": "sr",
    **{f"es-{land}": "es-419" for land in ("mx", "us", "ar", "co", "cl", "pe", "ve", "latam")},
}
VOICE = re.compile(r"[A-Za-z0-9][A-Za-z0-9 _-]{0,40}|")


def language_names(language: str) -> list[str]:
    """What a language may be called by espeak-ng, in small letters, the nearest first.

    It may come as anything calls it: de, de-DE, en_US.UTF-8, zh-Hans-CN. It is given as it is, or
    by espeak-ng's own name; then without its last parts.
    """
    parts = re.split("[-_]", re.split("[.@]", language.lower())[0])
    names = ["-".join(parts[:count]) for count in range(len(parts), 0, -1)]
    return list(dict.fromkeys(_OTHER_NAMES.get(name, name) for name in names))


@described
@dataclass(frozen=True)
class VoiceSettings:
    """The voice that a text is spoken with.

    Raises
    ------
    InputError
        For a number outside its range, or a name that no voice can have.
    """

    language: str = setting("en-us", help="Language of the text: de, fr, en-GB, zh-CN.")
    voice: str = setting("", help="Voice of espeak-ng: f2, m3, Annie; its own for each language.")
    words_per_minute: int = setting(165, low=80, high=450, help="Words spoken in a minute.")
    pitch: int = setting(50, low=0, high=99, help="Pitch of the voice.")
    engine: str = setting("espeak", choices=ENGINES, help="Speech synthesiser.")

    def __post_init__(self) -> None:
        check_settings(self)
        for name, pattern, allowed in (
            ("language", LANGUAGE, "a code such as en-us, de or pt-br"),
            ("voice", VOICE, "a name such as f2, m3 or Annie"),
        ):
            if pattern.fullmatch(getattr(self, name)) is None:
                given = getattr(self, name)
                raise InputError.about(f"`{name}`", found=repr(given[:60]), allowed=allowed)
