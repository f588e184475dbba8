"""When each phone of a speech is said, in one call: as the encoder hears them, or as a text has
them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from elocute.alignment.heard_phones import heard_phones
from elocute.alignment.transcript import Transcript, transcript_notes
from elocute.array_types import Float32Array
from elocute.audio.read import resampled_blocks
from elocute.audio.speech_input import SpeechInput, resolve_speech
from elocute.audio.speech_time_files import TimedSpeech
from elocute.audio.speech_times import SpeechTimes
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.protocol import encoder_samples
from elocute.errors import InputError


def find_phones(
    speech: SpeechInput,
    *,
    text: str | None = None,
    times: SpeechTimes | None = None,
    language: str = "en-us",
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
    language : str
        Of the text and words, as espeak-ng names it.
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
        For a text and times together, and a text that cannot be spoken.
    AlignmentError
        For a text that is not what is said.
    AudioError, MachineError
        For sound that cannot be used; where words are given and espeak-ng is missing.
    """
    if text is not None and times is not None:
        raise InputError.about("`times`", found="`text` too", allowed="one of them")
    told: list[str] = []
    sound = resolve_speech(speech, rate, channel, track=track, partial=partial, notes=told)
    heard, duration_s = _heard(sound, channel, told)
    if text is not None:
        return _aligned(Transcript.of_text(text, language), heard, duration_s, tuple(told))
    if times is not None:
        notes = (*told, *times.notes, *times.check(duration_s))
        if times.phones:
            return TimedSpeech(times.phones, times.words, duration_s, notes)
        return _aligned(Transcript.of_words(times.words, language), heard, duration_s, notes)
    phones = tuple(heard_phones(heard, duration_s))
    if not phones:
        told.append("no speech heard")
    return TimedSpeech(phones, (), duration_s, tuple(told))


def _aligned(
    transcript: Transcript, heard: Float32Array, duration_s: float, notes: tuple[str, ...]
) -> TimedSpeech:
    notes = (*notes, *transcript.notes)
    words = transcript.align(heard)
    phones = tuple(phone for word in words for phone in word.phones)
    spans = tuple((word.start_s, word.end_s, word.text) for word in words)
    return TimedSpeech(phones, spans, duration_s, (*notes, *transcript_notes(words)))


def _heard(
    sound: Path | Waveform, channel: int | None, notes: list[str]
) -> tuple[Float32Array, float]:
    """(row, 40) log-posteriors, and the length of the sound in s."""
    stream = builtin_encoder().stream()
    if isinstance(sound, Waveform):
        blocks = iter([encoder_samples(sound)])
    else:
        blocks = resampled_blocks(sound, SPEECH_RATE, channel, notes=notes)
    rows, samples = [], 0
    for block in blocks:
        rows.append(stream.push(block))
        samples += len(block)
    return np.concatenate([*rows, stream.flush()]), samples / SPEECH_RATE
