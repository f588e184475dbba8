"""The models that ship beside the rules: `--model voca` and `--model crnn`."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.animation import animate
from elocute.audio.read import read_audio
from elocute.errors import InputError, ModelError
from elocute.models import crnn_network, voca
from elocute.models.curve_stream import CurveStream
from elocute.models.feature_extraction import extract_features
from elocute.models.protocol import FrameSpan
from elocute.models.registry import open_model
from elocute.motion.curves import Curves
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


@pytest.mark.parametrize("model", ["articulation", *MODELS])
def test_bare_it_is_what_the_network_gives(speech_wav: Path, model: str) -> None:
    """Within 0 to 1, as curves are; nothing closes or rests by rule."""
    opened, sound = open_model(model), read_audio(speech_wav)
    bare = animate(sound, model=model, contacts="off", life=0)
    finished = animate(sound, model=model, life=0)
    mouth = opened.components or bare.curves.names
    raw, shown = (take.curves.select(mouth).values for take in (bare, finished))
    assert not shown[-20:].any() and raw[-20:].any()
    if model != "voca":
        return
    heard, seconds = extract_features(opened, sound, contacts=False)
    span = FrameSpan.whole(len(raw), 60.0)
    assert heard.phones is None and seconds == pytest.approx(sound.duration_s)
    weights = np.clip(opened.weights(heard, opened.style("plain"), span), 0, 1)
    places = [opened.components.index(name) for name in mouth]
    assert np.array_equal(raw, weights[:, places])


def test_a_mix_of_animations_is_the_animation_of_the_mix(speech_wav: Path) -> None:
    """VOCA 2019, section 7.2, to 1e-6 before contacts; live as well."""
    sound, shares = read_audio(speech_wav), {"broad": 0.5, "mumble": 0.3, "grid": 0.2}
    text = ",".join(f"{name}:{share}" for name, share in shares.items())

    def said(style: str, **options: Any) -> Curves:
        return animate(sound, model="voca", style=style, life=0, **options).curves

    whole = said(text, contacts="off")
    mixed = sum(s * said(name, contacts="off").values for name, s in shares.items())
    assert np.abs(whole.values - mixed).max() < 1e-6
    assert np.abs(said(text, contacts="off", mix="input").values - mixed).max() > 0.05
    live = CurveStream(open_model("voca"), sound.sample_rate, style=text, contacts="off")
    pieces = [live.push(sound.samples), live.flush()]
    streamed = np.concatenate([piece.values for piece in pieces if piece is not None])
    assert np.abs(streamed - mixed).max() < 1e-5
    finished = sum(s * said(name).values for name, s in shares.items())
    assert np.abs(said(text).values - finished).max() < 0.1  # contacts come after the mix
    with pytest.raises(InputError, match="output, input"):
        said(text, mix="middle")


def test_styles_of_voca_differ(speech_wav: Path, opening: Opening) -> None:
    styles = open_model("voca").styles
    assert "plain" in styles and "grid" in styles
    assert np.abs(opening("voca", "grid") - opening("voca")).mean() > 0.2
    with pytest.raises(ModelError, match="plain"):
        animate(speech_wav, model="voca", style="nobody")
