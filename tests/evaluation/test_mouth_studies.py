"""What noise, styles and faces do to a mouth: the measures on mouths that are known."""

from __future__ import annotations

from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.animation import animate
from elocute.audio.noise import white_noise
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.errors import AudioError, HeadError, InputError
from elocute.evaluation.mouth_studies import (
    NoiseScore,
    face_score_spread,
    face_scores,
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


@pytest.fixture(scope="module")
def motion(words: Waveform) -> Motion:
    return animate(words, fps=30).motion


def loudness(sound: Waveform) -> Any:
    """A mouth that opens as wide as the sound is loud, 100 times a second."""
    return np.abs(sound.samples).reshape(-1, 160).mean(axis=1).astype(np.float64)


def opening(sound: Waveform) -> Any:
    return measure_mouth(animate(sound, fps=30).motion)["opening_mm"].astype(np.float64)


def test_gains_scale_a_mouth_that_follows_loudness(words: Waveform) -> None:
    scores, openings = noise_scores(words, None, [0.0, -20.0], loudness)
    same, quiet = scores
    assert (same.level_db, same.amplitude_share, same.correlation) == pytest.approx((0, 1, 1))
    assert (quiet.level_db, quiet.amplitude_share) == pytest.approx((-20, 0.1))
    assert quiet.correlation == pytest.approx(1)
    assert quiet.amplitude_mm == pytest.approx(0.1 * loudness(words).mean())
    assert len(openings) == 3 and np.array_equal(openings[0], openings[1])


def test_the_louder_the_noise_the_less_the_mouth_follows(words: Waveform) -> None:
    noise = white_noise(len(words.samples), 0)
    scores, _ = noise_scores(words, noise, [-60.0, -12.0, 12.0], opening)
    almost, some, drowned = (score.correlation for score in scores)
    assert almost > 0.95 > some > drowned
    assert scores[0].amplitude_share == pytest.approx(1, abs=0.1)
    with pytest.raises(AudioError, match="silence"):
        noise_scores(words, np.zeros(10, np.float32), [-12.0], loudness)


def test_a_mouth_that_never_opens_has_nothing_to_lose(words: Waveform) -> None:
    def shut(sound: Waveform) -> Any:
        return np.zeros(10)

    scores, _ = noise_scores(words, None, [-6.0], shut)
    assert scores == [NoiseScore(-6.0, 0.0, 1.0, 0.0)]


def test_scores_are_averaged_level_by_level() -> None:
    one = [NoiseScore(-12, 2.0, 0.5, 0.8), NoiseScore(-6, 1.0, 0.2, 0.0)]
    two = [NoiseScore(-12, 4.0, 1.0, 0.6), NoiseScore(-6, 3.0, 0.4, 0.5)]
    first, second = mean_noise_scores([one, two])
    assert astuple(first) == (-12, 3.0, 0.75, pytest.approx(0.7))
    assert astuple(second) == (-6, 2.0, pytest.approx(0.3), 0.25)


def test_each_style_opens_the_mouth_in_its_own_way(words: Waveform) -> None:
    def moved(style: str) -> Motion:
        return animate(words, style=style, fps=30).motion

    curves = style_openings(["mumble", "plain", "broad"], moved)
    assert curves.names == ("mumble", "plain", "broad") and curves.fps == 30
    assert curves["mumble"].mean() < curves["plain"].mean() < curves["broad"].mean()
    np.testing.assert_array_equal(curves["broad"], measure_mouth(moved("broad"))["opening_mm"])


class TestFaces:
    def test_every_face_says_the_same(self, motion: Motion) -> None:
        """Lips rest alike on every face of the built-in head, and shapes add up."""
        scores = face_scores(motion, 3, seed=1)
        own = measure_mouth(motion)
        opening, width = own["opening_mm"], own["width_mm"]
        for score in scores:
            assert score.peak_opening_mm == pytest.approx(opening.max(), abs=0.01)
            assert score.mean_opening_mm == pytest.approx(opening.mean(), abs=0.01)
            assert score.contact_gap_mm == pytest.approx(opening[opening < 0.5].max(), abs=0.01)
            assert score.width_range_mm == pytest.approx(np.ptp(width), rel=0.1)
        assert face_scores(motion, 2, seed=1) == scores[:2]

    def test_a_gap_counts_only_where_lips_should_touch(self, motion: Motion) -> None:
        """A mouth held open never touches, so no face can fail to."""
        names = motion.names
        weights = np.zeros_like(motion.weights)
        weights[:, names.index("jawOpen")] = 0.5
        (score,) = face_scores(replace(motion, weights=weights), 1, seed=0)
        assert score.contact_gap_mm == 0 < score.mean_opening_mm == score.peak_opening_mm

    def test_a_decoder_moves_faces_by_its_own_shapes(self, motion: Motion) -> None:
        """As a trained model does: the same shapes, doubled, under names of their own."""
        head = motion.head
        names = tuple(f"voca{index:03d}" for index in range(len(head.expression_names)))
        doubled = replace(head, expression_names=names, expression_basis=2 * head.expression_basis)
        again = Motion(doubled, motion.weights / np.float32(2), motion.fps)
        (one,), (two,) = (face_scores(each, 1, seed=4) for each in (motion, again))
        assert vars(one) == pytest.approx(vars(two), abs=1e-3)

    def test_faces_that_are_not_there_are_refused(self, motion: Motion) -> None:
        short = replace(motion, weights=motion.weights[:2])
        for count, seed, told in ((0, 0, "count"), (1, -1, "seed")):
            with pytest.raises(HeadError, match=told):
                face_scores(short, count, seed)

    def test_another_topology_has_no_faces(self, python2: Any, tmp_path: Path) -> None:
        from elocute.head.registry import open_head

        (tmp_path / "flame.pkl").write_bytes(python2.dumps(python2.flame()))
        head = open_head(tmp_path / "flame.pkl")
        still = Motion(head, np.zeros((3, len(head.expression_names)), np.float32), 30)
        with pytest.raises(InputError, match="no identity space; allowed: a model that moves"):
            face_scores(still, 2, 0)

    def test_the_spread_is_over_faces(self, motion: Motion) -> None:
        scores = face_scores(motion, 4, seed=2)
        peaks = [score.peak_opening_mm for score in scores]
        row = face_score_spread(scores)["peak_opening_mm"]
        assert row == pytest.approx(
            {
                "mean": np.mean(peaks),
                "deviation": np.std(peaks),
                "least": min(peaks),
                "greatest": max(peaks),
            }
        )
        assert set(face_score_spread(scores)) == set(vars(scores[0]))
