"""Statistics of a corpus, gathered block by block."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.corpus.corpus_store import Corpus
from elocute.errors import CorpusError

BLOCK_FRAMES = 256


@dataclass(frozen=True, eq=False)
class Moments:
    """Mean and variance over frames."""

    count: int  # frames
    # (…,) of each number, over all frames.
    mean: Float64Array
    variance: Float64Array


def moments(blocks: Iterable[NDArray[np.floating]]) -> Moments:
    """Mean and variance in one numerically stable pass (Chan, Golub and LeVeque 1983).

    Parameters
    ----------
    blocks : iterable of (frame, …) float
        Blocks of one frame or more, equal in all other axes.

    Returns
    -------
    Moments
        Over all frames.
    """
    count, mean, spread = 0, np.zeros(0), np.zeros(0)
    for block in blocks:
        values = np.asarray(block, np.float64)
        size, middle = len(values), values.mean(axis=0)
        around = ((values - middle) ** 2).sum(axis=0)
        if not count:
            count, mean, spread = size, middle, around
            continue
        step = middle - mean
        spread = spread + around + step**2 * (count * size / (count + size))
        mean = mean + step * (size / (count + size))
        count += size
    return Moments(count, mean, spread / max(count, 1))


def displacement_blocks(corpus: Corpus, names: Iterable[str]) -> Iterator[NDArray[np.float32]]:
    """Displacements of some clips, a few seconds at a time.

    Parameters
    ----------
    corpus : Corpus
        The corpus.
    names : iterable of str
        Its clips.

    Yields
    ------
    (frame, vertex, 3) float32
        Displacements from the subject's template, m.

    Raises
    ------
    CorpusError
        For motion that is not finite; the clip and its frame are named.
    """
    for name in names:
        for start in range(0, corpus.entry(name).frames, BLOCK_FRAMES):
            block = corpus.displacements(name, start, start + BLOCK_FRAMES)
            finite = np.isfinite(block).all(axis=(1, 2))
            if not finite.all():
                raise CorpusError.about(
                    f"{corpus.folder / 'motion.npy'}, clip {name}",
                    found=f"NaN or infinity in frame {start + int(np.argmin(finite))}",
                    allowed="finite motion",
                    remedy="elocute corpus check",
                )
            yield block


def corpus_summary(corpus: Corpus) -> dict[str, object]:
    """The figures of `elocute corpus info` by name, for JSON; durations in minutes."""
    per_subject = {
        subject: sum(e.frames for e in corpus.entries if e.subject == subject) / corpus.fps
        for subject in corpus.subjects
    }
    return {
        "kind": corpus.kind,
        "topology": corpus.topology or "unnamed",
        "vertices": corpus.vertex_count,
        "components": len(corpus.components),
        "fps": corpus.fps,
        "clips": len(corpus.entries),
        "sentences": len({entry.sentence for entry in corpus.entries}),
        "minutes": round(corpus.frame_count / corpus.fps / 60, 2),
        "subjects": {name: round(seconds / 60, 2) for name, seconds in per_subject.items()},
        "splits": {
            name: {part: len(clips) for part, clips in split.parts().items()}
            for name, split in corpus.splits.items()
        },
        "note": corpus.note,
    }
