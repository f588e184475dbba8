"""Train the model that ships, `voca`, and put it into the package.

    python -m recipes.build_corpus build/corpus --natural build/trunk --grid DATA/grid_s1
    python -m recipes.train_default build/corpus build/default

The corpus holds natural and synthetic speech in eight simulated styles, and a real talker as the
style `grid`. What it measures is in docs/cards/voca.md.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from elocute.corpus.corpus_store import open_corpus
from elocute.files.work_folder import MODEL
from elocute.training.voca.run import train_voca
from elocute.training.voca.settings import VocaTrainConfig

ASSET = Path(__file__).parents[1] / "src" / "elocute" / "models" / "assets" / "voca.onnx"
NOTE = (
    "Trained by Elocute on simulated motion (recipes/build_corpus.py) and on speaker 1 of the GRID "
    "audio-visual corpus (Cooke et al. 2006, CC BY 4.0); speech: espeak-ng, flite, festival, and "
    "the corpora named in docs/cards/trunk.md."
)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("corpus", type=Path)
    parser.add_argument("folder", type=Path, help="for checkpoint and log; resumes from there")
    parser.add_argument("--epochs", type=int, default=6)
    parser.add_argument("--learning-rate", type=float, default=1e-3)
    parser.add_argument("--batch", type=int, default=256, help="pairs of frames")
    parser.add_argument("--encoder", default="phones")
    choice = parser.parse_args()
    choice.folder.mkdir(parents=True, exist_ok=True)
    corpus = open_corpus(choice.corpus)
    config = VocaTrainConfig(
        epochs=choice.epochs,
        learning_rate=choice.learning_rate,
        batch_pairs=choice.batch,
        encoder=choice.encoder,
    )

    def report(_share: float, line: str) -> None:
        print(line, flush=True)

    train_voca(corpus, config, choice.folder, resume=True, report=report, note=NOTE)
    ASSET.parent.mkdir(exist_ok=True)
    shutil.copyfile(choice.folder / MODEL, ASSET)
    print(ASSET, f"{ASSET.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
