"""A crowd whose truth is known: what it prefers, how it errs, and who of it cheats.

It answers any study as its participants would see it, to find out whether the report recovers what
was put in, and to try a study before anybody is asked. Its people are named `simulated-…`, and a
report says so on its first lines.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import cached_property
from typing import TYPE_CHECKING

from elocute.errors import StudyError
from elocute.settings import check_settings, described, setting
from elocute.study.design.design import MISMATCHED, Design
from elocute.study.design.trials import Shown, block_count, sequence
from elocute.study.report.answers import Answer, answer_to

if TYPE_CHECKING:
    import numpy as np

OBVIOUS = 5.0
"""Logits by which a face that moves to its own sound beats one that does not."""
BEGAN = datetime(2026, 1, 1, tzinfo=UTC)
SYNC_BOUNDS_MS, SYNC_SD_MS = (-90.0, 170.0), 70.0
"""Where most people begin to notice that a sound is early or late, and how surely."""
PEOPLE_MAX = 100_000


@described
@dataclass(frozen=True)
class Crowd:
    """A crowd.

    Raises
    ------
    StudyError
        For a value of another type or outside its range.
    """

    levels: Mapping[str, float] = field(default_factory=dict)
    """By condition: strength in logits for "binary", logit of being recognised or understood for
    "style" and "intelligibility", points of 100 for "rating". 0, or 50 points, where none is named.
    """
    people_sd: float = setting(
        0.6, low=0, high=50, help="Spread of it between people: logits, or points of a rating."
    )
    stimuli_sd: float = setting(0.3, low=0, high=50, help="Spread of it between stimuli.")
    noise: float = setting(15.0, low=0, high=50, help="Spread of single ratings, in points.")
    side: float = setting(0.0, low=-3, high=3, help="Liking of the left side, in logits.")
    side_sd: float = setting(0.0, low=0, high=5, help="Spread of it between people, in logits.")
    lapses: float = setting(0.03, low=0, high=1, help="Share of answers given at random.")
    cheaters: float = setting(0.0, low=0, high=1, help="Share of people who never look.")

    def __post_init__(self) -> None:
        check_settings(self, StudyError)

    def true_share(self, one: str, other: str) -> float:
        """How often people who look, of all people and for all stimuli, choose one over another.

        Parameters
        ----------
        one, other : str
            Conditions of a study of kind "binary".

        Returns
        -------
        float
        """
        from elocute.study.statistics.mixed_logit import marginal_share

        apart = self.levels.get(one, 0.0) - self.levels.get(other, 0.0)
        sd = math.hypot(self.people_sd, self.stimuli_sd, self.side_sd)
        sides = [marginal_share(apart + sign * self.side, sd) for sign in (1, -1)]
        return (1 - self.lapses) * sum(sides) / 2 + self.lapses / 2


@dataclass(frozen=True)
class Seat:
    """A place in a study, and all that who takes it is shown."""

    block: int
    visit: int
    shown: Sequence[Shown]


def seats_of(design: Design, people: int) -> list[Seat]:
    """The places that people take one after another.

    Parameters
    ----------
    design : Design
        The study, with its sounds by name.
    people : int
        How many.

    Returns
    -------
    list of Seat

    Raises
    ------
    StudyError
        For no people or too many.
    """
    if not 0 < people <= PEOPLE_MAX:
        raise StudyError.about("people", found=str(people), allowed=f"1 to {PEOPLE_MAX}")
    blocks = block_count(design)
    places = [(number % blocks + 1, number // blocks) for number in range(people)]
    return [Seat(block, visit, sequence(design, block, visit)) for block, visit in places]


def crowd_answers(
    design: Design,
    crowd: Crowd,
    seats: Sequence[Seat],
    seed: int = 0,
) -> list[Answer]:
    """What a crowd answers.

    Parameters
    ----------
    design : Design
        The study.
    crowd : Crowd
        Who is asked.
    seats : sequence of Seat
        What each person is shown.
    seed : int
        Of people, stimuli and answers.

    Returns
    -------
    list of Answer
        The table, by person and order.
    """
    import numpy as np  # not before: the command line reads the settings above

    rng = np.random.default_rng(seed)
    stimuli = _Stimuli(crowd, rng)
    cheating = rng.permutation(len(seats)) < round(crowd.cheaters * len(seats))
    table: list[Answer] = []
    for number, (seat, cheats) in enumerate(zip(seats, cheating.tolist(), strict=True), 1):
        own = np.random.default_rng(rng.integers(2**62))
        person = _Person(design, crowd, stimuli, own, cheats)
        table += person.session(f"simulated-{number:05}", seat)
    return table


class _Stimuli:
    """What stimuli add to conditions, drawn when they are first met."""

    def __init__(self, crowd: Crowd, rng: np.random.Generator) -> None:
        self._sd, self._rng = crowd.stimuli_sd, rng
        self._added: dict[tuple[str, str], float] = {}

    def added(self, stimulus: str, condition: str) -> float:
        key = stimulus, condition
        if key not in self._added:
            self._added[key] = float(self._rng.normal(0, 1)) * self._sd
        return self._added[key]


class _Person:
    """One who takes part."""

    def __init__(
        self,
        design: Design,
        crowd: Crowd,
        stimuli: _Stimuli,
        rng: np.random.Generator,
        cheats: bool,
    ) -> None:
        self._design, self._crowd, self._stimuli, self._rng = design, crowd, stimuli, rng
        self._cheats = cheats
        self._side = crowd.side + crowd.side_sd * float(rng.normal())
        self._always_left = cheats and rng.random() < 0.3
        self._own: dict[str, float] = {}
        self._pace = float(rng.lognormal(0, 0.25))

    @cached_property
    def _sync(self) -> tuple[float, float]:
        """Where this person begins to notice."""
        return tuple(each + 25 * float(self._rng.normal()) for each in SYNC_BOUNDS_MS)  # type: ignore[return-value]

    def session(self, name: str, seat: Seat) -> list[Answer]:
        """All answers; who fails the qualification stops, where the study says so."""
        answers: list[Answer] = []
        now = BEGAN
        for each in seat.shown:
            if each.trial.role not in ("practice", "qualification") and self._failed(answers):
                break
            seconds = round(self._seconds(), 3)
            now += timedelta(seconds=seconds + 1)
            answers.append(
                answer_to(
                    each,
                    self._answer(each),
                    participant=name,
                    group=seat.block,
                    seconds=seconds,
                    replays=0 if self._cheats else int(self._rng.poisson(0.3)),
                    answered_at=now.isoformat(timespec="milliseconds"),
                )
            )
        return answers

    def _failed(self, answers: Sequence[Answer]) -> bool:
        rules = self._design.qualification
        asked = [each for each in answers if each.role == "qualification"]
        right = sum(each.answer == each.correct for each in asked)
        return rules.failed == "stop" and bool(asked) and right < rules.needed

    def _seconds(self) -> float:
        if self._cheats:
            return float(self._rng.uniform(0.3, 2.0))
        return 4.0 * self._pace * float(self._rng.lognormal(0, 0.3))

    def _answer(self, shown: Shown) -> str:
        at_random = self._cheats or self._rng.random() < self._crowd.lapses
        if shown.right:
            if self._always_left:
                return shown.left
            lefts = 0.5 if at_random else _logistic(self._left_logit(shown))
            return shown.left if self._rng.random() < lefts else shown.right
        if shown.trial.kind == "rating":
            return self._rating(shown, at_random)
        if shown.trial.kind == "sync":
            return self._felt(shown, at_random)
        return self._word(shown, at_random)

    def _left_logit(self, shown: Shown) -> float:
        if MISMATCHED in (shown.left, shown.right):
            return OBVIOUS if shown.right == MISMATCHED else -OBVIOUS
        if shown.trial.kind == "style":
            right = shown.trial.correct
            known = self._level(right, shown.trial.stimulus)
            return self._side + (known if shown.left == right else -known)
        levels = [self._level(name, shown.trial.stimulus) for name in (shown.left, shown.right)]
        return self._side + levels[0] - levels[1]

    def _level(self, condition: str, stimulus: str) -> float:
        """How good a condition is, to this person and for this stimulus."""
        neutral = 50.0 if self._design.study.kind == "rating" else 0.0
        return self._crowd.levels.get(condition, neutral) + self._differing(condition, stimulus)

    def _differing(self, condition: str, stimulus: str) -> float:
        """What this person and this stimulus add to a condition."""
        if condition not in self._own:
            self._own[condition] = self._crowd.people_sd * float(self._rng.normal())
        differing = self._own[condition] + self._stimuli.added(stimulus, condition)
        # Two of a pair differ: the spread of the difference is what the crowd says.
        share = math.sqrt(0.5) if self._design.study.kind == "binary" else 1.0
        return share * differing

    def _rating(self, shown: Shown, at_random: bool) -> str:
        value = float(self._rng.uniform(0, 100))
        if not at_random:
            value = self._level(shown.left, shown.trial.stimulus)
            value += self._crowd.noise * float(self._rng.normal())
            if shown.left == self._design.comparisons.reference:
                value = 100 - abs(0.2 * self._crowd.noise * float(self._rng.normal()))
        value = min(max(value, 0.0), 100.0)
        steps = 25 if self._design.study.scale == "mos" else 1
        return str(round(value / steps) * steps)

    def _felt(self, shown: Shown, at_random: bool) -> str:
        if at_random:
            return str(self._rng.choice(shown.words))
        felt = self._design.condition(shown.left).offset_ms + SYNC_SD_MS * float(self._rng.normal())
        early, late = self._sync
        return "early" if felt < early else "late" if felt > late else "together"

    def _word(self, shown: Shown, at_random: bool) -> str:
        right = shown.trial.correct
        knows = right and not at_random
        if knows and self._rng.random() < _logistic(self._level(shown.left, shown.trial.stimulus)):
            return right
        others = [word for word in shown.words if not knows or word != right]
        return str(self._rng.choice(others))


def _logistic(logit: float) -> float:
    return 0.5 * (1 + math.tanh(logit / 2))
