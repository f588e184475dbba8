"""What a living head does about what it says: events of speech in, rows of motion out.

Every event draws a course into the rows ahead: a nod on an accent, a brow, a blink where a phrase
ends. What people leave to chance (when to blink, where to look) is drawn from the sound itself and
from who speaks, so one face always moves the same to the same sound, and otherwise to others.
"""

from __future__ import annotations

import math

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.life.canvas import Canvas, hill, joined, rise
from elocute.life.people import AVERAGE, Person
from elocute.life.prosody import BATCH, ROW_RATE
from elocute.life.prosody_events import Event, EventFinder, PhraseEnd, PhraseStart, Syllable
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
)
NOD, TURN, TILT, LOOK_DOWN, LOOK_LEFT, BLINK, BREATH = range(7)
INNER, BROW_L, BROW_R, DOWN, WIDE, SQUINT, CHEEK_L, CHEEK_R = range(7, len(CHANNELS))
LOOKAHEAD_ROWS = 80
"""A row is certain once so many more were heard."""
GOLDEN, PLASTIC = 0.6180339887498949, 0.7548776662466927  # step evenly through 0…1

# Degrees that a head turns about each axis; rates and sizes after docs/measurements/life.md.
POSTURE_DEG = (1.4, 2.1, 0.95)  # standard deviation of the postures that it takes
ACCENT_DEG = (2.1, 1.3, 0.7)  # of a whole prominence
SYLLABLE_DEG = 0.65  # of any syllable
SETTLE_DEG = 0.9  # the nod that ends a phrase
BROWS_HELD = 0.10  # of their shapes, by how far a head is from the middle

# Stress on the upper face: prominences, and weights of shapes (least, spread of a draw).
SOFT, ACCENT, EMPHATIC = 0.3, 0.5, 0.6
STIR = 0.13  # of the brows with any syllable of whole prominence, so that they never freeze
RAISE, KNIT, CHEEKS, NARROW = (0.34, 0.34), (0.09, 0.09), (0.04, 0.07), (0.03, 0.05)
LIDS_WITH_BROWS = 0.34  # of a raise: lids widen with it
BROW_REST = 55  # rows from one raise or knit to the next: brows come down before they rise
LID_REST = 80

REFRACTORY = 85  # rows from one blink to the next
WAIT_ROWS = 150  # of silence at the beginning, before the face comes alive without a voice
REDRAW_ROWS = 64
SPEAKING_MEAN, SILENT_MEAN = 150.0, 390.0  # rows between blinks that nothing calls for


_BREATH = joined([rise(45), 1 - rise(80)])
_STIR = joined([rise(22), 1 - rise(42)])
_LIDS = joined([rise(20), np.ones(16), 1 - rise(44)])


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
        self._canvas = Canvas(len(CHANNELS), LOOKAHEAD_ROWS + BATCH)
        self._blinks, self._blink_rate = blinks, blink_rate * person.blink_rate
        length = BLINK_S * person.blink_length
        moments = np.arange(round(length * ROW_RATE)) / ROW_RATE
        self._closure = lid_closure(moments / person.blink_length)
        self._person = person
        self._draws = 0
        self._last_blink = self._last_brow = self._last_lid = -1_000
        self._next_blink = self._next_posture = self._next_look = -1
        self._given = 0

    def push(self, rows: Float64Array) -> Float32Array:
        """Take a batch (row, 3) of prosody; give the rows that are certain now, perhaps none."""
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
        self._given += certain
        return self._canvas.take(certain)

    def _draw(self) -> float:
        """0 to 1, made of the sound of late, of who speaks and, for silence, of its length."""
        self._draws += 1
        factor = 1 + self._draws * PLASTIC % 1
        return ((self._finder.content + self._person.salt) * factor + self._draws * GOLDEN) % 1.0

    def _spread(self) -> float:
        """A draw around 0 with a standard deviation of 1, never beyond 3."""
        return 2 * (self._draw() + self._draw() + self._draw() - 1.5)

    def _answer(self, event: Event) -> None:
        if isinstance(event, Syllable):
            self._stress(event)
        elif isinstance(event, PhraseStart):
            self._begin(event)
        else:
            self._end(event)

    def _stress(self, syllable: Syllable) -> None:
        """Nod with a syllable, more with an accent; brows, lids and cheeks go with it."""
        prominence, row, canvas = syllable.prominence, syllable.row, self._canvas
        size = SYLLABLE_DEG + (ACCENT_DEG[0] - SYLLABLE_DEG) * prominence**1.5
        rows = round(17 + 21 * prominence + 6 * self._draw())
        # Up a little first, as one who strikes; some accents go up instead.
        sign = -0.7 if syllable.pitch > 1.5 and self._draw() < 0.45 else 1.0
        canvas.pulse(NOD, row - rows // 2 - 10, hill(18), -0.35 * sign * size)
        canvas.pulse(NOD, row - rows // 2 + 3, hill(rows), sign * size)
        for channel, reach in ((TURN, ACCENT_DEG[1]), (TILT, ACCENT_DEG[2])):
            sideways = reach * self._spread() * (0.35 + 0.65 * prominence)
            wide = round(rows * (0.9 + 0.6 * self._draw()))
            canvas.pulse(channel, row - wide // 2 + 2, hill(wide), sideways)
        self._lift(row - len(_STIR) // 3, _STIR, STIR * prominence)
        if prominence >= ACCENT:
            self._accent(syllable)
        elif prominence < SOFT and row - self._last_lid >= LID_REST and self._draw() < 0.5:
            self._narrow(row, self._weight(NARROW))

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
            if accent.pitch < 0.3 and self._draw() < 0.6:
                self._knit(row, size * self._weight(KNIT))
            else:
                self._raise_brows(row, size * self._weight(RAISE))
        elif accent.prominence >= EMPHATIC and self._draw() < 0.6:
            self._lift_cheeks(row, size * self._weight(CHEEKS))

    def _raise_brows(self, row: int, size: float) -> None:
        """Before a syllable, highest on it, and down without haste; lids widen with them."""
        size *= 1 - self._canvas.level[INNER]  # brows that are held up have less far to go
        up, held = round(18 + 9 * self._draw()), round(3 + 14 * self._draw())
        course = joined([rise(up), np.ones(held), 1 - rise(round(34 + 24 * self._draw()))])
        self._lift(row - up, course, size)
        self._canvas.pulse(WIDE, row - up, course, LIDS_WITH_BROWS * size)
        self._last_brow = row

    def _lift(self, start: int, course: Float64Array, size: float) -> None:
        """Both brows, one more than the other."""
        size *= self._person.brows
        lean = 0.26 * (2 * self._draw() - 1) + self._person.lean
        self._canvas.pulse(INNER, start, course, size * (0.7 + 0.3 * self._draw()))
        self._canvas.pulse(BROW_L, start, course, 0.8 * size * (1 + lean))
        self._canvas.pulse(BROW_R, start, course, 0.8 * size * (1 - lean))

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
        """Breathe, take another posture, and look away now and then."""
        row = start.row
        if start.pause > 35:
            depth = min(1.0, start.pause / 150) * (0.6 + 0.4 * self._draw())
            self._canvas.pulse(BREATH, row - 50, _BREATH, depth)
        self._take_posture(row - 20, 1.0)
        if self._draw() < 0.4:
            self._look(row - 12, 5.0)
        if self._draw() < 0.35 and row - self._last_brow > 60:
            self._raise_brows(row, 0.16 + 0.24 * self._draw())

    def _end(self, end: PhraseEnd) -> None:
        """Settle, look back, and blink more often than not."""
        self._canvas.pulse(NOD, end.row - 20, hill(75), SETTLE_DEG * self._draw())
        if self._draw() < 0.6 * self._blink_rate:
            self._blink(end.row + round(14 * self._draw()) - 4)
        if self._draw() < 0.6:
            self._look(end.row + 5, 0.8)

    def _pass_time(self) -> None:
        """What comes by itself: postures, glances and blinks, at times drawn before."""
        now = self._finder.row - 25
        if self._next_blink < 0:
            # Nothing is drawn before there is a voice to draw from, or a long silence.
            if not self._finder.speaking and now < WAIT_ROWS:
                return
            self._next_blink = now + round(200 * self._draw())
            self._next_posture, self._next_look = now + 60, now + round(90 * self._draw())
        if now >= self._next_posture:
            speaking = self._finder.speaking
            self._take_posture(now, 1.0 if speaking else 0.55)
            self._next_posture = now + round((95 if speaking else 190) * (0.6 + self._draw()))
        if now >= self._next_look:
            self._glance(now)
        if now >= self._next_blink:
            self._blink(now)

    def _take_posture(self, row: int, size: float) -> None:
        """Go to a posture around the middle, so that the head never drifts away."""
        rows = round(60 + 60 * self._draw())
        turn = self._spread()
        tilt = 0.85 * self._spread() + 0.4 * turn
        nod = self._spread()
        for channel, reach, drawn in zip(
            (NOD, TURN, TILT), POSTURE_DEG, (nod, turn, tilt), strict=True
        ):
            self._canvas.step(channel, row, rise(rows), size * reach * drawn)
        # Brows are held up with the head, or aside with it; the outer one where it tilts.
        held, lean = size * BROWS_HELD * max(0.0, 0.3 * abs(turn) - nod), 0.2 * tilt
        for channel, share in ((INNER, 0.9), (BROW_L, 0.8 + lean), (BROW_R, 0.8 - lean)):
            self._canvas.step(channel, row, rise(rows), held * max(0.0, share))

    def _glance(self, row: int) -> None:
        """The eyes rest on something for a while, then jump; mostly back to the middle."""
        self._look(row, 1.2 if self._draw() < 0.75 else 4.5)
        fixation = 35 - 90 * math.log(1 - 0.96 * self._draw())
        self._next_look = row + round(fixation)

    def _look(self, row: int, reach: float) -> None:
        down, left = 0.6 * reach * self._spread(), reach * self._spread()
        jump = math.hypot(
            down - self._canvas.level[LOOK_DOWN], left - self._canvas.level[LOOK_LEFT]
        )
        course = rise(max(2, round(2 + 0.25 * jump)))  # a saccade: 20 ms and 2.5 ms a degree
        self._canvas.step(LOOK_DOWN, row, course, down)
        self._canvas.step(LOOK_LEFT, row, course, left)
        if jump > 7 and self._draw() < 0.5:
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
