"""Methods of alignment against known times: errors of each, and whether differences are chance.

Each method is fitted once per word to all of the word's pairs, without any truth, and then aligns
each of them. Words are what the paired test counts, since pairs of one word share recordings.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from elocute.alignment.aligner import Aligner, find_dtw_path
from elocute.alignment.alignment import WarpingPath as Steps
from elocute.alignment.config import DtwPathConfig
from elocute.alignment.methods import fit_aligner, resolve_method
from elocute.alignment.sound_views import DEFAULT, speech_view
from elocute.alignment.warping_paths import diagonal_path
from elocute.audio.noise import babble, with_noise
from elocute.audio.read import read_audio
from elocute.errors import AlignmentError, ElocuteError
from elocute.evaluation.path_errors import carried_overlap, path_error
from elocute.evaluation.timed_recordings import (
    RecordingPair,
    TimedRecording,
    read_phone_times,
    sentence_pair,
    word_pair,
)

EXPECTED = "/expected"
"""After a method's name: its features, with the path read along the expected alignment."""
SOFTNESS = 0.1
DIAGONAL = "diagonal"
"""No method: frames matched in proportion. What others are worth is what they add to it."""
MEASURES = ("error_frames", "overlap", "found")


@dataclass(frozen=True)
class WordScore:
    """One word by one method: means over its pairs.

    error_frames: Eq. 11, lower is better. overlap: mean intersection-over-union of phones carried
    over, higher is better; found: of the whole word, where it was to be found.
    """

    word: str
    method: str
    pairs: int
    error_frames: float
    overlap: float
    found: float


def read_recordings(
    folder: Path, encoder: str = DEFAULT, noise_db: float | None = None
) -> tuple[list[TimedRecording], list[str]]:
    """All NAME.wav of a word with their NAME.json, and what is wrong with those left out.

    noise_db: speech over babble of the same voices (backwards), in decibels; None for clean.
    """
    takes, broken = [], []
    for path in sorted(folder.glob("*.wav")):
        try:
            parts, word = read_phone_times(path.with_suffix(".json"))
            sound = read_audio(path)
            if noise_db is not None:
                seed = sum(path.stem.encode()) + len(folder.name)
                sound = with_noise(sound, babble(sound, seed), -noise_db)
            takes.append(TimedRecording(path.stem, speech_view(sound, encoder), parts, word))
        except ElocuteError as error:
            broken.append(str(error))
    return takes, broken


def word_pairs(takes: Sequence[TimedRecording]) -> list[RecordingPair]:
    """Every two recordings of a word that say it with nearly the same phones."""
    pairs = (word_pair(takes[i], takes[j]) for j in range(len(takes)) for i in range(j))
    return [pair for pair in pairs if pair]


def sentence_pairs(
    sentences: Sequence[TimedRecording], words: Sequence[TimedRecording], each: int = 3
) -> list[RecordingPair]:
    """Each sentence with so many recordings of its word by others, taken turn by turn."""
    pairs = []
    for place, sentence in enumerate(sentences):
        others = [words[(place + n + 1) % len(words)] for n in range(len(words))]
        found = (sentence_pair(sentence, w) for w in others if w.name != sentence.name)
        pairs += [pair for pair in found if pair][:each]
    return pairs


def score_word(
    word: str, pairs: Sequence[RecordingPair], methods: Sequence[str], seed: int = 0
) -> list[WordScore]:
    """One row per method. Open ends where the pairs are words to be found in sentences."""
    views = [(pair.source.view, pair.target.view) for pair in pairs]
    rows, known = [], {}
    for method in methods:
        name = method.removesuffix(EXPECTED)
        if name == DIAGONAL:
            paths = [diagonal_path(len(source), len(target)) for source, target in views]
        else:
            if name not in known:
                config = resolve_method(name).config(open_source=not pairs[0].whole)
                known[name] = fit_aligner(views, name, config, seed)
            fitted = known[name] if name == method else with_expected_path(known[name])
            paths = [each.path for each in fitted.align_all(views)]
        scores = np.array([_pair_scores(p, path) for p, path in zip(pairs, paths, strict=True)])
        error, overlap, found = scores.mean(axis=0)
        rows.append(WordScore(word, method, len(pairs), float(error), float(overlap), float(found)))
    return rows


def with_expected_path(fitted: Aligner) -> Aligner:
    """The same features, paths read along the expected alignment. Raises AlignmentError for a
    method that reads its paths in its own way."""
    if not isinstance(fitted.config, DtwPathConfig):
        raise AlignmentError.about(
            f"method {EXPECTED}",
            found=type(fitted.config).__name__,
            allowed="dtw, ctw, dctw, dcaw",
        )
    config = replace(fitted.config, softness=SOFTNESS)
    return replace(fitted, config=config, find_path=partial(find_dtw_path, config))


def _pair_scores(pair: RecordingPair, path: Steps) -> tuple[float, float, float]:
    rate = pair.source.rate
    sources, targets = [s for s, _ in pair.spans], [t for _, t in pair.spans]
    true = (sources[0][0], sources[-1][1])
    word = (targets[0][0], targets[-1][1])
    found = carried_overlap(path, [true], [word], rate)
    return path_error(path, pair.truth), carried_overlap(path, sources, targets, rate), found


def compare_methods(rows: Sequence[WordScore], judged: str = "dcaw") -> dict[str, dict[str, Any]]:
    """Per method: means over words, and Wilcoxon's signed-rank test of `judged` against it.

    p is two-sided, over words; `better` says for how many words the judged method has the lower
    error (higher overlap).
    """
    methods = list(dict.fromkeys(row.method for row in rows))
    table: dict[str, dict[str, Any]] = {}
    for method in methods:
        own = [row for row in rows if row.method == method]
        table[method] = {"words": len(own), "pairs": sum(row.pairs for row in own)}
        for measure in MEASURES:
            table[method][measure] = float(np.mean([getattr(row, measure) for row in own]))
        if method != judged and judged in methods:
            table[method]["against"] = _wilcoxon_tests(rows, judged, method)
    return table


def _wilcoxon_tests(
    rows: Sequence[WordScore], judged: str, method: str
) -> dict[str, dict[str, float]]:
    from scipy.stats import wilcoxon

    tests = {}
    for measure in MEASURES:
        known = {(row.word, row.method): getattr(row, measure) for row in rows}
        words = sorted({row.word for row in rows})
        gains = np.array([known[word, method] - known[word, judged] for word in words])
        if measure != "error_frames":
            gains = -gains
        moved = np.abs(gains) > 0
        p = float(np.asarray(wilcoxon(gains))[1]) if moved.sum() >= 5 else 1.0
        tests[measure] = {"gain": float(gains.mean()), "better": int((gains > 0).sum()), "p": p}
    return tests


def score_folder(
    folder: Path,
    methods: Sequence[str],
    *,
    sentences: Path | None = None,
    encoder: str = DEFAULT,
    noise_db: float | None = None,
    words: Sequence[str] | None = None,
    seed: int = 0,
    done: Callable[[float, list[WordScore]], None] | None = None,
) -> tuple[list[WordScore], list[str]]:
    """Every word of a folder, or those named: rows, and what could not be used.

    sentences: a folder of the same words in sentences, in which they are to be found; noise is
    then in the sentences alone. `done` hears the share and the rows of each word as it is judged.
    Raises AlignmentError where nothing can be judged.
    """
    for method in methods:
        if method != DIAGONAL:
            resolve_method(method.removesuffix(EXPECTED))
    names = word_names(folder, sentences) if words is None else words
    rows, broken = [], []
    for place, name in enumerate(names):
        pairs, wrong = _pairs(folder, name, sentences, encoder, noise_db)
        broken += wrong
        own: list[WordScore] = []
        if len(pairs) < 2:
            broken.append(f"{name}: {len(pairs)} pairs whose phones agree; allowed: two or more")
        else:
            own = score_word(name, pairs, methods, seed)
        rows += own
        if done:
            done((place + 1) / len(names), own)
    if not rows:
        raise AlignmentError.about(
            folder,
            found=broken[0] if broken else "no folder of recordings of a word",
            allowed="WORD/NAME.wav with NAME.json, two recordings of a word or more",
        )
    return rows, broken


def word_names(folder: Path, sentences: Path | None = None) -> list[str]:
    """The words that a folder holds, and the sentences too where they are given."""
    names = sorted(p.name for p in folder.iterdir() if p.is_dir()) if folder.is_dir() else []
    return [name for name in names if sentences is None or (sentences / name).is_dir()]


def _pairs(
    folder: Path, name: str, sentences: Path | None, encoder: str, noise_db: float | None
) -> tuple[list[RecordingPair], list[str]]:
    takes, broken = read_recordings(folder / name, encoder, None if sentences else noise_db)
    if sentences is None:
        return word_pairs(takes), broken
    spoken, wrong = read_recordings(sentences / name, encoder, noise_db)
    return sentence_pairs([take for take in spoken if take.word], takes), broken + wrong
