"""A mouth judged by phones: classes of symbols, and scores of mouths that are known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from elocute.errors import HeadError
from elocute.evaluation.phone_mouth_scores import (
    SpokenTake,
    labiodental_gap,
    mouth_class,
    phone_mouth_score,
)
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion

FPS = 60


@pytest.mark.parametrize(
    ("symbols", "wanted"),
    [
        ("p b m pʲ bʲ pʰ mː P B M", "bilabial"),
        ("f v vʲ ɱ F V", "labiodental"),
        ("β ʋ ɸ pf", "either"),
        ("u uː y yː ø œ ɔø œ̃ ɔ̃ o̞ ʊ õ ʉ AO OW UW UH", "rounded"),
        ("i iː ɪ e e̞ ɛ ɛ̃ eɪ IY IH EH EY", "spread"),
        ("a ä aɪ ɯᵝ ə t k ʃ ʁ ħ w j tɕ AA T W", "other"),
        ("_ _: SIL", "silence"),
    ],
)
def test_what_phones_ask_of_a_mouth(symbols: str, wanted: str) -> None:
    assert {symbol: mouth_class(symbol) for symbol in symbols.split()} == dict.fromkeys(
        symbols.split(), wanted
    )


def test_nothing_and_a_change_of_language_are_silence() -> None:
    assert mouth_class("") == mouth_class("(en)") == "silence"


def mouth(**curves: Any) -> Motion:
    """Three seconds of a mouth that moves these shapes; the jaw is half open otherwise."""
    head = load_builtin_head()
    weights = np.zeros((3 * FPS, len(head.expression_names)), np.float32)
    weights[:, head.expression_names.index("jawOpen")] = 0.5
    for name, values in curves.items():
        weights[:, head.expression_names.index(name)] = values
    return Motion(head, weights, FPS)


def during(*stretches: tuple[float, float]) -> Any:
    """(frame,) 1 within the stretches, s."""
    times = np.arange(3 * FPS) / FPS
    return np.any([(times >= a) & (times < b) for a, b in stretches], axis=0).astype(np.float32)


def closed(*stretches: tuple[float, float]) -> Motion:
    return mouth(jawOpen=0.5 * (1 - during(*stretches)))


PHONES = [
    (0.5, 0.9, "a"),
    (0.9, 1.0, "p"),
    (1.0, 1.5, "a"),
    (1.5, 1.55, "m"),
    (1.55, 1.6, "b"),
    (1.6, 2.5, "a"),
]


def test_closures_are_counted() -> None:
    """mb is one closure; one of the two that are wanted is made, and a false one."""
    found = phone_mouth_score([SpokenTake(closed((0.92, 0.98), (2.0, 2.1)), PHONES)]).closures
    assert (found.wanted, found.met, found.made, found.right) == (2, 1, 2, 1)
    assert found.recall == found.precision == 0.5


@pytest.mark.parametrize(("late_s", "met"), [(-0.10, 0), (-0.02, 1), (0.02, 1), (0.10, 0)])
def test_closures_may_be_forty_milliseconds_off(late_s: float, met: int) -> None:
    early = late_s < 0
    motion = closed((0.85 + late_s, 0.9 + late_s) if early else (1.0 + late_s, 1.05 + late_s))
    phones = [(0.5, 0.9, "a"), (0.9, 1.0, "p"), (1.0, 2.5, "a")]
    assert phone_mouth_score([SpokenTake(motion, phones)]).closures.met == met


def test_a_contact_that_is_allowed_is_not_false() -> None:
    phones = [(0.5, 0.9, "a"), (0.9, 1.0, "β"), (1.0, 2.5, "a")]
    found = phone_mouth_score([SpokenTake(closed((0.92, 0.98)), phones)]).closures
    assert (found.wanted, found.made, found.right) == (0, 1, 1)
    assert np.isnan(found.recall)


def test_the_lower_lip_meets_the_teeth() -> None:
    bite = during((0.9, 1.0))
    motion = mouth(jawOpen=0.3 * (1 - bite), mouthLabiodental=bite)
    gap = labiodental_gap(motion)
    assert gap[57] < 2 < gap[30] and len(gap) == 180
    phones = [(0.5, 0.9, "a"), (0.9, 1.0, "f"), (1.0, 1.5, "a"), (1.5, 1.6, "v"), (1.6, 2.5, "a")]
    found = phone_mouth_score([SpokenTake(motion, phones)]).labiodentals
    assert (found.wanted, found.met, found.made, found.right) == (2, 1, 1, 1)


def test_rounded_vowels_are_narrower_and_further_forward() -> None:
    phones = [(0.5, 1.0, "u"), (1.0, 1.5, "i"), (1.5, 2.0, "o"), (2.0, 2.5, "e")]
    round_lips = during((0.5, 1.0), (1.5, 2.0))
    found = phone_mouth_score([SpokenTake(mouth(mouthPucker=round_lips), phones)])
    assert found.narrowing_mm > 3 and found.protrusion_mm > 1 and found.rounding_told == 1
    wrong = phone_mouth_score([SpokenTake(mouth(mouthPucker=1 - round_lips), phones)])
    assert wrong.narrowing_mm == pytest.approx(-found.narrowing_mm)
    assert wrong.rounding_told == 0
    assert np.isnan(phone_mouth_score([SpokenTake(mouth(), phones[:1])]).narrowing_mm)


def test_rest_is_judged_well_within_silence() -> None:
    phones = [(1.0, 1.5, "a")]
    silent = closed((0, 0.65), (1.7, 3))
    assert phone_mouth_score([SpokenTake(silent, phones)]).rest == 1
    half = closed((0, 0.65))
    assert 0.2 < phone_mouth_score([SpokenTake(half, phones)]).rest < 0.45
    assert phone_mouth_score([SpokenTake(mouth(), phones)]).rest == 0
    assert np.isnan(phone_mouth_score([SpokenTake(mouth(), [(0, 3, "a")])]).rest)


def test_opening_is_compared_with_the_reference_and_takes_are_averaged() -> None:
    rising = np.linspace(0, 0.5, 3 * FPS)
    one, other = mouth(jawOpen=rising), mouth(jawOpen=rising[::-1])
    same = SpokenTake(one, PHONES, one)
    assert phone_mouth_score([same]).opening_r == pytest.approx(1)
    both = phone_mouth_score([same, SpokenTake(one, PHONES, other)])
    assert both.opening_r == pytest.approx(0, abs=1e-3)
    assert both.seconds == 6 and both.closures.wanted == 4
    assert np.isnan(phone_mouth_score([SpokenTake(one, PHONES)]).opening_r)


def test_a_head_without_teeth_is_refused() -> None:
    motion = mouth()
    with pytest.raises(HeadError, match="no list of its lips and teeth"):
        labiodental_gap(replace(motion, head=replace(motion.head, regions={})))
