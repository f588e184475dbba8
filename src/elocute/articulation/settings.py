"""Settings common to `animate`, `stream` and the rules."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import InputError
from elocute.one_line_repr import brief
from elocute.settings import SEED_MAX, check_settings, described, setting, setting_of


@described
@dataclass(frozen=True, kw_only=True)
class AnimationSettings:
    """How speech becomes motion, whatever the model.

    Raises
    ------
    InputError
        For a setting outside its range.
    """

    fps: float = setting(
        60.0, low=1.0, high=240.0, help="Frames per second; 29.97 is taken for 30000/1001."
    )
    strength: float = setting(
        1.0, low=0.0, high=2.0, help="How far the mouth moves; 1 leaves it as the model has it."
    )
    contacts: str = setting(
        "auto",
        choices=("auto", "off"),
        help="Whether lip contacts (p, b, m; f, v) and rests are laid over by rule, or the model's "
        "own output is left as it is.",
    )
    mix: str = setting(
        "output",
        choices=("output", "input"),
        help="Where a trained model mixes styles: their outputs, as published, or at its input. "
        "The rules mix the numbers of their styles.",
    )
    seed: int = setting(
        0,
        low=0,
        high=SEED_MAX,
        help="Another take of the same sound: other blinks, looks and nods for each seed.",
    )

    def __post_init__(self) -> None:
        check_settings(self, of=AnimationSettings)


def lays_contacts(contacts: object) -> bool:
    """Whether contacts and rests are laid over by rule.

    Parameters
    ----------
    contacts : str
        "auto" or "off".

    Returns
    -------
    bool

    Raises
    ------
    InputError
        For anything else.
    """
    return _choice("contacts", contacts) == "auto"


def mixes_outputs(mix: object) -> bool:
    """Whether the outputs of styles are mixed.

    Parameters
    ----------
    mix : str
        "output" or "input".

    Returns
    -------
    bool

    Raises
    ------
    InputError
        For anything else.
    """
    return _choice("mix", mix) == "output"


def _choice(name: str, given: object) -> str:
    known = setting_of(AnimationSettings, name)
    if not isinstance(given, str) or given not in known.choices:
        raise InputError.about(f"`{name}`", found=brief(given), allowed=known.allowed)
    return given
