"""What noise and styles do to a mouth: the measures on mouths that are known."""

from __future__ import annotations

from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.animation import animate
from elocute.audio.noise import white_noise, with_gain, with_noise
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.errors import AudioError
from elocute.evaluation.mouth_studies import (
    NoiseScore,
    mean_noise_scores,
    noise_scores,
    style_openings,
)
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth


@pytest.fixture(scope="module")
def words(speech_wav: Path) -> Waveform:
    """Two seconds of speech without a rest."""
    speech = read_audio(speech_wav).resample(16000)
    return Waveform(speech.samples[16000:48000], 16000)


def loudness(sound: Waveform) -> Any:
    """A mouth that opens as wide as the sound is loud, 100 times a second."""
    return np.abs(sound.samples).reshape(-1, 160).mean(axis=1).astype(np.float64)


def opening(sound: Waveform) -> Any:
    return measure_mouth(animate(sound, fps=30).motion)["opening_mm"].astype(np.float64)


def noisy(noise: Any, level_db: float) -> Any:
    return lambda sound: with_noise(sound, noise, level_db)


def test_gains_scale_a_mouth_that_follows_loudness(words: Waveform) -> None:
    gains = [lambda sound, gain=gain: with_gain(sound, gain) for gain in (0.0, -20.0)]
    scores, openings = noise_scores(words, gains, loudness, 100)
    same, quiet = scores
    assert (same.amplitude_share, same.correlation) == pytest.approx((1, 1))
    assert quiet.amplitude_share == pytest.approx(0.1)
    assert quiet.correlation == pytest.approx(1)
    assert quiet.amplitude_mm == pytest.approx(0.1 * loudness(words).mean())
    assert len(openings) == 3 and np.array_equal(openings[0], openings[1])


def test_the_louder_the_noise_the_less_the_mouth_follows(words: Waveform) -> None:
    noise = white_noise(len(words.samples), 0)
    levels = [noisy(noise, level) for level in (-60.0, -12.0, 12.0)]
    scores, _ = noise_scores(words, levels, opening, 30)
    almost, some, drowned = (score.correlation for score in scores)
    assert almost > 0.95 > some > drowned
    assert scores[0].amplitude_share == pytest.approx(1, abs=0.1)
    assert scores[0].closure_recall >= scores[2].closure_recall
    with pytest.raises(AudioError, match="silence"):
        noise_scores(words, [noisy(np.zeros(10, np.float32), -12.0)], loudness, 100)


def test_a_mouth_that_never_opens_has_nothing_to_lose(words: Waveform) -> None:
    def shut(sound: Waveform) -> Any:
        return np.zeros(10)

    (score,), _ = noise_scores(words, [lambda sound: sound], shut, 60)
    assert score == NoiseScore(0.0, 1.0, 0.0, 0, 0, 0, 0)
    assert np.isnan(score.closure_recall) and np.isnan(score.closure_precision)


def test_closures_that_noise_takes_away_and_adds_are_counted(words: Waveform) -> None:
    """Clean speech closes twice; noise opens the first of them and closes once elsewhere."""
    clean = np.full(120, 5.0)
    clean[30:36] = clean[60:66] = 0
    disturbed = np.full(120, 5.0)
    disturbed[60:66] = disturbed[90:96] = 0
    mouths = iter([clean, disturbed])
    (score,), _ = noise_scores(words, [lambda sound: sound], lambda sound: next(mouths), 60)
    assert (score.closures_wanted, score.closures_met) == (2, 1)
    assert (score.closures_made, score.closures_right) == (2, 1)
    assert score.closure_recall == score.closure_precision == 0.5


def test_scores_are_averaged_level_by_level() -> None:
    one = [NoiseScore(2.0, 0.5, 0.8, 4, 4, 3, 3), NoiseScore(1.0, 0.2, 0.0, 4, 1, 0, 0)]
    two = [NoiseScore(4.0, 1.0, 0.6, 2, 0, 1, 0), NoiseScore(3.0, 0.4, 0.5, 2, 2, 2, 2)]
    first, second = mean_noise_scores([one, two])
    assert astuple(first) == (3.0, 0.75, pytest.approx(0.7), 3, 2, 2, 1.5)
    assert astuple(second) == (2.0, pytest.approx(0.3), 0.25, 3, 1.5, 1, 1)
    assert first.closure_recall == pytest.approx(2 / 3)  # of all closures, not a mean of shares


def test_each_style_opens_the_mouth_in_its_own_way(words: Waveform) -> None:
    def moved(style: str) -> Motion:
        return animate(words, style=style, fps=30).motion

    curves = style_openings(["mumble", "plain", "broad"], moved)
    assert curves.names == ("mumble", "plain", "broad") and curves.fps == 30
    assert curves["mumble"].mean() < curves["plain"].mean() < curves["broad"].mean()
    np.testing.assert_array_equal(curves["broad"], measure_mouth(moved("broad"))["opening_mm"])
