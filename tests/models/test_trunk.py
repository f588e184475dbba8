"""A trunk: heard the same however the sound is cut, as the network in torch, and animated."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra `train`")
pytest.importorskip("onnx", reason="needs the extra `train`")

import librosa
import torch

import elocute
from elocute.audio import whisper_mel
from elocute.audio.read import read_audio
from elocute.audio.whisper_mel import WhisperMel, mel_weights
from elocute.encoders.trunk import (
    LIVE_PACES,
    REST_ROWS,
    ROW_SAMPLES,
    SILENCE_ALONE,
    SILENT_DECADES,
    WHOLE,
    Pace,
    TrunkNetwork,
    TrunkRows,
    TrunkStream,
)
from elocute.errors import ModelError
from elocute.models.curve_stream import CurveStream
from elocute.models.feature_extraction import Hearing
from elocute.models.registry import open_model
from elocute.motion.mouth_measures import measure_mouth
from recipes.train_trunk import split_talkers
from recipes.trunk.export import export, scales
from recipes.trunk.fit import FitSettings, mouth_loss
from recipes.trunk.mouth_teacher import HeardMouth, Source, hear, teach
from recipes.trunk.mouths import MouthClip
from recipes.trunk.network import CONTEXT, Trunk, TrunkConfig
from recipes.trunk.spectrum import BatchLogMel

torch.set_num_threads(1)
RATE = 16000
PACES = [WHOLE, Pace(1), *LIVE_PACES]
SIZES = {
    "middle_mm": [6.7, 50.0, 0.0, 3.4],
    "spread_mm": [4.5, 4.2, 0.9, 3.7],
    "note": "a test",
}


@pytest.fixture(scope="module")
def speech(speech_wav) -> np.ndarray:
    return read_audio(speech_wav, sample_rate=RATE).samples[: 5 * RATE]


@pytest.fixture(scope="module")
def small() -> Trunk:
    """A trunk that nobody taught."""
    torch.manual_seed(3)
    config = TrunkConfig(
        width=32,
        layers=2,
        mouth_layer=1,
        heads=4,
        history=60,
        mouth_channels=16,
        live_channels=8,
        phone_channels=16,
    )
    return Trunk(config).eval()


@pytest.fixture(scope="module")
def path(small, speech, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("trunk") / "trunk.onnx"
    bands = BatchLogMel(0)(torch.from_numpy(speech)[None], CONTEXT)
    export(small, path, {"kind": "trunk", **SIZES}, scales(small, [bands]))
    return path


def listened(path: Path, sound: np.ndarray, block: int, pace: Pace = WHOLE) -> TrunkRows:
    stream = TrunkStream(TrunkNetwork(path), pace)
    parts = [stream.push(sound[at : at + block]) for at in range(0, len(sound), block)]
    return TrunkRows.joined([*parts, stream.flush()])


def test_bands_are_whisper_s() -> None:
    theirs = librosa.filters.mel(sr=RATE, n_fft=400, n_mels=80)
    np.testing.assert_allclose(mel_weights().T, theirs, atol=1e-7)


@pytest.mark.parametrize("block", [1, 160, 7777])
def test_cut_bands_are_the_same_bit_for_bit(speech, block) -> None:
    sound = speech[: 900 if block == 1 else None]
    whole, cut = WhisperMel(), WhisperMel()
    parts = [cut.push(sound[at : at + block]) for at in range(0, len(sound), block)]
    found = np.concatenate([*parts, cut.flush()])
    assert found.shape == (-(-len(sound) // whisper_mel.HOP), whisper_mel.BANDS)
    assert np.array_equal(found, np.concatenate([whole.push(sound), whole.flush()]))


@pytest.mark.parametrize("block", [320, 777, 40_000])
@pytest.mark.parametrize("pace", PACES)
def test_a_cut_sound_is_heard_the_same_bit_for_bit(path, speech, block, pace) -> None:
    whole, cut = listened(path, speech, len(speech), pace), listened(path, speech, block, pace)
    assert len(whole.mouth) == -(-len(speech) // ROW_SAMPLES)
    for name in ("hidden", "mouth", "phones"):
        assert np.array_equal(getattr(whole, name), getattr(cut, name)), name


@pytest.mark.parametrize("pace", PACES)
def test_it_is_the_network_that_was_taught(small, path, speech, pace) -> None:
    """Weights of seven bits and rows of eight, kept from run to run, against torch at once."""
    rest = np.zeros(REST_ROWS * ROW_SAMPLES, np.float32)
    sound = np.concatenate([rest, speech, rest])
    with torch.no_grad():
        hidden, last = small.rows(
            BatchLogMel(0)(torch.from_numpy(sound)[None], CONTEXT), pace.ahead
        )
        told = small.told(hidden, last, live=pace.live)[0].numpy()[REST_ROWS:-REST_ROWS]
        heard = torch.log_softmax(small.phones(last), -1)[0].numpy()[REST_ROWS:-REST_ROWS]
    found = listened(path, speech, 4000, pace)
    loud = (found.phones != SILENCE_ALONE).any(axis=1)
    assert loud.mean() > 0.5
    middle = hidden[0].numpy()[REST_ROWS:-REST_ROWS]
    for ours, theirs in (
        (found.hidden[loud], middle[loud]),
        (found.mouth, told),
        (found.phones[loud], heard[loud]),
    ):
        correlations = [np.corrcoef(a, b)[0, 1] for a, b in zip(ours.T, theirs.T, strict=True)]
        assert np.median(correlations) > 0.97


def test_nothing_is_heard_further_ahead_than_is_said(path, speech) -> None:
    model = open_model(path)
    at = 3 * RATE
    changed = speech.copy()
    changed[at:] = np.random.default_rng(0).normal(0, 0.1, len(speech) - at)
    certain = int((at / RATE - (model.lookahead_s - model.decoder_lookahead_s)) * 50)
    before, after = listened(path, speech, 9999), listened(path, changed, 9999)
    assert np.array_equal(before.mouth[:certain], after.mouth[:certain])
    assert not np.array_equal(before.mouth[certain + 40 :], after.mouth[certain + 40 :])


def test_a_stream_gives_what_the_whole_sound_gives(path, speech) -> None:
    whole = elocute.animate(speech, rate=RATE, model=path, life=0).curves.values
    stream = CurveStream(open_model(path), RATE)
    parts = [stream.push(speech[at : at + 480]) for at in range(0, len(speech), 480)]
    early = stream.frames_given
    parts.append(stream.flush())
    live = np.concatenate([part.values for part in parts if part is not None])
    assert live.shape == whole.shape and np.abs(live - whole).max() < 1e-5
    assert early / 60 > len(speech) / RATE - stream.lookahead_s - 0.1


def test_known_phones_move_it_where_nothing_sounds(path) -> None:
    said = [(0.5, 0.8, "AA"), (0.8, 0.9, "B"), (0.9, 1.3, "AA")]
    quiet = np.zeros(2 * RATE, np.float32)
    opening = measure_mouth(
        elocute.animate(quiet, rate=RATE, model=path, phones=said, life=0).motion
    )["opening_mm"]
    assert opening[round(0.85 * 60)] == 0 and opening[0] < 0.1


def test_far_below_the_loudest_nobody_speaks(path, speech) -> None:
    faint = speech * np.float32(10 ** (-SILENT_DECADES * 10 / 20 - 0.5))
    sound = np.concatenate([speech, faint])
    hearing = Hearing(TrunkNetwork(path), RATE)
    hidden = np.concatenate([hearing.push(sound).hidden, hearing.flush().hidden])
    heard = hearing.phones.flush()
    rows = len(speech) // ROW_SAMPLES
    assert (heard[rows + 20 :] == SILENCE_ALONE).all() and not hidden[rows + 20 :].any()
    assert np.exp(heard[:rows, 0]).min() < 0.9


def test_a_file_that_is_no_trunk_is_refused(tmp_path, path) -> None:
    with pytest.raises(ModelError, match="no such file"):
        open_model(tmp_path / "none.onnx")
    other = tmp_path / "other.onnx"
    other.write_bytes(path.read_bytes().replace(b'"history": 60', b'"history": 0,'))
    with pytest.raises(ModelError):
        open_model(other).lookahead_s  # noqa: B018


def clip(talker: str, name: str) -> MouthClip:
    nothing = np.zeros(0, np.float32)
    none = np.zeros(0)
    return MouthClip(name, talker, nothing, none, none, nothing, nothing)


def test_every_eighth_talker_is_held_out_whole() -> None:
    clips = [clip(f"t{k:02}", f"{k}.{n}") for k in range(12) for n in range(12 - k)]
    learned, other = split_talkers(clips)
    assert {one.talker for one in other} == {"t03", "t11"}
    assert not {one.talker for one in learned} & {"t03", "t11"} and len(learned) + len(other) == 78


def test_the_loss_falls_towards_the_mouth_of_each_clip() -> None:
    targets = torch.randn(1, 100, 7)
    targets[..., 6] = (targets[..., 6] > 0).float()
    belongs = torch.cat([torch.zeros(40), -torch.ones(20), torch.ones(40)])[None].long()
    settings = FitSettings()

    def loss(told: torch.Tensor) -> float:
        return mouth_loss(told, targets, belongs, settings).item()

    right = targets.clone()
    right[..., 6] = 20 * (targets[..., 6] - 0.5)
    assert loss(right) < 0.01 < 1 < loss(-right)
    spoilt = right.clone()
    spoilt[:, 40:60] = 100.0  # nothing is known there
    assert loss(spoilt) == pytest.approx(loss(right), abs=1e-5)


def test_the_head_of_a_mouth_learns_from_kept_rows_and_nothing_else_changes(small, speech) -> None:
    """A movement that can be read off both layers, the nearer one from later rows."""
    trunk = copy.deepcopy(small)
    heard = hear(trunk, BatchLogMel(0), speech, 4, (1, 2))
    rows, last = (torch.from_numpy(part.astype(np.float32)) for part in np.split(heard, 2, axis=1))
    assert len(heard) == len(speech) // ROW_SAMPLES

    def told(both: torch.Tensor) -> torch.Tensor:
        return trunk.told(*both.split(32, dim=-1))

    def r_of_opening() -> float:
        with torch.no_grad():
            return np.corrcoef(trunk.told(rows[None], last[None])[0, 20:, 0], targets[20:, 0])[0, 1]

    moving = np.roll(rows[:, 3], -2) + last[:, 5].numpy()
    targets = np.repeat(moving[:, None], 7, axis=1).astype(np.float32)
    targets[:, 6] = moving > 0
    known = np.ones(len(targets), np.bool_)
    known[:10] = False
    before = r_of_opening()
    source = Source([HeardMouth((heard,), targets, known)], 3, 60, 1.0)
    teach(trunk.mouth, told, [source], 80, seed=1)
    assert r_of_opening() > 0.6 > before
    for name, values in small.state_dict().items():
        assert name.startswith("mouth.") or torch.equal(values, trunk.state_dict()[name]), name
