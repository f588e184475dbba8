"""A setting is spelled once: checked, described, tabled and turned into options from there."""

from __future__ import annotations

import inspect
import math
from dataclasses import dataclass, fields
from typing import Any

import pytest

import elocute
from elocute.alignment.settings import (
    AlignConfig,
    CcaSoftConfig,
    CtwConfig,
    DcawConfig,
    DctwConfig,
    SoftDtwConfig,
)
from elocute.articulation.style import Style
from elocute.capture.blendshapes.settings import BlendshapeConfig
from elocute.capture.settings import BatchSettings, Scanner
from elocute.errors import InputError, ModelError
from elocute.models.take_settings import TakeOptions, TakeSettings
from elocute.settings import check_settings, described, setting, settings_of
from elocute.training.crnn.settings import CrnnTrainConfig
from elocute.training.voca.settings import VocaTrainConfig

EVERY = [
    AlignConfig,
    BatchSettings,
    BlendshapeConfig,
    CcaSoftConfig,
    CrnnTrainConfig,
    CtwConfig,
    DcawConfig,
    DctwConfig,
    Scanner,
    SoftDtwConfig,
    Style,
    VocaTrainConfig,
]


@described
@dataclass(frozen=True)
class Oven:
    """How a cake is baked."""

    minutes: int = setting(40, unit="min", low=1, high=120, help="How long.")
    share: float | None = setting(None, above=0, high=1, help="How full the tin is.")
    fan: bool = setting(False, help="Whether air is moved.")
    heat: str = setting("both", choices=("both", "top"), help="Where it comes from.")
    tin: tuple[int, int] = setting((20, 30), unit="cm", low=5, high=60, help="Its sides.")

    def __post_init__(self) -> None:
        check_settings(self, ModelError, "oven")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"minutes": 0}, "oven `minutes`: 0; allowed: 1 to 120 min"),
        ({"minutes": 1.5}, "oven `minutes`: 1.5; allowed: 1 to 120 min"),
        ({"minutes": True}, "oven `minutes`: True; allowed: 1 to 120 min"),
        ({"minutes": None}, "oven `minutes`: None; allowed: 1 to 120 min"),
        ({"share": 0}, "oven `share`: 0; allowed: above 0, up to 1"),
        ({"share": math.nan}, "oven `share`: nan; allowed: above 0, up to 1"),
        ({"fan": "no"}, "oven `fan`: 'no'; allowed: true or false"),
        ({"heat": "below"}, "oven `heat`: 'below'; allowed: both, top"),
        ({"tin": (20, 61)}, "oven `tin`: (20, 61); allowed: 2 numbers, each 5 to 60 cm"),
        ({"tin": (20,)}, "oven `tin`: (20); allowed: 2 numbers, each 5 to 60 cm"),
    ],
)
def test_what_cannot_be_is_refused_by_name(given: dict[str, Any], told: str) -> None:
    with pytest.raises(ModelError) as caught:
        Oven(**given)
    assert str(caught.value) == told


def test_what_can_be_is_taken() -> None:
    assert Oven(minutes=120, share=1, fan=True, heat="top", tin=(5, 60)).share == 1


def test_the_docstring_names_every_setting() -> None:
    assert (Oven.__doc__ or "").splitlines() == [
        "How a cake is baked.",
        "",
        "Parameters",
        "----------",
        "minutes : int, default 40",
        "    How long (1 to 120 min).",
        "share : float, optional",
        "    How full the tin is (above 0, up to 1).",
        "fan : bool, default False",
        "    Whether air is moved.",
        "heat : str, default 'both'",
        "    Where it comes from (both, top).",
        "tin : tuple[int, int], default (20, 30)",
        "    Its sides (5 to 60 cm).",
    ]


def test_sections_of_a_docstring_follow_its_parameters() -> None:
    doc = Style.__doc__ or ""
    assert doc.index("Parameters\n---") < doc.index("amplitude : float") < doc.index("Raises\n---")


@pytest.mark.parametrize("cls", EVERY, ids=lambda cls: cls.__name__)
def test_every_field_of_a_settings_class_is_a_setting_with_help(cls: type) -> None:
    known = {each.name: about for each, about in settings_of(cls)}
    assert list(known) == [each.name for each in fields(cls)]
    assert all(about.help.endswith(".") for about in known.values())


@pytest.mark.parametrize("cls", EVERY, ids=lambda cls: cls.__name__)
def test_every_number_outside_its_range_is_refused(cls: type) -> None:
    for each, about in settings_of(cls):
        for edge, beyond in ((about.low, -1), (about.high, 1), (about.above, 0)):
            if edge is not None:
                with pytest.raises(InputError, match=f"`{each.name}`"):
                    cls(**{each.name: edge + beyond})


def test_type_checkers_are_told_of_every_setting_of_a_take() -> None:
    told = {**TakeOptions.__annotations__}
    kinds = {name: getattr(kind, "__forward_arg__", kind) for name, kind in told.items()}
    assert kinds == {each.name: each.type for each, _ in settings_of(TakeSettings)}


def test_a_call_shows_the_settings_of_a_take_and_names_the_nearest() -> None:
    shown = inspect.signature(elocute.animate).parameters
    assert all(each.name in shown for each, _ in settings_of(TakeSettings))
    assert elocute.say.__doc__ and "mood : str | Mood, default 'neutral'" in elocute.say.__doc__
    with pytest.raises(TypeError, match="'fsp'; 'fps'"):
        elocute.stream(16000, fsp=30)  # type: ignore[call-arg]
