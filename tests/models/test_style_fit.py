"""Whose style a motion is in: found again where it is known, measured as it says, refused where
nothing can be found."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.animation import animate
from elocute.articulation.style import Style
from elocute.audio.features import Features
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.encoders.registry import resolve_encoder
from elocute.errors import ModelError
from elocute.head.builtin import load_builtin_head
from elocute.models import style_targets
from elocute.models.feature_extraction import extract_features
from elocute.models.model_shapes import basis_of
from elocute.models.protocol import FrameSpan, SpeechFeatures
from elocute.models.style_errors import StyleErrors
from elocute.models.style_fit import fit_style, search
from elocute.models.style_mixes import MixedStyle, read_mix, write_mix
from elocute.models.style_targets import ObservedMotion, finished_weights
from elocute.models.talkers import TalkersModel
from elocute.models.voca import SHIPPED, VocaModel
from elocute.motion import vertex_motion
from elocute.motion.vertex_motion import VertexMotion

MIX = {"broad": 0.6, "tense": 0.4}


@pytest.fixture(scope="module")
def model(learned: Any) -> VocaModel:
    return VocaModel(learned.model)


@pytest.fixture(scope="module")
def speech(speech_wav: Path) -> SpeechFeatures:
    """Two seconds of speech at 50 Hz."""
    phones = resolve_encoder("phones")(read_audio(speech_wav))
    return SpeechFeatures(Features(phones.values[25:125], phones.rate, phones.encoder))


@pytest.fixture(scope="module")
def take(model: VocaModel, speech: SpeechFeatures) -> ObservedMotion:
    """What the model itself does in a known mix, as `animate` shows it."""
    weights = finished_weights(model, speech, model.mix(MIX), FrameSpan.whole(120, 60.0))
    basis = basis_of(model.components, model.basis)
    return ObservedMotion(speech, VertexMotion(weights, load_builtin_head().template, 60.0, basis))


def test_a_known_mix_is_found_again(model: VocaModel, take: ObservedMotion) -> None:
    fit = fit_style(model, [take])
    assert model.mix(fit.mix).mixed_input == pytest.approx([0.0, 0.6, 0.4], abs=0.05)
    assert list(fit.mix)[:2] == ["broad", "tense"]
    assert fit.error_mm < 0.01 < min(fit.styles.values())
    assert fit.seconds == pytest.approx(2.0)
    given, found = model.style(fit.text), model.mix(fit.mix)
    assert given.mixed_input == pytest.approx(found.mixed_input, abs=1e-3)


@pytest.mark.parametrize("style", ["plain", "calm", "broad", "mumble", "rounded", "smiling", "wry"])
def test_everybody_is_known_by_a_sentence_nobody_taught(speech_wav: Path, style: str) -> None:
    """By the model that ships; crisp people it takes for plain ones."""
    model, sound = VocaModel(SHIPPED), read_audio(speech_wav).resample(16000)
    sound = Waveform(sound.samples[16_000:80_000], 16_000)
    speech, _ = extract_features(model, sound)
    said = animate(sound, model="articulation", style=style, life=0).motion
    motion = VertexMotion(
        said.weights, said.head.template, said.fps, basis_of(model.components, model.basis)
    )
    fit = fit_style(model, [ObservedMotion(speech, motion)])
    others = [error for name, error in fit.styles.items() if name != style]
    assert fit.best_style == style and fit.styles[style] < 0.95 * min(others)
    assert fit.error_mm < 1.05 * fit.styles[style]


def test_the_error_is_the_distance_of_vertices(
    model: VocaModel, take: ObservedMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also of what the model cannot do: here, vertices that shake."""
    monkeypatch.setattr(vertex_motion, "BLOCK_FRAMES", 37)
    basis, rest = basis_of(model.components, model.basis), take.motion.template
    shape, flat = basis.shape, basis.reshape(len(basis), -1)
    rng = np.random.default_rng(0)
    observed = rest + (take.motion.values @ flat).reshape(-1, *shape[1:])
    observed += rng.normal(0, 0.001, observed.shape)
    fit = fit_style(model, [ObservedMotion(take.speech, VertexMotion(observed, rest, 60.0))])
    for name, error in fit.styles.items():
        span = FrameSpan.whole(120, 60.0)
        weights = finished_weights(model, take.speech, model.mix({name: 1.0}), span)
        predicted = rest + (weights @ flat).reshape(observed.shape)
        distance = 1000 * np.linalg.norm(predicted - observed, axis=2)
        assert error == pytest.approx(np.sqrt(np.square(distance).mean()), rel=1e-5)
    assert 1.7 < fit.error_mm < min(fit.styles.values())  # √3 mm of it is the shaking


def test_frame_rates_and_lengths_may_differ(model: VocaModel, take: ObservedMotion) -> None:
    """A camera twice as fast, stopped after a second and a half."""
    values = take.motion.values[:90]
    doubled = np.repeat(values, 2, axis=0)
    doubled[1:-1:2] = (values[:-1] + values[1:]) / 2
    motion = VertexMotion(doubled, take.motion.template, 120.0, take.motion.basis)
    fit = fit_style(model, [ObservedMotion(take.speech, motion)])
    assert fit.seconds == pytest.approx(1.5)
    expected = fit_style(model, [ObservedMotion(take.speech, take.motion.cut(90))])
    assert fit.styles == pytest.approx(expected.styles, rel=1e-4)
    assert fit.error_mm < 0.01 < min(fit.styles.values())


def test_only_the_beginning_of_a_long_take_is_looked_at(
    model: VocaModel, take: ObservedMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = fit_style(model, [ObservedMotion(take.speech, take.motion.cut(60))])
    monkeypatch.setattr(style_targets, "SECONDS_MOST", 1.0)
    assert fit_style(model, [take]) == first


def test_takes_add_up(model: VocaModel, take: ObservedMotion) -> None:
    short = ObservedMotion(take.speech, take.motion.cut(24))
    with pytest.raises(ModelError, match=r"0\.40 s .*allowed: 0\.5 s"):
        fit_style(model, [short])
    assert fit_style(model, [short, take]).seconds == pytest.approx(2.4)


def test_what_explains_nothing_is_refused(model: VocaModel, take: ObservedMotion) -> None:
    with pytest.raises(ModelError, match=r"0\.00 s"):
        fit_style(model, [])
    other = VertexMotion(np.zeros((60, 9, 3)), np.zeros((9, 3)), 60.0)
    with pytest.raises(ModelError, match="motion: 9 vertices; allowed: "):
        fit_style(model, [ObservedMotion(take.speech, other)])
    broken = np.array(take.motion.values)
    broken[7, 3] = np.nan
    motion = VertexMotion(broken, take.motion.template, 60.0, take.motion.basis)
    with pytest.raises(ModelError, match="NaN"):
        fit_style(model, [ObservedMotion(take.speech, motion)])
    deaf = SpeechFeatures(Features(take.speech.features.values[:, :5], 50.0, "phones"))
    with pytest.raises(ModelError, match="5 features"):
        fit_style(model, [ObservedMotion(deaf, take.motion)])


@pytest.mark.parametrize(
    ("wanted", "best"),
    [
        ([0.2, 0.5, 0.3], [0.2, 0.5, 0.3]),
        ([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]),
        ([0.8, 0.7, -0.5], [0.55, 0.45, 0.0]),  # the nearest point of the triangle
    ],
)
def test_the_search_finds_the_least_on_the_simplex(wanted: list[float], best: list[float]) -> None:
    def loss(mix: Any) -> float:
        return float(np.square(mix - wanted).sum())

    start = np.array([1.0, 0.0, 0.0])
    found = search(loss, start)
    assert found == pytest.approx(best, abs=0.02)
    assert found.sum() == pytest.approx(1) and found.min() >= 0


@pytest.mark.parametrize("styles", [1, 3])
def test_the_search_ends_where_every_style_is_right(styles: int) -> None:
    start = np.eye(styles)[0]
    assert search(lambda mix: 0.0, start).tolist() == start.tolist()


def test_a_mix_is_one_of_outputs(model: VocaModel, speech: SpeechFeatures) -> None:
    """The published mix: the same of weights and so of vertices; at the input it is another."""
    span = FrameSpan.whole(120, 60.0)
    alone = [model.weights(speech, model.mix({name: 1.0}), span) for name in MIX]
    mixed = sum(share * each for share, each in zip(MIX.values(), alone, strict=True))
    assert np.abs(model.weights(speech, model.mix(MIX), span) - mixed).max() < 1e-6
    at_input = model.mix(MIX, outputs=False)
    assert at_input.inputs.shape == (1, 3) and model.mix(MIX).inputs.shape == (2, 3)
    assert np.abs(model.weights(speech, at_input, span) - mixed).max() > 1e-3


def test_a_new_style_beyond_the_mix_is_found(model: VocaModel, speech: SpeechFeatures) -> None:
    """Of the network's own input, further out than any of its styles."""
    vector, span = np.array([[-0.4, 1.4, 0.0]], np.float32), FrameSpan.whole(120, 60.0)
    style = MixedStyle(vector, np.ones(1, np.float32))
    weights = finished_weights(model, speech, style, span)
    basis = basis_of(model.components, model.basis)
    head = load_builtin_head()
    take = ObservedMotion(speech, VertexMotion(weights, head.template, 60.0, basis))
    fit = fit_style(model, [take], new=True)
    assert fit.vector is not None and fit.vector_error_mm is not None
    assert fit.vector_error_mm < 0.5 * fit.error_mm
    assert fit_style(model, [take]).vector is None


def test_how_far_a_person_moves_is_found_in_the_numbers_of_the_rules(speech_wav: Path) -> None:
    model, sound = TalkersModel(), read_audio(speech_wav)
    speech, _ = extract_features(model, sound)
    person = Style(amplitude=0.7, spread=1.4, smile=0.2)
    span = FrameSpan.whole(75, model.fps)
    basis = basis_of(model.components, model.basis)
    weights = finished_weights(model, speech, person, span)
    motion = VertexMotion(weights, load_builtin_head().template, model.fps, basis)
    fit = fit_style(model, [ObservedMotion(speech, motion)], new=True)
    assert fit.vector is not None
    for name, tolerance in (("amplitude", 0.07), ("spread", 0.2), ("smile", 0.07)):
        assert fit.vector[name] == pytest.approx(getattr(person, name), abs=tolerance)


def test_a_trained_model_tells_how_it_errs(learned: Any, tmp_path: Path) -> None:
    from elocute.training.voca.run import record_style_errors

    path = tmp_path / "model.onnx"
    path.write_bytes(Path(learned.model).read_bytes())
    record_style_errors(path, learned.corpus)
    model = VocaModel(path)
    errors = model.style_errors
    assert errors is not None and errors.gain.shape == (len(model.components),)
    again = StyleErrors.from_record(errors.record(), len(errors.gain))
    assert again.covariance == pytest.approx(errors.covariance, rel=1e-4)
    white = errors.whitening(np.eye(len(errors.gain)))
    assert np.isfinite(white).all()
    for broken in ({}, {"gain": [1.0], "covariance": [[1.0]]}, {"gain": "x", "covariance": 3}, []):
        with pytest.raises(ModelError, match="style errors"):
            StyleErrors.from_record(broken, len(errors.gain))


class TestStyleFile:
    @pytest.mark.parametrize("told", ['["ann"]', '{"ann": 1e9}', '{"ann": true}', '{"nobody": 1}'])
    def test_a_vector_that_is_none_is_refused(
        self, model: VocaModel, tmp_path: Path, told: str
    ) -> None:
        path = tmp_path / "mine.json"
        path.write_text('{"vector": {"broad": 1.5, "tense": -0.5}}')
        assert model.style(str(path)).inputs.tolist() == [[0.0, 1.5, -0.5]]
        path.write_text(f'{{"vector": {told}}}')
        with pytest.raises(ModelError, match="allowed: "):
            model.style(str(path))

    def test_a_mix_comes_back_as_shares_of_one(self, tmp_path: Path) -> None:
        write_mix(tmp_path / "mine.json", {"ann": 3.0, "bob": 1, "cy": 0}, {"error_mm": 0.5})
        assert read_mix(tmp_path / "mine.json") == {"ann": 0.75, "bob": 0.25}

    def test_a_model_speaks_in_it(self, model: VocaModel, tmp_path: Path) -> None:
        write_mix(tmp_path / "mine.json", MIX, {})
        mine = model.style(str(tmp_path / "mine.json"))
        assert mine.mixed_input == pytest.approx([0.0, 0.6, 0.4])
        write_mix(tmp_path / "mine.json", {"nobody": 1.0}, {})
        with pytest.raises(ModelError, match=r"'nobody'.*plain, broad, tense"):
            model.style(str(tmp_path / "mine.json"))

    @pytest.mark.parametrize(
        ("text", "told"),
        [
            ("{", "no JSON"),
            ("\x80", "no JSON"),
            ("[" * 60_000, "no JSON"),
            ("[1]", "JSON of a list"),
            ('{"style": "ann"}', "no mix"),
            ('{"mix": ["ann"]}', "no mix"),
            ('{"mix": {"ann": "1"}}', "no mix"),
            ('{"mix": {"ann": true}}', "no mix"),
            ('{"mix": {"ann": 1, "bob": -0.1}}', "no mix"),
            ('{"mix": {"ann": NaN}}', "NaN is no number"),
            ('{"mix": {"ann": 1e400}}', "beyond what a number holds"),
            ('{"mix": {"ann": 0}}', "sum to 0"),
            ('{"mix": {}}', "sum to 0"),
            (" " * 65_537, "65.54 kB"),
            (None, "no such file"),
        ],
    )
    def test_what_holds_no_mix_is_refused(
        self, tmp_path: Path, text: str | None, told: str
    ) -> None:
        path = tmp_path / "mine.json"
        if text is not None:
            path.write_bytes(text.encode("latin-1"))
        with pytest.raises(ModelError, match=told):
            read_mix(path)
