"""What a study is planned to find. Light: the command line reads it."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import StudyError
from elocute.settings import SEED_MAX, check_settings, described, setting


@described
@dataclass(frozen=True)
class Plan:
    """What is to be found, and by what study.

    Raises
    ------
    StudyError
        For a value of another type or outside its range.
    """

    share: float = setting(
        0.6,
        low=0.0,
        high=1.0,
        help="The preference to be found, of people who look; 0.5 with a true equivalence.",
    )
    equivalent: bool = setting(False, help="Plan to show that two are equivalent.")
    margin: float = setting(0.1, low=0.01, high=0.49, help="Margin of equivalence, around a half.")
    trials: int = setting(
        10, low=1, high=1_000, help="Answers of each person to the comparison in question."
    )
    stimuli: int = setting(10, low=1, high=1_000, help="Sentences and faces that it is shown with.")
    people_sd: float = setting(
        0.6, low=0, high=5, unit="logits", help="Spread of preferences between people."
    )
    stimuli_sd: float = setting(0.3, low=0, high=5, unit="logits", help="The same between stimuli.")
    lapses: float = setting(0.05, low=0, high=0.9, help="Share of answers given at random.")
    power: float = setting(0.8, low=0.05, high=0.999, help="Share of studies that are to find it.")
    confidence: float = setting(0.95, low=0.5, high=0.9999, help="Confidence of the test.")
    comparisons: int = setting(
        1, low=1, high=10_000, help="Tests that are corrected for, by Bonferroni."
    )
    simulations: int = setting(1_000, low=100, high=100_000, help="Studies simulated at a time.")
    seed: int = setting(0, low=0, high=SEED_MAX, help="Seed of the simulations.")

    def __post_init__(self) -> None:
        check_settings(self, StudyError)

    def check(self) -> None:
        """Raise StudyError for a preference that is none, or an equivalence that is one."""
        if self.equivalent and not abs(self.share - 0.5) < self.margin:
            raise StudyError.about(
                "`share`",
                found=f"{self.share:g}",
                allowed=f"within {self.margin:g} of 0.5, to be equivalent",
            )
        if not self.equivalent and (abs(self.share - 0.5) < 0.005 or not 0 < self.share < 1):
            raise StudyError.about(
                "`share`",
                found=f"{self.share:g}",
                allowed="more than 0 and less than 1, and not 0.5",
                remedy="`equivalent` plans to show that there is no preference",
            )

    @property
    def level(self) -> float:
        """Of significance for each test."""
        return (1 - self.confidence) / self.comparisons
