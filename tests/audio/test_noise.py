"""Noise stands under the speech as loud as it was asked for."""

import numpy as np
import pytest

from elocute.audio import Waveform
from elocute.audio.noise import (
    babble,
    street_noise,
    telephone_band,
    white_noise,
    with_gain,
    with_noise,
)
from elocute.errors import AudioError


@pytest.fixture
def words(speech):
    """Two seconds of real speech at 16 kHz."""
    return Waveform(speech(16000, 2.0), 16000)


def level_db(samples):
    return 10 * np.log10(np.mean(np.square(samples, dtype=np.float64)))


@pytest.mark.parametrize("gain_db", [-36, -12, 0, 6])
def test_the_level_is_the_signal_to_noise_ratio(words, gain_db):
    added = with_noise(words, white_noise(len(words.samples), 1), gain_db).samples - words.samples
    assert level_db(added) - level_db(words.samples) == pytest.approx(gain_db, abs=0.05)


def test_how_loud_the_noise_was_recorded_makes_no_difference(words):
    noise = white_noise(len(words.samples), 1)
    one, two = with_noise(words, noise, -12), with_noise(words, noise / np.float32(50), -12)
    np.testing.assert_allclose(one.samples, two.samples, atol=1e-6)


def test_short_noise_is_repeated_and_long_noise_cut(words):
    hum = np.sin(2 * np.pi * 50 * np.arange(320) / 16000).astype(np.float32)  # one period
    count = len(words.samples)
    for noise in (hum, np.tile(hum, count)):
        added = with_noise(words, noise, 0).samples - words.samples
        np.testing.assert_allclose(added[320:640], added[-320:], atol=1e-4)
        assert len(added) == count


def test_silence_is_no_noise(words):
    for noise in (np.zeros(100, np.float32), np.zeros(0, np.float32)):
        with pytest.raises(AudioError, match="noise: silence"):
            with_noise(words, noise, -12)


def test_gain_is_in_decibels(words):
    quiet = with_gain(words, -20)
    np.testing.assert_allclose(quiet.samples, words.samples / 10, rtol=1e-6)
    assert quiet.sample_rate == 16000
    with pytest.raises(AudioError, match="largest"):
        with_gain(words, 60)


def test_white_noise_holds_all_frequencies_alike():
    bands = np.abs(np.fft.rfft(white_noise(64000, 3)))[1:32001].reshape(8, -1)
    power = np.square(bands).mean(axis=1)
    assert power.max() / power.min() < 1.15


def test_babble_sounds_like_the_speaker_and_says_nothing(words):
    noise = babble(words, 0)
    spectra = [
        np.abs(np.fft.rfft(s)).reshape(-1)[:16000].reshape(16, -1).mean(axis=1)
        for s in (noise, words.samples)
    ]
    assert np.corrcoef(np.log(spectra))[0, 1] > 0.9
    assert abs(np.corrcoef(noise, words.samples)[0, 1]) < 0.1
    assert level_db(noise) > level_db(words.samples) - 15


def test_a_seed_always_makes_the_same_noise(words):
    assert np.array_equal(white_noise(50, 4), white_noise(50, 4))
    assert not np.array_equal(white_noise(50, 4), white_noise(50, 5))
    assert np.array_equal(babble(words, 4), babble(words, 4))
    assert not np.array_equal(babble(words, 4), babble(words, 5))


def band_db(samples, rate, low, high):
    """Power within a band, dB."""
    power = np.square(np.abs(np.fft.rfft(samples)))
    hertz = np.fft.rfftfreq(len(samples), 1 / rate)
    return 10 * np.log10(power[(hertz >= low) & (hertz < high)].sum() + 1e-12)


@pytest.mark.parametrize("rate", [16000, 44100])
def test_a_street_rumbles_and_cars_pass(rate):
    noise = street_noise(20 * rate, rate, seed=0)
    assert noise.dtype == np.float32 and len(noise) == 20 * rate and np.isfinite(noise).all()
    assert band_db(noise, rate, 30, 300) > band_db(noise, rate, 3000, 8000) + 6
    assert band_db(noise, rate, 500, 2000) > band_db(noise, rate, 3000, 8000) + 3
    seconds = np.sqrt(np.square(noise.reshape(40, -1)).mean(axis=1))
    assert 20 * np.log10(seconds.max() / seconds.min()) > 10
    np.testing.assert_array_equal(noise, street_noise(20 * rate, rate, seed=0))
    assert not np.array_equal(noise, street_noise(20 * rate, rate, seed=1))


def test_the_shortest_street():
    assert street_noise(1, 16000, 0).shape == (1,)


def test_a_telephone_passes_its_band_alone(words):
    heard = telephone_band(words)
    assert heard.sample_rate == 16000 and len(heard.samples) == len(words.samples)
    for low, high in ((400, 1000), (1000, 3300)):
        lost = band_db(words.samples, 16000, low, high) - band_db(heard.samples, 16000, low, high)
        assert abs(lost) < 0.5
    for low, high in ((0, 180), (3800, 8000)):
        lost = band_db(words.samples, 16000, low, high) - band_db(heard.samples, 16000, low, high)
        assert lost > 40
