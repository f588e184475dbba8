"""How fast VOCA trains, against the direct loop over vertices.

    python -m recipes.build_corpus build/corpus
    python -m benchmarks.voca_training build/corpus

First some clips with both decoders from the same seed: seconds per epoch and validation loss.
Then all training clips with the reduced decoder, `--epochs` of them (50: the paper's). Uses all
cores, as a training does.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.corpus.split import Split
from elocute.encoders.registry import resolve_encoder
from elocute.training.voca.fit import TrainedVoca, fit
from elocute.training.voca.settings import VocaTrainConfig
from elocute.training.voca.training_data import prepare


def part_of(corpus: Corpus, clips: int) -> Corpus:
    """The same corpus with a split of so many training clips, a quarter as many to validate."""
    split = corpus.split()
    step = max(1, len(split.train) // clips)
    few = Split(split.train[::step][:clips], split.validation[: max(1, clips // 4)], split.test)
    return replace(corpus, splits={**corpus.splits, "few": few})


def random_access(corpus: Corpus, count: int = 20_000) -> float:
    """Median seconds to fetch one frame of motion anywhere in the corpus."""
    numbers = np.random.default_rng(0)
    places = numbers.integers(0, corpus.frame_count, count)
    spent = []
    for place in places:
        begun = time.perf_counter()
        np.array(corpus.motion[place])
        spent.append(time.perf_counter() - begun)
    return float(np.median(spent))


def epoch_s(trained: TrainedVoca) -> float:
    return float(np.median([row["seconds"] for row in trained.log]))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--epochs", type=int, default=50)
    parser.add_argument("--clips", type=int, default=24, help="of the comparison")
    parser.add_argument("--comparison-epochs", type=int, default=8)
    choice = parser.parse_args()
    corpus = open_corpus(choice.corpus)
    print(f"| one frame of motion, anywhere | {random_access(corpus) * 1000:.4f} ms | <= 0.05 |")
    few = part_of(corpus, choice.clips)
    results = {}
    for reduced in (True, False):
        config = VocaTrainConfig(epochs=choice.comparison_epochs, reduced=reduced)
        data = prepare(few, config, resolve_encoder(config.encoder), "few")
        trained = results[reduced] = fit(data, config)
        print(
            f"| {choice.clips} clips, {'reduced' if reduced else 'full'} decoder, "
            f"{config.epochs} epochs | {epoch_s(trained):.2f} s an epoch, "
            f"validation {trained.log[-1]['validation_mm2']:.4f} mm² | |",
            flush=True,
        )
    one, two = (results[reduced].log[-1]["validation_mm2"] for reduced in (True, False))
    ratio = epoch_s(results[False]) / epoch_s(results[True])
    print(f"| full / reduced, time | {ratio:.1f} x | >= 5 |")
    print(f"| reduced / full, validation loss | {one / two:.3f} | within 1 % |")
    config = VocaTrainConfig(epochs=choice.epochs)
    begun = time.perf_counter()
    data = prepare(corpus, config, resolve_encoder(config.encoder))
    heard_s = time.perf_counter() - begun
    trained = fit(data, config, report=lambda _share, line: print(f"<!-- {line} -->", flush=True))
    minutes = (time.perf_counter() - begun) / 60
    clips, pairs = len(corpus.split().train), len(data.train.pairs)
    print(
        f"| {config.epochs} epochs, {clips} clips, {pairs} pairs | {minutes:.1f} min, "
        f"{heard_s:.0f} s of it hearing them | < 25 min for 50 |"
    )


if __name__ == "__main__":
    main()
