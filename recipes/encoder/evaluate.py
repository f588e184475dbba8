"""What the encoder hears on speakers it never met."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from elocute.encoders.phones_and_visemes import PHONE_TO_VISEME, PHONES, VISEMES
from recipes.encoder.store import Shard

Hear = Callable[[np.ndarray], np.ndarray]
VISEME_OF = np.array([VISEMES.index(PHONE_TO_VISEME[phone]) for phone in PHONES])
BILABIAL = [PHONES.index(p) for p in ("P", "B", "M")]
LABIODENTAL = [PHONES.index(p) for p in ("F", "V")]
THRESHOLDS = np.arange(0.05, 0.95, 0.025)


@dataclass(frozen=True)
class Utterance:
    """(sample,) at 16 kHz and (frame,) phones at 50 Hz."""

    speaker: str
    source: str
    language: str
    samples: np.ndarray
    labels: np.ndarray


@dataclass(frozen=True)
class Heard:
    """One utterance: log-posteriors and labels at 50 Hz."""

    speaker: str
    source: str
    language: str
    log_posteriors: np.ndarray
    labels: np.ndarray


def utterances_of(shards: list[Shard]) -> Iterator[Utterance]:
    for shard in shards:
        for item in shard.items:
            labels = np.asarray(shard.item_labels(item)[::2], int)
            yield Utterance(item.speaker, item.source, item.language, shard.samples(item), labels)


def listen(
    utterances: Iterable[Utterance], hear: Hear, noise_db: float | None = None
) -> list[Heard]:
    """Run `hear` over every utterance, with white-to-pink noise at a signal-to-noise ratio."""
    results = []
    numbers = np.random.default_rng(5)
    for one in utterances:
        samples = one.samples
        if noise_db is not None:
            samples = samples + _noise(numbers, samples, noise_db)
        posteriors = hear(samples)
        count = min(len(one.labels), len(posteriors))
        results.append(
            Heard(one.speaker, one.source, one.language, posteriors[:count], one.labels[:count])
        )
    return results


def _noise(numbers: np.random.Generator, samples: np.ndarray, snr_db: float) -> np.ndarray:
    spectrum = np.fft.rfft(numbers.standard_normal(len(samples)))
    spectrum *= (np.arange(len(spectrum)) + 50.0) ** -numbers.uniform(0, 0.6)
    noise = np.fft.irfft(spectrum, len(samples))
    gain = np.sqrt(np.mean(samples**2) / np.mean(noise**2)) * 10 ** (-snr_db / 20)
    return (noise * gain).astype(np.float32)


def viseme_accuracy(heard: list[Heard]) -> float:
    """Share of frames, silence included, whose most likely phone looks like the true one.

    Posteriors are summed over each viseme before the best is taken.
    """
    right = total = 0
    for one in heard:
        scores = viseme_scores(one.log_posteriors)
        right += int((scores.argmax(axis=1) == VISEME_OF[one.labels]).sum())
        total += len(one.labels)
    return right / total


def viseme_scores(log_posteriors: np.ndarray) -> np.ndarray:
    scores = np.zeros((len(log_posteriors), len(VISEMES)))
    np.add.at(scores.T, VISEME_OF, np.exp(log_posteriors).T)
    return scores


def f1_by_threshold(heard: list[Heard], phones: list[int]) -> np.ndarray:
    """(threshold, 3) hits, misses, false alarms over frames."""
    counts = np.zeros((len(THRESHOLDS), 3))
    for one in heard:
        score = np.exp(one.log_posteriors[:, phones]).sum(axis=1)
        truth = np.isin(one.labels, phones)
        said = score[None] > THRESHOLDS[:, None]
        counts += np.stack(
            [(said & truth).sum(1), (~said & truth).sum(1), (said & ~truth).sum(1)], axis=1
        )
    return counts


def f1(counts: np.ndarray) -> np.ndarray:
    hits, misses, alarms = np.moveaxis(counts, -1, 0)
    return 2 * hits / np.maximum(2 * hits + misses + alarms, 1)


def tuned_f1(heard: list[Heard], phones: list[int]) -> tuple[float, float]:
    """F1 and threshold, each half of the speakers at the threshold tuned on the other half.

    Of a single speaker, each half of the utterances.
    """
    speakers = sorted({one.speaker for one in heard})
    side_of = [
        (speakers.index(one.speaker) if len(speakers) > 1 else index) % 2
        for index, one in enumerate(heard)
    ]
    halves = [
        f1_by_threshold([one for one, at in zip(heard, side_of, strict=True) if at == side], phones)
        for side in (0, 1)
    ]
    picks = [int(f1(half).argmax()) for half in halves]
    joint = f1(halves[0][picks[1]] + halves[1][picks[0]])
    return float(joint), float(np.mean(THRESHOLDS[picks]))


def report(heard: list[Heard], noisy: list[Heard]) -> dict[str, float]:
    """The figures of the card."""
    bilabial, bilabial_at = tuned_f1(heard, BILABIAL)
    labiodental, labiodental_at = tuned_f1(heard, LABIODENTAL)
    by_source: dict[str, list[Heard]] = defaultdict(list)
    for one in heard:
        by_source[one.source].append(one)
    return {
        "viseme_accuracy": viseme_accuracy(heard),
        "bilabial_f1": bilabial,
        "bilabial_threshold": bilabial_at,
        "labiodental_f1": labiodental,
        "labiodental_threshold": labiodental_at,
        "viseme_accuracy_10db": viseme_accuracy(noisy),
        "minutes": sum(len(one.labels) for one in heard) / 3000,
        "speakers": len({one.speaker for one in heard}),
        **{f"viseme_accuracy {name}": viseme_accuracy(part) for name, part in by_source.items()},
    }
