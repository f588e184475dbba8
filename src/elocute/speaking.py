"""Text to motion in one call: espeak-ng speaks, and its phones move the face."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from elocute.animation import Animation, animate
from elocute.articulation.style import Style
from elocute.head.looks.look import Look
from elocute.life.moods import Mood
from elocute.life.settings import Life
from elocute.models.feature_extraction import Progress
from elocute.models.registry import DEFAULT_MODEL
from elocute.motion.edits.edit_list import EditList
from elocute.speech.voices.espeak import speak
from elocute.speech.voices.settings import VoiceSettings


def say(
    text: str,
    *,
    language: str = "en-us",
    voice: str = "",
    words_per_minute: int = 165,
    pitch: int = 50,
    fps: float = 60.0,
    identity: str | int | Path = "mean",
    head: str | Path = "builtin",
    mesh: str | None = None,
    style: str | Style = "plain",
    strength: float = 1.0,
    model: str | Path = DEFAULT_MODEL,
    contacts: str = "auto",
    mix: str = "output",
    life: float | str | Life = 1.0,
    mood: str | Mood = "neutral",
    seed: int = 0,
    look: str | Look | None = "auto",
    edits: EditList | str | Path | Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> Animation:
    """Speak a text and animate a head with it.

    The phones and their times are those that espeak-ng spoke; nothing is recognised.

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
    fps, identity, head, mesh, style, strength, model, contacts, mix, life, mood, seed, look
        As `animate` takes them.
    edits, progress
        Likewise.

    Returns
    -------
    Animation
        The motion, its curves and the speech as a Waveform.

    Raises
    ------
    InputError
        For a text, a voice or anything else that cannot be used.
    MachineError
        Where espeak-ng is missing.
    """
    spoken = speak(text, VoiceSettings(language, voice, words_per_minute, pitch))
    animation = animate(
        spoken.sound,
        phones=list(spoken.phones),
        fps=fps,
        identity=identity,
        head=head,
        mesh=mesh,
        style=style,
        strength=strength,
        model=model,
        contacts=contacts,
        mix=mix,
        life=life,
        mood=mood,
        seed=seed,
        look=look,
        edits=edits,
        progress=progress,
    )
    words = tuple((w.phones[0][0], w.phones[-1][1], w.text) for w in spoken.words if w.phones)
    return replace(animation, words=words)
