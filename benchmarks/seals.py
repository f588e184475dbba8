"""Seals of lips against phone labels: right, false and missed, of every model.

    python -m benchmarks.seals --data DATA
    python -m benchmarks.seals --data DATA --model talkers --clips 60

The phones are those of benchmarks.encoder: recordings of speakers that the phone encoder never
heard, aligned with their texts, in clips evenly taken from each source. A seal is a short closure
of the lips; it is right at a p, b or m, or up to 80 ms from one. A p, b or m is missed where the
lips do not touch from 40 ms before it to 40 ms after it. Telephone speech of single digits is left
out.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.mouth_motion import Animated
from elocute.animation import animate
from elocute.audio.waveform import Waveform
from elocute.encoders.phones_and_visemes import PHONES
from elocute.evaluation.lip_closures import CLOSED_MM, short_runs
from elocute.evaluation.phone_mouth_scores import SpokenTake, phone_mouth_score
from elocute.models.registry import model_names
from elocute.motion.mouth_measures import measure_mouth
from recipes.encoder.evaluate import Utterance
from recipes.encoder.reference import read_reference
from recipes.encoder.store import RATE

REFERENCE = Path(__file__).with_name("encoder_reference.json")
LEFT_OUT = ("fsdd",)
FPS = 60.0
POP_S = 0.06  # a shorter opening between two closures pops


def phones_of(utterance: Utterance) -> list[tuple[float, float, str]]:
    """Start, end in s, and phone of every run of labels."""
    labels = utterance.labels
    edges = [0, *(np.flatnonzero(np.diff(labels)) + 1).tolist(), len(labels)]
    return [(a / 50, b / 50, PHONES[labels[a]]) for a, b in pairwise(edges)]


def chosen(utterances: Sequence[Utterance], clips: int) -> list[Utterance]:
    """So many clips of each source, evenly taken."""
    found = []
    for source in sorted({one.source for one in utterances} - set(LEFT_OUT)):
        own = [one for one in utterances if one.source == source]
        found += own[:: max(1, len(own) // clips)][:clips]
    return found


def takes(
    utterances: Sequence[Utterance], model: str | Animated, pops: list[int]
) -> Iterator[SpokenTake]:
    """model: its name, or what makes a motion of a sound."""
    for one in utterances:
        sound = Waveform(one.samples, RATE)
        if isinstance(model, str):
            motion = animate(sound, model=model, fps=FPS, life=0).motion
        else:
            motion = model(sound)
        opening = measure_mouth(motion)["opening_mm"]
        pops.append(sum((b - a) / FPS < POP_S for a, b in short_runs(opening >= CLOSED_MM, FPS)))
        yield SpokenTake(motion, phones_of(one))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--data", type=Path, required=True, help="folder with speech/")
    parser.add_argument("--model", action="append", help="can be repeated; all by default")
    parser.add_argument("--clips", type=int, default=40, help="of each source")
    given = parser.parse_args()
    utterances = chosen(read_reference(REFERENCE, given.data / "speech"), given.clips)
    print(f"{len(utterances)} clips; p, b, m: right / false / missed of wanted; f, v: recall; pops")
    for model in given.model or model_names():
        pops: list[int] = []
        score = phone_mouth_score(takes(utterances, model, pops))
        seals, teeth = score.closures, score.labiodentals
        print(
            f"{model:14} {seals.right} / {seals.made - seals.right} / {seals.wanted - seals.met}"
            f" of {seals.wanted}; false {1 - seals.precision:.3f}, missed {1 - seals.recall:.3f};"
            f" f, v {teeth.recall:.3f}, precision {teeth.precision:.3f}; rest {score.rest:.3f};"
            f" pops {sum(pops)} in {score.seconds:.0f} s"
        )


if __name__ == "__main__":
    main()
