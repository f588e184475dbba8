"""Turns a text, or words with times, into phones of a recording with times."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from elocute.array_types import Float32Array
from elocute.encoders.phones_and_visemes import SILENCE
from elocute.errors import AlignmentError
from elocute.speech.spoken_text import SpokenWord
from elocute.speech.text.heard_phones import heard_phones
from elocute.speech.text.known_phones import blended_posteriors
from elocute.speech.text.phone_alignment import PronouncedWord, align_phones
from elocute.speech.text.pronunciation import pronounce, pronounce_each
from elocute.speech.times.captions import is_captions, said_text, words_of_captions
from elocute.speech.times.labels import Label

LONGEST_S = 1800.0
REFUSED, UNSURE = 0.25, 0.4
"""Mean confidence below which a text is refused, and told to be doubtful. Of right texts of natural
readings the least has 0.40 and of a noisy corpus 0.22; of wrong ones half have less than 0.21."""
DOUBTFUL = 0.12
"""Confidence of a word below which the encoder alone says what is spoken there."""
MOST_SILENT = 0.995
NAMED_MAX = 5
CAPTION_SLACK_S = 0.5
"""Seconds by which subtitles may be too early or too late."""
SPOKEN_S = 0.3
"""As much speech as is heard between recognised words, where a recogniser missed something."""


@dataclass(frozen=True)
class Transcript:
    """A text that is spoken in a recording, word by word.

    Parameters
    ----------
    words : tuple of PronouncedWord
        With their times, where these are known.
    text : str
        What is said, where it is known with its marks.
    notes : tuple of str
        What was left out of it.
    recognised : bool
        Whether it is what a recogniser heard: it may lack words, have wrong ones, or none. What
        does not fit the sound is then left to the encoder, and nothing refused.
    seams_s : tuple of float
        Times in s at which nothing is said: what was recognised is aligned part by part between.
    """

    words: tuple[PronouncedWord, ...]
    text: str = ""
    notes: tuple[str, ...] = ()
    recognised: bool = False
    seams_s: tuple[float, ...] = ()

    @classmethod
    def of_text(cls, text: str, language: str = "en-us") -> Transcript:
        """The transcript of a text, a script, or subtitles, whose times are kept. Raises
        InputError, MachineError."""
        said, notes = said_text(text)
        if is_captions(text):
            timed = [
                (start - CAPTION_SLACK_S, end + CAPTION_SLACK_S, word)
                for start, end, word in words_of_captions(text).words
            ]
            words = cls.of_words(timed, language).words
        else:
            words = tuple(pronounce(said, language))
        return cls(words, said, tuple(notes))

    @classmethod
    def of_words(
        cls, words: Sequence[tuple[float, float, str]], language: str = "en-us"
    ) -> Transcript:
        """The transcript of words whose times in s are known. Raises InputError, MachineError."""
        spelled = pronounce_each([word for _, _, word in words], language)
        pronounced = [
            PronouncedWord(word, spelled[word], (start, end))
            for start, end, word in words
            if spelled[word]
        ]
        if not pronounced:
            raise AlignmentError.about("words", found="none that is spoken", allowed="words")
        return cls(tuple(pronounced))

    def align(self, heard: Float32Array) -> list[SpokenWord]:
        """The words as they are found in a recording.

        Parameters
        ----------
        heard : (row, 40) float32
            Log-posteriors of the phone encoder, 50 rows a second.

        Raises
        ------
        AlignmentError
            For a recording without speech, too long or too short, and for a text that is not what
            is said in it.
        """
        if self.recognised:
            return self._align_parts(heard)
        seconds = len(heard) / 50
        if seconds > LONGEST_S:
            raise AlignmentError.about(
                "sound",
                found=f"{seconds:.0f} s",
                allowed=f"up to {LONGEST_S:g} s beside a text",
                remedy="cut a long recording into parts",
            )
        late = [word for word in self.words if word.span_s and word.span_s[0] > seconds]
        if late:
            raise AlignmentError.about(
                f"word {late[0].text[:40]!r}",
                found=f"after the end of the sound, {seconds:.2f} s",
                allowed="times of this sound",
                remedy="give the file that belongs to it",
            )
        if np.exp(heard[:, SILENCE]).mean() > MOST_SILENT:
            raise AlignmentError.about("sound", found="silence", allowed="speech beside a text")
        words = align_phones(heard, self.words)
        sure = _mean_confidence(words)
        if sure < REFUSED:
            raise AlignmentError.about(
                "text",
                found=f"words that do not match the sound (confidence {sure:.2f})",
                allowed=f"the text that is said: confidence {REFUSED:g} or more",
            )
        return words

    def _align_parts(self, heard: Float32Array) -> list[SpokenWord]:
        """The words of each part of the sound; none of a part too short for its words."""
        spoken: list[SpokenWord] = []
        for begin, end in pairwise([0.0, *self.seams_s, np.inf]):
            rows = heard[round(begin * 50) : None if end == np.inf else round(end * 50)]
            words = [
                replace(word, span_s=(word.span_s[0] - begin, word.span_s[1] - begin))
                for word in self.words
                if word.span_s and begin <= sum(word.span_s) / 2 < end
            ]
            if words and sum(len(word.phones) for word in words) <= len(rows):
                spoken += [_later(word, begin) for word in align_phones(rows, words)]
        return spoken


def _later(word: SpokenWord, by_s: float) -> SpokenWord:
    return replace(word, phones=tuple((a + by_s, b + by_s, phone) for a, b, phone in word.phones))


@dataclass(frozen=True)
class TranscribedPhones:
    """Phones of a transcript in a recording, and posteriors made of them.

    Parameters
    ----------
    words : tuple of SpokenWord
        The words.
    phones : tuple of (float, float, str)
        Start in s, end in s and phone: those of the words; where what was recognised is unsure,
        those that the encoder hears.
    posteriors : (row, 40) float32
        Natural logarithms: contacts as the text has them, the rest partly as heard.
    notes : tuple of str
        What to know about them.
    """

    words: tuple[SpokenWord, ...]
    phones: tuple[Label, ...]
    posteriors: Float32Array
    notes: tuple[str, ...]


def transcribe(transcript: Transcript, heard: Float32Array, duration_s: float) -> TranscribedPhones:
    """Find the phones of a transcript in a recording.

    Parameters
    ----------
    transcript : Transcript
        What is said in it.
    heard : (row, 40) float32
        Log-posteriors of the phone encoder, 50 rows a second.
    duration_s : float
        How long the recording lasts, s.

    Raises
    ------
    AlignmentError
        As `Transcript.align`.
    """
    words = transcript.align(heard)
    doubtful = [word for word in words if word.confidence < DOUBTFUL]
    unknown = [(word.start_s, word.end_s) for word in doubtful]
    kept = [word for word in words if word not in doubtful] if transcript.recognised else words
    known = phones = [phone for word in kept for phone in word.phones]
    if transcript.recognised:
        unknown += _missed(words, heard)
        phones = sorted([*known, *_within(heard_phones(heard, duration_s), unknown)])
    posteriors = blended_posteriors(known, heard, duration_s, unknown=unknown)
    notes = _notes(words, doubtful, transcript.recognised)
    return TranscribedPhones(tuple(words), tuple(phones), posteriors, tuple(notes))


def _missed(words: list[SpokenWord], heard: Float32Array) -> list[tuple[float, float]]:
    """Stretches between words in which the encoder hears speech all the same."""
    spoken = np.concatenate([[0], np.cumsum(np.exp(heard[:, SILENCE]) < 0.5)]) / 50
    edges = [0.0, *(edge for word in words for edge in (word.start_s, word.end_s)), len(heard) / 50]
    rows = np.minimum(np.round(np.array(edges) * 50).astype(int), len(heard))
    return [
        (edges[at], edges[at + 1])
        for at in range(0, len(edges), 2)
        if spoken[rows[at + 1]] - spoken[rows[at]] >= SPOKEN_S
    ]


def _within(phones: list[Label], stretches: list[tuple[float, float]]) -> list[Label]:
    """Those phones in order, cut where a stretch ends, of which most lies in it."""
    middles = [(start + end) / 2 for start, end, _ in phones]
    return [
        (max(a, start), min(b, end), phone)
        for start, end in stretches
        for a, b, phone in phones[bisect_left(middles, start) : bisect_left(middles, end)]
    ]


def _notes(words: list[SpokenWord], doubtful: list[SpokenWord], recognised: bool) -> list[str]:
    """What to know about words that were aligned: how well they fit, which were not found."""
    notes = []
    sure = 1.0 if recognised else _mean_confidence(words)
    if sure < UNSURE:
        notes.append(
            f"the text fits the sound poorly (confidence {sure:.2f}; right ones have {UNSURE:g})"
        )
    if doubtful:
        named = ", ".join(f"{w.text!r} at {w.start_s:.2f} s" for w in doubtful[:NAMED_MAX])
        more = f" and {len(doubtful) - NAMED_MAX} more" if len(doubtful) > NAMED_MAX else ""
        why = "unsure" if recognised else "not found in the sound"
        notes.append(f"{why}, left to the encoder: {named}{more}")
    return notes


def _mean_confidence(words: list[SpokenWord]) -> float:
    return float(np.mean([word.confidence for word in words]))
