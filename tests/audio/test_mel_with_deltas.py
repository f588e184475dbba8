"""The second paper's input, against librosa and python_speech_features."""

import librosa
import numpy as np
import pytest
import python_speech_features as psf

from elocute.audio import Waveform, mel_delta_windows, read_audio
from elocute.audio.mel_with_deltas import mel_deltas, slopes
from elocute.errors import InputError


@pytest.fixture(scope="module")
def sound(speech_wav) -> Waveform:
    whole = read_audio(speech_wav, sample_rate=44100)
    return Waveform(0.3 * whole.samples[:132300] + 0.01, 44100)


def librosa_log_mel(sound: Waveform, shift: int) -> np.ndarray:
    """(window, 128), window t centred on sample shift + 441 t of the normalised sound."""
    samples = sound.samples.astype(np.float64)
    samples -= samples.mean()
    samples /= np.abs(samples).max()
    power = librosa.feature.melspectrogram(
        y=np.concatenate([np.zeros(441 * 50), samples, np.zeros(441 * 50)])[shift:],
        sr=44100,
        n_fft=2048,
        win_length=882,
        hop_length=441,
        n_mels=128,
        htk=True,
        norm=None,
    )
    return np.log(np.maximum(power.T, 1e-6))


@pytest.mark.parametrize("first", [0, 1, 2])
def test_it_is_librosas_log_mel_and_its_regression_slopes_around_each_frame(sound, first):
    # At 30 frames a second every third one falls on the same grid of 441 samples.
    theirs = librosa_log_mel(sound, 1470 * first % 441)
    change = psf.delta(theirs, 2)
    expected = np.stack([theirs, change, psf.delta(change, 2)], axis=-1)
    ours = mel_delta_windows(sound, 30)
    assert ours.shape == (90, 41, 128, 3)
    for frame in range(first, 90, 3):
        middle = 50 + 1470 * frame // 441
        np.testing.assert_allclose(ours[frame], expected[middle - 20 : middle + 21], atol=1e-3)


def test_slopes_are_those_of_librosa():
    values = np.random.default_rng(0).normal(size=(60, 5))
    theirs = librosa.feature.delta(values, width=5, axis=0)[2:-2]
    np.testing.assert_allclose(slopes(values), theirs, atol=1e-12)


@pytest.mark.parametrize("fps", [24, 25, 29.97, 30, 60])
def test_there_is_one_window_for_each_video_frame(sound, fps):
    windows = mel_deltas(sound, fps)
    assert len(windows) == round(3 * fps)
    assert windows.windows(5, 8).shape == (3, 41, 128, 3)
    # A click is in the middle of the frame whose time it has.
    samples = np.zeros(132300, np.float32)
    frame = round(fps)
    samples[round(frame * 44100 / fps)] = 1
    levels = mel_delta_windows(Waveform(samples, 44100), fps)[frame, :, :, 0].mean(axis=1)
    assert levels.argmax() == 20
    assert levels[19] == pytest.approx(levels[21], abs=1e-3)


def test_level_and_offset_do_not_matter(sound):
    other = Waveform(sound.samples * 0.1 + 0.2, 44100)
    np.testing.assert_allclose(mel_delta_windows(other), mel_delta_windows(sound), atol=0.05)


@pytest.mark.parametrize("value", [0.0, 0.3])
def test_silence_is_the_floor_and_does_not_move(value):
    silence = mel_delta_windows(Waveform(np.full(44100, value, np.float32), 44100))
    np.testing.assert_allclose(silence[..., 0], np.log(1e-6), rtol=1e-6)
    assert not silence[..., 1:].any()


def test_any_rate_and_the_shortest_sound_will_do():
    assert mel_delta_windows(Waveform(np.ones(20, np.float32), 8000)).shape == (1, 41, 128, 3)


@pytest.mark.parametrize("fps", [0, -30, float("nan"), 1000])
def test_impossible_frame_rates_are_refused(sound, fps):
    with pytest.raises(InputError, match="allowed: above 0, up to 100"):
        mel_deltas(sound, fps)
