"""Forced alignment: from a text and its sound to the times of words and phones (English).

pocketsphinx with wide beams finds when each phone is said, whatever the text; the confidence that
the text is what was said comes from the phone encoder, which does not know the text.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.phones_and_visemes import PHONES
from elocute.errors import AlignmentError, needs_extra
from elocute.speech.spoken_text import SpokenWord
from elocute.speech.text.text_words import words_of_text
from elocute.speech.text.word_times import TimedWord, TimedWords
from elocute.speech.times.labels import Label

FRAME_S = 0.01  # of pocketsphinx's times
PAD_S = 0.15  # of faint noise around clips that begin and end in the middle of a breath
PAD_LEVEL = 1e-5
LONGEST_S = 1800.0
SILENT_PEAK = 1e-4  # full scale is 1: 80 dB below it nothing is said
TEXT_MAX = 100_000
SPELLED = re.compile(r"[a-z'’]+")
CONFIDENCE_MIN = 0.15  # mean of all words, below which the text is not what was said


def words_in(text: str) -> list[str]:
    """Lower-case words as a pronouncing dictionary spells them."""
    text = text.lower().replace("’", "'").replace("-", " ")
    return [word for word in re.sub(r"[^a-z' ]", " ", text).split() if word.strip("'")]


class EnglishAligner:
    """pocketsphinx with wide beams; words that its dictionary lacks are refused, never guessed.

    Raises MachineError where pocketsphinx is not installed.
    """

    def __init__(self) -> None:
        with needs_extra("forced alignment", "wild"):
            from pocketsphinx import Decoder
        self.decoder = Decoder(
            lm=None, loglevel="FATAL", bestpath=False, beam=1e-80, pbeam=1e-80, wbeam=1e-60
        )

    def unknown(self, text: str) -> list[str]:
        """Words that are not in the dictionary, each once; numbers and foreign letters are in
        none."""
        foreign = [
            word.text
            for word in words_of_text(text)
            if not word.is_sign and not SPELLED.fullmatch(word.text.lower())
        ]
        missing = [word for word in words_in(text) if self.decoder.lookup_word(word) is None]
        return [*dict.fromkeys([*foreign, *missing])]

    def phones(self, word: str) -> list[str]:
        """The first pronunciation of a word that the dictionary has, in ARPAbet."""
        return self.decoder.lookup_word(word).split()

    def knows(self, text: str) -> bool:
        """Whether the text has words, all of them in the dictionary."""
        return bool(words_in(text)) and not self.unknown(text)

    def align(self, samples: NDArray[np.float32], text: str) -> list[Label] | None:
        """Phones with times, rests among them; None where the text does not fit the sound."""
        spoken = self.spoken(samples, text)
        return None if spoken is None else [phone for word in spoken for phone in word.phones]

    def spoken(self, samples: NDArray[np.float32], text: str) -> list[SpokenWord] | None:
        """Words and the rests between them (text "<sil>") of samples (sample,) at 16 kHz.

        None where a word is unknown or the text does not fit the sound.
        """
        if not self.knows(text):
            return None
        loud = np.clip(samples / (np.abs(samples).max() + 1e-6) * 0.7, -1, 1)
        data = (loud * 32767).astype(np.int16).tobytes()
        try:
            self.decoder.set_align_text(" ".join(words_in(text)))
            self._pass(data)
            if self.decoder.hyp() is None:
                return None
            self.decoder.set_alignment()
            self._pass(data)
        except RuntimeError:
            return None
        return [_spoken_word(word) for word in self.decoder.get_alignment()]

    def _pass(self, data: bytes) -> None:
        self.decoder.start_utt()
        self.decoder.process_raw(data, no_search=False, full_utt=True)
        self.decoder.end_utt()


def _spoken_word(word: object) -> SpokenWord:
    phones = tuple(
        (
            phone.start * FRAME_S,
            (phone.start + phone.duration) * FRAME_S,
            phone.name if phone.name in PHONES else "SIL",
        )
        for phone in word  # pyright: ignore[reportGeneralTypeIssues]
    )
    name = re.sub(r"\(\d+\)$", "", word.name)  # pyright: ignore[reportAttributeAccessIssue]
    return SpokenWord(name, phones)


def segment_words(
    waveform: Waveform, text: str, aligner: EnglishAligner | None = None
) -> TimedWords:
    """Find when each word of an English text is said.

    Parameters
    ----------
    waveform
        Speech, at any rate, up to half an hour.
    text
        The words that are said, in order.
    aligner
        One that was made before, to save loading it again.

    Returns
    -------
    TimedWords
        Times in s and a confidence from 0 to 1 for each word.

    Raises
    ------
    AlignmentError
        For a text without words, words that the dictionary lacks, silence, sound that is too short
        or too long, or a text that does not fit the sound.
    MachineError
        Where pocketsphinx is not installed.
    """
    _check_text(text)
    samples = _checked(waveform)
    aligner = aligner or EnglishAligner()
    unknown = aligner.unknown(text)
    if unknown:
        raise AlignmentError.about(
            "text",
            found=f"no pronunciation of {', '.join(unknown[:10])}",
            allowed="words of pocketsphinx's English dictionary",
            remedy="spell them as they are pronounced",
        )
    spoken = aligner.spoken(_padded(samples), text)
    count = len(words_in(text))
    words = [] if spoken is None else [w for w in spoken if not w.text.startswith(("<", "["))]
    if len(words) != count:
        raise AlignmentError.about(
            "text",
            found=f"{count} words that do not fit into {waveform.duration_s:.2f} s",
            allowed="the text of this sound",
        )
    timed = _with_confidence(samples, words)
    sure = float(np.mean([word.confidence for word in timed]))
    if sure < CONFIDENCE_MIN:
        raise AlignmentError.about(
            "text",
            found=f"words that do not match the sound (confidence {sure:.2f})",
            allowed=f"the text that is said: confidence {CONFIDENCE_MIN:g} or more",
        )
    return TimedWords(tuple(timed), waveform.duration_s)


def _check_text(text: str) -> None:
    if not words_in(text) or len(text) > TEXT_MAX:
        raise AlignmentError.about(
            "text",
            found=f"{len(words_in(text))} words in {len(text)} letters",
            allowed=f"one word or more, up to {TEXT_MAX} letters",
        )


def _checked(waveform: Waveform) -> NDArray[np.float32]:
    seconds = waveform.duration_s
    if not 0.05 <= seconds <= LONGEST_S:
        raise AlignmentError.about(
            "sound",
            found=f"{seconds:.2f} s",
            allowed=f"0.05 to {LONGEST_S:g} s",
            remedy="cut a long recording into parts",
        )
    samples = waveform.resample(SPEECH_RATE).samples
    samples = samples - samples.mean()
    if np.abs(samples).max() < SILENT_PEAK:
        raise AlignmentError.about("sound", found="silence", allowed="speech")
    return samples


def _padded(samples: NDArray[np.float32]) -> NDArray[np.float32]:
    pad = np.random.default_rng(len(samples)).normal(0, PAD_LEVEL, round(PAD_S * SPEECH_RATE))
    return np.concatenate([pad, samples, pad[::-1]]).astype(np.float32)


def _with_confidence(samples: NDArray[np.float32], words: list[SpokenWord]) -> list[TimedWord]:
    """Words with times in s of the samples without padding, and confidence.

    The confidence is the geometric mean, over a word's frames, of the encoder's posterior of all
    phones with the viseme of the aligned one, in the frame itself or a neighbour.
    """
    posteriors = _viseme_posteriors(samples)
    seconds = len(samples) / SPEECH_RATE
    timed = []
    for word in words:
        start = min(max(word.start_s - PAD_S, 0.0), seconds - 2 * FRAME_S)
        end = min(max(word.end_s - PAD_S, start + FRAME_S), seconds)
        logs = [
            _log_posteriors(posteriors, name, begin - PAD_S, finish - PAD_S)
            for begin, finish, name in word.phones
        ]
        sure = float(np.exp(np.mean(np.concatenate(logs))))
        timed.append(TimedWord(word.text, round(start, 4), round(end, 4), round(min(sure, 1.0), 4)))
    return timed


def _viseme_posteriors(samples: NDArray[np.float32]) -> dict[str, NDArray[np.float32]]:
    """From phone to (frame,) at 50 Hz: posterior of its viseme, the best of three frames."""
    from elocute.encoders.phone_encoder import builtin_encoder
    from elocute.encoders.phones_and_visemes import PHONE_TO_VISEME

    posteriors = np.exp(builtin_encoder().encode(samples))
    visemes = [PHONE_TO_VISEME[phone] for phone in PHONES]
    by_phone = {}
    for phone, viseme in zip(PHONES, visemes, strict=True):
        alike = [index for index, other in enumerate(visemes) if other == viseme]
        padded = np.pad(posteriors[:, alike].sum(axis=1), 1, "edge")
        by_phone[phone] = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    return by_phone


def _log_posteriors(
    posteriors: dict[str, NDArray[np.float32]], phone: str, start_s: float, end_s: float
) -> NDArray[np.float32]:
    posterior = posteriors[phone]
    first = min(max(round(start_s * 50), 0), len(posterior) - 1)
    return np.log(np.maximum(posterior[first : max(first + 1, round(end_s * 50))], 1e-4))
