"""Speech from text by espeak-ng, with the times of its phones and words.

espeak-ng is a program of its own under the GPL: it is not part of Elocute, is installed by whoever
wants it, and runs in a process of its own (`espeak_library.py`).
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.waveform import Waveform
from elocute.errors import InputError, MachineError, printable
from elocute.speech.phone_symbols import PROLONGS, REST, ipa_phones
from elocute.speech.spoken_text import SpokenText, SpokenWord
from elocute.speech.text.text_words import share_phones, words_of_text
from elocute.speech.times.labels import Label
from elocute.speech.voices import espeak_library
from elocute.speech.voices.settings import TEXT_MAX, VoiceSettings, language_names

LETTERS_PER_S = 200.0
"""Slower than any machine speaks; ten seconds more are given."""
PITCH_RANGE = 50
# Where the system or its package managers put the library.
LIBRARIES = (
    "libespeak-ng.so.1",
    "libespeak-ng.1.dylib",
    "/opt/homebrew/lib/libespeak-ng.dylib",
    "/usr/local/lib/libespeak-ng.dylib",
    "libespeak-ng.dll",
    r"C:\Program Files\eSpeak NG\libespeak-ng.dll",
)
# A stop is silent while the mouth is closed. espeak-ng's event marks where it bursts; the silence
# before it counts as the end of the phone before.
STOPS = frozenset(["P", "T", "K", "B", "D", "G", "CH", "JH"])
SILENT = 1e-3
CLOSURE_MAX_S = 0.12
HIDDEN_SHARE = 1 / 3
LANGUAGE_MARK = re.compile(r"\(([a-z0-9-]+)\)")
"""An event of this name says in which language the text goes on."""
LEAD_S, TAIL_S = 0.25, 0.35
"""Silence around the words, so that the mouth opens before them and comes to rest after them."""


def check_text(text: str) -> str:
    """A text that can be spoken, white space around it taken away; line ends and tabs are spaces.

    Raises
    ------
    InputError
        For a text that is empty, too long or not text, and for control characters: espeak-ng takes
        some of them for commands.
    """
    if not isinstance(text, str):
        raise InputError.about("text", found=type(text).__name__, allowed="text")
    if len(text) > TEXT_MAX:
        raise InputError.about(
            "text",
            found=f"{len(text)} letters",
            allowed=f"up to {TEXT_MAX}",
            remedy="speak it in parts",
        )
    joined = " ".join(text.split())
    for place, letter in enumerate(joined):
        if not letter.isprintable() and letter not in "\u200c\u200d\u00ad":
            raise InputError.about(
                "text", found=f"{letter!r} at letter {place + 1}", allowed="text without controls"
            )
    if not any(letter.isalnum() for letter in joined):
        raise InputError.about(
            "text", found=repr(joined[:40]) if joined else "nothing", allowed="words"
        )
    return joined


def speak(text: str, settings: VoiceSettings | None = None) -> SpokenText:
    """Speak a text with espeak-ng, as `registry.speak` does."""
    settings, text = settings or VoiceSettings(), check_text(text)
    alone = {word.text for word in words_of_text(text)}
    header, samples, rate = _said(text, settings, sorted(alone))
    if not header["phones"] or not np.any(np.abs(samples) > SILENT):
        raise InputError.about(
            "text",
            found="nothing that is spoken",
            allowed=f"words of `language` {settings.language}",
        )
    phones, sources = _phones(header["phones"], len(samples), rate, settings.language.lower())
    phones = _closed(phones, samples, rate)
    words = _words(text, phones, _places(header["words"], sources), header["alone"])
    padded = np.concatenate(
        [np.zeros(round(LEAD_S * rate)), samples, np.zeros(round(TAIL_S * rate))]
    ).astype(np.float32)
    later = tuple(SpokenWord(word.text, _later(word.phones)) for word in words)
    return SpokenText(Waveform(padded, rate), _later(phones), later)


def spell(words: Sequence[str], settings: VoiceSettings) -> dict[str, tuple[str, ...]]:
    """The ARPAbet phones of words, each as it is said alone; none for one that is not spoken.

    `settings` say the language. Raises as `speak`.
    """
    for word in words:
        if any(map(str.isalnum, word)):
            check_text(word)
    answer, _, _ = _said("a", settings, alone=words)
    return {
        word: tuple(_spelled(ipa, settings.language.lower()))
        for word, ipa in answer["alone"].items()
    }


def _said(
    text: str, settings: VoiceSettings, alone: Sequence[str] = ()
) -> tuple[dict[str, Any], Float32Array, int]:
    """What the library answers: events, samples within ±1, and their rate; and how the words
    `alone` are spelled in IPA."""
    request = {
        "text": text,
        "languages": language_names(settings.language),
        "variant": settings.voice,
        "words_per_minute": settings.words_per_minute,
        "pitch": settings.pitch,
        "pitch_range": PITCH_RANGE,
        "alone": list(alone),
    }
    failures = []
    for library, home in _libraries():
        answer, data = _asked({**request, "library": library, "data_home": home})
        if "failed" in answer:
            failures.append(answer["failed"])
            continue
        for name, kind in (("languages", "language"), ("variants", "voice")):
            if name in answer:
                raise InputError.about(
                    f"`{kind}` {getattr(settings, kind)}",
                    found="unknown to espeak-ng",
                    allowed=", ".join(answer[name]),
                )
        samples = np.frombuffer(data, np.int16).astype(np.float32) / np.float32(32768)
        return answer, samples.astype(np.float32), int(answer["rate"])
    why = printable(failures[0])[:120] if failures else "no library"
    raise MachineError(
        f"speaking a text needs espeak-ng ({why}); install it: pip install 'elocute[tts]', or the "
        "system's package espeak-ng"
    )


def _libraries() -> Sequence[tuple[str, str | None]]:
    """Libraries to try, each with the folder of its data where that is known."""
    try:
        import espeakng_loader  # pyright: ignore[reportMissingImports]
    except ImportError:
        return [(name, None) for name in LIBRARIES]
    library = Path(espeakng_loader.get_library_path())
    return [(str(library), str(library.parent)), *((name, None) for name in LIBRARIES)]


def _asked(request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    """Ask the process that holds the library: its answer and the samples."""
    limit_s = 10 + len(request["text"]) / LETTERS_PER_S
    try:
        done = subprocess.run(
            [sys.executable, "-I", espeak_library.__file__],
            input=json.dumps(request).encode(),
            capture_output=True,
            timeout=limit_s,
            check=False,
        )
        answer, _, samples = done.stdout.partition(b"\n")
        if done.returncode == 0 and answer:
            return json.loads(answer), samples
        reason = f"it ended with code {done.returncode}"
    except subprocess.TimeoutExpired:
        reason = f"no answer within {limit_s:.0f} s"
    except OSError as error:
        reason = f"{sys.executable!r} cannot be started ({error.strerror})"
    return {"failed": reason}, b""


def _phones(
    events: list[list[Any]], total: int, rate: int, language: str
) -> tuple[list[Label], list[int]]:
    """Phones with times in s of the samples, and the number of the event of each."""
    labels: list[Label] = []
    sources: list[int] = []
    ends = [start for start, _ in events[1:]] + [total]
    for number, ((start, name), end) in enumerate(zip(events, ends, strict=True)):
        switched = LANGUAGE_MARK.fullmatch(name)
        language = switched[1] if switched else language
        names = [REST] if switched else ipa_phones(name, language) or [REST]
        if names == [PROLONGS] and labels:
            labels[-1] = (labels[-1][0], end / rate, labels[-1][2])
        elif end == start and labels and labels[-1][2] != REST and REST not in names:
            # espeak-ng draws a vowel and the l behind it in one: the l has the vowel's last part.
            begun, until, before = labels.pop()
            cut = until - (until - begun) * HIDDEN_SHARE
            labels += [(begun, cut, before), (cut, until, names[0])]
            sources.append(number)
        elif end > start:
            part = (end - start) / len(names)
            for place, phone in enumerate(names):
                begin = start + place * part
                labels.append((begin / rate, (begin + part) / rate, phone or REST))
                sources.append(number)
    return labels, sources


def _closed(phones: list[Label], samples: Float32Array, rate: int) -> list[Label]:
    """The same phones, stops with the silence in which the mouth is closed before they burst."""
    loud = np.flatnonzero(np.abs(samples) > SILENT)
    moved = list(phones)
    for index in range(1, len(moved)):
        start, end, phone = moved[index]
        before = moved[index - 1]
        if phone not in STOPS or before[2] == REST:
            continue
        heard = loud[: np.searchsorted(loud, round(start * rate))]
        silent_s = float(heard[-1]) / rate if len(heard) else 0.0
        begin = max(silent_s, start - CLOSURE_MAX_S, (before[0] + start) / 2)
        if begin < start:
            moved[index - 1] = (before[0], begin, before[2])
            moved[index] = (begin, end, phone)
    return moved


def _places(events: list[list[int]], sources: list[int]) -> list[int]:
    """Where in the text the engine was at each phone: a word's event comes before its phones."""
    begun = np.array([before for _, _, _, before in events])
    places = [0, *(place for _, place, _, _ in events)]
    return [places[at] for at in np.searchsorted(begun, sources, "right").tolist()]


def _words(
    text: str, phones: list[Label], places: list[int], alone: dict[str, str]
) -> list[SpokenWord]:
    """All words of the text, with their phones; pauses are part of none."""
    spoken = [(phone, at) for phone, at in zip(phones, places, strict=True) if phone[2] != REST]
    words = words_of_text(text)
    lengths = [len(_spelled(alone.get(word.text, ""))) for word in words]
    shares = share_phones(text, words, [at for _, at in spoken], lengths)
    return [
        SpokenWord(word.text, tuple(spoken[number][0] for number in numbers))
        for word, numbers in shares
    ]


def _spelled(ipa: str, language: str = "") -> list[str]:
    """The phones of a word in IPA, parted by _."""
    phones: list[str] = []
    for part in ipa.replace(" ", "_").split("_"):
        mark = LANGUAGE_MARK.fullmatch(part)
        language = mark[1] if mark else language
        phones += [] if mark else ipa_phones(part, language)
    return [name for name in phones if name not in (PROLONGS, REST)]


def _later(times: Sequence[Label]) -> tuple[Label, ...]:
    return tuple((start + LEAD_S, end + LEAD_S, name) for start, end, name in times)
