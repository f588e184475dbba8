"""Words of captured speakers: where they are said in a corpus, and the motion that goes with them.

A clip whose text is one word is that word, whole; of any other, WORDS/SUBJECT.SENTENCE.json (or
.TextGrid) says when each word is said, as `elocute words` writes it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, Float64Array
from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_store import Corpus
from elocute.errors import CorpusError
from elocute.motion.motion import Motion
from elocute.numerics.resampling import read_rows
from elocute.numerics.ridge import ridge_projection
from elocute.speech.text.word_times import read_words

MARGIN_S = 0.05  # kept around a word, where its neighbours leave room: lips move before the sound


@dataclass(frozen=True)
class CapturedWord:
    """A word that a captured speaker says from start_s to end_s of a clip of the corpus."""

    name: str
    word: str
    subject: str
    split: str
    clip: str
    start_s: float
    end_s: float


def captured_words(
    corpus: Corpus, words: Path | None = None, split: str = "default"
) -> dict[str, list[CapturedWord]]:
    """All that captured speakers say, with its times, by the spelling in lower case.

    words: folder of CLIP.json or CLIP.TextGrid with the times of the words, as `elocute words`
    writes them; a clip of one word needs none. split: where the corpus lacks it, all clips count as
    `train`. Raises CorpusError where no clip holds a word with times, and AlignmentError for a file
    of words that is broken or does not fit its clip.
    """
    if words is not None and not words.is_dir():
        raise CorpusError.about(words, found="no folder", allowed="a folder of CLIP.json")
    parts = _parts(corpus, split)
    by_spelling: dict[str, list[CapturedWord]] = {}
    for entry in corpus.entries:
        if entry.name not in parts:
            continue
        for index, (word, start, end) in enumerate(_spoken(corpus, entry.name, words)):
            by_spelling.setdefault(word, []).append(
                CapturedWord(
                    name=f"{entry.name}.{index:03d}",
                    word=word,
                    subject=entry.subject,
                    split=parts[entry.name],
                    clip=entry.name,
                    start_s=start,
                    end_s=end,
                )
            )
    if not by_spelling:
        raise CorpusError.about(
            corpus.folder,
            found="no word with its times",
            allowed="clips of one word each, or `words`, a folder with CLIP.json",
            remedy="make them: elocute words segment",
        )
    return by_spelling


def words_of_source(
    captured: dict[str, list[CapturedWord]], source: str
) -> dict[str, list[CapturedWord]]:
    """The same with one subject alone in the training part; the other parts stay.

    Raises CorpusError for a subject of whom that part holds no word.
    """
    known = {word.subject for words in captured.values() for word in words if word.split == "train"}
    if source not in known:
        raise CorpusError.about(
            "`sources`",
            found=f"{source}, of whom no word is in the training part",
            allowed=", ".join(sorted(known)) or "nobody: the training part holds no word",
        )
    kept = {
        spelling: [word for word in words if word.split != "train" or word.subject == source]
        for spelling, words in captured.items()
    }
    return {spelling: words for spelling, words in kept.items() if words}


def _parts(corpus: Corpus, split: str) -> dict[str, str]:
    """From the name of a clip to train, validation or test."""
    if split not in corpus.splits:
        return {entry.name: "train" for entry in corpus.entries}
    parts = corpus.split(split).parts()
    return {clip: part for part, clips in parts.items() for clip in clips}


def _spoken(corpus: Corpus, clip: str, words: Path | None) -> list[tuple[str, float, float]]:
    """(word, start_s, end_s) with margins as wide as the neighbours allow."""
    entry = corpus.entry(clip)
    duration = entry.frames / corpus.fps
    path = _words_path(words, clip)
    if path is None:
        text = entry.text.strip().casefold()
        return [(text, 0.0, duration)] if len(text.split()) == 1 else []
    listed = read_words(path).words
    if listed[-1].end_s > duration + 1 / corpus.fps:
        raise CorpusError.about(
            path,
            found=f"words until {listed[-1].end_s:.2f} s",
            allowed=f"{duration:.2f} s, the length of clip {clip}",
        )
    spoken = []
    for index, word in enumerate(listed):
        before = listed[index - 1].end_s if index else 0.0
        after = listed[index + 1].start_s if index + 1 < len(listed) else duration
        start = max(word.start_s - MARGIN_S, min((before + word.start_s) / 2, word.start_s), 0.0)
        end = min(word.end_s + MARGIN_S, max((after + word.end_s) / 2, word.end_s), duration)
        spoken.append((word.text.strip(".,;:!?").casefold(), start, end))
    return spoken


def _words_path(words: Path | None, clip: str) -> Path | None:
    if words is None:
        return None
    for suffix in (".json", ".TextGrid"):
        if (words / f"{clip}{suffix}").is_file():
            return words / f"{clip}{suffix}"
    return None


@dataclass(frozen=True, eq=False)
class CapturedCorpus:
    """A corpus whose motion is given as parameters of a basis of speech blendshapes.

    basis: a Motion, as `sweep` makes it. Raises CorpusError where their meshes differ.
    """

    corpus: Corpus
    basis: Motion

    def __post_init__(self) -> None:
        shapes = self.basis.head.expression_basis
        if shapes.shape[1] != self.corpus.vertex_count:
            raise CorpusError.about(
                "basis",
                found=f"{shapes.shape[1]} vertices",
                allowed=f"{self.corpus.vertex_count}, as {self.corpus.folder} has",
            )

    @cached_property
    def _solver(self) -> Float64Array:
        """(number or component, parameter): least squares, from what the corpus stores.

        In double precision: sums over so many vertices would end in other bits with another
        number of threads, and shards are to be the same whoever wrote them.
        """
        shapes = self.basis.head.expression_basis
        flat = shapes.reshape(len(shapes), -1).astype(np.float64)
        inverse = ridge_projection(flat)
        if self.corpus.basis is None:
            return inverse
        stored = np.asarray(self.corpus.basis).reshape(len(self.corpus.basis), -1)
        return stored.astype(np.float64) @ inverse

    def parameters(self, word: CapturedWord, times_s: NDArray[np.floating]) -> Float32Array:
        """(time, parameter) at times in s of the clip, by projection and interpolation."""
        fps = self.corpus.fps
        first = max(0, int(np.floor(times_s.min() * fps)))
        last = int(np.ceil(times_s.max() * fps)) + 1
        if self.corpus.basis is None:
            moved = self.corpus.displacements(word.clip, first, last)
            rows = moved.reshape(len(moved), -1)
        else:
            rows = np.asarray(self.corpus.frames(word.clip)[first:last])
        values = (rows.astype(np.float64) @ self._solver).astype(np.float32)
        return read_rows(values, np.asarray(times_s) * fps - first)

    def sound(self, word: CapturedWord) -> Waveform:
        """The sound of the word."""
        return cut_sound(self.corpus.sound(word.clip), word.start_s, word.end_s)


def cut_sound(sound: Waveform, start_s: float, end_s: float) -> Waveform:
    """The part of a sound from start_s to end_s, at least two samples."""
    first = max(0, min(round(start_s * sound.sample_rate), len(sound.samples) - 2))
    last = max(first + 2, round(end_s * sound.sample_rate))
    return Waveform(sound.samples[first:last], sound.sample_rate)
