"""The front end of the encoder, against librosa's mel and against itself in pieces."""

import numpy as np
import pytest

from elocute.audio import front_end
from elocute.audio.front_end import FrontEnd, encoder_features
from elocute.audio.waveform import SPEECH_RATE


def noise(seconds: float, level: float = 0.1) -> np.ndarray:
    samples = np.random.default_rng(3).normal(0, level, round(seconds * SPEECH_RATE))
    return samples.astype(np.float32)


def in_pieces(samples: np.ndarray, size: int) -> np.ndarray:
    stream = FrontEnd()
    parts = [stream.push(samples[at : at + size]) for at in range(0, len(samples), size)]
    return np.concatenate([*parts, stream.flush()])


@pytest.mark.parametrize("count", [0, 1, 159, 160, 161, 4000, 16001])
def test_a_sound_gives_one_frame_for_every_ten_milliseconds_begun(count):
    assert encoder_features(np.zeros(count, np.float32)).shape == (-(-count // 160), 64)


@pytest.mark.parametrize("size", [37, 160, 401, 5000, 48000])
def test_pieces_of_any_size_give_the_same_as_the_whole(size):
    samples = noise(3.0)
    np.testing.assert_allclose(in_pieces(samples, size), encoder_features(samples), atol=2e-5)


def test_filters_are_the_htk_mel_filters_of_librosa():
    librosa = pytest.importorskip("librosa")
    theirs = librosa.filters.mel(
        sr=16000, n_fft=512, n_mels=64, fmin=40, fmax=7800, htk=True, norm=None
    ).T
    ours = front_end.mel_weights()
    # Ours have area one.
    scaled = theirs / (theirs.sum(axis=0) + 1e-6)
    np.testing.assert_allclose(ours, scaled, atol=1e-5)


def test_features_are_librosa_bands_over_a_running_mean_kept_frame_by_frame():
    librosa = pytest.importorskip("librosa")
    samples = noise(2.0)
    # librosa centres the window of 400 within 512 samples; ours is centred on 160 t.
    spectrum = librosa.stft(
        np.pad(samples, 256), n_fft=512, hop_length=160, win_length=400, window="hann", center=False
    )
    bands = (np.abs(spectrum) ** 2).T @ front_end.mel_weights() * front_end.power_scale()
    decay = np.exp(-0.01 / front_end.MEAN_S)
    weight = front_end.PRIOR_S * 100
    total = np.full(front_end.BANDS, front_end.PRIOR * weight)
    expected = []
    for power in bands[:200].astype(np.float64):
        total, weight = decay * total + power, decay * weight + 1
        level = np.log(power + front_end.FLOOR) - np.log(total / weight + front_end.FLOOR)
        expected.append(np.clip(level * front_end.SCALE, -front_end.LIMIT, front_end.LIMIT))
    np.testing.assert_allclose(encoder_features(samples), expected, atol=1e-4)


def test_level_does_not_matter_once_something_was_heard():
    samples = noise(20.0)
    loud, quiet = (
        encoder_features(samples),
        encoder_features(samples * np.float32(0.01)),
    )
    settled = slice(1200, None)
    assert np.abs(loud[settled] - quiet[settled]).mean() < 0.05


def test_nothing_later_than_the_declared_lookahead_is_seen():
    samples = noise(2.0)
    changed = samples.copy()
    at = 16000
    changed[at:] = 0
    same = round((1.0 - front_end.LOOKAHEAD_S) * 100)
    before, after = encoder_features(samples), encoder_features(changed)
    np.testing.assert_array_equal(before[:same], after[:same])
    assert np.abs(before[same + 2] - after[same + 2]).max() > 0


@pytest.mark.parametrize(
    "samples",
    [
        np.zeros(16000, np.float32),
        noise(1.0, 1e-5),
        np.clip(noise(1.0, 5.0), -1, 1),
        np.full(16000, 1.0, np.float32),
    ],
    ids=["silence", "nearly silence", "clipped", "constant"],
)
def test_any_sound_gives_finite_features_within_limits(samples):
    features = encoder_features(samples)
    assert np.isfinite(features).all()
    assert np.abs(features).max() <= front_end.LIMIT


def test_silence_after_speech_is_below_the_running_mean():
    samples = np.concatenate([noise(1.0), np.zeros(8000, np.float32)])
    assert encoder_features(samples)[110:].max() < -1
