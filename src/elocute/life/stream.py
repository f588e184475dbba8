"""The stream of life: sound in, rows of motion out, each as soon as it is certain."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.audio.resampling_stream import RESAMPLING_S, ResamplingStream
from elocute.audio.waveform import SPEECH_RATE
from elocute.life.director import CHANNELS, LOOKAHEAD_ROWS, Director
from elocute.life.moods import NEUTRAL, Mood
from elocute.life.people import AVERAGE, Person
from elocute.life.prosody import BATCH, PROSODY_S, ROW_RATE, SILENT_ROW, ProsodyStream
from elocute.life.settings import Life

LOOKAHEAD_S = RESAMPLING_S + PROSODY_S + LOOKAHEAD_ROWS / ROW_RATE + 1 / ROW_RATE
"""How much later than its own time a row comes, s."""


class LifeStream:
    """Blocks of sound in, rows (row, channel) of motion out; row k stands at k / rate.

    A whole sound is a stream fed once: how it is cut makes no difference.

    Parameters
    ----------
    sample_rate : int
        Of the sound, Hz.
    life : Life
        Only `blinks` matters here; the other parts scale what is laid over the face.
    mood : Mood
        Only its rate of blinks matters here.
    person : Person
        Who speaks.
    """

    name, rate = "life", ROW_RATE

    def __init__(
        self, sample_rate: int, life: Life, mood: Mood = NEUTRAL, person: Person = AVERAGE
    ) -> None:
        self._sample_rate, self._samples = sample_rate, 0
        self._turns: list[tuple[float, bool]] = []  # seconds from which on somebody else speaks
        self._heard_rows, self._listening = 0, False
        self._resampled = ResamplingStream(sample_rate, SPEECH_RATE)
        self._prosody = ProsodyStream()
        self._director = Director(life.blinks, mood.blinks, person)
        self._given = 0

    @property
    def lookahead_s(self) -> float:
        """How much later than its own time a row comes, s."""
        return LOOKAHEAD_S

    def push(self, samples: Float32Array, listen: bool = False) -> Float32Array:
        """Take a block (sample,); give the rows that are certain now, perhaps none.

        With `listen` it is a partner's voice, whom the face attends to.
        """
        if listen != (self._turns[-1][1] if self._turns else self._listening):
            self._turns.append((self._samples / self._sample_rate, listen))
        self._samples += len(samples)
        return self._rows(self._prosody.push(self._resampled.push(samples)))

    def flush(self) -> Float32Array:
        """End the sound: the remaining rows, up to one behind its end."""
        rest = self._resampled.push(np.zeros(0, np.float32), last=True)
        rows = [self._rows(self._prosody.push(rest)), self._rows(self._prosody.flush())]
        wanted = int(np.ceil(self._samples / self._sample_rate * ROW_RATE)) + 1
        silence = np.tile(np.array(SILENT_ROW), (BATCH, 1))
        while self._given < wanted:
            rows.append(self._rows([silence]))
        return np.concatenate(rows)

    def _rows(self, batches: Iterable[Float64Array]) -> Float32Array:
        parts = [np.zeros((0, len(CHANNELS)), np.float32)]
        for batch in batches:
            while self._turns and self._turns[0][0] <= self._heard_rows / ROW_RATE:
                self._listening = self._turns.pop(0)[1]
            self._heard_rows += len(batch)
            parts.append(self._director.push(batch, self._listening))
        rows = np.concatenate(parts)
        self._given += len(rows)
        return rows
