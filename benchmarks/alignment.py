"""Alignment against known times: the paper's Table 1 on free data (Tzirakis et al. 2019, 6.2).

    python -m benchmarks.alignment words --words 100            (a) words by ten synthetic voices
    python -m benchmarks.alignment words --words 100 --noise-db 10
    python -m benchmarks.alignment find --words 20              (c) a word in a sentence
    python -m benchmarks.alignment natural --data ../shared/data        (b) digits and phrases
    python -m benchmarks.alignment visual --data ../shared/data         (d) a talker's mouth

Speech is made once, in --folder. Every method has the same features and, in (c), the same help:
both ends of the sentence are free, the word goes in whole. A run that
is broken off goes on where it was. Settings were tuned on --part tuning:
other words by other voices. Per method: mean error in frames (Eq. 11; lower is better), mean
intersection-over-union of phones carried over and of the word found (higher is better), and p of
Wilcoxon's signed-rank test over words of what `dcaw` gains over it. `dcaw` is this project's
method of that name, not the published one (docs/measurements/alignment.md).
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"
ROOT = Path(__file__).resolve().parents[1]

import torch

from elocute.cli.commands.evaluate_alignment import DEFAULT_METHODS, print_table
from elocute.evaluation.alignment_scores import (
    WordScore,
    compare_methods,
    score_folder,
    score_word,
    word_names,
    word_pairs,
)
from recipes.alignment.natural import natural_words
from recipes.alignment.speak import TUNING_VOICES, VOICES, speak_all, speak_sentences
from recipes.alignment.texts import FRAMES, TUNING_WORDS, WORDS
from recipes.alignment.visual import visual_words


def main() -> None:
    torch.set_num_threads(1)
    given = arguments()
    started = time.perf_counter()
    given.folder.mkdir(parents=True, exist_ok=True)
    record = given.folder / f"{given.name}.jsonl"
    rows = known_rows(record)
    if not given.table:
        {"words": synthetic, "find": synthetic, "natural": natural, "visual": visual}[
            given.experiment
        ](given, rows, record)
    table = compare_methods(rows)
    print(
        f"{given.name}: {len({row.word for row in rows})} words, "
        f"{sum(row.pairs for row in rows) // len(table)} pairs, "
        f"{time.perf_counter() - started:.0f} s in this run"
    )
    print_table(table)
    print(json.dumps({"experiment": given.name, "methods": table}))


def known_rows(record: Path) -> list[WordScore]:
    """Words scored by an earlier run that was broken off, or of fewer words."""
    if not record.exists():
        return []
    lines = record.read_text(encoding="utf-8").splitlines()
    return [WordScore(**json.loads(line)) for line in lines]


def keep(rows: list[WordScore], record: Path):
    """Add each word's rows as it is scored."""

    def done(share: float, own: list[WordScore]) -> None:
        rows.extend(own)
        with record.open("a", encoding="utf-8") as file:
            file.writelines(json.dumps(asdict(row)) + "\n" for row in own)
        if sys.stderr.isatty():
            print(f"\r{share:.0%}", end="", file=sys.stderr)

    return done


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("experiment", choices=("words", "find", "natural", "visual"))
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "alignment")
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--words", type=int, default=24)
    parser.add_argument("--part", default="report", choices=("report", "tuning"))
    parser.add_argument("--noise-db", type=float)
    parser.add_argument("--encoder", default="fbank")
    parser.add_argument("--methods", default=f"{DEFAULT_METHODS},ctw/expected,dctw/expected")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--table", action="store_true", help="print what is there, score nothing")
    given = parser.parse_args()
    noise = "clean" if given.noise_db is None else f"{given.noise_db:g}dB"
    given.name = f"{given.experiment}-{given.part}-{given.encoder}-{noise}-{given.seed}"
    return given


def synthetic(given: argparse.Namespace, rows: list[WordScore], record: Path) -> None:
    tuning = given.part == "tuning"
    texts = (TUNING_WORDS if tuning else WORDS)[: given.words]
    voices = TUNING_VOICES if tuning else VOICES
    folder, start = given.folder, "tuning-" if tuning else ""
    speak_all(folder, f"{start}words", texts, voices)
    sentences = None
    if given.experiment == "find":
        speak_sentences(folder, f"{start}sentences", texts, voices, FRAMES)
        sentences = folder / f"{start}sentences"
    score(given, rows, record, folder / f"{start}words", texts, sentences)


def natural(given: argparse.Namespace, rows: list[WordScore], record: Path) -> None:
    natural_words(given.data, given.folder / "natural")
    texts = word_names(given.folder / "natural")[: given.words]
    score(given, rows, record, given.folder / "natural", texts)


def score(
    given: argparse.Namespace,
    rows: list[WordScore],
    record: Path,
    folder: Path,
    texts: Sequence[str],
    sentences: Path | None = None,
) -> None:
    wanted = [text for text in texts if text not in {row.word for row in rows}]
    if wanted:
        _, broken = score_folder(
            folder,
            given.methods.split(","),
            sentences=sentences,
            encoder=given.encoder,
            noise_db=given.noise_db,
            words=wanted,
            seed=given.seed,
            on_word=keep(rows, record),
        )
        print(*(f"left out: {line}" for line in broken), sep="\n", file=sys.stderr)


def visual(given: argparse.Namespace, rows: list[WordScore], record: Path) -> None:
    known, done = {row.word for row in rows}, keep(rows, record)
    for word, takes in list(visual_words(given.data).items())[: given.words]:
        pairs = word_pairs(takes)
        if len(pairs) > 1 and word not in known:
            done(0.0, score_word(word, pairs, given.methods.split(","), given.seed))


if __name__ == "__main__":
    main()
