"""What a notebook is given, where it would be too much."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from elocute.animation import Animation
from elocute.motion.motion import Motion


def test_a_motion_is_shown_without_sound(motion: Motion) -> None:
    assert motion._repr_html_().startswith("<iframe srcdoc=")


def test_a_long_take_is_told_in_a_sentence(motion: Motion) -> None:
    hour = replace(motion, weights=np.zeros((216_000, len(motion.names)), np.float32), fps=60)
    shown = hour._repr_html_()
    assert len(shown) < 500 and "too long" in shown and "write(" in shown


def test_a_sound_that_is_gone_is_told(take: Animation) -> None:
    shown = replace(take, sound=Path("gone<b>.wav"))._repr_html_()
    assert "no such file" in shown and "<b>" not in shown
