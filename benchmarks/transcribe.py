"""What recognised words are worth where nobody says what is spoken, against the text that was read.

    python -m benchmarks.transcribe DATA --recogniser base [--each 30]

DATA is a folder with speech/transcripts.tsv and readers/readers.tsv (path, speaker, language,
text). Phones are compared with those of the text by espeak-ng (edit distance, over the phones of
the text), closures (p, b, m; f, v) with those of the text as it is aligned: one is found where the
lips do the same during it, and false where the text has none.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.heard_phones import edits
from benchmarks.known_text import LANGUAGES
from elocute import find_phones
from elocute.articulation.driver import BILABIALS, LABIODENTALS
from elocute.audio.read import read_audio
from elocute.errors import AlignmentError
from elocute.speech.text.pronunciation import pronounce
from elocute.speech.text.recogniser import recognise
from elocute.speech.text.text_words import words_of_text
from elocute.speech.times.write import TimedSpeech

SOURCES = ("readers/libri_other", "speech/ljspeech_a", "speech/kerstin_de", "speech/nathalie_nl")
WORDS_MIN = 4


@dataclass
class Tally:
    """What one way of hearing gets wrong."""

    phones: int = 0
    found: int = 0
    false: int = 0
    made: int = 0

    def add(self, text: Sequence[str], truth: TimedSpeech, heard: TimedSpeech) -> None:
        self.phones += edits(text, [phone for *_, phone in heard.phones])
        for kind in (BILABIALS, LABIODENTALS):
            wanted, made = _contacts(truth, kind), _contacts(heard, kind)
            self.found += sum(_meets(each, made) for each in wanted)
            self.false += sum(not _meets(each, wanted) for each in made)
            self.made += len(made)


@dataclass
class Source:
    """The readings of one source."""

    readings: int = 0
    words: int = 0
    word_errors: int = 0
    phones: int = 0
    closures: int = 0
    seconds: float = 0.0
    cpu_s: float = 0.0
    alone: Tally = field(default_factory=Tally)
    recognised: Tally = field(default_factory=Tally)


def _contacts(speech: TimedSpeech, kind: Iterable[str]) -> list[tuple[float, float]]:
    return [(start, end) for start, end, phone in speech.phones if phone in set(kind)]


def _meets(span: tuple[float, float], others: list[tuple[float, float]]) -> bool:
    return any(start < span[1] and end > span[0] for start, end in others)


def _words(text: str) -> list[str]:
    return [word.text.casefold() for word in words_of_text(text)]


def measure(data: Path, source: str, model: str, each: int) -> Source:
    """Hear readings that are spread over a source, without their texts and with a recogniser."""
    table = data / (
        "readers/readers.tsv" if source.startswith("readers") else "speech/transcripts.tsv"
    )
    with table.open(encoding="utf-8") as file:
        rows = [
            row
            for row in csv.DictReader(file, delimiter="\t")
            if row["path"].startswith(f"{source}/") and len(row["text"].split()) >= WORDS_MIN
        ]
    found = Source()
    for at in np.linspace(0, len(rows) - 1, min(each, len(rows))).round().astype(int):
        row = rows[at]
        sound, language = read_audio(data / row["path"]), LANGUAGES[row["language"]]
        text = [phone for word in pronounce(row["text"], language) for phone in word.phones]
        try:
            truth = find_phones(sound, text=row["text"], language=language)
        except AlignmentError:
            continue
        started = time.process_time()
        heard = find_phones(sound, transcribe=model, language=language)
        found.cpu_s += time.process_time() - started
        said, wanted = _words(recognise(sound, model, language).text), _words(row["text"])
        found.readings += 1
        found.seconds += sound.duration_s
        found.words += len(wanted)
        found.word_errors += edits(wanted, said)
        found.phones += len(text)
        found.closures += sum(len(_contacts(truth, k)) for k in (BILABIALS, LABIODENTALS))
        found.recognised.add(text, truth, heard)
        found.alone.add(text, truth, find_phones(sound))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--recogniser", default="base", help="a model's name or folder")
    parser.add_argument("--each", type=int, default=30, help="readings of each source")
    given = parser.parse_args()
    print("| source | readings | word errors | phone errors, ear alone | recognised", end="")
    print(" | closures found, false: ear alone | recognised | CPU s per s |")
    print("|---|---|---|---|---|---|---|---|")
    for source in SOURCES:
        found = measure(given.data, source, given.recogniser, given.each)
        cells = [
            source.partition("/")[2],
            str(found.readings),
            f"{found.word_errors / found.words:.3f}",
            *(f"{way.phones / found.phones:.3f}" for way in (found.alone, found.recognised)),
            *(
                f"{way.found / found.closures:.3f}, {way.false / max(way.made, 1):.3f}"
                for way in (found.alone, found.recognised)
            ),
            f"{found.cpu_s / found.seconds:.2f}",
        ]
        print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
