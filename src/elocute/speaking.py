"""Text to motion in one call: a synthesiser speaks, and its phones move the face."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

from elocute.animation import Animation, animate
from elocute.models.feature_extraction import Progress
from elocute.models.take_settings import TakeOptions, TakeSettings
from elocute.settings import taking
from elocute.speech.voices.registry import speak
from elocute.speech.voices.settings import VoiceSettings


@taking(TakeSettings)
def say(
    text: str,
    *,
    language: str = "en-us",
    voice: str = "",
    words_per_minute: int = 165,
    pitch: int = 50,
    engine: str = "espeak",
    progress: Progress | None = None,
    **settings: Unpack[TakeOptions],
) -> Animation:
    """Speak a text and animate a head with it.

    The phones and their times are those that were spoken; nothing is recognised.

    Parameters
    ----------
    text : str
        What is said, 20,000 letters at most.
    language : str
        Language of the text, as espeak-ng names it.
    voice : str
        A voice of espeak-ng; "" for the language's own.
    words_per_minute : int
        How fast, 80 to 450.
    pitch : int
        Of the voice, 0 to 99.
    engine : str
        The speech synthesiser, one of `voices.settings.ENGINES`.
    progress : callable, optional
        Called with the share of the speech that is done, 0 to 1.

    Returns
    -------
    Animation
        The motion, its curves and the speech as a Waveform.

    Raises
    ------
    InputError
        For a text, a voice or anything else that cannot be used.
    MachineError
        Where the synthesiser is missing.
    """
    spoken = speak(text, VoiceSettings(language, voice, words_per_minute, pitch, engine))
    animation = animate(spoken.sound, phones=list(spoken.phones), progress=progress, **settings)
    words = tuple((w.phones[0][0], w.phones[-1][1], w.text) for w in spoken.words if w.phones)
    return replace(animation, words=words)
