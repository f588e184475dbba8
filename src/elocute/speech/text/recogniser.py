"""Recognises the words of a recording with Whisper on this machine (faster-whisper).

Nothing is fetched: a model is a folder, or lies in the cache where its owner put it. What is
recognised is a text with rough times, and goes the way of a known text: the times that count are
those of its alignment.
"""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.speech_input import speech_blocks
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.errors import InputError, MachineError, ModelError, needs_extra
from elocute.files.onnx_session import load_onnxruntime
from elocute.one_line_repr import brief
from elocute.speech.text.phone_alignment import PronouncedWord
from elocute.speech.text.pronunciation import pronounce, pronounce_each
from elocute.speech.text.transcript import CAPTION_SLACK_S, Transcript
from elocute.speech.voices.settings import language_names

Transcribe = bool | str | os.PathLike[str]
"""Whether words are recognised, and by which model; see `recognise`."""
DEFAULT_RECOGNISER = "base"
PIECE_S, SEAM_S = 240.0, 30.0
"""Seconds of sound that are heard at once, and their last ones within which they are parted."""
HUSH_S = 0.3
"""A piece ends in the middle of the quietest stretch that is so long."""
SHORTEST_S = 0.2
UNSURE = 0.1
"""Probability of a word below which the ear alone says what is spoken there: see
docs/measurements/text.md."""
REPEATS = 2.4
"""A stretch that is compressed further than this is one word over and over, which nobody said."""
FILES = ("model.bin", "config.json", "tokenizer.json")
REPOSITORY = re.compile(r"[\w.-]+/[\w.-]+")
_WHISPERS = {"cmn": "zh", "nb": "no"}
"""Languages by Whisper's names where espeak-ng has others."""
_SPOKEN = {"en": "en-us"}


class _Part(NamedTuple):
    """A piece of a text as Whisper parts it, its times in s and its probability."""

    text: str
    start_s: float
    end_s: float
    probability: float


def recognise(
    sound: Path | Waveform,
    choice: Transcribe,
    language: str = "auto",
    channel: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Transcript:
    """What is said in a sound.

    Parameters
    ----------
    sound : Path or Waveform
        As `resolve_speech` gives it; some minutes of it are held in memory.
    choice : True, str or Path
        A folder with the files of a model of faster-whisper, or a name: "tiny.en", "base",
        "OWNER/REPOSITORY"; a model of that name has to be in the cache of Hugging Face already.
        True means "base".
    language : str
        Of the speech, as espeak-ng or others call it; "auto" takes the one that is heard.
    channel : int, optional
        The channel to take of a file, instead of their mean.
    progress : callable, optional
        Called with the seconds that were listened to.

    Returns
    -------
    Transcript
        Recognised: its words have rough times, and some are unsure.

    Raises
    ------
    InputError
        For a name that no model has, and a language that the model or espeak-ng does not know.
    ModelError
        For a folder that is no such model.
    MachineError
        Where faster-whisper, a model of that name, or espeak-ng is missing.
    """
    if not isinstance(choice, bool | str | os.PathLike) or not str(choice) or choice is False:
        raise InputError.about(
            "`transcribe`", found=brief(choice), allowed="True, the name of a model, or its folder"
        )
    name = DEFAULT_RECOGNISER if choice is True else str(choice)
    model = _opened(name)
    code = _code_of(language, name, model.supported_languages)
    if language != "auto":
        pronounce_each(["a"], language)  # told before an hour is listened to
    words: list[PronouncedWord] = []
    texts, seams, notes = list[str](), list[float](), list[str]()
    for start_s, piece in _pieces(speech_blocks(sound, channel)):
        seams += [start_s] if start_s else []
        parts, detected = _heard(model, piece, start_s, code)
        text = "".join(part.text for part in parts)
        if any(map(str.isalnum, text)):
            if code is None:
                code, language = detected, _SPOKEN.get(detected, detected)
                notes.append(f"language heard: {detected}")
            try:
                words += _timed(pronounce(text, language), text, parts)
                texts.append(text.strip())
            except InputError:
                reason = f"espeak-ng does not speak those from {start_s:g} s on in {language}"
                notes.append(f"words left to the encoder: {reason}")
        if progress is not None:
            progress(start_s + len(piece) / SPEECH_RATE)
    if not words:
        notes.append("no words recognised: phones are as they are heard")
    return Transcript(tuple(words), " ".join(texts), tuple(notes), True, tuple(seams))


def recogniser_folder(name: str) -> Path:
    """Where a model lies on this machine. Raises InputError, MachineError."""
    with needs_extra("recognising words", "transcribe"):
        load_onnxruntime()  # it listens for voices, and sends nothing
        from faster_whisper import available_models, download_model
    if Path(name).is_dir():
        return Path(name)
    if name not in available_models() and REPOSITORY.fullmatch(name) is None:
        raise InputError.about(
            f"recogniser {name!r}",
            found="no folder",
            allowed=f"a model's folder, or one of {' '.join(available_models())}",
        )
    try:
        return Path(download_model(name, local_files_only=True))
    except (OSError, ValueError) as error:
        raise MachineError(
            f"recognising words needs a model, and {name!r} is not in this machine's cache; get it "
            f"once: python -c \"import faster_whisper; faster_whisper.download_model('{name}')\"; "
            "or give a model's folder"
        ) from error


@lru_cache(maxsize=1)
def _opened(name: str) -> Any:
    """The model of a name or a folder."""
    folder = recogniser_folder(name)
    missing = [file for file in FILES if not (folder / file).is_file()]
    if missing:  # without its tokenizer, one would be fetched
        raise ModelError.about(
            folder, found=f"no {missing[0]}", allowed="a folder of faster-whisper's models"
        )
    from faster_whisper import WhisperModel

    try:
        return WhisperModel(str(folder), device="cpu", compute_type="int8", local_files_only=True)
    except Exception as error:  # those of three libraries, which have no common base
        raise ModelError.about(
            folder, found=f"no model that can be loaded ({error})", allowed="Whisper's"
        ) from error


def _code_of(language: str, name: str, known: Sequence[str]) -> str | None:
    """What the model calls a language; None where it has to be heard. Raises InputError."""
    if language == "auto":
        return known[0] if len(known) == 1 else None
    codes = [_WHISPERS.get(each, each) for each in language_names(language)]
    for code in codes:
        if code in known:
            return code
    raise InputError.about(
        "`language`",
        found=f"{language!r}, which {name} does not recognise",
        allowed="auto, " + (" ".join(known) if len(known) < 9 else f"{len(known)} languages"),
    )


def _heard(
    model: Any, piece: Float32Array, start_s: float, code: str | None
) -> tuple[list[_Part], str]:
    """What is said in a piece, and its language; its silences, in which Whisper invents words, are
    not listened to."""
    if len(piece) < SHORTEST_S * SPEECH_RATE:
        return [], ""
    segments, facts = model.transcribe(
        piece,
        language=code,
        temperature=0.0,  # no dice: the same sound gives the same words
        condition_on_previous_text=False,
        word_timestamps=True,
        vad_filter=True,
    )
    words = [w for each in segments if each.compression_ratio <= REPEATS for w in each.words or ()]
    parts = [
        _Part(
            " ".join(re.split(r"\s+", "".join(c if c.isprintable() else " " for c in word.word))),
            start_s + float(word.start),
            start_s + float(word.end),
            float(word.probability),
        )
        for word in words
    ]
    return parts, facts.language


def _timed(
    words: Sequence[PronouncedWord], text: str, parts: Sequence[_Part]
) -> Iterator[PronouncedWord]:
    """The words of a text, each with the times and the doubts of the parts that it lies in."""
    ends, at = list(accumulate(len(part.text) for part in parts)), 0
    for word in words:
        at = max(text.find(word.text, at), at)
        last = at + len(word.text) - 1
        mine = parts[bisect_right(ends, at) : bisect_right(ends, last) + 1] or parts[-1:]
        span = mine[0].start_s - CAPTION_SLACK_S, mine[-1].end_s + CAPTION_SLACK_S
        yield replace(word, span_s=span, sure=min(part.probability for part in mine) >= UNSURE)
        at = last + 1


def _pieces(blocks: Iterable[Float32Array]) -> Iterator[tuple[float, Float32Array]]:
    """Stretches of a sound, each with its start in s, parted where it is quiet."""
    size, start = round(PIECE_S * SPEECH_RATE), 0
    kept: list[Float32Array] = []
    for block in blocks:
        kept.append(block)
        while sum(map(len, kept)) > size:
            whole = np.concatenate(kept)
            cut = size - round(SEAM_S * SPEECH_RATE)
            cut += _quietest(whole[cut:size])
            yield start / SPEECH_RATE, whole[:cut]
            kept, start = [whole[cut:]], start + cut
    if any(map(len, kept)):
        yield start / SPEECH_RATE, np.concatenate(kept)


def _quietest(samples: Float32Array) -> int:
    """The middle of the quietest stretch of HUSH_S, in samples."""
    width = round(HUSH_S * SPEECH_RATE)
    energy = np.concatenate([[0.0], np.cumsum(samples.astype(float) ** 2)])
    return int(np.argmin(energy[width:] - energy[:-width])) + width // 2
