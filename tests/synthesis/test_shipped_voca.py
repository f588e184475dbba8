"""The model that ships beside the rules: `--model voca`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from elocute.errors import ModelError
from elocute.motion.measures import measure_mouth
from elocute.synthesis.animate import animate
from elocute.synthesis.voca import SHIPPED_PATH, VocaModel

LIPS_CLOSE_S = {"me": 1.69, "p": 5.46, "m": 6.34, "blue": 8.18}  # as recipes/example.py says


@pytest.fixture(scope="module")
def mouth(speech_wav: Path) -> dict[str, np.ndarray]:
    return measure_mouth(animate(speech_wav, model="voca").motion)


def test_it_speaks_and_rests(mouth: dict[str, np.ndarray]) -> None:
    gap = mouth["opening_mm"]
    assert np.percentile(gap, 90) > 4
    assert gap[:6].max() < 0.1 and gap[-20:].max() < 0.1


@pytest.mark.parametrize("word", LIPS_CLOSE_S)
def test_its_lips_meet(mouth: dict[str, np.ndarray], word: str) -> None:
    frame = round(LIPS_CLOSE_S[word] * 60)
    assert mouth["opening_mm"][frame - 8 : frame + 9].min() == 0


def test_its_styles_differ(speech_wav: Path, mouth: dict[str, np.ndarray]) -> None:
    styles = VocaModel("voca").record.styles
    assert "plain" in styles and "grid" in styles
    other = measure_mouth(animate(speech_wav, model="voca", style="grid").motion)
    assert np.abs(other["opening_mm"] - mouth["opening_mm"]).mean() > 0.2
    with pytest.raises(ModelError, match="plain"):
        animate(speech_wav, model="voca", style="nobody")


def test_it_is_small() -> None:
    assert SHIPPED_PATH.stat().st_size < 1_000_000
