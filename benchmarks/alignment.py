"""Alignment against known times: the paper's Table 1 on free data (Tzirakis et al. 2019, 6.2).

    python -m benchmarks.alignment words --words 100            (a) words by ten synthetic voices
    python -m benchmarks.alignment words --words 100 --noise-db 10
    python -m benchmarks.alignment find --words 20              (c) a word in a sentence
    python -m benchmarks.alignment natural --data ../shared/data        (b) digits and phrases
    python -m benchmarks.alignment visual --data ../shared/data         (d) a talker's mouth
    python -m benchmarks.alignment three --words 8              (e) three recordings at once

Speech is made once, in --folder. Every method has the same features and, in (c), the same help:
both ends of the sentence are free, the word goes in whole. A run that
is broken off goes on where it was. Settings were tuned on --part tuning:
other words by other voices. Per method: mean error in frames (Eq. 11; lower is better), mean
intersection-over-union of phones carried over and of the word found (higher is better), and p of
Wilcoxon's signed-rank test over words of what --tested gains over it. METHOD/together is fitted
once, to all words; --ablation leaves the parts of the learned methods out, one by one
(docs/measurements/alignment.md).
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from itertools import combinations
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"
ROOT = Path(__file__).resolve().parents[1]

import numpy as np
import torch

from elocute.alignment.aligner import Aligner
from elocute.alignment.methods import fit_aligner
from elocute.cli.commands.evaluate_alignment import DEFAULT_METHODS, print_table
from elocute.evaluation.alignment_scores import (
    WordScore,
    ablation_variants,
    compare_methods,
    method_variant,
    pair_scores,
    read_recordings,
    score_folder,
    score_words,
    word_names,
    word_pairs,
)
from elocute.evaluation.timed_recordings import TimedRecording, word_pair
from recipes.alignment.natural import natural_words
from recipes.alignment.speak import TUNING_VOICES, VOICES, speak_all, speak_sentences
from recipes.alignment.texts import FRAMES, TUNING_WORDS, WORDS
from recipes.alignment.visual import visual_words

TRIPLES = 15  # of a word


def main() -> None:
    torch.set_num_threads(1)
    given = arguments()
    started = time.perf_counter()
    given.folder.mkdir(parents=True, exist_ok=True)
    record = given.folder / f"{given.name}.jsonl"
    rows = known_rows(record)
    if not given.table:
        EXPERIMENTS[given.experiment](given, rows, record)
    table = compare_methods(rows, given.tested)
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
    parser.add_argument("experiment", choices=EXPERIMENTS)
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "alignment")
    parser.add_argument("--data", type=Path, default=ROOT.parent / "shared" / "data")
    parser.add_argument("--words", type=int, default=24)
    parser.add_argument("--part", default="report", choices=("report", "tuning"))
    parser.add_argument("--noise-db", type=float)
    parser.add_argument("--encoder", default="fbank")
    parser.add_argument("--methods", default=DEFAULT_METHODS)
    parser.add_argument("--ablation", action="store_true", help="parts left out, in their stead")
    parser.add_argument("--together", action="store_true", help="with --ablation: one fit for all")
    parser.add_argument("--tested")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--table", action="store_true", help="print what is there, score nothing")
    given = parser.parse_args()
    noise = "clean" if given.noise_db is None else f"{given.noise_db:g}dB"
    way = "/together" if given.together else ""
    given.tested = given.tested or f"dcaw{way}"
    given.variants = (
        ablation_variants(given.together)
        if given.ablation
        else [method_variant(m) for m in given.methods.split(",")]
    )
    named = given.experiment, given.part, given.encoder, noise, given.seed
    given.name = "-".join(map(str, (*named, *(["ablation"] if given.ablation else []))))
    if given.experiment == "three" or any(each.together for each in given.variants):
        given.name += f"-{given.words}-together"  # what is fitted depends on all of the words
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
    known = {row.word for row in rows}
    if not known.issuperset(texts):
        _, broken = score_folder(
            folder,
            given.variants,
            sentences=sentences,
            encoder=given.encoder,
            noise_db=given.noise_db,
            words=texts,
            seed=given.seed,
            known=known,
            on_word=keep(rows, record),
        )
        print(*(f"left out: {line}" for line in broken), sep="\n", file=sys.stderr)


def visual(given: argparse.Namespace, rows: list[WordScore], record: Path) -> None:
    takes = list(visual_words(given.data).items())[: given.words]
    pairs = {word: word_pairs(each) for word, each in takes}
    score_words(
        {word: each for word, each in pairs.items() if len(each) > 1},
        given.variants,
        seed=given.seed,
        known={row.word for row in rows},
        on_word=keep(rows, record),
    )


def three(given: argparse.Namespace, rows: list[WordScore], record: Path) -> None:
    """Three recordings aligned at once, by methods fitted together to all triples.

    Each pair of columns of the path is scored as a path of two. `dcaw: pair by pair` does not let
    the attention of each pair see the other pairs.
    """
    speak_all(given.folder, "words", WORDS[: given.words], VOICES)
    groups: dict[str, list[tuple[TimedRecording, ...]]] = {}
    for word in WORDS[: given.words]:
        takes = read_recordings(given.folder / "words" / word, given.encoder, given.noise_db)[0]
        triples = combinations(takes, 3)
        alike = [t for t in triples if all(word_pair(*two) for two in combinations(t, 2))]
        groups[word] = alike[:: max(1, len(alike) // TRIPLES)]
    every = [tuple(take.view for take in triple) for found in groups.values() for triple in found]
    fitted = {name: fit_aligner(every, name, seed=given.seed) for name in ("dtw", "ctw", "dcaw")}
    fitted["dcaw: pair by pair"] = replace(fitted["dcaw"], all_pairs=False)
    done, known = keep(rows, record), {row.word for row in rows}
    for word, triples in groups.items():
        if triples and word not in known:
            done(0.0, [_score_triples(word, name, fitted[name], triples) for name in fitted])


def _score_triples(
    word: str, name: str, aligner: Aligner, triples: Sequence[tuple[TimedRecording, ...]]
) -> WordScore:
    found = []
    for triple in triples:
        path = aligner.align(*(take.view for take in triple)).path
        for i, j in combinations(range(3), 2):
            pair = word_pair(triple[i], triple[j])
            assert pair is not None
            found.append(pair_scores(pair, np.unique(path[:, [i, j]], axis=0)))
    error, overlap, whole = map(float, np.mean(found, axis=0))
    return WordScore(word, name, len(found), error, overlap, whole)


EXPERIMENTS = {
    "words": synthetic,
    "find": synthetic,
    "natural": natural,
    "visual": visual,
    "three": three,
}

if __name__ == "__main__":
    main()
