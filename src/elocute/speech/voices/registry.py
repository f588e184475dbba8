"""Speaks a text with any of the speech synthesisers."""

from __future__ import annotations

import importlib

from elocute.speech.spoken_text import SpokenText, Voice
from elocute.speech.text.script_text import without_tags
from elocute.speech.voices.settings import VoiceSettings


def speak(text: str, settings: VoiceSettings | None = None) -> SpokenText:
    """Speak a text.

    Parameters
    ----------
    text : str
        What is said, in the language of the voice; tags of SSML in it are no words.
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
    return voice(without_tags(text) if isinstance(text, str) else text, settings)
