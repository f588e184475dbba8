"""Train a small VOCA on a small corpus, and measure each speaker in each style.

python examples/research.py out/research --epochs 20

The corpus is three simulated speakers who say the clip that ships with Elocute; with recordings of
your own, `elocute corpus convert` writes one. Needs the extra `train`.
"""

import argparse
from pathlib import Path

import numpy as np

import elocute
from elocute.corpus import Clip, Corpus, Split, corpus_writer, open_corpus
from elocute.evaluation import (
    MetricConfig,
    builtin_region,
    clip_predictor,
    score_clips,
    subject_scores,
)
from elocute.models import open_model
from elocute.training import VocaTrainConfig, train_voca

CLIP = Path(elocute.__file__).parent / "assets" / "example.flac"
STYLES, PARTS, PART_S = ("plain", "broad", "tense"), 4, 2.5


def build(folder: Path) -> Corpus:
    """Three speakers say the same four stretches; the last two are for validation and test.

    A corpus for a paper keeps speakers apart as well: `elocute.corpus` has splits for that.
    """
    head = elocute.load_builtin_head()
    speech = elocute.read_audio(CLIP, sample_rate=16000)
    faces = {style: head.identity_template(np.full(3, 0.3 * i)) for i, style in enumerate(STYLES)}
    size = round(PART_S * speech.sample_rate)
    with corpus_writer(
        folder,
        faces,
        fps=60,
        basis=head.expression_basis,
        components=head.expression_names,
        faces=head.quads,
        topology=head.name,
    ) as writer:
        for style in STYLES:
            for part in range(PARTS):
                sound = elocute.Waveform(speech.samples[part * size : (part + 1) * size], 16000)
                weights = elocute.animate(sound, style=style, life=0).motion.weights
                writer.add(Clip(style, f"part{part}", "", sound, weights))
        names = [entry.name for entry in writer.entries]
        writer.splits["default"] = Split(
            tuple(name for name in names if name.endswith(("part0", "part1"))),
            tuple(name for name in names if name.endswith("part2")),
            tuple(name for name in names if name.endswith("part3")),
        )
    return open_corpus(folder)


def main() -> None:
    parser = argparse.ArgumentParser(description="Train and evaluate a small VOCA.")
    parser.add_argument("output", nargs="?", default="out/research", type=Path)
    parser.add_argument("--epochs", default=20, type=int)
    given = parser.parse_args()

    (given.output / "voca").mkdir(parents=True, exist_ok=True)
    corpus = build(given.output / "corpus")
    train_voca(
        corpus, VocaTrainConfig(epochs=given.epochs, learning_rate=2e-3), given.output / "voca"
    )
    model = open_model(given.output / "voca" / "model.onnx")
    measure = MetricConfig(builtin_region("lips"), builtin_region("upper_face"), mouth=True)
    test = corpus.split("default").test
    predict = clip_predictor(model, corpus)
    for row in subject_scores(score_clips(corpus, test, model.styles, predict, measure)):
        error = row.intervals["lve_mm"]
        print(
            f"{row.subject:>6} in the style {row.style:>6}: lip vertex error {error.value:.2f} mm"
        )


if __name__ == "__main__":
    main()
