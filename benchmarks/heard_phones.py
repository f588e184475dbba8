"""How many phones the encoder hears wrongly, against the text that was read.

    python -m benchmarks.heard_phones DATA [--readers ljspeech_a,ljspeech_b]

DATA is a folder with speech/transcripts.tsv (path, speaker, language, text).
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from elocute import find_phones
from elocute.encoders.phones_and_visemes import PHONE_TO_VISEME
from elocute.speech.text.pronunciation import pronounce

SENTENCES = 40


def edits(wanted: Sequence[str], found: Sequence[str]) -> int:
    """Least number of insertions, deletions and exchanges (Levenshtein)."""
    least = np.arange(len(found) + 1)
    for row, label in enumerate(wanted, 1):
        before, least[0] = least.copy(), row
        for column, other in enumerate(found, 1):
            exchanged = before[column - 1] + (label != other)
            least[column] = min(before[column] + 1, least[column - 1] + 1, exchanged)
    return int(least[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--readers", default="ljspeech_a,ljspeech_b")
    given = parser.parse_args()
    with (given.data / "speech/transcripts.tsv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file, delimiter="\t"))
    print("| reader | phones | phone errors | viseme errors |\n|---|---|---|---|")
    for reader in given.readers.split(","):
        chosen = [row for row in rows if row["path"].startswith(f"speech/{reader}/")][:SENTENCES]
        total = phones = visemes = 0
        for row in chosen:
            text = [phone for word in pronounce(row["text"], "en-us") for phone in word.phones]
            heard = [phone for *_, phone in find_phones(given.data / row["path"]).phones]
            total += len(text)
            phones += edits(text, heard)
            visemes += edits(*([PHONE_TO_VISEME[each] for each in both] for both in (text, heard)))
        told = f"{phones / total:.3f} | {visemes / total:.3f}"
        print(f"| {reader}, {len(chosen)} sentences | {total} | {told} |")


if __name__ == "__main__":
    main()
