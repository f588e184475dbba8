"""Voices told from noise, and the spectrum that they are told by."""

from __future__ import annotations

import numpy as np
import pytest

from elocute.audio.band_levels import BANDS, BandLevels
from elocute.audio.read import read_audio
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.models.feature_extraction import VoiceSoundStream
from elocute.models.talker_voice import voice_share

RATE = 16_000


def rows_of(sound):
    bands = BandLevels()
    return np.concatenate([bands.push(sound), bands.flush()])


def share_of(sound):
    posteriors = np.exp(builtin_encoder().encode(sound))
    return voice_share(posteriors, rows_of(sound)[: len(posteriors)], 50.0)


def test_speech_is_a_voice_and_so_is_silence(speech_wav) -> None:
    sound = read_audio(speech_wav, sample_rate=RATE).samples
    assert np.percentile(share_of(sound), 2) > 0.95
    assert share_of(np.zeros(RATE, np.float32)).min() == 1


def test_a_tone_is_none() -> None:
    t = np.arange(2 * RATE) / RATE
    tone = np.sum([np.sin(2 * np.pi * 220 * k * t) / k for k in range(1, 6)], axis=0)
    assert share_of((0.1 * tone).astype(np.float32))[10:-10].max() < 0.2


@pytest.mark.parametrize("size", [1, 333, 5000])
def test_a_cut_sound_gives_the_same_rows(size) -> None:
    sound = np.random.default_rng(0).normal(size=7777).astype(np.float32)
    if size == 1:
        sound = sound[:900]
    bands, stream = BandLevels(), VoiceSoundStream(RATE)
    parts = [sound[k : k + size] for k in range(0, len(sound), size)]
    cut = np.concatenate([*(bands.push(part) for part in parts), bands.flush()])
    assert cut.shape == (-(-len(sound) // 320), BANDS)
    assert np.allclose(cut, rows_of(sound), atol=1e-5)
    both = np.concatenate([*(stream.push(part) for part in parts), stream.flush()])
    assert np.allclose(both[:, 2:], cut, atol=1e-4)


def test_a_louder_band_has_a_higher_row() -> None:
    t = np.arange(RATE) / RATE
    low, high = (rows_of(np.sin(2 * np.pi * f * t).astype(np.float32))[25] for f in (150, 5000))
    assert low.argmax() < 3 and high.argmax() > 12
