"""The models that ship beside the rules: `--model voca` and `--model crnn`."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from elocute.animation import animate
from elocute.errors import ModelError
from elocute.models import crnn_network, voca
from elocute.models.registry import open_model
from elocute.motion.mouth_measures import measure_mouth

LIPS_CLOSE_S = {"me": 1.69, "p": 5.46, "m": 6.34, "blue": 8.18}  # as recipes/example.py says
MODELS = {"voca": (voca.SHIPPED_PATH, 1.0), "crnn": (crnn_network.SHIPPED_PATH, 3.0)}  # MB at most
Opening = Callable[..., np.ndarray]


@pytest.fixture(scope="module")
def opening(speech_wav: Path) -> Opening:
    """(frame,) mm between the lips as a model, in a style, says the example."""

    @cache
    def measured(model: str, style: str = "plain") -> np.ndarray:
        return measure_mouth(animate(speech_wav, model=model, style=style).motion)["opening_mm"]

    return measured


@pytest.mark.parametrize("model", MODELS)
def test_it_speaks_and_rests(opening: Opening, model: str) -> None:
    gap = opening(model)
    assert np.percentile(gap, 90) > 4
    assert gap[:6].max() < 0.1 and gap[-20:].max() < 0.1


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("word", LIPS_CLOSE_S)
def test_its_lips_meet(opening: Opening, model: str, word: str) -> None:
    frame = round(LIPS_CLOSE_S[word] * 60)
    assert opening(model)[frame - 8 : frame + 9].min() == 0


@pytest.mark.parametrize("model", MODELS)
def test_it_moves_much_as_the_rules_do(opening: Opening, model: str) -> None:
    r = np.corrcoef(opening(model), opening("articulation"))[0, 1]
    assert 0.7 < r < 0.999


@pytest.mark.parametrize("model", MODELS)
def test_it_is_small(model: str) -> None:
    path, most_mb = MODELS[model]
    assert path.stat().st_size < most_mb * 1e6


def test_styles_of_voca_differ(speech_wav: Path, opening: Opening) -> None:
    styles = open_model("voca").styles
    assert "plain" in styles and "grid" in styles
    assert np.abs(opening("voca", "grid") - opening("voca")).mean() > 0.2
    with pytest.raises(ModelError, match="plain"):
        animate(speech_wav, model="voca", style="nobody")
