"""Build the shipped speech encoder `phones` from nothing but free speech.

    python -m recipes.train_encoder synthesise   # espeak-ng, flite, festival: exact phone times
    python -m recipes.train_encoder align        # natural English by forced alignment
    python -m recipes.train_encoder train        # resumes from its checkpoint
    python -m recipes.train_encoder realign      # German, Dutch, wake words: the network itself
    python -m recipes.train_encoder train        # goes on, now with these too
    python -m recipes.train_encoder reference    # phones of the test clips for the benchmark
    python -m recipes.train_encoder ship         # ONNX into the package, and what it hears

The shipped file was trained for 214 minutes on two cores: `realign` English and Dutch after 21
minutes, German after 24, so that until then no German speaker had been heard; all of them once more
after 70; then `train --minutes 158` and `--minutes 214`.

Debian: espeak-ng flite festival festvox-us-slt-hts festvox-kallpc16k festvox-kdlpc16k and the
word lists wamerican wngerman wdutch wfrench wspanish witalian wpolish wswedish.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "src" / "elocute"
BENCHMARK = Path(__file__).parents[1] / "benchmarks" / "encoder_reference.json"
FLITE_MINUTES, FESTIVAL_MINUTES = 35, 30


def synthesise(data: Path, work: Path, minutes: float) -> None:
    from recipes.encoder import synthesise as voices

    voices.espeak_shard(work, voices.ESPEAK_MINUTES)
    voices.flite_shard(work, FLITE_MINUTES)
    voices.festival_shard(work, FESTIVAL_MINUTES)


def align(data: Path, work: Path, minutes: float, parts: int = 8) -> None:
    from recipes.encoder.natural import aligned_shard, list_recordings, split_of

    recordings = [r for r in list_recordings(data) if r.language == "en" and r.text]
    recordings.sort(key=lambda r: hashlib.md5(r.path.name.encode()).hexdigest())
    for part in range(parts):
        for split in ("train", "test"):
            name = f"nat_{split}_{part}"
            if not (work / f"{name}.json").exists():
                chosen = [r for r in recordings[part::parts] if split_of(r) == split]
                print(name, aligned_shard(chosen, work, name), "of", len(chosen), flush=True)


def train(data: Path, work: Path, minutes: float) -> None:
    from elocute.networks.phone_net import PhoneNetConfig
    from recipes.encoder import train as training

    names = sorted(p.stem for p in work.glob("*.json") if "test" not in p.name)
    noises = sorted((data / "noise").glob("*.flac"))
    config = training.TrainConfig(minutes=minutes)
    training.train(work, names, noises, work / "phones.pt", config, PhoneNetConfig())


def realign(data: Path, work: Path, minutes: float) -> None:
    from recipes.encoder.realign import realigned_shards

    realigned_shards(data, work, work / "phones.pt", [])


def reference(data: Path, work: Path, minutes: float) -> None:
    from recipes.encoder.reference import write_reference

    names = sorted(p.stem for p in work.glob("*test*.json"))
    write_reference(work, names, BENCHMARK)


def ship(data: Path, work: Path, minutes: float) -> None:
    from elocute.encoders.phone_encoder import BUILTIN_PATH, PhoneEncoder
    from recipes.encoder import evaluate, ship
    from recipes.encoder.store import load_shard

    thresholds: dict[str, float] = {}
    BUILTIN_PATH.parent.mkdir(exist_ok=True)
    ship.export(ship.load_net(work / "phones.pt"), BUILTIN_PATH, thresholds)
    shards = [load_shard(work, p.stem) for p in sorted(work.glob("*test*.json"))]
    spoken, hear = list(evaluate.utterances_of(shards)), PhoneEncoder().encode
    clean, noisy = evaluate.listen(spoken, hear), evaluate.listen(spoken, hear, noise_db=10)
    figures = evaluate.report(clean, noisy)
    print(json.dumps(figures, indent=1))
    thresholds["bilabial"] = round(figures["bilabial_threshold"], 3)
    thresholds["labiodental"] = round(figures["labiodental_threshold"], 3)
    ship.export(ship.load_net(work / "phones.pt"), BUILTIN_PATH, thresholds)


STEPS = {f.__name__: f for f in (synthesise, align, train, realign, reference, ship)}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("step", choices=STEPS)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--work", type=Path, default=Path("build/encoder"))
    parser.add_argument("--minutes", type=float, default=80, help="wall time of `train`")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    STEPS[arguments.step](arguments.data, arguments.work, arguments.minutes)
