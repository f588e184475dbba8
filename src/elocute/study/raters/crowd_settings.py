"""What is known of a crowd: its preferences, and how it errs. Light: the command line reads it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from elocute.errors import StudyError
from elocute.settings import check_settings, described, setting


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
        0.6, low=0, high=50, help="How far people differ in it: logits, or points of a rating."
    )
    stimuli_sd: float = setting(0.3, low=0, high=50, help="How far stimuli differ in it.")
    noise: float = setting(15.0, low=0, high=50, help="Of single ratings, in points.")
    side: float = setting(0.0, low=-3, high=3, help="Liking of the left side, in logits.")
    side_sd: float = setting(0.0, low=0, high=5, help="How far people differ in it, in logits.")
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
