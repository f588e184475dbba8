"""Pronounces the words of a text: by espeak-ng, otherwise by a dictionary of English."""

from __future__ import annotations

from collections.abc import Sequence

from elocute.encoders.phones_and_visemes import PHONES
from elocute.errors import AlignmentError, MachineError
from elocute.speech.text.phone_alignment import PronouncedWord
from elocute.speech.text.text_words import words_of_text
from elocute.speech.voices.espeak import check_text, speak, spell
from elocute.speech.voices.settings import VoiceSettings

UNTOLD = "en-us"
"""What "auto" means where nothing is recognised."""


def pronounce(text: str, language: str = UNTOLD) -> list[PronouncedWord]:
    """The words of a text with their phones, in its order; language "auto" is English.

    Raises
    ------
    InputError
        For a text or language that cannot be used, or a word that no dictionary has.
    MachineError
        Where neither espeak-ng nor, for English, pocketsphinx is installed.
    """
    text, language = check_text(text), _named(language)
    try:
        spoken = speak(text, VoiceSettings(language))
    except MachineError as missing:
        if not language.lower().startswith("en"):
            raise
        return _from_dictionary(text, missing)
    return [
        PronouncedWord(word.text, tuple(phone for _, _, phone in word.phones))
        for word in spoken.words
    ]


def pronounce_each(words: Sequence[str], language: str = UNTOLD) -> dict[str, tuple[str, ...]]:
    """The phones of words, each said alone; no phones for a word that is not spoken.

    A word may be there many times; language "auto" is English. Raises as `pronounce`.
    """
    different, language = list(dict.fromkeys(words)), _named(language)
    try:
        return spell(different, VoiceSettings(language))
    except MachineError as missing:
        if not language.lower().startswith("en"):
            raise
        return {
            word: tuple(
                phone
                for part in (_from_dictionary(word, missing) if any(map(str.isalnum, word)) else [])
                for phone in part.phones
            )
            for word in different
        }


def _named(language: str) -> str:
    return UNTOLD if language == "auto" else language


def _from_dictionary(text: str, missing: MachineError) -> list[PronouncedWord]:
    """From pocketsphinx's dictionary; `missing` says why espeak-ng is not used."""
    from elocute.speech.text.forced_alignment import EnglishAligner, words_in

    try:
        aligner = EnglishAligner()
    except MachineError as error:
        raise MachineError(f"{missing}; or, for English: {error}") from error
    unknown = aligner.unknown(text)
    if unknown or not words_in(text):
        raise AlignmentError.about(
            "text",
            found=f"no pronunciation of {', '.join(unknown[:10])}" if unknown else "no words",
            allowed="words of pocketsphinx's English dictionary",
            remedy="install espeak-ng (pip install 'elocute[tts]'), which speaks every word",
        )
    spelled = [
        (word.text, [phone for part in words_in(word.text) for phone in aligner.phones(part)])
        for word in words_of_text(text)
    ]
    return [
        PronouncedWord(word, tuple(phone for phone in phones if phone in PHONES))
        for word, phones in spelled
        if phones
    ]
