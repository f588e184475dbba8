"""The recurrent model that ships: `--model crnn`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from elocute.motion.measures import measure_mouth
from elocute.synthesis.animate import animate
from elocute.synthesis.crnn import SHIPPED_PATH

LIPS_CLOSE_S = {"me": 1.69, "p": 5.46, "m": 6.34, "blue": 8.18}  # as recipes/example.py says


@pytest.fixture(scope="module")
def mouth(speech_wav: Path) -> dict[str, np.ndarray]:
    return measure_mouth(animate(speech_wav, model="crnn").motion)


def test_it_speaks_and_rests(mouth: dict[str, np.ndarray]) -> None:
    gap = mouth["opening_mm"]
    assert np.percentile(gap, 90) > 4
    assert gap[:6].max() < 0.1 and gap[-20:].max() < 0.1


@pytest.mark.parametrize("word", LIPS_CLOSE_S)
def test_its_lips_meet(mouth: dict[str, np.ndarray], word: str) -> None:
    frame = round(LIPS_CLOSE_S[word] * 60)
    assert mouth["opening_mm"][frame - 8 : frame + 9].min() == 0


def test_it_moves_as_the_rules_do(speech_wav: Path, mouth: dict[str, np.ndarray]) -> None:
    """They taught it, and it hears for itself: not through the encoder of phones."""
    rules = measure_mouth(animate(speech_wav, model="articulation").motion)
    r = np.corrcoef(mouth["opening_mm"], rules["opening_mm"])[0, 1]
    assert 0.7 < r < 0.999


def test_it_is_small() -> None:
    assert SHIPPED_PATH.stat().st_size < 3_000_000
