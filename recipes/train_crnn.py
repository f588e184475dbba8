"""Train the recurrent model that ships, `crnn`, and put it into the package.

    python -m recipes.train_crnn build/crnn --natural build/trunk        builds shards first
    python -m recipes.train_crnn build/crnn --shards SHARDS --sounds FOLDER

It resumes from the folder. On two cores: 30 to 40 minutes. Whatever voices the shards hold, the
sound is made worse in training (noise, loudness, equalisation, band limits, other vocal tracts and
tempos), which is what carries over to natural voices; bands above 8 kHz are not heard, as most
of the sound has none. The figures for docs/cards/crnn.md are printed at the end.

    python -m recipes.train_crnn build/crnn --natural build/trunk --encoder trunk --speakers 0
            --epochs 10 --batch 20 --no-asset

is what was tried through the trunk (docs/measurements/recurrent-model.md): ten minutes of a core.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from pathlib import Path

from elocute.corpus.shards import open_shards
from elocute.files.work_folder import MODEL
from elocute.training.crnn.run import train_crnn
from elocute.training.crnn.settings import CrnnTrainConfig

ASSET = Path(__file__).parents[1] / "src" / "elocute" / "models" / "assets" / "crnn.onnx"
NOTE = (
    "Trained by Elocute on shards of synthetic and aligned speech with simulated motion "
    "(recipes/train_crnn.py); docs/cards/crnn.md says more."
)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="for shards, checkpoint, log; resumes from there")
    parser.add_argument("--shards", type=Path, help="shards that exist (elocute propagate)")
    parser.add_argument("--sounds", type=Path, help="the folder of their sounds")
    parser.add_argument("--speakers", type=int, default=240, help="0: natural speech alone")
    parser.add_argument("--words", type=int, default=10, help="said by each speaker")
    parser.add_argument("--sentences", type=int, default=2, help="said by each speaker")
    parser.add_argument(
        "--natural", type=Path, help="work folder of train_trunk.py: adds natural speech"
    )
    parser.add_argument("--epochs", type=int, default=18)
    parser.add_argument("--batch", type=int, default=50, help="clips")
    parser.add_argument("--learning-rate", type=float, default=1e-3)
    parser.add_argument("--augment", type=float, default=0.9)
    parser.add_argument("--weight-power", type=float, default=0.25)
    parser.add_argument("--encoder", default="mel-deltas", help="or trunk")
    parser.add_argument("--no-asset", action="store_true", help="leave the package alone")
    choice = parser.parse_args()
    choice.folder.mkdir(parents=True, exist_ok=True)
    shards, sounds = choice.shards, choice.sounds
    if shards is None:
        shards, sounds = choice.folder / "shards", choice.folder / "sounds"
        if not shards.is_dir():
            from recipes.crnn.shards import build

            shutil.rmtree(choice.folder / "reader", ignore_errors=True)
            build(
                shards,
                sounds,
                choice.folder,
                speakers=choice.speakers,
                words_each=choice.words,
                sentences_each=choice.sentences,
                natural=choice.natural,
            )
    if sounds is None:
        sys.exit("--shards needs --sounds")
    config = CrnnTrainConfig(
        epochs=choice.epochs,
        batch_clips=choice.batch,
        learning_rate=choice.learning_rate,
        last_rate=0.05,
        augment=choice.augment,
        highest_hz=8000.0,
        weight_power=choice.weight_power,
        encoder=choice.encoder,
    )
    training = choice.folder / "training"
    training.mkdir(exist_ok=True)

    def report(share: float, line: str) -> None:
        if share:
            print(line, flush=True)

    opened = open_shards(shards, sounds)
    trained, missing = train_crnn(opened, config, training, resume=True, report=report, note=NOTE)
    best = min(trained.log, key=lambda row: row["validation_loss"])
    print(json.dumps({"clips": len(opened), "missing": len(missing), "best": best}))
    if not choice.no_asset:
        ASSET.parent.mkdir(exist_ok=True)
        shutil.copyfile(training / MODEL, ASSET)
        print(ASSET, f"{ASSET.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
