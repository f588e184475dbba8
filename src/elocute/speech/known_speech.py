"""What is known of a speech beside its sound: phones, words with times, or a text."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from elocute.array_types import Float32Array
from elocute.encoders.protocol import FEATURE_RATE
from elocute.numerics.input_checks import check_alone
from elocute.speech.cues.files import as_written
from elocute.speech.text.heard_phones import heard_phones
from elocute.speech.text.known_phones import blended_posteriors, known_posteriors
from elocute.speech.text.transcript import Transcript, transcribe as aligned
from elocute.speech.times.labels import Label, PhoneRefiner
from elocute.speech.times.read import SpeechTimes


@dataclass(frozen=True)
class KnownSpeech:
    """Phones as `extract_features` takes them, None where nothing is known, and what comes up
    later.

    `notes` say what to know about the phones and `words` are start in s, end in s and word, with
    the marks of a given text, where words are known; both grow while the features are made.
    """

    phones: list[Label] | PhoneRefiner | None
    notes: list[str] = field(default_factory=list)
    words: list[Label] = field(default_factory=list)

    def tell(self, note: str) -> None:
        """Add a note."""
        self.notes.append(note)


def known_speech(
    phones: list[Label] | SpeechTimes | PhoneRefiner | None, text: str | None, language: str
) -> KnownSpeech:
    """What a caller knows of a speech: phones with their times, what a file of such times holds,
    what makes them of what is heard, or what is said in the language.

    Raises
    ------
    InputError
        For phones and a text together, and a text that cannot be spoken.
    MachineError
        Where the pronunciation of words is wanted and espeak-ng is missing.
    """
    check_alone(phones=phones, text=text)
    if text is not None:
        return transcribed_speech(Transcript.of_text(text, language))
    if isinstance(phones, SpeechTimes):
        return _timed(phones, language)
    return KnownSpeech(phones)


def transcribed_speech(transcript: Transcript, notes: tuple[str, ...] = ()) -> KnownSpeech:
    """What a transcript says of a speech: nothing where no words were recognised."""
    all_notes, words = [*notes, *transcript.notes], list[Label]()
    if not transcript.words:
        return KnownSpeech(None, all_notes)

    def refine(heard: Float32Array, duration_s: float) -> Float32Array:
        alignment = aligned(transcript, heard, duration_s)
        all_notes.extend(alignment.notes)
        spoken = [(word.start_s, word.end_s, word.text) for word in alignment.words]
        words.extend(as_written(spoken, transcript.text))
        return alignment.posteriors

    return KnownSpeech(refine, all_notes, words)


def corrected_phones(phones: Sequence[Label], text: str | None, language: str) -> PhoneRefiner:
    """Phones that somebody has corrected after they were found from a text, or heard.

    What was left as it was found stays as it sounds: only where a phone was moved, changed, added
    or taken away do rows become those of known phones. So a correction changes nothing elsewhere.
    """

    def refine(heard: Float32Array, duration_s: float) -> Float32Array:
        if text is None:
            found = heard_phones(heard, duration_s)
            rows = blended_posteriors(found, heard, duration_s)
        else:
            alignment = aligned(Transcript.of_text(text, language), heard, duration_s)
            found, rows = list(alignment.phones), alignment.posteriors.copy()
        known = known_posteriors(phones, duration_s)
        times = np.arange(min(len(rows), len(known))) / FEATURE_RATE
        for start, end, _ in _in_one_alone(phones, found):
            inside = np.flatnonzero((times > start - 0.5 / FEATURE_RATE) & (times < end))
            rows[inside] = known[inside]
        return rows

    return refine


def _in_one_alone(one: Sequence[Label], other: Sequence[Label]) -> list[Label]:
    """Labels that only one of two lists has, to a millisecond."""

    def of(labels: Sequence[Label]) -> dict[tuple[int, int, str], Label]:
        return {(round(1000 * each[0]), round(1000 * each[1]), each[2]): each for each in labels}

    first, second = of(one), of(other)
    return [(first | second)[key] for key in first.keys() ^ second.keys()]


def _timed(times: SpeechTimes, language: str) -> KnownSpeech:
    if not times.phones:
        known = transcribed_speech(Transcript.of_words(times.words, language), times.notes)
        inner = _within(times, known.phones, known.notes)
        return KnownSpeech(inner, known.notes, known.words)
    notes = list(times.notes)

    def refine(heard: Float32Array, duration_s: float) -> Float32Array:
        return blended_posteriors(
            times.phones, heard, duration_s, unknown=times.unknown, heard_share=0.0
        )

    return KnownSpeech(_within(times, refine, notes), notes, list(times.words))


def _within(
    times: SpeechTimes, refine: PhoneRefiner | list[Label] | None, notes: list[str]
) -> PhoneRefiner:
    """The refiner, once the times are known to fit the sound."""
    assert callable(refine)
    inner: Callable[[Float32Array, float], Float32Array] = refine

    def checked(heard: Float32Array, duration_s: float) -> Float32Array:
        notes.extend(times.check(duration_s))
        return np.asarray(inner(heard, duration_s), np.float32)

    return checked
