"""How much of life, and which mood: what callers may say."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest

from elocute.errors import InputError
from elocute.life import MOODS, Life, Mood, resolve_life, resolve_mood
from elocute.life.moods import heard_mood


def test_a_number_is_meant_for_every_part():
    assert resolve_life("0.6") == resolve_life(0.6) == Life(*[0.6] * 7)
    assert resolve_life(1) == Life() and resolve_life("1").any
    assert not resolve_life("0").any


def test_parts_by_name_leave_the_others_as_they_are():
    assert resolve_life("head=0.5,blinks=0") == Life(head=0.5, blinks=0.0)
    assert resolve_life("0,head=1") == Life(1.0, 0, 0, 0, 0, 0, 0)
    assert resolve_life(Life(gaze=0.2)).gaze == 0.2


@pytest.mark.parametrize(
    "wrong", ["", "ears=1", "head", "head=2", "head=x", "1,1", -1, 2, None, []]
)
def test_what_is_no_life_is_refused_in_a_line(wrong):
    with pytest.raises(InputError, match=r"life.*allowed: 0 to 1.*head, brows") as told:
        resolve_life(wrong)
    assert "\n" not in str(told.value)


def test_a_part_out_of_range_is_refused():
    with pytest.raises(InputError, match="brows"):
        Life(brows=1.5)


def test_a_mood_has_an_intensity():
    half, whole = resolve_mood("happy:0.5"), resolve_mood("happy")
    assert half.curves["mouthSmile"] == pytest.approx(whole.curves["mouthSmile"] / 2)
    assert half.head - 1 == pytest.approx((whole.head - 1) / 2)
    assert asdict(resolve_mood("sad")) == asdict(MOODS["sad"])


def test_moods_mix():
    mixed = resolve_mood("sad:0.5,tender:0.5")
    assert mixed.curves["browInnerUp"] == pytest.approx(
        (MOODS["sad"].curves["browInnerUp"] + MOODS["tender"].curves["browInnerUp"]) / 2
    )
    assert resolve_mood(Mood(head=0.5)).head == 0.5


def test_a_mood_can_be_left_to_the_voice():
    """Varied voices are lively, effort knits the brows, and neither makes a smile."""
    auto, never, fully = resolve_mood("auto"), np.zeros(2), np.ones(2)
    calm, lively = (heard_mood(auto, varied, never) for varied in (never, fully))
    forceful = heard_mood(auto, fully, fully)
    assert np.all(calm.head < 1) and np.all(lively.head > 1) and np.all(forceful.head > 1)
    assert np.all(forceful.curves["browDown"] > 0.3) and np.all(calm.curves["browDown"] == 0)
    assert not any(name.startswith("mouth") for name in lively.curves)
    assert heard_mood(MOODS["sad"], never, never) is MOODS["sad"]


@pytest.mark.parametrize(
    "wrong", ["grumpy", "auto:0.5", "auto,sad", "happy:2", "happy:x", "happy,sad", "", 3, "sad,sad"]
)
def test_what_is_no_mood_is_refused_in_a_line(wrong):
    with pytest.raises(InputError, match=r"mood.*allowed") as told:
        resolve_mood(wrong)
    assert "\n" not in str(told.value)
