"""Which clips each experiment in the wild trains and is measured on, and their exact parameters.

Tzirakis et al. 2019, section 6.4: a network learns from propagated parameters of the training
speakers, is validated on those of other speakers, and is tested on the captured words of the
participant whose motion that was, which it has not heard. `exact` shards hold the same clips with
the motion that a simulator knows, which no capture of other people's speech could give.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elocute.array_types import Float32Array
from elocute.corpus.shards import Shards
from elocute.corpus.word_clip import SENTENCE
from elocute.errors import CorpusError, InputError
from elocute.files.json_records import read_record
from elocute.files.reading import FileKind
from elocute.training.crnn.feature_cache import CachedClip, FeatureCache, at_rate
from elocute.training.crnn.settings import CrnnTrainConfig
from elocute.training.crnn.training_data import training_clips

TRAININGS = ("speaker", "word", "mse")
TRAINING_CONTENTS = {
    "speaker": "other speakers, the same words",
    "word": "other speakers, other words",
    "mse": "as the first, mean squared error",
}
HELD_OUT = 10  # one word in so many is kept from training, as 50 of 500
SPLIT_ALLOWED = 'JSON with {"words": {"held_out": ["word", …]}}'
SPLIT_FILE = FileKind(SPLIT_ALLOWED, 16_000_000)


@dataclass(frozen=True)
class ExperimentClips:
    """The clips of one experiment: to learn from, to choose the epoch by, and to measure on.

    measured: "validation" and "test", recordings of speakers that are not trained on. Where clips
    were carried over, also "source", the own words of the captured speakers whose motion that was,
    unless they are trained on, and "participant", a captured speaker of the test part.
    """

    train: list[CachedClip]
    validation: list[CachedClip]
    measured: dict[str, list[CachedClip]]


def experiment_clips(
    features: FeatureCache,
    training: str,
    config: CrnnTrainConfig,
    held_out: Sequence[str] | None = None,
) -> ExperimentClips:
    """Select the clips of one of `TRAININGS`.

    "word" trains on words that its validation and test do not contain (`held_out`; by default one
    in `HELD_OUT`, chosen by a hash); clips of whole sentences are left out of it, as they contain
    words of both. config says whether captured clips are trained on. Raises CorpusError where a
    part has no clip, or no clip has a word that is held out.
    """
    if held_out is None:
        held_out = held_out_words([row.word for row in features.clips])
    held = set(held_out)

    def chosen(rows: Sequence[CachedClip], *, train: bool) -> list[CachedClip]:
        if training != "word":
            return list(rows)
        return [r for r in rows if r.word != SENTENCE and (r.word in held) != train]

    test = features.select("test")
    others = [row for row in test if row.carried] or test
    measured = {
        "validation": chosen(features.select("validation"), train=False),
        "test": chosen(others, train=False),
    }
    if any(row.carried for row in features.clips):
        own = [] if config.captured else features.select("train")
        for part, captured in (("source", own), ("participant", test)):
            rows = chosen([row for row in captured if not row.carried], train=False)
            measured |= {part: rows} if rows else {}
    train = chosen(training_clips(features, config), train=True)
    for part, rows in {"train": train, **measured}.items():
        if not rows:
            raise CorpusError.about(
                "shards",
                found=f"no clip in {part} ({TRAINING_CONTENTS[training]})",
                allowed="one or more",
            )
    return ExperimentClips(train, measured["validation"], measured)


def held_out_words(words: Sequence[str]) -> tuple[str, ...]:
    """One word in `HELD_OUT`, sorted, chosen by a hash and so independent of what else is there."""
    order = sorted({w for w in words if w != SENTENCE}, key=_hash)
    return tuple(sorted(order[: max(1, len(order) // HELD_OUT)]))


def _hash(word: str) -> str:
    """Hexadecimal SHA-256 of a word."""
    return hashlib.sha256(word.encode()).hexdigest()


def read_held_out(path: str | Path) -> tuple[str, ...]:
    """Read which words are held out, from split.json as `recipes.build_words` writes it.

    Raises InputError for a file without them.
    """
    record = read_record(path, SPLIT_FILE)
    words = record.get("words")
    held = words.get("held_out") if isinstance(words, dict) else None
    if not isinstance(held, list) or not held or not all(isinstance(w, str) for w in held):
        raise InputError.about(path, found="no words held out", allowed=SPLIT_ALLOWED)
    return tuple(held)


def exact_parameters(shards: Shards, exact: Shards, fps: float) -> dict[str, Float32Array]:
    """Exact parameters (frame, parameter) of the clips of shards at `fps`, as far as they are
    known.

    exact: some of the same clips with parameters of the same basis; CorpusError for another.
    """
    ours, theirs = (each.basis.head.expression_basis for each in (shards, exact))
    if ours.shape != theirs.shape or not np.allclose(ours, theirs, atol=1e-6):
        raise CorpusError.about(
            exact.folder,
            found="another basis",
            allowed=f"that of {shards.folder}, which its clips are compared with",
        )
    return {clip.clip: at_rate(clip.parameters, clip.fps, fps) for clip in exact.clips()}
