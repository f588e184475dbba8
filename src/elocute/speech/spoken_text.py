"""Words with their phones, and what every speech synthesiser gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from elocute.audio.waveform import Waveform
from elocute.speech.times.labels import Label
from elocute.speech.voices.settings import VoiceSettings


@dataclass(frozen=True)
class SpokenWord:
    """A word as it was spoken, or found in a recording.

    Parameters
    ----------
    text : str
        As the text writes it.
    phones : tuple of (float, float, str)
        Start in s, end in s and ARPAbet phone; one or more, but for signs that nobody speaks.
    confidence : float
        0 to 1, how well the sound matches; 1 where the times are known, 0 of a guess.
    """

    text: str
    phones: tuple[Label, ...]
    confidence: float = 1.0

    @property
    def start_s(self) -> float:
        return self.phones[0][0]

    @property
    def end_s(self) -> float:
        return self.phones[-1][1]


@dataclass(frozen=True, eq=False)
class SpokenText:
    """A text as it was spoken.

    Parameters
    ----------
    sound : Waveform
        The speech, with silence around it.
    phones : tuple of (float, float, str)
        Start in s, end in s and ARPAbet phone; pauses are SIL.
    words : tuple of SpokenWord
        The words, each with its phones.
    """

    sound: Waveform
    phones: tuple[Label, ...]
    words: tuple[SpokenWord, ...]


class Voice(Protocol):
    """The function `speak` of a module of `elocute.speech.voices` that `ENGINES` names."""

    def __call__(self, text: str, settings: VoiceSettings) -> SpokenText:
        """Speak a text. Raises InputError for what cannot be spoken, MachineError where the
        synthesiser is missing."""
        ...
