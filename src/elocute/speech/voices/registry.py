"""Speaks a text with any of the speech synthesisers."""

from __future__ import annotations

import importlib

from elocute.speech.spoken_text import SpokenText, Voice
from elocute.speech.voices.settings import VoiceSettings


def speak(text: str, settings: VoiceSettings | None = None) -> SpokenText:
    """Speak a text.

    Parameters
    ----------
    text : str
        What is said, in the language of the voice.
    settings : VoiceSettings, optional
        The synthesiser and its voice.

    Returns
    -------
    SpokenText

    Raises
    ------
    InputError
        For a text that cannot be spoken, a language or a voice that the synthesiser does not have.
    MachineError
        Where the synthesiser is missing or fails.
    """
    settings = settings or VoiceSettings()
    voice: Voice = importlib.import_module(f"elocute.speech.voices.{settings.engine}").speak
    return voice(text, settings)
