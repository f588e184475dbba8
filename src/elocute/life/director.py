"""Turns events of speech into rows of head, gaze, lid and brow motion.

Every event draws a course into the rows ahead: a nod on an accent, a brow, a blink where a phrase
ends. What people leave to chance (when to blink, where to look) is drawn from the sound itself and
from who speaks, so one face always moves the same to the same sound, and otherwise to others.
"""

from __future__ import annotations

import math

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.life.ground import GOLDEN, PLASTIC, Ground
from elocute.life.lookahead_buffer import LookaheadBuffer, hill, joined, rise
from elocute.life.people import AVERAGE, Person
from elocute.life.prosody import BATCH, ROW_RATE
from elocute.life.prosody_events import (
    Event,
    EventFinder,
    PhraseEnd,
    PhraseStart,
    Syllable,
)
from elocute.motion.blink_timing import BLINK_S, lid_closure

CHANNELS = (
    "nod",
    "turn",
    "tilt",
    "look_down",
    "look_left",
    "blink",
    "breath",
    "brow_inner",
    "brow_left",
    "brow_right",
    "brow_down",
    "lid_wide",
    "lid_squint",
    "cheek_left",
    "cheek_right",
    "lid",
    "side",
    "corner",
    "lively",
    "force",
)
NOD, TURN, TILT, LOOK_DOWN, LOOK_LEFT, BLINK, BREATH = range(7)
INNER, BROW_L, BROW_R, DOWN, WIDE, SQUINT, CHEEK_L, CHEEK_R = range(7, 15)
LID, SIDE, CORNER, LIVELY, FORCE = range(15, len(CHANNELS))
LOOKAHEAD_ROWS = 80
"""A row is certain once so many more were heard."""

# Degrees that a head turns about each axis; rates and sizes after docs/measurements/life.md.
POSTURE_DEG = (1.5, 1.8, 1.1)  # standard deviation of the postures that it takes
WIDE_SHARE, WIDE_REACH = 0.12, 3.4  # of postures, which go so much further aside
MOST_DEG = 11.0  # that a posture turns
TURNING_BACK = 0.4  # of how far it is aside, so that it is the other side's turn
ACCENT_DEG = (2.6, 1.3, 0.7)  # of a whole prominence
NODDED = 0.32  # share of the accents that a nod goes with
NOD_REST = 70  # rows from one to the next
SWAY_DEG = (0.75, 0.85, 0.45)  # while somebody speaks, at no time that the voice says
SETTLE_DEG = 0.9  # the nod that ends a phrase
BROWS_HELD = 0.10  # of their shapes, by how far a head is from the middle

# Where eyes look: degrees (least, spread of a draw), and how likely they leave the listener.
AWAY_DEG = (10.0, 8.0)
AWAY_BEGINNING, AWAY_HESITATING, AWAY_THINKING = 0.36, 0.6, 0.3
# Each time that eyes move by themselves:
AWAY_SPEAKING, AWAY_IDLE, AWAY_LISTENING = 0.12, 0.08, 0.03
AWAY_REST = 420  # rows after which they leave as likely as that; sooner less, later more
FINAL_PITCH = -1.5  # semitones: a phrase that ends lower ends a turn
HEAD_WITH_GAZE = 0.25  # of a shift of gaze
FIXATION_DEG, MICRO_DEG = 1.2, 0.35

# Stress on the upper face: prominences, and weights of shapes (least, spread of a draw).
SOFT, ACCENT, EMPHATIC = 0.3, 0.5, 0.6
STIR = 0.13  # of the brows with any syllable of whole prominence, so that they never freeze
RAISE, KNIT, CHEEKS, NARROW = (0.34, 0.34), (0.09, 0.09), (0.04, 0.07), (0.03, 0.05)
FLASH, EFFORT_KNIT = (0.2, 0.06), 0.25
INNER_ONLY, ONE_SIDED, FLASHED = 0.14, 0.34, 0.48  # of the raises, each beyond the one before
LIDS_WITH_BROWS = 0.34  # of a raise: lids widen with it
BROW_REST = 55  # rows from one raise or knit to the next: brows come down before they rise
LID_REST = 80

# Of one who listens: how likely a nod is where the other's phrase ends, and after an accent.
NOD_AT_END, NOD_AT_ACCENT, LISTENING_REST = 0.6, 0.12, 220
LISTENER_NOD_DEG = (1.6, 2.2)

REFRACTORY = 85  # rows from one blink to the next
WAIT_ROWS = 150  # of silence at the beginning, before anything is drawn without a voice
REDRAW_ROWS = 64
SPEAKING_MEAN, SILENT_MEAN = 150.0, 390.0  # rows between blinks that nothing calls for
BREATH_ROWS, BREATH_DEPTH = 390, 0.28  # of one who rests


_BREATH = joined([rise(45), 1 - rise(80)])
_RESTING_BREATH = joined([rise(150), 1 - rise(210)])
_STIR = joined([rise(22), 1 - rise(42)])
_LIDS = joined([rise(20), np.ones(16), 1 - rise(44)])
_FLASH = joined([rise(9), np.ones(4), 1 - rise(13)])


class Director:
    """Rows of prosody in, rows of motion (row, channel) out, `LOOKAHEAD_ROWS` later.

    Parameters
    ----------
    blinks : float
        Share of the blinks that are made, 0 to 1.
    blink_rate : float
        How often lids close, 1 as people do on average.
    person : Person
        Who speaks.
    """

    def __init__(
        self, blinks: float = 1.0, blink_rate: float = 1.0, person: Person = AVERAGE
    ) -> None:
        self._finder = EventFinder()
        self._canvas = LookaheadBuffer(len(CHANNELS), LOOKAHEAD_ROWS + BATCH)
        self._blinks, self._blink_rate = blinks, blink_rate * person.blink_rate
        length = BLINK_S * person.blink_length
        moments = np.arange(round(length * ROW_RATE)) / ROW_RATE
        self._closure = lid_closure(moments / person.blink_length)
        self._person, self._ground = person, Ground(CHANNELS, person)
        self._draws = 0
        self._last_blink = self._last_brow = self._last_lid = self._last_nod = -1_000
        self._last_away = 0
        self._next_blink = self._next_posture = self._next_look = self._next_breath = -1
        self._away = self._listening = False
        self._given = 0

    def push(self, rows: Float64Array, listening: bool = False) -> Float32Array:
        """Take a batch (row, 4) of prosody; give the rows that are certain now, perhaps none.

        With `listening` it is somebody else's voice.
        """
        if listening != self._listening:
            self._listening = listening
            self._finder.forget_voice()
        for event in self._finder.push(rows):
            # A draw depends on its place in an event, not on all draws before: where another
            # recording of the same voice has an event more, all others stay as they are.
            self._draws = event.row // REDRAW_ROWS
            self._answer(event)
        self._draws = 100 + self._finder.row // REDRAW_ROWS
        self._pass_time()
        certain = self._finder.row + 1 - LOOKAHEAD_ROWS - self._given
        if certain <= 0:
            return np.zeros((0, len(CHANNELS)), np.float32)
        ground = self._ground.rows(self._given, certain).astype(np.float32)
        self._given += certain
        return self._canvas.take(certain) + ground

    def _draw(self) -> float:
        """0 to 1, made of the sound of late, of who speaks and, for silence, of its length."""
        self._draws += 1
        factor = 1 + self._draws * PLASTIC % 1
        return ((self._finder.content + self._person.salt) * factor + self._draws * GOLDEN) % 1.0

    def _spread(self) -> float:
        """A draw around 0 with a standard deviation of 1, never beyond 3."""
        return 2 * (self._draw() + self._draw() + self._draw() - 1.5)

    def _answer(self, event: Event) -> None:
        if self._listening:
            self._attend(event)
        elif isinstance(event, Syllable):
            self._stress(event)
        elif isinstance(event, PhraseStart):
            self._begin(event)
        elif isinstance(event, PhraseEnd):
            self._end(event)
        elif self._leaves(event.row, AWAY_HESITATING):
            self._look_away(event.row + 20, 60)

    def _attend(self, event: Event) -> None:
        """Listen: nod where a phrase of the other ends and on some accents, and look at them."""
        rested = event.row - self._last_nod > LISTENING_REST
        if isinstance(event, PhraseStart):
            self._look_near(event.row + 15, FIXATION_DEG)
        elif isinstance(event, PhraseEnd):
            if rested and event.length > 60 and self._draw() < NOD_AT_END:
                self._nod_along(event.row + 25 + round(25 * self._draw()))
            if self._draw() < 0.45 * self._blink_rate:
                self._blink(event.row + 10 + round(30 * self._draw()))
        elif isinstance(event, Syllable) and event.prominence >= ACCENT:
            if rested and self._draw() < NOD_AT_ACCENT:
                self._nod_along(event.row + 20)
            elif event.row - self._last_brow > LISTENING_REST and self._draw() < NOD_AT_ACCENT:
                self._raise_brows(event.row + 25, 0.7 * self._weight(RAISE))

    def _nod_along(self, row: int) -> None:
        """Nod once to three times, ever less."""
        size, times = self._weight(LISTENER_NOD_DEG), 1 + int(2.5 * self._draw())
        for each in range(times):
            self._canvas.pulse(NOD, row + 36 * each, hill(44), size * 0.65**each)
        self._last_nod = row

    def _stress(self, syllable: Syllable) -> None:
        """Sway as one who speaks; on a few accents nod, and let brows, lids and cheeks go along."""
        prominence, row = syllable.prominence, syllable.row
        self._sway(row)
        if (
            prominence >= ACCENT
            and row - self._last_nod >= NOD_REST
            and self._draw() < NODDED * (0.4 + prominence)
        ):
            self._strike(syllable)
        self._lift(row - len(_STIR) // 3, _STIR, STIR * prominence)
        if prominence >= ACCENT:
            self._accent(syllable)
        elif prominence < SOFT and row - self._last_lid >= LID_REST and self._draw() < 0.5:
            self._narrow(row, self._weight(NARROW))

    def _sway(self, row: int) -> None:
        """Move the head about, half a second or so around a syllable but not on it."""
        for channel, reach in zip((NOD, TURN, TILT), SWAY_DEG, strict=True):
            rows = round(17 + 83 * self._draw() ** 2)
            start = row - rows // 2 + round(90 * (self._draw() - 0.4))
            self._canvas.pulse(channel, start, hill(rows), reach * self._spread())

    def _strike(self, accent: Syllable) -> None:
        """Nod with an accent: up a little first, as one who strikes; some go up instead."""
        prominence, row, canvas = accent.prominence, accent.row, self._canvas
        size = ACCENT_DEG[0] * (0.4 + 0.6 * prominence)
        rows = round(20 + 16 * prominence + 8 * self._draw())
        sign = -0.7 if accent.pitch > 1.5 and self._draw() < 0.45 else 1.0
        canvas.pulse(NOD, row - rows // 2 - 10, hill(18), -0.35 * sign * size)
        canvas.pulse(NOD, row - rows // 2 + 3, hill(rows), sign * size)
        for channel, reach in ((TURN, ACCENT_DEG[1]), (TILT, ACCENT_DEG[2])):
            wide = round(rows * (0.9 + 0.6 * self._draw()))
            canvas.pulse(channel, row - wide // 2 + 2, hill(wide), reach * self._spread())
        self._last_nod = row

    def _weight(self, bounds: tuple[float, float]) -> float:
        least, spread = bounds
        return least + spread * self._draw()

    def _accent(self, accent: Syllable) -> None:
        """Raise the brows, or knit them where the voice is low, or else lift the cheeks."""
        row, size = accent.row, 0.4 + 0.6 * accent.prominence
        rested = row - self._last_brow
        wanted = 0.1 + 0.5 * accent.prominence + 0.4 * min(1.0, max(0.0, accent.pitch) / 4)
        # Brows that have been still for long are the more ready to go.
        wanted *= 0.6 + 0.4 * min(2.5, rested / 150)
        if rested >= BROW_REST and self._draw() < wanted:
            effort = self._finder.force
            if self._draw() < (0.6 if accent.pitch < 0.3 else 0.0) + 0.6 * effort:
                self._knit(row, size * self._weight(KNIT) + EFFORT_KNIT * effort)
            else:
                self._raise_brows(row, size * self._weight(RAISE))
        elif accent.prominence >= EMPHATIC and self._draw() < 0.6:
            self._lift_cheeks(row, size * self._weight(CHEEKS))

    def _raise_brows(self, row: int, size: float) -> None:
        """Before a syllable, highest on it, and down without haste; lids widen with them.

        Mostly both, else their inner ends, one of them, or both in a flash.
        """
        kind, size = self._draw(), size * (1 - self._canvas.level[INNER])  # held up: less to go
        up, held = round(18 + 9 * self._draw()), round(3 + 14 * self._draw())
        course = joined([rise(up), np.ones(held), 1 - rise(round(34 + 24 * self._draw()))])
        sides = (1.0, 1.0, 1.0)
        if kind < INNER_ONLY:
            sides = (1.0, 0.2, 0.2)
        elif kind < ONE_SIDED:
            sides = (
                (0.5, 1.0, 0.35) if self._draw() < 0.5 + 2 * self._person.lean else (0.5, 0.35, 1.0)
            )
        elif kind < FLASHED:
            up, course, size = 9, _FLASH, self._weight(FLASH)
        self._lift(row - up, course, size, sides)
        self._canvas.pulse(WIDE, row - up, course, LIDS_WITH_BROWS * size * max(sides[1:]))
        self._last_brow = row

    def _lift(
        self,
        start: int,
        course: Float64Array,
        size: float,
        sides: tuple[float, float, float] = (1.0, 1.0, 1.0),
    ) -> None:
        """Inner ends, left and right brow, one more than the other."""
        size *= self._person.brows
        lean = 0.26 * (2 * self._draw() - 1) + self._person.lean
        inner, left, right = sides
        self._canvas.pulse(INNER, start, course, inner * size * (0.7 + 0.3 * self._draw()))
        self._canvas.pulse(BROW_L, start, course, 0.8 * left * size * (1 + lean))
        self._canvas.pulse(BROW_R, start, course, 0.8 * right * size * (1 - lean))

    def _knit(self, row: int, size: float) -> None:
        self._canvas.pulse(DOWN, row - 20, _LIDS, size * self._person.brows)
        self._narrow(row, 0.5 * size)
        self._last_brow = row

    def _lift_cheeks(self, row: int, size: float) -> None:
        lean = 0.3 * (2 * self._draw() - 1)
        self._canvas.pulse(CHEEK_L, row - 20, _LIDS, size * (1 + lean))
        self._canvas.pulse(CHEEK_R, row - 20, _LIDS, size * (1 - lean))
        self._narrow(row, 0.6 * size)

    def _narrow(self, row: int, size: float) -> None:
        self._canvas.pulse(SQUINT, row - 20, _LIDS, size)
        self._last_lid = row

    def _begin(self, start: PhraseStart) -> None:
        """Breathe, take another posture, and look away at times."""
        row = start.row
        if start.pause > 35:
            depth = min(1.0, start.pause / 150) * (0.6 + 0.4 * self._draw())
            self._canvas.pulse(BREATH, row - 50, _BREATH, depth)
        self._take_posture(row - 20, 1.0)
        if self._leaves(row, AWAY_BEGINNING):
            self._look_away(row - 15, 30)
        if self._draw() < 0.35 and row - self._last_brow > 60:
            self._raise_brows(row, 0.16 + 0.24 * self._draw())

    def _end(self, end: PhraseEnd) -> None:
        """Settle, look back or, where more will come, perhaps away, and often blink."""
        self._canvas.pulse(NOD, end.row - 20, hill(75), SETTLE_DEG * self._draw())
        self._take_posture(end.row + 5, 0.6)
        if self._draw() < 0.45 * self._blink_rate:
            self._blink(end.row + round(14 * self._draw()) - 4)
        if end.pitch > FINAL_PITCH and self._leaves(end.row, AWAY_THINKING):
            self._look_away(end.row + 10, 40)
        else:
            self._look_near(end.row + 5, 0.8)

    def _pass_time(self) -> None:
        """What comes by itself: postures, glances, blinks and breaths, at times drawn before."""
        now, speaking = self._finder.row - 25, self._finder.speaking and not self._listening
        if not self._listening:
            for channel, felt in ((LIVELY, self._finder.lively), (FORCE, self._finder.force)):
                self._canvas.step(channel, now, rise(2 * BATCH), felt)
        if self._next_blink < 0:
            # Nothing is drawn before there is a voice to draw from, or a long silence.
            if not self._finder.speaking and now < WAIT_ROWS:
                return
            self._next_blink = now + round(300 * self._draw())
            self._next_posture, self._next_look = now + 60, now + round(90 * self._draw())
            self._next_breath = now
        if now >= self._next_posture:
            self._take_posture(now, 1.0 if speaking else 0.5)
            self._next_posture = now + round((110 if speaking else 230) * (0.6 + self._draw()))
        if now >= self._next_look:
            self._glance(now)
        if now >= self._next_blink:
            self._blink(now)
        if now >= self._next_breath:
            self._next_breath = now + round(BREATH_ROWS * (0.85 + 0.3 * self._draw()))
            if not speaking:
                depth = BREATH_DEPTH * (0.7 + 0.3 * self._draw())
                self._canvas.pulse(BREATH, now, _RESTING_BREATH, depth)

    def _take_posture(self, row: int, size: float) -> None:
        """Go to a posture around the middle, so that the head never drifts away."""
        turn, tilt, nod = (self._spread() for _ in range(3))
        turn -= TURNING_BACK * self._canvas.level[TURN] / POSTURE_DEG[1]
        wide = WIDE_REACH if self._draw() < WIDE_SHARE * size else 1.0
        rows = round((60 + 60 * self._draw()) * wide**0.5)
        tilt = 0.85 * tilt + 0.4 * turn
        for channel, reach, drawn in zip(
            (NOD, TURN, TILT), POSTURE_DEG, (nod, wide * turn, tilt), strict=True
        ):
            self._canvas.step(channel, row, rise(rows), _within_reach(size * reach * drawn))
        # Brows are held up with the head, or aside with it; the outer one where it tilts.
        held, lean = size * BROWS_HELD * max(0.0, 0.3 * abs(turn) - nod), 0.2 * tilt
        for channel, share in ((INNER, 0.9), (BROW_L, 0.8 + lean), (BROW_R, 0.8 - lean)):
            self._canvas.step(channel, row, rise(rows), held * max(0.0, share))

    def _glance(self, row: int) -> None:
        """The eyes come back, rest on the listener and move about there; at times they leave."""
        leaving = AWAY_SPEAKING if self._finder.speaking else AWAY_IDLE
        if self._away or self._draw() < 0.35:
            self._look_near(row, FIXATION_DEG)
        elif self._leaves(row, AWAY_LISTENING if self._listening else leaving):
            self._look_away(row, 45)
            return
        else:
            down, left = (self._canvas.level[each] for each in (LOOK_DOWN, LOOK_LEFT))
            self._look_at(row, down + MICRO_DEG * self._spread(), left + MICRO_DEG * self._spread())
        self._next_look = row + round(25 - 60 * math.log(1 - 0.96 * self._draw()))

    def _leaves(self, row: int, likely: float) -> bool:
        """Whether eyes leave the listener now: the likelier, the longer they stayed."""
        return self._draw() < likely * min(1.6, (row - self._last_away) / AWAY_REST)

    def _look_near(self, row: int, reach: float) -> None:
        """At the listener's face."""
        self._away = False
        self._look_at(row, 0.6 * reach * self._spread(), reach * self._spread())

    def _look_away(self, row: int, least: int) -> None:
        """To a side and up or down, for so many rows at least; the head goes some of the way."""
        size, bearing = self._weight(AWAY_DEG), 0.6 * self._spread()
        side = 1.0 if self._draw() < 0.5 else -1.0
        down, left = 0.8 * size * math.sin(bearing), side * size * math.cos(bearing)
        self._look_at(row, down, left)
        course = rise(round(35 + 15 * self._draw()))
        for channel, moved in ((NOD, 0.5 * down), (TURN, left)):
            target = self._canvas.level[channel] + HEAD_WITH_GAZE * moved
            self._canvas.step(channel, row + 6, course, _within_reach(target))
        self._away, self._last_away = True, row
        self._next_look = max(row, self._finder.row - 25) + round(least + 70 * self._draw())

    def _look_at(self, row: int, down: float, left: float) -> None:
        jump = math.hypot(
            down - self._canvas.level[LOOK_DOWN], left - self._canvas.level[LOOK_LEFT]
        )
        course = rise(max(2, round(2 + 0.25 * jump)))  # a saccade: 20 ms and 2.5 ms a degree
        self._canvas.step(LOOK_DOWN, row, course, down)
        self._canvas.step(LOOK_LEFT, row, course, left)
        if jump > 7 and self._draw() < 0.45:
            self._blink(row - 3)

    def _blink(self, row: int) -> None:
        """Close the lids, unless they just did; then draw when to do it without a reason."""
        mean = (SPEAKING_MEAN if self._finder.speaking else SILENT_MEAN) / self._blink_rate
        wait = -mean / 2 * (math.log(1 - 0.97 * self._draw()) + math.log(1 - 0.97 * self._draw()))
        partial, made = self._draw(), self._draw() < self._blinks
        if row - self._last_blink < REFRACTORY:
            return
        self._last_blink, self._next_blink = row, row + round(REFRACTORY + wait)
        if made:
            depth = 1.0 if partial > 0.18 else 0.5 + 2.2 * partial
            self._canvas.pulse(BLINK, row, self._closure, depth)
            self._canvas.pulse(LOOK_DOWN, row, self._closure, depth)


def _within_reach(degrees: float) -> float:
    return max(-MOST_DEG, min(MOST_DEG, degrees))
