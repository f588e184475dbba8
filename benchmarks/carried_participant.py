"""What other people's motion, carried over to a held-out participant's words, shares with her own.

    python -m benchmarks.carried_participant build/words build/shards [--method softdtw]

The words of the captured speakers of the test part are cut out and treated as anybody's recordings:
each receives the motion of the captured speaker of the training part that fits it best, and is
compared with the motion that was captured. A network that learns from carried-over parameters
learns faces and habits of those speakers, so this is about what it can reach on the row "speaker
participant" of `elocute evaluate wild`. A method that needs no fitting is the default, as each
word has one recording here.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
import soundfile

from elocute.corpus.corpus_store import open_corpus
from elocute.corpus.shards import open_shards
from elocute.evaluation.concordance import score_concordance
from elocute.evaluation.wild_scores import variance_shares
from elocute.propagation.captured_words import CapturedCorpus, CapturedWord, captured_words
from elocute.propagation.corpus_propagation import propagate_corpus
from elocute.propagation.settings import PropagateConfig


def write_recordings(capture: CapturedCorpus, words: list[CapturedWord], folder: Path) -> None:
    """FOLDER/WORD/test/SUBJECT__0.wav"""
    for word in words:
        sound, path = capture.sound(word), folder / word.word / "test" / f"{word.subject}__0.wav"
        path.parent.mkdir(parents=True, exist_ok=True)
        soundfile.write(path, sound.samples, sound.sample_rate, subtype="PCM_16")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("words", type=Path, help="folder that recipes.build_words made")
    parser.add_argument("shards", type=Path, help="whose blendshapes are used")
    parser.add_argument("--method", default="softdtw")
    choice = parser.parse_args()
    shards = open_shards(choice.shards, choice.words)
    corpus = open_corpus(choice.words / "captured")
    capture = CapturedCorpus(corpus, shards.basis)
    times = choice.words / "captured_words"
    listed = [w for words in captured_words(corpus, times).values() for w in words]
    held = {(word.word, word.subject): word for word in listed if word.split == "test"}
    with tempfile.TemporaryDirectory() as room:
        recordings, folder = Path(room, "recordings"), Path(room, "shards")
        write_recordings(capture, list(held.values()), recordings)
        config = PropagateConfig(method=choice.method, confidence=0.0)
        basis = choice.shards / "basis.npz"
        propagate_corpus(
            corpus.folder, recordings, folder, config, words=times, basis=basis, root=recordings
        )
        carried, true = [], []
        for clip in open_shards(folder, recordings).clips():
            word = held[clip.word, clip.speaker]
            carried.append(clip.parameters)
            seconds = word.start_s + np.arange(len(clip)) / clip.fps
            true.append(capture.parameters(word, seconds))
    score = score_concordance(carried, true, variance_shares(shards))
    first = " ".join(f"{each.value:.2f}" for each in score.first)
    print(
        f"{choice.method}, {score.clips} words: mean of {shards.components} {score.mean.value:.3f} "
        f"[{score.mean.low:.3f}, {score.mean.high:.3f}], weighted {score.weighted.value:.3f}, "
        f"c1 … c5 {first}"
    )


if __name__ == "__main__":
    main()
