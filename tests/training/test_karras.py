"""The network of Karras et al. learns, resumes bit for bit, and runs without torch as with it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra `train`")

import torch

import elocute
from elocute.audio.autocorrelation import autocorrelation
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_store import Corpus
from elocute.errors import ModelError
from elocute.models.curve_stream import CurveStream
from elocute.models.feature_extraction import extract_features
from elocute.models.karras import KarrasModel
from elocute.models.protocol import FrameSpan
from elocute.models.registry import open_model
from elocute.networks.karras import Karras, KarrasConfig, Noise, SharedKarras
from elocute.training.karras.fit import Balance, TrainedKarras, fit, loss_terms
from elocute.training.karras.run import export_karras
from elocute.training.karras.settings import KarrasTrainConfig
from elocute.training.karras.training_data import (
    KarrasTrainingData,
    draw_runs,
    prepare,
)

Make = Callable[..., Corpus]
CONFIG = KarrasTrainConfig(
    epochs=6, batch_runs=2, run_frames=8, emotion=4, emotion_frames=8, noise=False
)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory, make_corpus: Make) -> Corpus:
    return make_corpus(tmp_path_factory.mktemp("corpus") / "weights")


@pytest.fixture(scope="module")
def data(corpus: Corpus) -> KarrasTrainingData:
    return prepare(corpus, CONFIG)


@pytest.fixture(scope="module")
def trained(data: KarrasTrainingData) -> TrainedKarras:
    return fit(data, CONFIG)


@pytest.fixture(scope="module")
def model(
    corpus: Corpus, trained: TrainedKarras, tmp_path_factory: pytest.TempPathFactory
) -> KarrasModel:
    path = tmp_path_factory.mktemp("model") / "model.onnx"
    export_karras(trained, corpus, path, "a test")
    opened = open_model(path)
    assert isinstance(opened, KarrasModel)
    return opened


# The network


def test_layers_are_those_of_the_papers_table() -> None:
    """Table 1: the sizes of all ten convolutions for 64 rows of 32 coefficients."""
    network, sizes = Karras(KarrasConfig(outputs=15066)), []
    for layer in (*network.formants, *network.articulation):
        layer.register_forward_hook(lambda _m, _i, out: sizes.append(tuple(out.shape[1:])))
    out = network(torch.zeros(1, 64, 32), torch.zeros(1, 16))
    formants = [(72, 16), (108, 8), (162, 4), (243, 2), (256, 1)]
    articulation = [(256, 32), (256, 16), (256, 8), (256, 4), (256, 1)]
    assert sizes == [*formants, *articulation]
    assert network.embedding.weight.shape == (150, 256 + 16)
    assert out.shape == (1, 15066)


def test_what_is_shared_gives_what_windows_one_by_one_give() -> None:
    torch.manual_seed(1)
    network, rows = Karras(KarrasConfig(30, 5)), torch.rand(2, 64 + 4 * 6, 32)
    places, emotions = 4 * torch.arange(7).expand(2, -1), torch.randn(2, 7, 5)
    windows = rows.unfold(1, 64, 4).transpose(2, 3)
    with torch.no_grad():
        one_by_one = network(windows.flatten(0, 1), emotions.flatten(0, 1)).unflatten(0, (2, 7))
        runs = network.of_runs(rows, places, emotions)
        shared = SharedKarras(network, emotions[0])
        whole = shared(rows[0], torch.eye(7)[3:4])
        alike = network(rows[0].unfold(0, 64, 1).transpose(1, 2), emotions[0, 3].expand(25, -1))
    torch.testing.assert_close(runs, one_by_one, rtol=0, atol=1e-5)
    torch.testing.assert_close(whole, alike, rtol=0, atol=1e-5)


def test_noise_is_one_factor_for_each_map_of_a_run() -> None:
    factors = Noise(3, torch.Generator().manual_seed(0))(torch.ones(12, 2000, 5))
    runs = factors.unflatten(0, (3, 4))
    assert torch.equal(runs, runs[:, :1, :, :1].expand_as(runs))
    assert float((runs[:, 0, :, 0].log() / np.log(1.4)).std()) == pytest.approx(1, abs=0.03)


# The loss


def test_terms_of_a_pair_are_the_papers() -> None:
    """Written out vertex by vertex for pairs of frames, as in section 4.3."""
    draw = np.random.default_rng(0)
    vertices, pairs, size = 7, 3, 5
    true, predicted = draw.normal(size=(2, pairs, 2, vertices, 3))
    emotions = draw.normal(size=(pairs, 2, size))
    position = motion = emotion = 0.0
    for pair in range(pairs):
        for frame in range(2):
            difference = (true - predicted)[pair, frame]
            position += (difference**2).sum() / (3 * vertices) / (2 * pairs)
        step = (true[pair, 1] - true[pair, 0]) - (predicted[pair, 1] - predicted[pair, 0])
        motion += 2 * (step**2).sum() / (3 * vertices) / pairs
        emotion += 2 / size * ((emotions[pair, 1] - emotions[pair, 0]) ** 2).sum() / pairs
    emotion /= (emotions**2).mean()
    outputs, targets = (torch.from_numpy(x).flatten(2) for x in (predicted, true))
    terms = loss_terms(outputs, targets, torch.from_numpy(emotions), vertices)
    assert terms.tolist() == pytest.approx([position, motion, emotion], rel=1e-6)


def test_terms_are_balanced_whatever_their_units() -> None:
    balance, terms = Balance(), torch.tensor([1e-6, 3.0, 5e4])
    for _ in range(400):
        balance(terms)
    assert float(balance(terms)) == pytest.approx(3, rel=1e-2)


# The data


def test_targets_lie_where_windows_have_their_middle(
    corpus: Corpus, data: KarrasTrainingData
) -> None:
    """Output k of a clip is at (k + 0.5) · 8 ms, and hears 260 ms to both sides."""
    clip = data.train.clips[1]
    assert data.space is not None
    frames = data.space.coordinates(corpus, clip.name)
    targets, at = data.train.clip_targets(clip).numpy(), 10.5 * 0.008 * corpus.fps
    below = int(at)
    expected = frames[below] * (1 - at + below) + frames[below + 1] * (at - below)
    np.testing.assert_allclose(targets[10], expected, atol=1e-4)
    samples = corpus.sound(clip.name).resample(16000).samples
    scaled = samples / np.abs(samples - samples.mean()).max()
    window = data.train.clip_rows(clip)[100:164].numpy()
    middle = round(100.5 * 0.008 * 16000)
    heard = scaled[middle - 4160 : middle + 4160]
    for row in (0, 17, 63):
        stretch = heard[row * 128 : row * 128 + 256].astype(np.float64)
        windowed = (stretch - stretch.mean()) * np.hanning(257)[:256]
        lags = [(windowed[: 256 - lag] * windowed[lag:]).sum() for lag in range(32)]
        np.testing.assert_allclose(window[row], lags, rtol=1e-3, atol=1e-4)


def test_runs_stay_in_their_clip_and_are_shifted(data: KarrasTrainingData) -> None:
    """Every run's windows and targets belong to one clip, one frame of 32 ms after another."""
    generator = torch.Generator().manual_seed(0)
    phases = set()
    for _ in range(8):
        runs = draw_runs(data.train, CONFIG, generator)
        for run in range(len(runs)):
            row = int(runs.rows[run])
            clip = next(c for c in data.train.clips if c.row <= row < c.row + c.outputs)
            assert runs.windows[run].tolist() == list(range(0, 4 * CONFIG.run_frames, 4))
            assert row - clip.row + int(runs.windows[run, -1]) < clip.outputs
            phases.add((row - clip.row) % 4)
            steps = runs.places[run].diff() / data.train.fps
            assert steps.numpy() == pytest.approx(0.032, abs=1e-6)
            assert runs.places[run, -1] <= clip.frame + clip.frames - 1
            assert clip.vector <= runs.vectors[run, 0] < clip.vector + clip.vectors - 1
    assert phases == {0, 1, 2, 3}


def test_autocorrelation_is_the_same_from_any_row() -> None:
    sound = np.random.default_rng(0).normal(size=5000).astype(np.float32)
    whole = autocorrelation(sound, -3, 50)
    np.testing.assert_allclose(autocorrelation(sound, 11, 7), whole[14:21], rtol=1e-6)
    assert not whole[:2].any() and not whole[44:].any()
    assert autocorrelation(sound, 4, 0).shape == (0, 32)


# Training


def test_the_loss_falls(trained: TrainedKarras) -> None:
    losses = [row["train_position"] for row in trained.log]
    assert losses[-1] < 0.7 * losses[0]
    assert all(np.isfinite(row["validation_mm2"]) for row in trained.log)


def test_a_resumed_training_goes_on_bit_for_bit(
    data: KarrasTrainingData, trained: TrainedKarras, tmp_path: Path
) -> None:
    fit(data, dataclasses.replace(CONFIG, epochs=2), tmp_path)
    resumed = fit(data, CONFIG, tmp_path, resume=True)
    for name, value in trained.network.state_dict().items():
        assert torch.equal(value, resumed.network.state_dict()[name]), name
    assert torch.equal(trained.emotions, resumed.emotions)
    assert len((tmp_path / "log.csv").read_text().splitlines()) == 7
    with pytest.raises(ModelError, match="emotion_speed"):
        fit(data, dataclasses.replace(CONFIG, emotion_speed=1.0), tmp_path, resume=True)


@pytest.mark.slow
def test_settings_as_published_train_too(corpus: Corpus) -> None:
    config = KarrasTrainConfig.preset("paper", epochs=1)
    data = prepare(corpus, config)
    assert data.space is None
    frames = sum(-(-clip.outputs // 4) for clip in data.train.clips)
    fitted = fit(data, config)
    assert fitted.network.decoder.out_features == 3 * corpus.vertex_count
    assert data.train.clips[-1].vector + data.train.clips[-1].vectors >= frames


# The model


def test_onnx_gives_the_numbers_of_torch(
    corpus: Corpus, data: KarrasTrainingData, trained: TrainedKarras, model: KarrasModel
) -> None:
    clip = data.train.clips[0]
    speech, _ = extract_features(model, corpus.sound(clip.name), contacts=False)
    span = FrameSpan(0, clip.outputs - 1, 125.0)  # each halfway between two outputs
    weights = model.weights(speech, model.mix({model.styles[0]: 1.0}), span)
    windows = data.train.clip_rows(clip).unfold(0, 64, 1).transpose(1, 2)
    with torch.no_grad():
        emotion = trained.emotions[:1].expand(len(windows), -1)
        coordinates = trained.network(windows, emotion).numpy()
    assert trained.space is not None and trained.space.to_weights is not None
    outputs = coordinates @ trained.space.to_weights
    np.testing.assert_allclose(weights[1:], (outputs[1:-1] + outputs[:-2]) / 2, atol=1e-4)


def test_a_corpus_of_vertices_gives_a_model_with_shapes_of_its_own(
    tmp_path: Path, corpus: Corpus, model: KarrasModel, make_corpus: Make
) -> None:
    vertices = make_corpus(tmp_path / "vertices", vertices=True)
    config = dataclasses.replace(CONFIG, epochs=1)
    trained = fit(prepare(vertices, config), config)
    export_karras(trained, vertices, tmp_path / "model.onnx")
    own = open_model(tmp_path / "model.onnx")
    assert own.components == () and own.basis is not None
    assert own.basis.shape == (trained.network.config.components + 1, vertices.vertex_count, 3)
    assert np.isfinite(own.basis).all() and not own.makes_contacts


def test_styles_are_speakers_and_a_neutral_state(model: KarrasModel, speech_wav: Path) -> None:
    assert model.styles == ("plain", "neutral")
    assert model.encoder == "autocorrelation"
    take = elocute.animate(speech_wav, model=model.path, style="neutral")
    assert take.motion.frame_count > 100
    with pytest.raises(ModelError, match="plain, neutral"):
        elocute.animate(speech_wav, model=model.path, style="angry")


@pytest.mark.parametrize("block", [48, 4801, 48000])
@pytest.mark.parametrize("known", [True, False])
def test_a_stream_gives_what_the_whole_sound_gives(
    model: KarrasModel, speech_wav: Path, block: int, known: bool
) -> None:
    samples = read_audio(speech_wav, sample_rate=48000).samples[48_000:144_000]
    sound = Waveform(samples, 48000)

    def live(size: int) -> np.ndarray:
        level = model.sound_level(sound) if known else None
        stream = CurveStream(model, 48000, level=level)
        parts = [stream.push(samples[at : at + size]) for at in range(0, len(samples), size)]
        late = len(samples) / 48000 - stream.frames_given / 60
        assert 0.2 < late <= stream.lookahead_s + 0.02
        return np.concatenate([p.values for p in (*parts, stream.flush()) if p is not None])

    whole = (
        elocute.animate(sound, model=model.path, life=0).curves.values
        if known
        else live(len(samples))
    )
    np.testing.assert_allclose(live(block), whole, atol=1e-5)


def test_a_long_sound_needs_no_more_than_one_block(
    model: KarrasModel, speech_wav: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    speech, seconds = extract_features(model, read_audio(speech_wav), contacts=False)
    span = FrameSpan.whole(int(seconds * 60), 60.0)
    whole = model.weights(speech, model.style("even"), span)
    monkeypatch.setattr("elocute.models.karras.BLOCK_OUTPUTS", 100)
    np.testing.assert_allclose(model.weights(speech, model.style("even"), span), whole, atol=1e-5)
