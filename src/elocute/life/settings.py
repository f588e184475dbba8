"""How much of life a face shows, part by part."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

from elocute.errors import InputError
from elocute.one_line_repr import brief
from elocute.settings import check_settings, described, setting, settings_of


@described
@dataclass(frozen=True)
class Life:
    """What moves beside the mouth: 1 as people do on average, 0 not at all.

    Raises
    ------
    InputError
        For a number outside 0 to 1.
    """

    head: float = setting(1.0, low=0.0, high=1.0, help="Turns of head and neck.")
    brows: float = setting(1.0, low=0.0, high=1.0, help="Brows, and lids with them, on accents.")
    blinks: float = setting(1.0, low=0.0, high=1.0, help="Share of the blinks that are made.")
    gaze: float = setting(1.0, low=0.0, high=1.0, help="Movements of the eyes, and lids with them.")
    breath: float = setting(1.0, low=0.0, high=1.0, help="Breaths, at rest and before phrases.")
    cheeks: float = setting(1.0, low=0.0, high=1.0, help="Cheeks and lids, with mouth and accents.")
    asymmetry: float = setting(1.0, low=0.0, high=1.0, help="Unevenness of an open mouth.")

    def __post_init__(self) -> None:
        check_settings(self, about="life")

    @property
    def any(self) -> bool:
        """Whether anything moves."""
        return any(getattr(self, part) > 0 for part in PARTS)


PARTS = tuple(field.name for field, _ in settings_of(Life))
ALLOWED = f"0 to 1, or parts of it ({', '.join(PARTS)}), as in 0.6 or head=0.5,blinks=0"


def resolve_life(given: float | str | Life) -> Life:
    """The Life that a caller names.

    Parameters
    ----------
    given : float, str or Life
        A number from 0 to 1 for all parts; a text as the command line takes it: "0.6",
        "head=0.5,blinks=0" (other parts stay as they are by default), "0,head=1" (other parts 0);
        or a Life, which is returned as it is.

    Returns
    -------
    Life

    Raises
    ------
    InputError
        Naming what is allowed.
    """
    if isinstance(given, Life):
        return given
    if isinstance(given, str):
        return _parsed(given)
    from elocute.numerics.input_checks import real_number

    return _everywhere(real_number(given), given)


def _parsed(text: str) -> Life:
    life = Life()
    for place, part in enumerate(text.split(",")):
        name, equals, number = part.strip().partition("=")
        share = _number(number if equals else name)
        if not equals and place == 0:
            life = _everywhere(share, text)
        elif equals and name.strip() in PARTS and share is not None and 0 <= share <= 1:
            life = replace(life, **{name.strip(): share})
        else:
            raise _refused(part.strip())
    return life


def _everywhere(share: float | None, given: object) -> Life:
    if share is None or not 0 <= share <= 1:
        raise _refused(given)
    return Life(**{field.name: float(share) for field in fields(Life)})


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _refused(given: object) -> InputError:
    return InputError.about("`life`", found=brief(given), allowed=ALLOWED)
