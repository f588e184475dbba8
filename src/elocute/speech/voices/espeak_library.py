"""espeak-ng's C library: speech with the place of every phone and word in it.

This file needs the standard library alone. `espeak.py` runs it as a process of its own, since the
library keeps its state from one text to the next and a flaw in it would end the caller with it: a
JSON object on standard input, on the output a JSON object in one line and then 16-bit samples.
"""

from __future__ import annotations

import ctypes
import json
import os
import sys
from dataclasses import dataclass
from typing import Any

SYNCHRONOUS = 2
# Phone events, their names in IPA, and an error where the library would end the process.
OPTIONS = 1 | 2 | 0x8000
RATE_PARAMETER, PITCH_PARAMETER, RANGE_PARAMETER = 1, 3, 4
END, WORD, PHONE = 0, 1, 7
UTF8, IPA = 1, 2


class _Name(ctypes.Union):
    _fields_ = (("number", ctypes.c_int), ("name", ctypes.c_char_p), ("string", ctypes.c_char * 8))


class _Event(ctypes.Structure):
    _fields_ = (
        ("type", ctypes.c_int),
        ("uid", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_ms", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("id", _Name),
    )


class _Voice(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_char_p),
        ("languages", ctypes.c_char_p),
        ("identifier", ctypes.c_char_p),
        ("gender", ctypes.c_ubyte),
        ("age", ctypes.c_ubyte),
        ("variant", ctypes.c_ubyte),
        ("xx1", ctypes.c_ubyte),
        ("score", ctypes.c_int),
        ("spare", ctypes.c_void_p),
    )


_CALLBACK = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event)
)


@dataclass(frozen=True)
class EspeakSpeech:
    """What the library said: 16-bit samples of the machine's byte order, and where each phone and
    word begins.

    `phones` are the first sample of each phone and its name in IPA, "" and marks of stress or
    length among them. `words` are the first sample of each word, its first letter in the text
    counted from 0, its letters, and how many of `phones` come before it.
    """

    samples: bytes
    sample_rate: int
    phones: list[tuple[int, str]]
    words: list[tuple[int, int, int, int]]


class EspeakLibrary:
    """The library, loaded once in a process; OSError where it cannot be loaded, or finds no data.

    `library` is its file, or the name under which the system finds it; `data_home` the folder that
    holds `espeak-ng-data`, the library's own by default.
    """

    def __init__(self, library: str = "libespeak-ng.so.1", data_home: str | None = None) -> None:
        self._library = ctypes.CDLL(library)
        self._library.espeak_ListVoices.restype = ctypes.POINTER(ctypes.POINTER(_Voice))
        self._library.espeak_TextToPhonemes.restype = ctypes.c_char_p
        home = None if data_home is None else os.fsencode(data_home)
        self.rate = self._library.espeak_Initialize(SYNCHRONOUS, 500, home, OPTIONS)
        if self.rate <= 0:
            raise OSError("espeak-ng finds no data")
        self._blocks: list[bytes] = []
        self._phones: list[tuple[int, str]] = []
        self._words: list[tuple[int, int, int, int]] = []
        self._callback = _CALLBACK(self._collect)
        self._library.espeak_SetSynthCallback(self._callback)

    def _collect(self, samples: Any, count: int, events: Any) -> int:
        if count > 0 and samples:
            self._blocks.append(ctypes.string_at(samples, 2 * count))
        index = 0
        while events[index].type != END:
            event = events[index]
            if event.type == PHONE:
                name = event.id.string.decode("utf-8", "ignore")
                self._phones.append((event.sample, name))
            elif event.type == WORD:
                place = event.text_position - 1
                self._words.append((event.sample, place, event.length, len(self._phones)))
            index += 1
        return 0

    def languages(self) -> list[str]:
        """The first name of each language; those of MBROLA, another program, left out."""
        listed = self._listed(None)
        return sorted({name for name, identifier in listed if not identifier.startswith("mb/")})

    def variants(self) -> list[str]:
        """The voices that any language can be spoken with."""
        listed = self._listed(ctypes.byref(_Voice(languages=b"variant")))
        return sorted({identifier.rpartition("/")[2] for _, identifier in listed})

    def _listed(self, like: Any) -> list[tuple[str, str]]:
        """Language and identifier of every voice."""
        listed, voices = self._library.espeak_ListVoices(like), []
        while listed[len(voices)]:
            voice = listed[len(voices)].contents
            # Before each language stands its priority, in one byte.
            language = (voice.languages or b"\0")[1:].decode("utf-8", "replace")
            voices.append((language, (voice.identifier or b"").decode("utf-8", "replace")))
        return voices

    def _set_voice(self, voice: str) -> bool:
        """A language's file has a name of its own: that of fr-fr is fr."""
        if self._library.espeak_SetVoiceByName(voice.encode()) == 0:
            return True
        language, plus, variant = voice.partition("+")
        own = dict(reversed(self._listed(None))).get(language)
        return own is not None and (
            self._library.espeak_SetVoiceByName(f"{own}{plus}{variant}".encode()) == 0
        )

    def speak(
        self, text: str, voice: str, words_per_minute: int, pitch: int, pitch_range: int
    ) -> EspeakSpeech:
        """Speak a text; `voice` is a language, or one with a variant: en-us+f3.

        Raises LookupError where there is no such voice.
        """
        for kept in (self._blocks, self._phones, self._words):
            kept.clear()
        if not self._set_voice(voice):
            raise LookupError(voice)
        for parameter, value in (
            (RATE_PARAMETER, words_per_minute),
            (PITCH_PARAMETER, pitch),
            (RANGE_PARAMETER, pitch_range),
        ):
            self._library.espeak_SetParameter(parameter, value, 0)
        data = text.encode()
        self._library.espeak_Synth(data, len(data) + 1, 0, 1, 0, UTF8, None, None)
        return EspeakSpeech(
            b"".join(self._blocks), self.rate, list(self._phones), list(self._words)
        )

    def spell(self, word: str) -> str:
        """A word in IPA as the voice that spoke last says it alone, its phones parted by _."""
        data = ctypes.c_char_p(word.encode())
        rest = ctypes.cast(ctypes.pointer(data), ctypes.POINTER(ctypes.c_void_p))
        parts = []
        while rest.contents.value:  # a clause at a time
            part = self._library.espeak_TextToPhonemes(rest, UTF8, IPA | ord("_") << 8)
            parts.append((part or b"").decode("utf-8", "ignore"))
        return "_".join(parts)


def main() -> None:
    """Answer the one request of standard input."""
    request = json.loads(sys.stdin.buffer.read())
    home = request["data_home"]
    if home is not None:  # the library keeps no more than 160 letters of the name
        os.chdir(home)
        home = "."
    try:
        library = EspeakLibrary(request["library"], home)
        answer, samples = _answer(library, request), b""
        if isinstance(answer, EspeakSpeech):
            samples = answer.samples
            answer = {
                "rate": answer.sample_rate,
                "phones": answer.phones,
                "words": answer.words,
                "alone": {word: library.spell(word) for word in request["alone"]},
            }
    except OSError as error:
        answer, samples = {"failed": str(error)}, b""
    sys.stdout.buffer.write(json.dumps(answer).encode() + b"\n" + samples)


def _answer(library: EspeakLibrary, request: dict[str, Any]) -> EspeakSpeech | dict[str, Any]:
    """What was said, or the names there are where none is that of the request."""
    if request["variant"] and request["variant"] not in library.variants():
        return {"variants": library.variants()}
    numbers = (request["words_per_minute"], request["pitch"], request["pitch_range"])
    for language in request["languages"]:
        voice = "+".join(filter(None, (language, request["variant"])))
        try:
            return library.speak(request["text"], voice, *numbers)
        except LookupError:
            continue
    return {"languages": library.languages()}


if __name__ == "__main__":
    main()
