"""Words with their times, as JSON and as a TextGrid that Praat opens and saves."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from elocute.audio.read import DURATION_MAX_S
from elocute.errors import AlignmentError
from elocute.files.atomic import write_atomically
from elocute.files.json_records import finite_number, parse_json
from elocute.files.reading import FileKind, read_bytes
from elocute.speech.text.text_words import is_printable
from elocute.speech.times.textgrid import TextGridInterval, format_textgrid, parse_textgrid

FORMAT, VERSION = "elocute-words", 1
WORDS_FILE = FileKind("words with times", 32_000_000, AlignmentError)
WORDS_MAX = 200_000
WORD_LONGEST = 120
TIER = "words"
SLACK_S = 1e-3  # programs round times


@dataclass(frozen=True)
class TimedWord:
    """One word with its times in s.

    confidence: 0 to 1, how well the sound matches the word; 1 where a person set it. Raises
    AlignmentError for impossible times or an unprintable text.
    """

    text: str
    start_s: float
    end_s: float
    confidence: float = 1.0

    def __post_init__(self) -> None:
        text = self.text
        if not isinstance(text, str) or not (text.strip() and is_printable(text)):
            self._refuse("unprintable text", "one word")
        if len(text) > WORD_LONGEST:
            self._refuse(f"{len(text)} letters", f"up to {WORD_LONGEST}")
        numbers = (self.start_s, self.end_s, self.confidence)
        if any(finite_number(number) is None for number in numbers):
            shown = ", ".join(repr(number)[:40] for number in numbers)
            self._refuse(f"times and confidence {shown}", "finite numbers")
        if not 0 <= self.start_s < self.end_s:
            self._refuse(f"{self.start_s:g} to {self.end_s:g} s", "0 <= start < end")
        if not 0 <= self.confidence <= 1:
            self._refuse(f"confidence {self.confidence:g}", "0 to 1")

    def _refuse(self, found: str, allowed: str) -> None:
        raise AlignmentError.about(f"word {str(self.text)[:40]!r}", found=found, allowed=allowed)


@dataclass(frozen=True)
class TimedWords:
    """The words of a sound, in order and without overlap; duration_s is that of the sound.

    Raises AlignmentError where they overlap or end after the sound.
    """

    words: tuple[TimedWord, ...]
    duration_s: float

    def __post_init__(self) -> None:
        if not 0 < (finite_number(self.duration_s) or 0.0) <= DURATION_MAX_S:
            raise AlignmentError.about(
                "words",
                found=f"a duration of {str(self.duration_s)[:40]} s",
                allowed="above 0, up to a day",
            )
        if not 0 < len(self.words) <= WORDS_MAX:
            raise AlignmentError.about(
                "words", found=f"{len(self.words)}", allowed=f"1 to {WORDS_MAX}"
            )
        before: TimedWord | None = None
        for word in self.words:
            if before is not None and word.start_s < before.end_s - SLACK_S:
                raise AlignmentError.about(
                    f"word {word.text!r}",
                    found=f"from {word.start_s:g} s, in {before.text!r}",
                    allowed=f"{before.end_s:g} s or later",
                )
            before = word
        last = self.words[-1]
        if last.end_s > self.duration_s + SLACK_S:
            raise AlignmentError.about(
                f"word {last.text!r}",
                found=f"until {last.end_s:g} s",
                allowed=f"up to {self.duration_s:g} s, the length of the sound",
            )

    @property
    def text(self) -> str:
        return " ".join(word.text for word in self.words)


def read_words(path: str | Path) -> TimedWords:
    """Read a .json that `write_words` wrote, or a .TextGrid as Praat saves it as text.

    Raises AlignmentError for any other file.
    """
    path = Path(path)
    if path.suffix.lower() not in READERS:
        raise AlignmentError.about(path, found=f"suffix {path.suffix!r}", allowed=" ".join(READERS))
    data = read_bytes(path, WORDS_FILE)
    try:
        return READERS[path.suffix.lower()](data)
    except AlignmentError as error:
        raise AlignmentError.about(path, found=str(error)) from error


def write_words(words: TimedWords, path: str | Path) -> None:
    """Write .json, or .TextGrid (long form, UTF-8). Raises AlignmentError, OutputError."""
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in READERS:
        raise AlignmentError.about(path, found=f"suffix {path.suffix!r}", allowed=" ".join(READERS))
    text = _json_of(words) if suffix == ".json" else _textgrid_of(words)
    with write_atomically(path) as draft:
        draft.write_text(text, encoding="utf-8")


def merge_edits(edited: TimedWords, before: TimedWords | None) -> TimedWords:
    """Words after a person's review: confidence 1 for what was changed, else what it was before."""
    if before is None:
        return edited
    known = {(w.text, round(w.start_s, 3), round(w.end_s, 3)): w.confidence for w in before.words}
    kept = tuple(
        replace(
            word,
            confidence=known.get((word.text, round(word.start_s, 3), round(word.end_s, 3)), 1.0),
        )
        for word in edited.words
    )
    return replace(edited, words=kept)


def _json_of(words: TimedWords) -> str:
    rows = ",\n".join(
        "  "
        + json.dumps(
            {"word": w.text, "start_s": w.start_s, "end_s": w.end_s, "confidence": w.confidence},
            ensure_ascii=False,
        )
        for w in words.words
    )
    head = json.dumps({"format": FORMAT, "version": VERSION, "duration_s": words.duration_s})
    return f'{head[:-1]}, "words": [\n{rows}\n]}}\n'


def _from_json(data: bytes) -> TimedWords:
    allowed = f"format {FORMAT}, version {VERSION}"
    record: Any = parse_json(data, "words", allowed=allowed, error=AlignmentError)
    try:
        if record["format"] != FORMAT or record["version"] != VERSION:
            raise ValueError("another format")
        rows = [(w["word"], w["start_s"], w["end_s"], w["confidence"]) for w in record["words"]]
        duration = record["duration_s"]
    except (ValueError, KeyError, TypeError) as error:
        raise AlignmentError.about(
            "words", found=f"words that cannot be read ({str(error)[:120]})", allowed=allowed
        ) from error
    return TimedWords(tuple(TimedWord(*row) for row in rows), duration)


def _textgrid_of(words: TimedWords) -> str:
    spoken = [TextGridInterval(w.start_s, w.end_s, w.text) for w in words.words]
    return format_textgrid({TIER: spoken}, words.duration_s)


def _from_textgrid(data: bytes) -> TimedWords:
    spoken, duration = parse_textgrid(data, TIER)
    return TimedWords(
        tuple(TimedWord(each.text, each.start_s, each.end_s) for each in spoken), duration
    )


READERS = {".json": _from_json, ".textgrid": _from_textgrid}
