"""Settings that every way from speech to motion has: `animate`, `stream`, and the rules alone."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.settings import check_settings, described, setting


@described
@dataclass(frozen=True)
class AnimationSettings:
    """How speech becomes motion, whatever the model.

    Raises
    ------
    InputError
        For a number outside its range.
    """

    fps: float = setting(60.0, low=1.0, high=240.0, help="Frames per second.")
    strength: float = setting(
        1.0, low=0.0, high=2.0, help="How far the mouth moves; 1 leaves it as the model has it."
    )

    def __post_init__(self) -> None:
        check_settings(self)
