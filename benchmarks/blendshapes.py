"""Speech blendshapes from many meshes: time, memory, and error on people held out.

python -m recipes.build_corpus build/corpus
python -m benchmarks.blendshapes build/corpus
"""

from __future__ import annotations

import argparse
import itertools
import resource
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from elocute.capture.blendshapes.basis_comparison import (
    BasisProjection,
    reconstruction_errors,
    strongest_shapes,
)
from elocute.capture.blendshapes.blendshape_learning import BlendshapeConfig, learn_blendshapes
from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.head.builtin import load_builtin_head


def clips_of(corpus: Corpus, frames: int) -> list[str]:
    """Training clips, again from the first where they are too few, up to so many frames."""
    chosen: list[str] = []
    count = 0
    names: Iterator[str] = itertools.cycle(corpus.split().train)
    while count < frames:
        chosen.append(next(names))
        count += corpus.entry(chosen[-1]).frames
    return chosen


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--frames", type=int, default=80_000)
    parser.add_argument("--components", type=int, default=8)
    choice = parser.parse_args()
    corpus = open_corpus(choice.corpus)
    begun = time.perf_counter()
    config = BlendshapeConfig(choice.components)
    learned = learn_blendshapes(corpus, clips_of(corpus, choice.frames), config)
    spent = time.perf_counter() - begun
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"| {learned.frames} meshes of {corpus.vertex_count} vertices | {spent:.0f} s | |")
    print(f"| peak memory | {peak:.2f} GB | < 2 |")
    for share in (0.99, 0.999):
        enough = int(np.searchsorted(learned.explained, share)) + 1
        print(f"| components that hold {share:.1%} | {enough} | |")
    parts, arkit = corpus.split(), load_builtin_head().expression_basis
    best = strongest_shapes(corpus, parts.train[::8], arkit, choice.components)
    bases = [
        BasisProjection("speech", learned.head.expression_basis),
        BasisProjection(f"ARKit, best {choice.components}", arkit[best]),
        BasisProjection(f"ARKit, all {len(arkit)}", arkit),
    ]
    for found in reconstruction_errors(corpus, parts.test, bases):
        print(f"| {found.name}: held-out people, mean distance | {found.mean_mm:.4f} mm | |")


if __name__ == "__main__":
    main()
