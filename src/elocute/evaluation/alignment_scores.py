"""Methods of alignment against known times: errors of each, and whether differences are chance.

Each method is fitted without any truth, to all pairs of one word or (`/together`) of all words at
once, and then aligns each of them. Words are what the paired test counts, since pairs of one word
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
from elocute.alignment.alignment import FloatArray
from elocute.alignment.alignment import WarpingPath as Steps
from elocute.alignment.config import DtwPathConfig
from elocute.alignment.methods import fit_aligner, resolve_method
from elocute.alignment.sound_views import DEFAULT, WINDOWS, speech_view
from elocute.alignment.warping_paths import diagonal_path
from elocute.audio.noise import babble, with_noise
from elocute.audio.read import read_audio
from elocute.errors import AlignmentError, ElocuteError
from elocute.evaluation.alignment_trials import Pair, Take, read_parts, sentence_pair, word_pair
from elocute.evaluation.path_errors import carried_overlap, path_error

SOFTNESS = 0.1
DIAGONAL = "diagonal"
"""No method: frames matched in proportion. What others are worth is what they add to it."""
READINGS = {"features": None, "expected": SOFTNESS}
"""How else features may be read: by the cheapest path, or along soft-DTW's expected alignment."""
TOGETHER = "together"
MEASURES = ("error_frames", "overlap", "found")


@dataclass(frozen=True)
class Contender:
    """A method as it takes part: its row's name, settings, and how it is fitted and read.

    settings: those that are not the method's defaults. together: fitted once, to the pairs of all
    words. reading: one of `READINGS`, or empty for the method's own.
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


def contender(name: str) -> Contender:
    """METHOD, METHOD/together, METHOD/expected, … as a contender. Raises AlignmentError."""
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
    return Contender(name, method, together=TOGETHER in ways, reading=reading)


@dataclass(frozen=True)
class Row:
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


def read_takes(
    folder: Path, encoder: str = DEFAULT, noise_db: float | None = None
) -> tuple[list[Take], list[str]]:
    """All NAME.wav of a word with their NAME.json, and what is wrong with those left out.

    noise_db: speech over babble of the same voices (backwards), in decibels; None for clean.
    """
    takes, broken = [], []
    for path in sorted(folder.glob("*.wav")):
        try:
            parts, word = read_parts(path.with_suffix(".json"))
            sound = read_audio(path)
            if noise_db is not None:
                seed = sum(path.stem.encode()) + len(folder.name)
                sound = with_noise(sound, babble(sound, seed), -noise_db)
            takes.append(Take(path.stem, speech_view(sound, encoder), parts, word))
        except ElocuteError as error:
            broken.append(str(error))
    return takes, broken


def pairs_of_words(takes: Sequence[Take]) -> list[Pair]:
    """Every two recordings of a word that say it with nearly the same phones."""
    pairs = (word_pair(takes[i], takes[j]) for j in range(len(takes)) for i in range(j))
    return [pair for pair in pairs if pair]


def pairs_to_find(sentences: Sequence[Take], words: Sequence[Take], each: int = 3) -> list[Pair]:
    """Each sentence with so many recordings of its word by others, taken turn by turn."""
    pairs = []
    for place, sentence in enumerate(sentences):
        others = [words[(place + n + 1) % len(words)] for n in range(len(words))]
        found = (sentence_pair(sentence, w) for w in others if w.name != sentence.name)
        pairs += [pair for pair in found if pair][:each]
    return pairs


def judge_words(
    words: Mapping[str, Sequence[Pair]],
    contenders: Sequence[Contender],
    *,
    seed: int = 0,
    encoder: str = DEFAULT,
    known: Collection[str] = (),
    done: Callable[[float, list[Row]], None] | None = None,
) -> list[Row]:
    """One row for each word and contender. Open ends where pairs are words in sentences.

    words: pairs of each. known: words to fit to, where contenders are fitted together, but not to
    judge. `done` hears the share and the rows of each word as it is judged.
    """
    every = [pair for pairs in words.values() for pair in pairs]
    fits = {
        each.fit_key: _fitted(each, every, seed, encoder) for each in contenders if each.together
    }
    rows: list[Row] = []
    for place, (word, pairs) in enumerate(words.items()):
        if word in known:
            continue
        own_fits = dict(fits)
        own: list[Row] = []
        for each in contenders:
            if each.fit_key not in own_fits:
                own_fits[each.fit_key] = _fitted(each, pairs, seed, encoder)
            paths = _paths(own_fits[each.fit_key], each, pairs)
            scores = [path_scores(pair, path) for pair, path in zip(pairs, paths, strict=True)]
            error, overlap, found = map(float, np.mean(scores, axis=0))
            own.append(Row(word, each.name, len(pairs), error, overlap, found))
        rows += own
        if done:
            done((place + 1) / len(words), own)
    return rows


def _fitted(each: Contender, pairs: Sequence[Pair], seed: int, encoder: str) -> Aligner | None:
    if each.method == DIAGONAL:
        return None
    settings = dict(each.settings)
    if each.method == "dcaw":
        settings["windows"] = encoder == WINDOWS
    config = resolve_method(each.method).config(open_source=not pairs[0].whole, **settings)
    return fit_aligner(_views(pairs), each.method, config, seed)


def _paths(fitted: Aligner | None, each: Contender, pairs: Sequence[Pair]) -> list[Steps]:
    if fitted is None:
        return [diagonal_path(len(source), len(target)) for source, target in _views(pairs)]
    if each.reading:
        fitted = read_otherwise(fitted, READINGS[each.reading])
    return [found.path for found in fitted.align_all(_views(pairs))]


def _views(pairs: Sequence[Pair]) -> list[tuple[FloatArray, FloatArray]]:
    return [(pair.source.view, pair.target.view) for pair in pairs]


def read_otherwise(fitted: Aligner, softness: float | None) -> Aligner:
    """The same features and costs, with paths by DTW, or softly; of DCAW without its attention."""
    if not isinstance(fitted.config, DtwPathConfig):
        return read_features(fitted, softness)
    config = replace(fitted.config, softness=softness)
    return replace(fitted, config=config, find_path=partial(find_dtw_path, config))


def path_scores(pair: Pair, path: Steps) -> tuple[float, float, float]:
    """Error in frames, overlap of the parts carried over, and of the whole word (`Row`)."""
    rate = pair.source.rate
    sources, targets = [s for s, _ in pair.spans], [t for _, t in pair.spans]
    true = (sources[0][0], sources[-1][1])
    word = (targets[0][0], targets[-1][1])
    found = carried_overlap(path, [true], [word], rate)
    return path_error(path, pair.truth), carried_overlap(path, sources, targets, rate), found


def summarise(rows: Sequence[Row], judged: str = "dcaw") -> dict[str, dict[str, Any]]:
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
            table[method]["against"] = _tested(rows, judged, method)
    return table


def _tested(rows: Sequence[Row], judged: str, method: str) -> dict[str, dict[str, float]]:
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


def judge_folder(
    folder: Path,
    contenders: Sequence[Contender],
    *,
    sentences: Path | None = None,
    encoder: str = DEFAULT,
    noise_db: float | None = None,
    words: Sequence[str] | None = None,
    seed: int = 0,
    known: Collection[str] = (),
    done: Callable[[float, list[Row]], None] | None = None,
) -> tuple[list[Row], list[str]]:
    """Every word of a folder, or those named: rows, and what could not be used.

    sentences: a folder of the same words in sentences, in which they are to be found; noise is
    then in the sentences alone. The rest as for `judge_words`. Raises AlignmentError where nothing
    can be judged.
    """
    broken: list[str] = []
    usable: dict[str, list[Pair]] = {}
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
    rows = judge_words(usable, contenders, seed=seed, encoder=encoder, known=known, done=done)
    return rows, broken


def word_names(folder: Path, sentences: Path | None = None) -> list[str]:
    """The words that a folder holds, and the sentences too where they are given."""
    names = sorted(p.name for p in folder.iterdir() if p.is_dir()) if folder.is_dir() else []
    return [name for name in names if sentences is None or (sentences / name).is_dir()]


def _pairs(
    folder: Path, name: str, sentences: Path | None, encoder: str, noise_db: float | None
) -> tuple[list[Pair], list[str]]:
    takes, broken = read_takes(folder / name, encoder, None if sentences else noise_db)
    if sentences is None:
        return pairs_of_words(takes), broken
    spoken, wrong = read_takes(sentences / name, encoder, noise_db)
    return pairs_to_find([take for take in spoken if take.word], takes), broken + wrong
