"""Loudness of a voice: the same however the sound is cut, and in the unit that it says."""

import numpy as np
import pytest

from elocute.audio.loudness import COLUMNS, FLOOR_DB, Loudness


def rows_of(samples, block=None):
    rows = Loudness()
    block = block or max(1, len(samples))
    pieces = [rows.push(samples[at : at + block]) for at in range(0, len(samples), block)]
    return np.concatenate([*pieces, rows.flush()])


def voice(seconds=3.13, seed=0):
    noise = np.random.default_rng(seed).normal(size=round(seconds * 16000)) * 0.1
    return (noise * np.abs(np.sin(np.arange(len(noise)) / 3000))).astype(np.float32)


@pytest.mark.parametrize("block", [1, 160, 777, 16000])
def test_a_stream_gives_what_the_whole_sound_gives(block):
    whole = rows_of(voice())
    assert whole.shape == (157, COLUMNS)
    assert np.abs(rows_of(voice(), block) - whole).max() < 1e-5


@pytest.mark.parametrize("count", [0, 1, 319, 320, 321, 700])
def test_every_320_samples_are_a_row(count):
    assert len(rows_of(voice()[:count])) == -(-count // 320)


def test_loudness_is_in_decibels_of_full_scale():
    tone = np.sin(2 * np.pi * 200 * np.arange(16000) / 16000).astype(np.float32)
    loud, quiet = rows_of(tone)[25, 0], rows_of(tone / 10)[25, 0]
    assert loud == pytest.approx(-3.01, abs=0.05) and quiet == pytest.approx(loud - 20, abs=0.05)


def test_the_loudest_so_far_is_forgotten_slowly_and_never_below_the_floor():
    sound = np.concatenate([voice(1.0) * 5, np.zeros(16000 * 40, np.float32)])
    loudest = rows_of(sound)[:, 1]
    assert loudest[60] > -15
    assert loudest[60 + 250] == pytest.approx(loudest[60] - 7.5, abs=0.01)  # five seconds later
    assert loudest[-1] == FLOOR_DB
