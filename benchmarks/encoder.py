"""Which phones the shipped trunk hears of natural speakers it was never trained on.

    python -m benchmarks.encoder --data ../shared/data

The reference phones (`encoder_reference.json`, written by `recipes.train_trunk reference`)
are forced alignments: English by pocketsphinx, German by an earlier ear along espeak-ng's phones,
at a time when it had not been trained on any natural German.
F1 counts frames of 20 ms; each half of the speakers is judged at the threshold tuned on the other.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np

from elocute.encoders.phone_encoder import PhoneEncoder
from elocute.encoders.trunk import WHOLE, Pace
from recipes.encoder import evaluate
from recipes.encoder.reference import read_reference

REFERENCE = Path(__file__).with_name("encoder_reference.json")
TARGETS = {
    "viseme accuracy": 0.82,
    "bilabial F1": 0.84,
    "labiodental F1": 0.80,
    "viseme accuracy, 10 dB noise": 0.75,
}


def figures(clean: list[evaluate.Heard], noisy: list[evaluate.Heard]) -> dict[str, float]:
    """The four headline figures of one group of clips."""
    return {
        "viseme accuracy": evaluate.viseme_accuracy(clean),
        "bilabial F1": evaluate.tuned_f1(clean, evaluate.BILABIAL)[0],
        "labiodental F1": evaluate.tuned_f1(clean, evaluate.LABIODENTAL)[0],
        "viseme accuracy, 10 dB noise": evaluate.viseme_accuracy(noisy),
    }


def cpu_per_second(encoder: PhoneEncoder, seconds: float = 30.0) -> float:
    """CPU seconds for a second of sound on one thread, front end included; best of five."""
    samples = np.random.default_rng(0).normal(0, 0.1, round(seconds * 16000)).astype(np.float32)
    encoder.encode(samples)
    spent = []
    for _ in range(5):
        started = time.process_time()
        encoder.encode(samples)
        spent.append((time.process_time() - started) / seconds)
    return min(spent)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--model", type=Path, help="another .onnx than the shipped one")
    parser.add_argument(
        "--ahead", type=int, default=WHOLE.ahead, help="rows of 20 ms a layer sees ahead"
    )
    arguments = parser.parse_args()
    encoder = PhoneEncoder(arguments.model, Pace(arguments.ahead))
    spoken = read_reference(REFERENCE, arguments.data / "speech")
    clean = evaluate.listen(spoken, encoder.encode)
    noisy = evaluate.listen(spoken, encoder.encode, noise_db=10)
    english = [one.source for one in clean if one.language == "en"]
    groups = {"English, all": ("en", None), "German (kerstin)": ("de", None)}
    groups |= {f"English: {name}": ("en", name) for name in sorted(set(english))}
    print(
        f"{'':32}" + "".join(f"{name:>30}" for name in TARGETS) + f"{'minutes':>9}{'speakers':>9}"
    )
    for label, (language, source) in groups.items():
        chosen = [
            index
            for index, one in enumerate(clean)
            if one.language == language and source in (None, one.source)
        ]
        if not chosen:
            continue
        row = figures([clean[i] for i in chosen], [noisy[i] for i in chosen])
        minutes = sum(len(clean[i].labels) for i in chosen) / 3000
        speakers = len({clean[i].speaker for i in chosen})
        print(
            f"{label:32}"
            + "".join(f"{row[name]:30.3f}" for name in TARGETS)
            + f"{minutes:9.1f}{speakers:9d}"
        )
    print(f"{'target':32}" + "".join(f"{value:30.2f}" for value in TARGETS.values()))
    print(f"CPU on one thread: {cpu_per_second(encoder):.4f} s per second of sound")
    print(f"look-ahead: {encoder.lookahead_s * 1000:.1f} ms")


if __name__ == "__main__":
    main()
