"""VOCA learns, resumes bit for bit, and runs without torch as it ran with it."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra `train`")
if importlib.util.find_spec("lightning_fabric") is None:  # large: imported where it is needed
    pytest.skip("needs the extra `train`", allow_module_level=True)

import torch

import elocute
from elocute.audio.features import Features
from elocute.corpus.corpus_store import Corpus
from elocute.encoders.registry import resolve_encoder
from elocute.errors import InputError, ModelError
from elocute.models.curve_stream import CurveStream
from elocute.models.feature_extraction import extract_features
from elocute.models.protocol import FrameSpan, SpeechFeatures
from elocute.models.voca import VocaModel
from elocute.training.voca.fit import (
    TrainedVoca,
    fit,
    new_network,
    pair_loss,
    share_of_batch,
)
from elocute.training.voca.run import export_voca
from elocute.training.voca.settings import VocaTrainConfig
from elocute.training.voca.training_data import VocaTrainingData, prepare

Make = Callable[..., Corpus]
CONFIG = VocaTrainConfig(epochs=4, encoder="fbank", learning_rate=1e-3)


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory, make_corpus: Make) -> Corpus:
    return make_corpus(tmp_path_factory.mktemp("corpus") / "weights")


@pytest.fixture(scope="module")
def data(corpus: Corpus) -> VocaTrainingData:
    return prepare(corpus, CONFIG, resolve_encoder("fbank"))


@pytest.fixture(scope="module")
def trained(data: VocaTrainingData) -> TrainedVoca:
    return fit(data, CONFIG)


def test_the_loss_falls(trained: TrainedVoca) -> None:
    losses = [row["train_mm2"] for row in trained.log]
    assert losses[-1] < 0.7 * losses[0]
    assert all(np.isfinite(row["validation_mm2"]) for row in trained.log)


def test_coordinates_keep_the_distances_of_vertices(corpus: Corpus, data: VocaTrainingData) -> None:
    assert data.space is not None
    one, two = (data.space.coordinates(corpus, name)[5] for name in ("plain.s0", "plain.s1"))
    vertices = corpus.displacements("plain.s0")[5] - corpus.displacements("plain.s1")[5]
    expected = np.square(vertices.astype(np.float64) * 1000).sum()
    assert np.square((one - two).astype(np.float64)).sum() == pytest.approx(expected, rel=1e-4)
    back = data.space.displacements(one[None])[0]
    np.testing.assert_allclose(back, corpus.displacements("plain.s0")[5], atol=1e-6)


def test_the_reduced_decoder_has_the_loss_of_the_full_one(
    corpus: Corpus, trained: TrainedVoca
) -> None:
    """The same network, its decoder expanded to vertices, loses the same on the same pairs."""
    full = prepare(corpus, dataclasses.replace(CONFIG, reduced=False), resolve_encoder("fbank"))
    assert trained.space is not None
    basis = torch.from_numpy(trained.space.basis)
    reduced = prepare(corpus, CONFIG, resolve_encoder("fbank")).train
    frames = torch.stack([reduced.pairs - 1, reduced.pairs]).flatten()
    styles = torch.eye(1)[reduced.subjects[frames]]
    with torch.no_grad():
        predicted = trained.network(reduced.windows(frames), styles)
    shape, vertices = (2, len(reduced.pairs), -1), corpus.vertex_count
    small = pair_loss(
        predicted.reshape(shape), reduced.targets[frames].reshape(shape), CONFIG, vertices
    )
    large = pair_loss(
        (predicted @ basis).reshape(shape),
        full.train.targets[frames].reshape(shape),
        CONFIG,
        vertices,
    )
    assert float(small) == pytest.approx(float(large), rel=1e-3)


def test_a_resumed_training_goes_on_bit_for_bit(data: VocaTrainingData, tmp_path: Path) -> None:
    whole = fit(data, CONFIG)
    half = dataclasses.replace(CONFIG, epochs=2)
    fit(data, half, tmp_path)
    resumed = fit(data, CONFIG, tmp_path, resume=True)
    for name, value in whole.network.state_dict().items():
        assert torch.equal(value, resumed.network.state_dict()[name]), name
    rows = (tmp_path / "log.csv").read_text().splitlines()
    assert len(rows) == 5
    assert list((tmp_path / "events").iterdir())


def test_other_settings_do_not_resume(data: VocaTrainingData, tmp_path: Path) -> None:
    fit(data, dataclasses.replace(CONFIG, epochs=1), tmp_path)
    with pytest.raises(ModelError, match="velocity_weight"):
        fit(data, dataclasses.replace(CONFIG, velocity_weight=1.0), tmp_path, resume=True)
    (tmp_path / "checkpoint.safetensors").write_bytes(b"rubbish")
    with pytest.raises(ModelError, match="no checkpoint"):
        fit(data, CONFIG, tmp_path, resume=True)


def test_onnx_gives_the_numbers_of_torch(
    corpus: Corpus, trained: TrainedVoca, tmp_path: Path
) -> None:
    export_voca(trained, corpus, tmp_path / "model.onnx", "a test")
    model = VocaModel(tmp_path / "model.onnx")
    assert model.record.styles == ("plain",)
    values = np.random.default_rng(0).normal(size=(90, 26)).astype(np.float32)
    heard, span = SpeechFeatures(Features(values, 60.0, "fbank")), FrameSpan.whole(90, 60.0)
    weights = model.weights(heard, model.mix({"plain": 1.0}), span)
    windows = Features(values, 60.0, "fbank").windows(16)
    with torch.no_grad():
        coordinates = trained.network(torch.from_numpy(windows.copy()), torch.ones(90, 1)).numpy()
    assert trained.space is not None and trained.space.to_weights is not None
    np.testing.assert_allclose(weights, coordinates @ trained.space.to_weights, atol=1e-5)


def test_a_model_of_vertices_carries_its_own_basis(
    tmp_path: Path, make_corpus: Make, speech_wav: Path
) -> None:
    corpus = make_corpus(tmp_path / "c", vertices=True, fps=30.0)
    data = prepare(corpus, CONFIG, resolve_encoder("fbank"))
    trained = fit(data, CONFIG)
    export_voca(trained, corpus, tmp_path / "model.onnx")
    animation = elocute.animate(speech_wav, model=tmp_path / "model.onnx", fps=30, life=0)
    motion = animation.motion
    assert motion.names[-1] == "vocaMean"
    features = resolve_encoder("fbank")(elocute.read_audio(speech_wav)).resample(30.0)
    with torch.no_grad():
        windows = torch.from_numpy(features.windows(16)[40:41].copy())
        coordinates = trained.network(windows, torch.ones(1, 1)).numpy()
    assert trained.space is not None
    expected = motion.head.template + trained.space.displacements(coordinates)[0]
    np.testing.assert_allclose(motion.vertices(40, 41)[0], expected, atol=1e-5)


def test_a_learned_model_animates_and_closes_lips(
    corpus: Corpus, trained: TrainedVoca, tmp_path: Path, speech_wav: Path
) -> None:
    export_voca(trained, corpus, tmp_path / "model.onnx")
    talk = elocute.animate(speech_wav, model=tmp_path / "model.onnx", identity="ada")
    plain = elocute.animate(speech_wav, identity="ada")
    assert talk.motion.weights.shape == plain.motion.weights.shape
    opening = elocute.measure_mouth(talk.motion)["opening_mm"]
    assert opening[:6].max() < 0.1
    assert opening.max() > 1.0


def test_the_middle_of_the_trunk_is_projected_and_streams(
    corpus: Corpus, tmp_path: Path, speech_wav: Path
) -> None:
    config = dataclasses.replace(CONFIG, encoder="trunk", epochs=1)
    data = prepare(corpus, config, resolve_encoder("trunk"))
    trained = fit(data, config)
    shape = trained.network.config
    assert (shape.heard, shape.features) == (512, 64)
    # Onto the directions in which the rows differ most, each with the same deviation.
    seen = trained.network.projected(data.train.features)
    assert torch.allclose(seen.std(dim=0), torch.ones(64), atol=0.1)
    assert torch.allclose(torch.cov(seen.T), torch.eye(64), atol=0.1)
    export_voca(trained, corpus, tmp_path / "model.onnx")
    model, sound = VocaModel(tmp_path / "model.onnx"), elocute.read_audio(speech_wav)
    assert (model.encoder, model.record.features) == ("trunk", 512)
    heard, _ = extract_features(model, sound, contacts=False)
    found = model.weights(heard, model.style("even"), FrameSpan.whole(90, 60.0))
    windows = heard.features.resample(60.0).windows(16)[:90]
    with torch.no_grad():
        styles = torch.full((90, shape.styles), 1 / shape.styles)
        narrow = trained.network.projected(torch.from_numpy(windows.copy()))
        coordinates = trained.network(narrow, styles).numpy()
    assert trained.space is not None and trained.space.to_weights is not None
    np.testing.assert_allclose(found, coordinates @ trained.space.to_weights, atol=1e-4)
    for contacts in ("auto", "off"):
        whole = elocute.animate(sound, model=model.path, contacts=contacts, life=0).curves.values
        live = CurveStream(model, sound.sample_rate, contacts=contacts)
        parts = [live.push(sound.samples[a : a + 999]) for a in range(0, len(sound.samples), 999)]
        assert live.frames_given / 60 > sound.duration_s - model.lookahead_s - 0.1
        joined = np.concatenate([p.values for p in (*parts, live.flush()) if p is not None])
        np.testing.assert_allclose(joined, whole, atol=1e-5)
    assert model.lookahead_s < 1.5
    with pytest.raises(InputError, match="trunk alone"):
        extract_features(model, sound, contacts=False, phones=[(0.0, 1.0, "AA")])


def test_features_that_are_few_are_taken_as_they_are(trained: TrainedVoca) -> None:
    assert (trained.network.config.heard, trained.network.config.features) == (0, 26)


def test_styles_and_models_that_are_not_there_are_named(
    corpus: Corpus, trained: TrainedVoca, tmp_path: Path, speech_wav: Path
) -> None:
    export_voca(trained, corpus, tmp_path / "model.onnx")
    with pytest.raises(ModelError, match="plain"):
        elocute.animate(speech_wav, model=tmp_path / "model.onnx", style="nobody")
    with pytest.raises(ModelError, match="no such file"):
        elocute.animate(speech_wav, model=tmp_path / "none.onnx")
    (tmp_path / "text.onnx").write_text(json.dumps({}))
    with pytest.raises(ModelError, match="no ONNX network"):
        elocute.animate(speech_wav, model=tmp_path / "text.onnx")


def test_the_preset_of_the_paper_decodes_vertex_by_vertex(
    tmp_path: Path, make_corpus: Make
) -> None:
    """Section 5 and Table 1: 64 pairs, 1e-4, 50 epochs, the decoder over all vertices from PCA."""
    config = VocaTrainConfig.preset("paper", encoder="fbank")
    assert (config.batch_pairs, config.learning_rate, config.epochs) == (64, 1e-4, 50)
    assert (config.position_weight, config.velocity_weight, config.components) == (1.0, 10.0, 50)
    corpus = make_corpus(tmp_path / "c", vertices=True)
    data = prepare(corpus, config, resolve_encoder("fbank"))
    torch.manual_seed(0)
    network = new_network(data, config)
    assert network.decoder.out_features == corpus.vertex_count * 3
    components = network.decoder.weight.detach()
    moved = data.train.targets - data.train.targets.mean(dim=0)
    left = moved - moved @ torch.linalg.pinv(components).T @ components.T
    assert float(left.square().sum()) < 1e-3 * float(moved.square().sum())
    assert network.layers[0].weight.abs().max() <= 0.04
    assert not network.decoder.bias.any()


def test_nothing_of_a_step_stays_on_the_cpu(data: VocaTrainingData) -> None:
    """On the meta device every tensor that was left on the CPU is an error, as on a real one."""
    network = new_network(data, CONFIG).to("meta")
    frames = data.train.to("meta")
    later = frames.pairs[:8]
    both = torch.cat([later - 1, later])
    styles = torch.eye(len(data.styles), device="meta")[frames.subjects[both]]
    predicted = network(frames.windows(both), styles)
    loss = pair_loss(
        predicted.reshape(2, 8, -1), frames.targets[both].reshape(2, 8, -1), CONFIG, data.vertices
    )
    loss.backward()
    assert all(value.grad is not None for value in network.parameters())
    assert loss.device.type == "meta"


@pytest.mark.parametrize("pairs", [64, 5, 3, 2, 1])
@pytest.mark.parametrize("processes", [1, 2, 3])
def test_shares_of_a_batch_have_its_mean(pairs: int, processes: int) -> None:
    losses = torch.rand(pairs, dtype=torch.float64)
    shares = [share_of_batch(losses, rank, processes) for rank in range(processes)]
    mean = sum(weight * float(share.mean()) for share, weight in shares) / processes
    assert mean == pytest.approx(float(losses.mean()))


@pytest.mark.slow
def test_two_processes_train_as_one_does(
    corpus: Corpus, data: VocaTrainingData, tmp_path: Path
) -> None:
    """Started by torchrun, joined by gloo; the last batch of an epoch is not even."""
    config = dataclasses.replace(CONFIG, epochs=2, batch_pairs=33)
    assert len(data.train.pairs) % 33 % 2 == 1
    alone = fit(data, config, device="cpu")
    torchrun = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node=2"]
    train = ["-m", "elocute", "train", "voca", str(corpus.folder), "-o", str(tmp_path / "out")]
    settings = ["--epochs=2", "--batch=33", "--encoder=fbank", "--learning-rate=1e-3"]
    subprocess.run(
        [*torchrun, *train, *settings, "--device=cpu"],
        check=True,
        capture_output=True,
        timeout=300,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
    )
    rows = (tmp_path / "out/log.csv").read_text().splitlines()
    losses = [float(row.split(",")[1]) for row in rows[1:]]
    assert losses == pytest.approx([row["train_mm2"] for row in alone.log], rel=1e-4)
    validation = [float(row.split(",")[2]) for row in rows[1:]]
    assert validation == pytest.approx([row["validation_mm2"] for row in alone.log], rel=1e-3)
    assert VocaModel(tmp_path / "out/model.onnx").record.styles == ("plain",)
