"""Detects syllables with their prominence, ends of phrases, hesitation, liveliness and effort.

All levels are relative to the loudest of late, all pitches to the voice's own mean, so a voice
recorded louder or softer has the same events.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from elocute.array_types import Float64Array
from elocute.life.lookahead_buffer import hill
from elocute.life.prosody import BATCH, LEVEL, PITCH, SILENT_ROW, TILT, VOICING

RANGE_DB = 30.0  # below the loudest of late: from there on a level counts as nothing
VOICED_DB = 20.0  # voiced rows further below it are no speech: echoes, breathing, a far voice
DECAY_DB = 0.015  # that the loudest of late sinks in each row: 1.5 dB/s
SMOOTH = 7  # rows to both sides of a smoothed strength
AHEAD = 8  # rows after its own that the loudness of a row is judged by
PEAK = 8  # rows to both sides in which a syllable is the strongest
ONSET_ROWS, ONSET_WITHIN = 5, 14  # voiced rows that begin a phrase
PAUSE = 28  # rows without voice that end one
STRENGTH_LEAST = 0.3
MEAN_LEAST = 0.003  # share of a row in the mean pitch: some three seconds of voice
JUMP = 5.0  # semitones from row to row that no voice makes: a mistaken octave
HELD_ROWS, HELD_PITCH, HELD_DB = 38, 0.8, 5.0  # a voice so even for so long is an "uhm"
CALM_PITCH, LIVELY_PITCH = 1.5, 3.5  # deviations in semitones, over some three seconds of voice
USUAL_LEAST, LATE = 0.0004, 0.01  # shares of a row in the means of 25 s and 1 s of voice
FORCE_DB, BRIGHT_DB = (4.0, 16.0), (-9.0, 1.0)  # level and tilt above what is usual; tilt itself
EVENT_ROWS = AHEAD + SMOOTH + max(PEAK, ONSET_WITHIN)
"""A syllable or a beginning is told this many rows after its own."""


@dataclass(frozen=True)
class Syllable:
    """A syllable's nucleus.

    Parameters
    ----------
    row : int
        Where it is strongest.
    prominence : float
        0 to 1: how far it stands out in strength and pitch.
    pitch : float
        Semitones above the voice's mean of late.
    """

    row: int
    prominence: float
    pitch: float


@dataclass(frozen=True)
class PhraseStart:
    """The first voiced row of a phrase, and how many rows nobody spoke before it."""

    row: int
    pause: int


@dataclass(frozen=True)
class PhraseEnd:
    """The last voiced row of a phrase, how many rows it had, and where its pitch came to."""

    row: int
    length: int
    pitch: float


@dataclass(frozen=True)
class Hesitation:
    """A vowel that goes on and on: from this row on somebody thinks."""

    row: int


Event = Syllable | PhraseStart | PhraseEnd | Hesitation


class EventFinder:
    """Rows of prosody in, events out; state of bounded size."""

    def __init__(self) -> None:
        self.row = -1
        """The newest row."""
        self.content = 0.0
        """A number that the sound of the last second or two makes: draws come from it."""
        self.lively = self.force = 0.0
        """How varied the voice of late is, and how much effort is in it, 0 to 1."""
        self._loudest = SILENT_ROW[LEVEL]
        self._levels: deque[float] = deque([SILENT_ROW[LEVEL]] * (AHEAD + 1), AHEAD + 1)
        self._voiced: deque[float] = deque([0.0] * (AHEAD + 1), AHEAD + 1)
        self._pitches: deque[float] = deque([0.0] * (AHEAD + 1), AHEAD + 1)
        self._tilts: deque[float] = deque([0.0] * (AHEAD + 1), AHEAD + 1)
        self._raw: deque[float] = deque([0.0] * (2 * SMOOTH + 1), 2 * SMOOTH + 1)
        self._smooth: deque[float] = deque([0.0] * (2 * PEAK + 1), 2 * PEAK + 1)
        self._tune: deque[float] = deque([0.0] * (2 * PEAK + SMOOTH + 1), 2 * PEAK + SMOOTH + 1)
        self._weights = (hill(2 * SMOOTH + 1) / hill(2 * SMOOTH + 1).sum()).tolist()
        self._usual, self._spread = 0.5, 0.15  # strength of syllables of late
        self._mean_pitch = self._pitch = self._melody = self._heard = 0.0
        self._odd = self._voiced_rows = 0
        self._varied, self._strain, self._usual_strain, self._tilt = CALM_PITCH**2, 0.0, 0.0, -20.0
        self._held, self._held_level, self._held_pitch = 0, 0.0, 0.0
        self._recent: deque[bool] = deque([False] * ONSET_WITHIN, ONSET_WITHIN)
        self._last_voiced, self._began = -1_000, -1
        self.speaking = False

    def push(self, rows: Float64Array) -> list[Event]:
        """Take a batch (row, 4) of prosody; give what can be told now, in its order."""
        assert len(rows) == BATCH
        found: list[Event] = []
        for row in rows.tolist():
            self.row += 1
            self._hear(row)
            found += self._phrases()
            found += self._hesitation()
            found += self._syllables()
        return found

    def _hear(self, row: list[float]) -> None:
        level = row[LEVEL]
        self._loudest = max(level, self._loudest - DECAY_DB)
        self._levels.append(level)
        self._voiced.append(row[VOICING])
        self._pitches.append(row[PITCH])
        self._tilts.append(row[TILT])
        below, voiced = min(0.0, self._levels[0] - self._loudest), self._voiced[0]
        self._raw.append(max(0.0, 1 + below / RANGE_DB) * (0.25 + 0.75 * voiced))
        spoken = voiced > 0.5 and below > -VOICED_DB
        self._recent.append(spoken)
        self._smooth.append(sum(map(float.__mul__, self._raw, self._weights)))
        if spoken and self.speaking:
            self._follow(self._pitches[0])
            self._feel(self._levels[0], self._tilts[0])
        self._tune.append(self._pitch)
        # Leaky sums of the voice alone: what was said of late, whatever noise is behind it.
        share = voiced * max(0.0, 1 + below / VOICED_DB)
        self._heard = 0.985 * self._heard + share
        self._melody = 0.97 * self._melody + share * self._pitch / 4
        self.content = 0.4 * self._heard + 0.3 * self._melody

    def _follow(self, pitch: float) -> None:
        """Track the pitch in semitones above its mean of late; it holds where there is no voice."""
        self._voiced_rows += 1
        if self._voiced_rows == 1:
            self._mean_pitch = pitch
        relative = pitch - self._mean_pitch
        if abs(relative - self._pitch) > JUMP and self._odd < 6:
            self._odd += 1
            return
        self._odd = 0
        self._mean_pitch += max(MEAN_LEAST, 2 / (self._voiced_rows + 1)) * relative
        relative = max(-12.0, min(12.0, pitch - self._mean_pitch))
        self._pitch += 0.35 * (relative - self._pitch)

    def forget_voice(self) -> None:
        """Another voice follows, which has a loudness and a pitch of its own."""
        self._loudest, self._voiced_rows, self._odd = SILENT_ROW[LEVEL], 0, 0

    def _feel(self, level: float, tilt: float) -> None:
        """Tell liveliness and effort, by what is usual for this voice in this recording."""
        strain, rows = level + tilt, self._voiced_rows
        self._varied += 0.004 * (self._pitch**2 - self._varied)
        self._usual_strain += max(USUAL_LEAST, 1 / rows) * (strain - self._usual_strain)
        self._strain += max(LATE, 1 / rows) * (strain - self._strain)
        self._tilt += max(LATE, 1 / rows) * (tilt - self._tilt)
        self.lively = _share(self._varied**0.5, (CALM_PITCH, LIVELY_PITCH))
        raised = _share(self._strain - self._usual_strain, FORCE_DB)
        self.force = max(raised, _share(self._tilt, BRIGHT_DB))

    def _hesitation(self) -> list[Event]:
        """Whether a vowel has been held for as long as only who thinks does."""
        level, pitch = self._levels[0], self._pitches[0]
        even = abs(pitch - self._held_pitch) < HELD_PITCH
        if not (self._recent[-1] and even and abs(level - self._held_level) < HELD_DB):
            self._held, self._held_level, self._held_pitch = 0, level, pitch
        self._held += 1
        return [Hesitation(self.row - AHEAD - HELD_ROWS)] if self._held == HELD_ROWS else []

    def _phrases(self) -> list[Event]:
        row = self.row - AHEAD  # of the newest entry in `_recent`
        if not self.speaking and sum(self._recent) >= ONSET_ROWS:
            first = row - ONSET_WITHIN + 1 + list(self._recent).index(True)
            pause, self._began, self.speaking = first - self._last_voiced, first, True
            self._last_voiced = row
            return [PhraseStart(first, pause)]
        if self.speaking and self._recent[-1]:
            self._last_voiced = row
        if self.speaking and row - self._last_voiced >= PAUSE:
            self.speaking = False
            length = self._last_voiced - self._began
            return [PhraseEnd(self._last_voiced, length, self._pitch)]
        return []

    def _syllables(self) -> list[Event]:
        strengths = self._smooth
        middle = strengths[PEAK]
        if middle < STRENGTH_LEAST or middle < max(strengths) or strengths[PEAK - 1] == middle:
            return []
        row = self.row - AHEAD - SMOOTH - PEAK
        pitch = max(list(self._tune)[:-SMOOTH])
        louder = (middle - self._usual) / self._spread
        self._spread += 0.1 * (max(0.08, abs(middle - self._usual)) - self._spread)
        self._usual += 0.15 * (middle - self._usual)
        prominence = 0.4 + 0.22 * louder + 0.09 * pitch
        return [Syllable(row, max(0.0, min(1.0, prominence)), pitch)]


def _share(value: float, bounds: tuple[float, float]) -> float:
    """Where a value is between two bounds, 0 to 1."""
    return min(1.0, max(0.0, (value - bounds[0]) / (bounds[1] - bounds[0])))
