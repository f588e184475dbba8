"""Methods of alignment against known phone times: the errors of each, and tests between them.

Each method is fitted without the true times, to all pairs of one word or (`/together`) of all words
at once, and then aligns each of them. The paired test counts words, since the pairs of one word
share recordings.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from elocute.alignment.aligner import Aligner, find_dtw_path, read_features
from elocute.alignment.alignment import WarpingPath
from elocute.alignment.dtw import diagonal_path
from elocute.alignment.methods import fit_aligner, resolve_method
from elocute.alignment.settings import DtwPathConfig
from elocute.alignment.sound_views import DEFAULT, WINDOWS, speech_view
from elocute.array_types import Float32Array
from elocute.audio.noise import babble, with_noise
from elocute.audio.read import read_audio
from elocute.errors import AlignmentError, ElocuteError
from elocute.evaluation.timed_recordings import (
    RecordingPair,
    TimedRecording,
    carried_overlap,
    path_error,
    read_phone_times,
    sentence_pair,
    word_pair,
)

SOFTNESS = 0.1
DIAGONAL = "diagonal"
"""No method: frames matched in proportion. What others are worth is what they add to it."""
READINGS = {"features": None, "expected": SOFTNESS}
"""How else features may be read: by the cheapest path, or along soft-DTW's expected alignment."""
TOGETHER = "together"
MEASURES = ("error_frames", "overlap", "found")
PLAIN = ("diagonal", "dtw", "softdtw", "ctw", "ctw/expected", "dctw", "dctw/expected")
PARTS: dict[str, Sequence[tuple[str, dict[str, Any]]]] = {
    "cca-soft": (
        ("no guide", {"guide": 0.0}),
        ("no prior", {"prior": 0.0}),
        ("no attention", {"sharpness": 0.0}),
        ("no guide, prior, attention", {"guide": 0.0, "prior": 0.0, "sharpness": 0.0}),
        ("cheapest path", {"softness": None}),
        ("no training", {"steps": 0}),
    ),
    "dcaw": (
        ("no training", {"steps": 0}),
        ("no folding", {"folds": 0, "fold_every": 10**6}),
        ("Eq. 2 alone", {"mutual": False}),
        ("attention fixed", {"attention": "fixed"}),
        ("attention sampled", {"attention": "sampled"}),
        ("attention DTW's path", {"attention": "path"}),
        ("attention diagonal", {"attention": "diagonal"}),
        ("attention uniform", {"attention": "uniform"}),
    ),
}
"""Parts of the learned methods that an ablation leaves out."""


@dataclass(frozen=True)
class MethodVariant:
    """A method, its settings, and how it is fitted and read.

    name: what it is called in tables. method: as for `resolve_method`, or `DIAGONAL`. settings:
    those that differ from the method's defaults. together: fitted once, to the pairs of all words.
    reading: one of `READINGS`; empty for the method's own.
    """

    name: str
    method: str
    settings: tuple[tuple[str, Any], ...] = ()
    together: bool = False
    reading: str = ""

    @property
    def fit_key(self) -> tuple[object, ...]:
        """Equal where the same fit will do."""
        return self.method, self.settings, self.together


def method_variant(name: str) -> MethodVariant:
    """Read the name of a variant: METHOD, METHOD/together, METHOD/expected, METHOD/features.

    Raises AlignmentError for an unknown method, or a way that it cannot be fitted or read in.
    """
    method, *ways = name.split("/")
    if method != DIAGONAL:
        resolve_method(method)
    allowed = {TOGETHER, *READINGS} if method not in (DIAGONAL, "softdtw") else set()
    unknown = [way for way in ways if way not in allowed]
    if unknown or len(set(ways) & set(READINGS)) > 1:
        raise AlignmentError.about(
            f"method {name!r}",
            found="/".join(unknown or ways),
            allowed=", ".join(sorted(allowed)) or "nothing after its name",
        )
    reading = next((way for way in ways if way in READINGS), "")
    return MethodVariant(name, method, together=TOGETHER in ways, reading=reading)


def ablation_variants(together: bool = False) -> list[MethodVariant]:
    """Features, CCA, and both learned methods with and without their parts, in this order.

    Of DCAW also what its features give by DTW, read without attention, and what is left where
    attention is off in training too: warped by the diagonal, read by DTW. together: learned methods
    are fitted once to all words.
    """
    way = "/together" if together else ""
    learned = {"ctw", "dctw"}
    variants = [
        method_variant(n.replace("/", f"{way}/", 1) if "/" in n else n + way)
        if n.split("/")[0] in learned
        else method_variant(n)
        for n in PLAIN
    ]
    for method, parts in PARTS.items():
        variants.append(method_variant(method + way))
        if method == "dcaw":
            variants += [method_variant(f"dcaw{way}/{reading}") for reading in READINGS]
        for name, settings in parts:
            chosen = tuple(settings.items())
            variants.append(MethodVariant(f"{method}: {name}", method, chosen, together))
        if method == "dcaw":
            off = (("attention", "diagonal"),)
            variants.append(MethodVariant("dcaw: attention off", method, off, together, "features"))
    return variants


@dataclass(frozen=True)
class WordScore:
    """One word aligned by one method: means over so many pairs of recordings.

    error_frames: of the path, Eq. 11 of Tzirakis et al. 2019; lower is better. overlap: mean
    intersection over union of phones carried over, 0 to 1; higher is better. found: the same of the
    whole word, where it was to be found in a sentence.
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
    """Read all recordings of a word, NAME.wav with NAME.json of phone times beside it, by name.

    encoder: gives the views, as for `speech_view`. noise_db: level of the speech over babble made
    of the same voice backwards; clean by default. The second list says why others were left out.
    """
    recordings, broken = [], []
    for path in sorted(folder.glob("*.wav")):
        try:
            phones, word = read_phone_times(path.with_suffix(".json"))
            sound = read_audio(path)
            if noise_db is not None:
                seed = sum(path.stem.encode()) + len(folder.name)
                sound = with_noise(sound, babble(sound, seed), -noise_db)
            recordings.append(TimedRecording(path.stem, speech_view(sound, encoder), phones, word))
        except ElocuteError as error:
            broken.append(str(error))
    return recordings, broken


def word_pairs(recordings: Sequence[TimedRecording]) -> list[RecordingPair]:
    """Every two recordings of a word that say it with nearly the same phones."""
    pairs = (
        word_pair(recordings[i], recordings[j]) for j in range(len(recordings)) for i in range(j)
    )
    return [pair for pair in pairs if pair]


def sentence_pairs(
    sentences: Sequence[TimedRecording], words: Sequence[TimedRecording], each: int = 3
) -> list[RecordingPair]:
    """Each sentence with recordings of its word by others in turn, `each` of them at most."""
    pairs = []
    for place, sentence in enumerate(sentences):
        others = [words[(place + n + 1) % len(words)] for n in range(len(words))]
        candidates = (sentence_pair(sentence, w) for w in others if w.name != sentence.name)
        pairs += [pair for pair in candidates if pair][:each]
    return pairs


def score_words(
    words: Mapping[str, Sequence[RecordingPair]],
    variants: Sequence[MethodVariant],
    *,
    seed: int = 0,
    encoder: str = DEFAULT,
    known: Collection[str] = (),
    on_word: Callable[[float, list[WordScore]], None] | None = None,
) -> list[WordScore]:
    """Align all pairs of each word by each variant and compare the paths with the true ones.

    The pairs are all whole, or none: of words in sentences, methods may start and end anywhere in
    the sentence. encoder: what the views were made with. known: words that need no scores; variants
    fitted together are fitted to them too. on_word: called with the share that is done, 0 to 1, and
    the scores of each word.
    """
    every = [pair for pairs in words.values() for pair in pairs]
    fits = {each.fit_key: _fitted(each, every, seed, encoder) for each in variants if each.together}
    rows: list[WordScore] = []
    for place, (word, pairs) in enumerate(words.items()):
        if word in known:
            continue
        own_fits = dict(fits)
        own: list[WordScore] = []
        for each in variants:
            if each.fit_key not in own_fits:
                own_fits[each.fit_key] = _fitted(each, pairs, seed, encoder)
            paths = _paths(own_fits[each.fit_key], each, pairs)
            scores = [pair_scores(pair, path) for pair, path in zip(pairs, paths, strict=True)]
            error, overlap, whole = map(float, np.mean(scores, axis=0))
            own.append(WordScore(word, each.name, len(pairs), error, overlap, whole))
        rows += own
        if on_word:
            on_word((place + 1) / len(words), own)
    return rows


def _fitted(
    each: MethodVariant, pairs: Sequence[RecordingPair], seed: int, encoder: str
) -> Aligner | None:
    if each.method == DIAGONAL:
        return None
    settings = dict(each.settings)
    if each.method == "dcaw":
        settings["windows"] = encoder == WINDOWS
    config = resolve_method(each.method).config(open_source=not pairs[0].whole, **settings)
    return fit_aligner(_views(pairs), each.method, config, seed)


def _paths(
    fitted: Aligner | None, each: MethodVariant, pairs: Sequence[RecordingPair]
) -> list[WarpingPath]:
    if fitted is None:
        return [diagonal_path(len(source), len(target)) for source, target in _views(pairs)]
    if each.reading:
        fitted = read_otherwise(fitted, READINGS[each.reading])
    return [alignment.path for alignment in fitted.align_all(_views(pairs))]


def _views(pairs: Sequence[RecordingPair]) -> list[tuple[Float32Array, Float32Array]]:
    return [(pair.source.view, pair.target.view) for pair in pairs]


def read_otherwise(fitted: Aligner, softness: float | None) -> Aligner:
    """An aligner with the same features whose paths are found by dynamic time warping.

    What reads its path from attention does without it. softness: as of `PathSettings`; None for the
    cheapest path.
    """
    if not isinstance(fitted.config, DtwPathConfig):
        return read_features(fitted, softness)
    config = replace(fitted.config, softness=softness)
    return replace(fitted, config=config, find_path=partial(find_dtw_path, config))


def pair_scores(pair: RecordingPair, path: WarpingPath) -> tuple[float, float, float]:
    """Error of a path in frames, overlap of the phones, and overlap of the whole word."""
    rate = pair.source.rate
    sources, targets = [s for s, _ in pair.spans], [t for _, t in pair.spans]
    true = (sources[0][0], sources[-1][1])
    word = (targets[0][0], targets[-1][1])
    whole = carried_overlap(path, [true], [word], rate)
    return path_error(path, pair.truth), carried_overlap(path, sources, targets, rate), whole


def compare_methods(
    rows: Sequence[WordScore], candidate: str = "dcaw"
) -> dict[str, dict[str, Any]]:
    """Means over words, and Wilcoxon's signed-rank test of one method against the others.

    By method `words`, `pairs` and the means of `MEASURES`; for all but the candidate, if it is
    there, also `against`: for each measure the candidate's mean `gain` over the method (positive is
    better), the number of words for which it is `better`, and the two-sided `p` over words.
    """
    methods = list(dict.fromkeys(row.method for row in rows))
    table: dict[str, dict[str, Any]] = {}
    for method in methods:
        own = [row for row in rows if row.method == method]
        table[method] = {"words": len(own), "pairs": sum(row.pairs for row in own)}
        for measure in MEASURES:
            table[method][measure] = float(np.mean([getattr(row, measure) for row in own]))
        if method != candidate and candidate in methods:
            table[method]["against"] = _wilcoxon_tests(rows, candidate, method)
    return table


def _wilcoxon_tests(
    rows: Sequence[WordScore], candidate: str, method: str
) -> dict[str, dict[str, float]]:
    """Gain, words gained and p of each measure, of the candidate over a method."""
    from scipy.stats import wilcoxon

    tests = {}
    for measure in MEASURES:
        known = {(row.word, row.method): getattr(row, measure) for row in rows}
        words = sorted({row.word for row in rows})
        gains = np.array([known[word, method] - known[word, candidate] for word in words])
        if measure != "error_frames":
            gains = -gains
        moved = np.abs(gains) > 0
        p = float(np.asarray(wilcoxon(gains))[1]) if moved.sum() >= 5 else 1.0
        tests[measure] = {"gain": float(gains.mean()), "better": int((gains > 0).sum()), "p": p}
    return tests


def score_folder(
    folder: Path,
    variants: Sequence[MethodVariant],
    *,
    sentences: Path | None = None,
    encoder: str = DEFAULT,
    noise_db: float | None = None,
    words: Sequence[str] | None = None,
    seed: int = 0,
    known: Collection[str] = (),
    on_word: Callable[[float, list[WordScore]], None] | None = None,
) -> tuple[list[WordScore], list[str]]:
    """Score the words of FOLDER/WORD/NAME.wav with NAME.json of phone times, or those named.

    sentences: a folder of the same words in sentences, in which they are to be found; noise is then
    in the sentences alone. encoder, noise_db: as for `read_recordings`. known, on_word: as for
    `score_words`. Gives a score for each word and method, and what could not be used, and why.
    Raises AlignmentError for an unknown method, or where no word can be scored.
    """
    broken: list[str] = []
    usable: dict[str, list[RecordingPair]] = {}
    for name in word_names(folder, sentences) if words is None else words:
        pairs, wrong = _pairs(folder, name, sentences, encoder, noise_db)
        broken += wrong
        if len(pairs) < 2:
            broken.append(f"{name}: {len(pairs)} pairs whose phones agree; allowed: two or more")
        else:
            usable[name] = pairs
    if not usable:
        raise AlignmentError.about(
            folder,
            found=broken[0] if broken else "no folder of recordings of a word",
            allowed="WORD/NAME.wav with NAME.json, two recordings of a word or more",
        )
    rows = score_words(usable, variants, seed=seed, encoder=encoder, known=known, on_word=on_word)
    return rows, broken


def word_names(folder: Path, sentences: Path | None = None) -> list[str]:
    """Sorted names of the words that a folder holds; with `sentences`, those that are in both."""
    names = sorted(p.name for p in folder.iterdir() if p.is_dir()) if folder.is_dir() else []
    return [name for name in names if sentences is None or (sentences / name).is_dir()]


def _pairs(
    folder: Path, name: str, sentences: Path | None, encoder: str, noise_db: float | None
) -> tuple[list[RecordingPair], list[str]]:
    """Pairs of one word, and why recordings were left out."""
    words, broken = read_recordings(folder / name, encoder, None if sentences else noise_db)
    if sentences is None:
        return word_pairs(words), broken
    spoken, wrong = read_recordings(sentences / name, encoder, noise_db)
    return sentence_pairs([each for each in spoken if each.word], words), broken + wrong
