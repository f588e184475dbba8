"""A crowd whose truth is known: what it prefers, how it errs, and who of it cheats.

It answers any study as its participants would see it, to find out whether the report recovers what
was put in, and to try a study before anybody is asked. Its people are named `simulated-…`, and a
report says so on its first lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import cached_property

import numpy as np

from elocute.errors import StudyError
from elocute.study.design.design import MISMATCHED, Design
from elocute.study.design.trials import Shown, Trial, block_count, sequence
from elocute.study.raters.crowd_settings import Crowd
from elocute.study.report.answers import Answer

OBVIOUS = 5.0
"""Logits by which a face that moves to its own sound beats one that does not."""
BEGAN = datetime(2026, 1, 1, tzinfo=UTC)
WORD_CHOICES = 4
SYNC_BOUNDS_MS, SYNC_SD_MS = (-90.0, 170.0), 70.0
"""Where most people begin to notice that a sound is early or late, and how surely."""
PEOPLE_MAX = 100_000


class Truth:
    """What a crowd finds of each clip, before people and stimuli differ: its stated levels.

    Parameters
    ----------
    design : Design
        The study.
    crowd : Crowd
        Whose levels these are.
    """

    sync_bounds_ms = SYNC_BOUNDS_MS
    """Where half notice that a sound is early, and late."""

    def __init__(self, design: Design, crowd: Crowd) -> None:
        self.design, self.levels = design, crowd.levels

    def strength(self, condition: str, stimulus: str) -> float:
        """How good a clip is: logits, points of a rating, or the logit of being understood."""
        del stimulus
        neutral = 50.0 if self.design.study.kind == "rating" else 0.0
        return self.levels.get(condition, neutral)

    def recognised(self, trial: Trial) -> float:
        """The logit of choosing the right one in a comparison of styles."""
        return self.strength(trial.correct, trial.stimulus)

    def obvious(self, condition: str, stimulus: str) -> float:
        """By how much a condition beats a face that moves to another sentence, in logits."""
        del condition, stimulus
        return OBVIOUS

    def late_ms(self, condition: str) -> float:
        """How late a sound is against what the face does."""
        return self.design.condition(condition).offset_ms


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
    truth: Truth | None = None,
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
    truth : Truth, optional
        What they find of each clip, such as `raters.Raters`; by default the crowd's levels.

    Returns
    -------
    list of Answer
        The table, by person and order.
    """
    rng = np.random.default_rng(seed)
    stimuli = _Stimuli(crowd, rng)
    truth = truth or Truth(design, crowd)
    cheating = rng.permutation(len(seats)) < round(crowd.cheaters * len(seats))
    table: list[Answer] = []
    for number, (seat, cheats) in enumerate(zip(seats, cheating.tolist(), strict=True), 1):
        own = np.random.default_rng(rng.integers(2**62))
        person = _Person(design, crowd, truth, stimuli, own, cheats)
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
        truth: Truth,
        stimuli: _Stimuli,
        rng: np.random.Generator,
        cheats: bool,
    ) -> None:
        self._truth = truth
        self._design, self._crowd, self._stimuli, self._rng = design, crowd, stimuli, rng
        self._cheats = cheats
        self._side = crowd.side + crowd.side_sd * float(rng.normal())
        self._always_left = cheats and rng.random() < 0.3
        self._own: dict[str, float] = {}
        self._pace = float(rng.lognormal(0, 0.25))

    @cached_property
    def _sync(self) -> tuple[float, float]:
        """Where this person begins to notice."""
        return tuple(each + 25 * float(self._rng.normal()) for each in self._truth.sync_bounds_ms)  # type: ignore[return-value]

    def session(self, name: str, seat: Seat) -> list[Answer]:
        """All answers; who fails the qualification stops, where the study says so."""
        given: list[Answer] = []
        now = BEGAN
        for each in seat.shown:
            if each.trial.role not in ("practice", "qualification") and self._failed(given):
                break
            seconds = round(self._seconds(), 3)
            now += timedelta(seconds=seconds + 1)
            given.append(
                Answer(
                    participant=name,
                    group=seat.block,
                    order=each.order,
                    trial=each.trial.name,
                    kind=each.trial.kind,
                    role=each.trial.role,
                    stimulus=each.trial.stimulus,
                    reference=each.trial.reference,
                    left=each.left,
                    right=each.right,
                    answer=self._answer(each),
                    correct=each.trial.correct,
                    seconds=seconds,
                    replays=0 if self._cheats else int(self._rng.poisson(0.3)),
                    answered_at=now.isoformat(timespec="milliseconds"),
                )
            )
        return given

    def _failed(self, given: Sequence[Answer]) -> bool:
        rules = self._design.qualification
        asked = [each for each in given if each.role == "qualification"]
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
            surely = self._truth.obvious(shown.trial.correct, shown.trial.stimulus)
            return surely if shown.right == MISMATCHED else -surely
        if shown.trial.kind == "style":
            right = shown.trial.correct
            known = self._truth.recognised(shown.trial)
            known += self._differing(right, shown.trial.stimulus)
            return self._side + (known if shown.left == right else -known)
        levels = [self._level(name, shown.trial.stimulus) for name in (shown.left, shown.right)]
        return self._side + levels[0] - levels[1]

    def _level(self, condition: str, stimulus: str) -> float:
        """How good a condition is, to this person and for this stimulus."""
        differing = self._differing(condition, stimulus)
        return self._truth.strength(condition, stimulus) + differing

    def _differing(self, condition: str, stimulus: str) -> float:
        """What this person and this stimulus add to a condition."""
        if condition not in self._own:
            self._own[condition] = self._crowd.people_sd * float(self._rng.normal())
        differing = self._own[condition] + self._stimuli.added(stimulus, condition)
        # Two of a pair differ: the spread of the difference is what the crowd says.
        share = np.sqrt(0.5) if self._design.study.kind == "binary" else 1.0
        return float(share * differing)

    def _rating(self, shown: Shown, at_random: bool) -> str:
        value = float(self._rng.uniform(0, 100))
        if not at_random:
            value = self._level(shown.left, shown.trial.stimulus)
            value += self._crowd.noise * float(self._rng.normal())
            if shown.left == self._design.comparisons.reference:
                value = 100 - abs(0.2 * self._crowd.noise * float(self._rng.normal()))
        value = float(np.clip(value, 0, 100))
        steps = 25 if self._design.study.scale == "mos" else 1
        return str(round(value / steps) * steps)

    def _felt(self, shown: Shown, at_random: bool) -> str:
        if at_random:
            return str(self._rng.choice(shown.words))
        felt = self._truth.late_ms(shown.left) + SYNC_SD_MS * float(self._rng.normal())
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
    return float(0.5 * (1 + np.tanh(logit / 2)))
