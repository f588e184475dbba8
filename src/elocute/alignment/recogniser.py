"""The words of a recording, recognised by Whisper on this machine (faster-whisper).

Nothing is fetched: a model is a folder, or lies in the cache where its owner put it. What is
recognised is a text with rough times, and goes the way of a known text: the times that count are
those of its alignment.
"""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from elocute.alignment.phone_alignment import PronouncedWord
from elocute.alignment.pronunciation import pronounce, pronounce_each
from elocute.alignment.transcript import CAPTION_SLACK_S, Transcript
from elocute.array_types import Float32Array
from elocute.audio.speech_input import speech_blocks
from elocute.audio.voice_settings import language_names
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.errors import InputError, MachineError, ModelError, needs_extra
from elocute.files.onnx_session import load_onnxruntime
from elocute.one_line_repr import brief

Transcribe = bool | str | os.PathLike[str]
"""Whether words are recognised, and by which model; see `open_recogniser`."""
DEFAULT_RECOGNISER = "base"
PIECE_S, SEAM_S = 240.0, 30.0
"""Seconds of sound that are heard at once, and their last ones within which they are parted."""
HUSH_S = 0.3
"""A piece ends in the middle of the quietest stretch that is so long."""
SHORTEST_S = 0.2
UNSURE = 0.3
"""Probability of a word below which the ear alone says what is spoken there: see
docs/measurements/text.md."""
REPEATS = 2.4
"""A stretch that is compressed further than this is one word over and over, which nobody said."""
FILES = ("model.bin", "config.json", "tokenizer.json")
REPOSITORY = re.compile(r"[\w.-]+/[\w.-]+")
_WHISPERS = {"cmn": "zh", "nb": "no"}
"""Languages by Whisper's names where espeak-ng has others."""
_SPOKEN = {"en": "en-us"}


@dataclass(frozen=True)
class _Written:
    """What was recognised in a piece: its text; of each part of it, where it ends, its times in s
    and its probability."""

    text: str
    ends: list[int]
    spans_s: list[tuple[float, float]]
    sure: list[float]

    def timed(self, words: list[PronouncedWord]) -> Iterator[PronouncedWord]:
        """The words of the text, each with the times and the doubts of the parts it lies in."""
        at = 0
        for word in words:
            at = max(self.text.find(word.text, at), at)
            first = min(bisect_right(self.ends, at), len(self.ends) - 1)
            at += len(word.text)
            parts = range(first, min(bisect_right(self.ends, at - 1), len(self.ends) - 1) + 1)
            span = self.spans_s[parts[0]][0], self.spans_s[parts[-1]][1]
            sure = min(self.sure[part] for part in parts) >= UNSURE
            yield replace(
                word, span_s=(span[0] - CAPTION_SLACK_S, span[1] + CAPTION_SLACK_S), sure=sure
            )


@dataclass(frozen=True)
class Recogniser:
    """A Whisper model that listens.

    Parameters
    ----------
    whisper : faster_whisper.WhisperModel
        The model.
    name : str
        As it was asked for.
    """

    whisper: Any
    name: str

    def transcript(
        self,
        blocks: Iterable[Float32Array],
        language: str = "auto",
        progress: Callable[[float], None] | None = None,
    ) -> Transcript:
        """What is said in a recording.

        Parameters
        ----------
        blocks : iterable of (sample,) float32
            Mono at 16 kHz, of any length; some minutes of it are held in memory.
        language : str
            Of the speech, as espeak-ng or others call it; "auto" takes the one that is heard.
        progress : callable, optional
            Called with the seconds that were listened to.

        Returns
        -------
        Transcript
            Recognised: its words have rough times, and some are unsure.

        Raises
        ------
        InputError
            For a language that the model or espeak-ng does not know.
        MachineError
            Where espeak-ng is missing.
        """
        code = self._code(language)
        if language != "auto":
            pronounce_each(["a"], language)  # told before an hour is listened to
        words: list[PronouncedWord] = []
        texts: list[str] = []
        seams: list[float] = []
        notes: list[str] = []
        for start_s, piece in _pieces(blocks):
            if start_s:
                seams.append(start_s)
            heard, detected = self._heard(piece, start_s, code)
            if any(map(str.isalnum, heard.text)):
                if code is None:
                    code, language = detected, _SPOKEN.get(detected, detected)
                    notes.append(f"language heard: {detected}")
                try:
                    words += heard.timed(pronounce(heard.text, language))
                    texts.append(heard.text.strip())
                except InputError:
                    told = (
                        f"words from {start_s:g} s on, which espeak-ng does not speak in {language}"
                    )
                    notes.append(f"left to the encoder: {told}")
            if progress is not None:
                progress(start_s + len(piece) / SPEECH_RATE)
        if not words:
            notes.append("no words recognised: phones are as they are heard")
        return Transcript(
            tuple(words), " ".join(texts), tuple(notes), recognised=True, seams_s=tuple(seams)
        )

    def _code(self, language: str) -> str | None:
        """What the model calls a language; None where it has to be heard. Raises InputError."""
        known = self.whisper.supported_languages
        if language == "auto":
            return known[0] if len(known) == 1 else None
        names = [_WHISPERS.get(name, name) for name in language_names(language)]
        for name in names:
            if name in known:
                return name
        raise InputError.about(
            "`language`",
            found=f"{language!r}, which {self.name} does not recognise",
            allowed="auto, " + (" ".join(known) if len(known) < 9 else f"{len(known)} languages"),
        )

    def _heard(self, piece: Float32Array, start_s: float, code: str | None) -> tuple[_Written, str]:
        """What is said in a piece, and its language; its silences are not listened to, in which
        Whisper invents words."""
        written = _Written("", [], [], [])
        if len(piece) < SHORTEST_S * SPEECH_RATE:
            return written, code or "en"
        segments, facts = self.whisper.transcribe(
            piece,
            language=code,
            temperature=0.0,  # no dice: the same sound gives the same words
            condition_on_previous_text=False,
            word_timestamps=True,
            vad_filter=True,
        )
        texts: list[str] = []
        for segment in segments:
            if segment.compression_ratio > REPEATS:
                continue
            for word in segment.words or ():
                letters = "".join(each if each.isprintable() else " " for each in word.word)
                texts.append(re.sub(r"\s+", " ", letters))
                written.spans_s.append((start_s + float(word.start), start_s + float(word.end)))
                written.sure.append(float(word.probability))
        return replace(written, text="".join(texts), ends=list(accumulate(map(len, texts)))), str(
            facts.language
        )


def recognise(
    sound: Path | Waveform,
    choice: Transcribe,
    language: str = "auto",
    channel: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Transcript:
    """What is said in a sound, as `resolve_speech` gives it; see `Recogniser.transcript`."""
    recogniser = open_recogniser(choice)
    return recogniser.transcript(speech_blocks(sound, channel), language, progress)


def open_recogniser(choice: Transcribe) -> Recogniser:
    """Load a Whisper model.

    Parameters
    ----------
    choice : True, str or Path
        A folder with the files of a model of faster-whisper, or a name: "tiny.en", "base", "small",
        "OWNER/REPOSITORY"; a model of that name has to be in the cache of Hugging Face already.
        True means "base".

    Returns
    -------
    Recogniser

    Raises
    ------
    InputError
        For a name that no model has.
    ModelError
        For a folder that is no such model.
    MachineError
        Where faster-whisper, or a model of that name, is missing.
    """
    if choice is True:
        choice = DEFAULT_RECOGNISER
    if not isinstance(choice, str | os.PathLike) or not str(choice):
        raise InputError.about(
            "`transcribe`", found=brief(choice), allowed="True, the name of a model, or its folder"
        )
    return _opened(str(choice))


@lru_cache(maxsize=1)
def _opened(name: str) -> Recogniser:
    folder = recogniser_folder(name)
    missing = [file for file in FILES if not (folder / file).is_file()]
    if missing:  # without its tokenizer, one would be fetched
        raise ModelError.about(
            folder, found=f"no {missing[0]}", allowed="a folder of faster-whisper's models"
        )
    from faster_whisper import WhisperModel

    try:
        model = WhisperModel(str(folder), device="cpu", compute_type="int8", local_files_only=True)
    except (RuntimeError, ValueError, OSError, KeyError) as error:
        raise ModelError.about(
            folder, found=f"no model that can be loaded ({error})", allowed="Whisper's"
        ) from error
    return Recogniser(model, name)


def recogniser_folder(name: str) -> Path:
    """Where a model lies on this machine.

    Parameters
    ----------
    name : str
        As `open_recogniser` takes it.

    Returns
    -------
    Path

    Raises
    ------
    InputError, MachineError
        As `open_recogniser`.
    """
    with needs_extra("recognising words", "transcribe"):
        load_onnxruntime()  # it listens for voices, and sends nothing
        from faster_whisper import available_models, download_model
    if Path(name).is_dir():
        return Path(name)
    if name not in available_models() and REPOSITORY.fullmatch(name) is None:
        raise InputError.about(
            "`transcribe`",
            found=f"{name!r}, which is no folder",
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
    if rest := sum(map(len, kept)):
        yield start / SPEECH_RATE, np.concatenate(kept)[:rest]


def _quietest(samples: Float32Array) -> int:
    """The middle of the quietest stretch of HUSH_S, in samples."""
    width = round(HUSH_S * SPEECH_RATE)
    energy = np.concatenate([[0.0], np.cumsum(samples.astype(float) ** 2)])
    return int(np.argmin(energy[width:] - energy[:-width])) + width // 2
