"""Recurrent models on continuous speech of a simulated speaker, whatever blendshapes they weigh.

    python -m benchmarks.crnn_speech build/words/sentences build/shards
            --models crnn build/ours/speaker/model.onnx [--subject NAME] [--clips 50]

What a model moves is projected onto the blendshapes of the shards, as is the true motion, and
compared there: the concordance of `elocute evaluate wild`, row "sentences state". Beside it stands
the mean distance of the lips' vertices, in mm, to which all directions count by what they move.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.corpus.shards import open_shards
from elocute.evaluation.wild_experiments import select_sentences
from elocute.evaluation.wild_scores import score_sentences, variance_shares
from elocute.head.builtin import load_builtin_head
from elocute.models.crnn_network import CrnnNetwork, stream_weights
from elocute.numerics.resampling import frame_places, read_rows
from elocute.numerics.ridge import ridge_projection


def lips_mm(corpus: Corpus, names: list[str], model: CrnnNetwork, lips: np.ndarray) -> float:
    """Mean distance of the lips' vertices to the true ones, mm, at the corpus's frame rate."""
    found = []
    for name in names:
        true = corpus.displacements(name)[:, lips]
        weights = stream_weights(model, corpus.sound(name))
        moved = np.tensordot(weights, model.basis[:, lips], 1)
        moved = read_rows(
            moved.reshape(len(moved), -1), frame_places(0, len(true), model.record.fps, corpus.fps)
        )
        found.append(np.linalg.norm(moved.reshape(true.shape) - true, axis=2).mean(axis=1))
    return 1000 * float(np.concatenate(found).mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("corpus", type=Path)
    parser.add_argument("shards", type=Path, help="whose blendshapes are compared in")
    parser.add_argument("--models", nargs="+", default=["crnn"])
    parser.add_argument("--subject")
    parser.add_argument("--clips", type=int, default=50)
    choice = parser.parse_args()
    corpus, shards = open_corpus(choice.corpus), open_shards(choice.shards, choice.shards)
    names = select_sentences(corpus, shards, choice.subject, choice.clips)
    basis = shards.basis.head.expression_basis
    onto = ridge_projection(basis.reshape(len(basis), -1).astype(np.float64)).astype(np.float32)
    head = load_builtin_head()
    lips = head.regions["lips"]
    print(f"{len(names)} clips: mean of {len(basis)} [95 %], weighted, c1 … c5, lips mm")
    for name in choice.models:
        model = CrnnNetwork(name)
        turned = model.basis.reshape(len(model.basis), -1) @ onto

        def predict(
            sound: Waveform, model: CrnnNetwork = model, turned: Float32Array = turned
        ) -> Float32Array:
            return stream_weights(model, sound) @ turned

        score = score_sentences(
            corpus, names, basis, model.record.fps, variance_shares(shards), predict
        )
        first = " ".join(f"{each.value:.2f}" for each in score.first)
        mean = score.mean
        print(
            f"{name}: {mean.value:.3f} [{mean.low:.3f}, {mean.high:.3f}] "
            f"{score.weighted.value:.3f}  {first}  {lips_mm(corpus, names, model, lips):.3f} mm"
        )


if __name__ == "__main__":
    main()
