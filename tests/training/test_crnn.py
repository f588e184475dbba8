"""Training of the recurrent model: loss, cuts, resuming, export, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra `train`")

import torch

from elocute.animation import animate
from elocute.audio.mel_with_deltas import mel_columns
from elocute.audio.read import read_audio
from elocute.audio.sound_level import samples_level
from elocute.audio.waveform import Waveform
from elocute.encoders.registry import resolve_encoder
from elocute.errors import CorpusError, ModelError
from elocute.evaluation.concordance import score_concordance
from elocute.files.work_folder import MODEL
from elocute.models.crnn import CrnnModel
from elocute.models.crnn_network import (
    JOINS,
    OWN_COLUMN,
    CrnnNetwork,
    CrnnStream,
    stream_weights,
)
from elocute.models.curve_stream import CurveStream
from elocute.models.model_shapes import as_builtin, speech_names, to_shapes
from elocute.models.registry import open_model
from elocute.models.voca import VocaModel
from elocute.motion.motion import Motion
from elocute.networks.crnn import SharedCrnn
from elocute.training.crnn.batches import predict_batch, random_batch, random_segment, whole_batch
from elocute.training.crnn.feature_cache import cache_features, columns_of
from elocute.training.crnn.fit import audible_bands, fit
from elocute.training.crnn.loss import (
    concordance,
    concordance_loss,
    explained_shares,
    tempered_weights,
)
from elocute.training.crnn.run import train_crnn
from elocute.training.crnn.settings import CrnnTrainConfig
from elocute.training.crnn.training_data import select_training_data

FPS = 30.0
SHORT = CrnnTrainConfig(epochs=2, batch_clips=8, augment=0.5, highest_hz=8000)


@pytest.fixture(scope="module")
def shards(speech_shards: Any) -> Any:
    return speech_shards


@pytest.fixture(scope="module")
def basis(speech_shards: Any) -> Motion:
    return speech_shards.basis


@pytest.fixture(scope="module")
def model(shards: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("trained")
    train_crnn(shards, SHORT, folder)
    return folder / MODEL


def test_concordance_is_lins() -> None:
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(2, 40, 3)).astype(np.float32)
    expected = 2 * np.array([np.cov(x[:, i], y[:, i], bias=True)[0, 1] for i in range(3)])
    expected /= x.var(0) + y.var(0) + (x.mean(0) - y.mean(0)) ** 2
    one, other = (torch.from_numpy(part)[None] for part in (x, y))
    mask = torch.ones(1, 40)
    assert np.allclose(concordance(one, other, mask).numpy(), expected, atol=1e-5)
    found = score_concordance([x[:15], x[15:]], [y[:15], y[15:]], np.ones(3))
    assert found.mean.value == pytest.approx(expected.mean(), abs=1e-5)
    assert found.mean.low <= found.mean.value <= found.mean.high
    assert found.clips == 2 and found.frames == 40
    shares = torch.tensor([1.0, 0.0, 0.0])
    assert float(concordance_loss(other, other, mask, shares)) == pytest.approx(0, abs=1e-5)


def test_padding_weighs_nothing() -> None:
    rng = torch.Generator().manual_seed(0)
    x, y = torch.randn(2, 2, 9, 4, generator=rng)
    mask = torch.ones(2, 9)
    mask[1, 5:] = 0
    before = concordance(x, y, mask)
    x[1, 5:], y[1, 5:] = 100.0, -100.0
    assert torch.equal(concordance(x, y, mask), before)


def test_shares_are_those_of_the_variance() -> None:
    shapes = torch.zeros(3, 5, 3)
    shapes[0, 0, 0], shapes[1, 1, 1] = 2.0, 1.0
    shares = explained_shares(shapes)
    assert torch.allclose(shares, torch.tensor([0.8, 0.2, 0.0]))
    assert torch.allclose(tempered_weights(shares, 1.0), shares, atol=1e-6)
    half = tempered_weights(shares, 0.5)[:2]
    assert half[0] / half[1] == pytest.approx(2.0)
    assert torch.allclose(tempered_weights(shares, 0.0), torch.full((3,), 1 / 3))


def test_the_preset_of_the_paper() -> None:
    """Sections 5 and 6.1; what the defaults do otherwise is told with them."""
    paper = CrnnTrainConfig.preset("paper")
    assert (paper.learning_rate, paper.last_rate, paper.batch_clips) == (5e-4, 1.0, 50)
    assert (paper.loss, paper.weight_power, paper.keep) == ("concordance", 1.0, 0.5)
    assert (paper.augment, paper.gradient_limit, paper.captured) == (0.0, 0.0, False)
    assert audible_bands(paper.highest_hz).all() and not audible_bands(8000).all()
    assert CrnnTrainConfig.preset("default", epochs=3) == CrnnTrainConfig(epochs=3)
    with pytest.raises(ModelError, match="default, paper"):
        CrnnTrainConfig.preset("publication")


def test_segments_keep_half() -> None:
    draw = np.random.default_rng(1)
    found = [random_segment(21, CrnnTrainConfig(), draw) for _ in range(500)]
    assert min(count for _, count in found) == 11 and max(count for _, count in found) == 21
    assert all(first >= 0 and first + count <= 21 for first, count in found)
    assert len({first for first, _ in found}) > 8


def test_batches_give_what_single_clips_give(shards: Any, tmp_path: Path, basis: Motion) -> None:
    cache = cache_features(shards, tmp_path)
    rows = cache.select("train")
    data = select_training_data(cache, basis.head.expression_basis, rows, [])
    trained = fit(data, replace(SHORT, epochs=1), tmp_path)
    shared = SharedCrnn(trained.network)
    with torch.no_grad():
        together = predict_batch(shared, whole_batch(cache, rows[:5]))
        for index, row in enumerate(rows[:5]):
            alone = predict_batch(shared, whole_batch(cache, [row]))[0]
            assert float((together[index, : row.frames] - alone).abs().max()) < 1e-5
    # And a clip in its context hears what the whole recording is made of.
    clip = next(c for c in shards.clips() if c.clip == rows[0].clip)
    margin = 8 / FPS
    direct = mel_columns(shards.sound(clip, margin))
    first = int(cache.starts(rows[0])[0])
    begin = int(direct.starts[8]) - first
    assert np.allclose(
        cache.columns(rows[0])[first:40], direct.static[begin + first : begin + 40], atol=0.01
    )


def test_cuts_and_effects_leave_frames_and_sound_together(shards: Any, tmp_path: Path) -> None:
    cache = cache_features(shards, tmp_path)
    rows = cache.select("train")
    for augment in (0.0, 1.0):
        config = replace(SHORT, augment=augment)
        batch = random_batch(cache, rows, config, np.random.default_rng(5))
        again = random_batch(cache, rows, config, np.random.default_rng(5))
        for one, other in zip(vars(batch).values(), vars(again).values(), strict=True):
            assert torch.equal(one, other)
        assert int(batch.starts.max()) + 49 <= len(batch.static)
        assert batch.mask.sum() == len(batch.starts)
        assert torch.isfinite(batch.static).all()


def test_resumed_training_is_bit_identical(shards: Any, tmp_path: Path, basis: Motion) -> None:
    cache = cache_features(shards, tmp_path)
    data = select_training_data(
        cache, basis.head.expression_basis, cache.select("train"), cache.select("validation")
    )
    for name in ("whole", "parts"):
        (tmp_path / name).mkdir()
    whole = fit(data, replace(SHORT, epochs=3), tmp_path / "whole")
    fit(data, replace(SHORT, epochs=1), tmp_path / "parts")
    parts = fit(data, replace(SHORT, epochs=3), tmp_path / "parts", resume=True)
    for name, value in whole.network.state_dict().items():
        assert torch.equal(value, parts.network.state_dict()[name]), name
    assert len(parts.log) == 3
    assert (tmp_path / "parts" / "log.csv").read_text().count("\n") == 4
    with pytest.raises(ModelError, match="other learning_rate"):
        fit(data, replace(SHORT, learning_rate=1e-3), tmp_path / "parts", resume=True)


def test_exported_model_is_the_network(
    shards: Any, model: Path, speech_wav: Path, tmp_path: Path, basis: Motion
) -> None:
    cache = cache_features(shards, model.parent)
    data = select_training_data(
        cache, basis.head.expression_basis, cache.select("train"), cache.select("validation")
    )
    trained = fit(data, SHORT, model.parent, resume=True)
    sound = read_audio(speech_wav)
    columns = mel_columns(sound)
    with torch.no_grad():
        expected, _ = SharedCrnn(trained.network)(
            torch.from_numpy(columns.static)[None], torch.from_numpy(columns.starts)[None]
        )
    found = stream_weights(CrnnNetwork(model), sound)
    assert found.shape == expected[0].shape and expected.std() > 0.01
    assert np.abs(found - expected[0].numpy()).max() < 1e-5
    assert np.array_equal(CrnnNetwork(model).basis, basis.head.expression_basis)


@pytest.mark.parametrize("joins", JOINS)
def test_streams_give_the_whole(model: Path, speech_wav: Path, joins: str) -> None:
    opened, sound = CrnnNetwork(model), read_audio(speech_wav)
    whole = stream_weights(opened, sound, joins)
    assert len(whole) == round(sound.duration_s * FPS)
    level = samples_level(sound.resample(44100).samples)
    live = []
    for size in (700, 100_000):
        for known in (level, None):
            stream = CrnnStream(opened, sound.sample_rate, joins, known)
            pieces = [sound.samples[a : a + size] for a in range(0, len(sound.samples), size)]
            given = [stream.push(piece) for piece in pieces]
            found = np.concatenate([*given, stream.flush()])
            assert found.shape == whole.shape
            if known:
                assert np.abs(found - whole).max() < 1e-5
            else:
                live.append(found)
            if size == 700:  # frames come as soon as their 0.25 s of future are there
                cache = np.cumsum([len(piece) for piece in pieces]) / sound.sample_rate
                ready = np.cumsum([len(part) for part in given]) / FPS
                assert (cache - ready)[20:].max() < 0.25 + 0.1
    assert np.abs(live[0] - live[1]).max() < 1e-5


def test_it_may_hear_the_middle_of_the_trunk(
    shards: Any, speech_wav: Path, tmp_path: Path, basis: Motion
) -> None:
    """Trained, kept in its file and streamed; the loudness of the whole sound is not asked for."""
    trained, _ = train_crnn(shards, replace(SHORT, encoder="trunk"), tmp_path)
    model, sound = open_model(tmp_path / MODEL), read_audio(speech_wav, sample_rate=16000)
    assert isinstance(model, CrnnModel)
    assert model.encoder == "trunk"
    assert not model.needs_sound_level and model.sound_level(sound) is None
    static, starts = columns_of(sound, FPS, "trunk")
    rows = resolve_encoder("trunk")(sound).values
    own = OWN_COLUMN["trunk"]
    assert np.array_equal(static[own : own + 80 : 2], rows[:40])  # each for two columns
    with torch.no_grad():
        expected, _ = SharedCrnn(trained.network)(
            torch.from_numpy(static)[None], torch.from_numpy(starts)[None]
        )
    found = stream_weights(model.network, sound)
    assert np.abs(found - expected[0].numpy()).max() < 1e-5 and found.std() > 0.01
    whole = animate(sound, model=tmp_path / MODEL, life=0).curves.values
    live = CurveStream(model, sound.sample_rate)
    parts = [live.push(sound.samples[a : a + 777]) for a in range(0, len(sound.samples), 777)]
    early = live.frames_given
    joined = np.concatenate([p.values for p in (*parts, live.flush()) if p is not None])
    assert joined.shape == whole.shape and np.abs(joined - whole).max() < 1e-5
    assert early / 60 > sound.duration_s - model.lookahead_s - 0.1 and model.lookahead_s < 1.5


def test_joins_differ_only_by_memory(model: Path, speech_wav: Path) -> None:
    opened, sound = CrnnNetwork(model), read_audio(speech_wav)
    state, pieces = (stream_weights(opened, sound, joins) for joins in JOINS)
    assert np.abs(state[:14] - pieces[:14]).max() < 1e-5
    assert np.abs(state[20:] - pieces[20:]).max() > 1e-4
    with pytest.raises(ModelError, match="joins"):
        stream_weights(opened, sound, "glue")


@pytest.mark.parametrize("seconds", [0.001, 0.02, 0.3])
def test_short_and_silent_sounds(model: Path, seconds: float) -> None:
    silence = Waveform(np.zeros(max(2, round(seconds * 16000)), np.float32), 16000)
    found = stream_weights(CrnnNetwork(model), silence)
    assert len(found) == max(1, round(silence.duration_s * FPS)) and np.isfinite(found).all()


def test_it_animates_the_built_in_head(model: Path, speech_wav: Path) -> None:
    made = animate(speech_wav, model=model)
    curves = made.curves
    assert curves["jawOpen"].max() > 0.01 and curves.values.min() >= 0
    # Contacts are the driver's, as with VOCA: the lips close where p, b or m is cache.
    assert curves["mouthClose"].max() > 0.01
    rest = np.abs(curves.select(speech_names()).values[:10]).max()
    assert rest < 0.05


def test_speech_shapes_and_back(basis: Motion) -> None:
    rng = np.random.default_rng(2)
    values = rng.uniform(0, 1, (20, len(basis.names))).astype(np.float32)
    shapes = basis.head.expression_basis
    mixed = np.einsum("ij,jvk->ivk", rng.normal(size=(len(shapes),) * 2), shapes)
    there = to_shapes(values, basis.names, mixed.astype(np.float32))
    back = as_builtin(there, mixed.astype(np.float32))
    error = np.einsum("fc,cvk->fvk", back - values, shapes)
    assert np.linalg.norm(error, axis=2).max() < 1e-4  # 0.1 mm


def test_models_are_told_apart(model: Path) -> None:
    assert isinstance(open_model(model), CrnnModel)
    voca = open_model("voca")
    assert isinstance(voca, VocaModel)
    with pytest.raises(ModelError, match="recurrent"):
        _ = CrnnNetwork(voca.path).record


def test_bands_above_what_is_heard_are_muted(model: Path) -> None:
    audible = audible_bands(8000.0)
    assert 85 < audible.sum() < 95 and audible_bands(22050.0).sum() == 128
    opened = CrnnNetwork(model)
    columns = np.random.default_rng(0).normal(-5, 2, (60, 128)).astype(np.float32)
    other = columns + 3 * (1 - audible)
    starts = np.array([0, 3])
    one, two = (opened.step(c, starts, opened.rest)[0] for c in (columns, other))
    assert np.array_equal(one, two)


def test_sounds_that_are_missing_are_named(shards: Any, tmp_path: Path) -> None:
    (tmp_path / "none").mkdir()
    with pytest.raises(CorpusError, match="no sound that can be read"):
        cache_features(replace(shards, sound_root=tmp_path / "none"), tmp_path)


@pytest.mark.parametrize(
    "changed",
    [
        {"epochs": 0},
        {"loss": "mae"},
        {"keep": 0.0},
        {"learning_rate": float("nan")},
        {"augment": 2.0},
        {"highest_hz": 10.0},
        {"fps": True},
        {"weight_power": 1.5},
    ],
)
def test_settings_outside_are_refused(changed: dict[str, Any]) -> None:
    with pytest.raises(ModelError, match=next(iter(changed))):
        replace(CrnnTrainConfig(), **changed)
