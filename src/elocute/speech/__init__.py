"""Speech as phones, words and texts with their times.

timed_phones, known_speech   the phones of a recording · what is known of it beside its sound
times                        files of phones, visemes, words and captions: read and written
text                         a text, or what is recognised, aligned with its sound
voices                       speech synthesis
cues                         mouth cues and captions for drawn characters and players
phone_symbols                other alphabets of phones as ARPAbet
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.speech.spoken_text import SpokenText as SpokenText, SpokenWord as SpokenWord
    from elocute.speech.text.forced_alignment import segment_words as segment_words
    from elocute.speech.text.word_times import (
        TimedWord as TimedWord,
        TimedWords as TimedWords,
        read_words as read_words,
        write_words as write_words,
    )
    from elocute.speech.timed_phones import find_phones as find_phones
    from elocute.speech.times.read import (
        SpeechTimes as SpeechTimes,
        read_speech_times as read_speech_times,
    )
    from elocute.speech.voices.registry import speak as speak
    from elocute.speech.voices.settings import VoiceSettings as VoiceSettings

__getattr__, __dir__ = lazy(__name__, __file__)
