"""Finds when each phone of a speech is said, from its sound, a text, or times that are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.speech_input import SpeechInput, resolve_speech, speech_blocks
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.errors import AlignmentError
from elocute.numerics.input_checks import check_alone
from elocute.speech.text.heard_phones import heard_phones
from elocute.speech.text.recogniser import Transcribe, recognise
from elocute.speech.text.transcript import Transcript, transcribe as aligned
from elocute.speech.text.word_times import TimedWord, TimedWords
from elocute.speech.times.read import SpeechTimes
from elocute.speech.times.write import TimedSpeech


def find_phones(
    speech: SpeechInput,
    *,
    text: str | None = None,
    times: SpeechTimes | None = None,
    transcribe: Transcribe = False,
    language: str = "auto",
    rate: int | None = None,
    channel: int | None = None,
    track: int | None = None,
    partial: bool = False,
) -> TimedSpeech:
    """Find when each phone of a speech is said, and each word where words are known.

    Parameters
    ----------
    speech : path, Waveform, bytes, binary file or array
        The sound, as `animate` takes it.
    text : str, optional
        What is said: its words and phones are aligned to the sound. Without it, phones are what the
        encoder hears, and there are no words.
    times : SpeechTimes, optional
        Known times of phones, which are kept as they are, or of words, whose phones are aligned.
    transcribe : bool, str or Path
        Whether its words are recognised: True, or the name or the folder of a Whisper model, which
        the extra `transcribe` listens with. Where it is unsure, phones are what the encoder hears.
    language : str
        Of the text and words, as espeak-ng names it; "auto" is the one that is recognised, or
        English.
    rate : int, optional
        Sample rate of an array, Hz.
    channel : int, optional
        The channel to take instead of their mean.
    track : int, optional
        The audio track to take of a file with several, from 0.
    partial : bool
        Whether a file that was cut off is taken as far as it goes.

    Returns
    -------
    TimedSpeech

    Raises
    ------
    InputError
        For two of text, times and transcribe, and a text that cannot be spoken.
    AlignmentError
        For a text that is not what is said.
    AudioError, MachineError
        For sound that cannot be used; where words are wanted and espeak-ng, the recogniser or its
        model is missing.
    """
    check_alone(times=times, text=text, transcribe=transcribe or None)
    sound_notes: list[str] = []
    sound = resolve_speech(speech, rate, channel, track=track, partial=partial, notes=sound_notes)
    heard, duration_s = _heard(sound, channel, sound_notes)
    if text is not None or transcribe:
        if text is None:
            transcript = recognise(sound, transcribe, language, channel)
        else:
            transcript = Transcript.of_text(text, language)
        return _aligned(transcript, heard, duration_s, tuple(sound_notes))
    if times is not None:
        notes = (*sound_notes, *times.notes, *times.check(duration_s))
        if times.phones:
            return TimedSpeech(times.phones, times.words, duration_s, notes)
        return _aligned(Transcript.of_words(times.words, language), heard, duration_s, notes)
    phones = tuple(heard_phones(heard, duration_s))
    if not phones:
        sound_notes.append("no speech heard")
    return TimedSpeech(phones, (), duration_s, tuple(sound_notes))


def find_words(
    speech: SpeechInput, *, transcribe: Transcribe = True, language: str = "auto"
) -> TimedWords:
    """Recognise the words of a speech, and find when each is said.

    Takes and raises what `find_phones` does, and AlignmentError where no words are recognised. The
    words have the confidence of their alignment, 0 where the recogniser is unsure.
    """
    sound = resolve_speech(speech)
    heard, duration_s = _heard(sound, None, [])
    alignment = aligned(recognise(sound, transcribe, language), heard, duration_s)
    if not alignment.words:
        raise AlignmentError.about("sound", found="no words that are recognised", allowed="speech")
    return TimedWords(
        tuple(
            TimedWord(word.text, word.start_s, min(word.end_s, duration_s), word.confidence)
            for word in alignment.words
        ),
        duration_s,
    )


def _aligned(
    transcript: Transcript, heard: Float32Array, duration_s: float, notes: tuple[str, ...]
) -> TimedSpeech:
    alignment = aligned(transcript, heard, duration_s)
    spans = tuple((word.start_s, word.end_s, word.text) for word in alignment.words)
    notes = (*notes, *transcript.notes, *alignment.notes)
    return TimedSpeech(alignment.phones, spans, duration_s, notes, transcript.text)


def _heard(
    sound: Path | Waveform, channel: int | None, notes: list[str]
) -> tuple[Float32Array, float]:
    """(row, 40) log-posteriors, and the length of the sound in s."""
    stream = builtin_encoder().stream()
    rows, samples = [], 0
    for block in speech_blocks(sound, channel, notes):
        rows.append(stream.push(block))
        samples += len(block)
    return np.concatenate([*rows, stream.flush()]), samples / SPEECH_RATE
