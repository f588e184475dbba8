"""Rest in pauses, and sounds that are no voice."""

import numpy as np
import pytest

from elocute.articulation.driver import posteriors_from_phones
from elocute.articulation.rest import rest_share
from elocute.articulation.voice_evidence import voice_share
from elocute.audio.phones_and_visemes import PHONES

RATE = 50


def silence(*stretches):
    """(row,) posterior of silence: seconds of speech and of silence in turn, speech first."""
    parts = [np.full(round(s * RATE), place % 2, float) for place, s in enumerate(stretches)]
    return np.concatenate(parts)


def test_a_short_pause_is_speech_and_a_long_one_is_rest():
    assert rest_share(silence(1, 0.36, 1), RATE).max() == 0
    middle = rest_share(silence(1, 2.0, 1), RATE)[50:150]
    assert middle.max() == 1 and middle[0] < 0.05 and middle[-1] < 0.05


def test_the_longer_the_pause_the_deeper_the_rest():
    depths = [rest_share(silence(1, pause, 1), RATE).max() for pause in (0.45, 0.6, 0.8, 1.2)]
    assert 0 < depths[0] < 0.5 and sorted(depths) == depths and depths[-1] == 1


def test_a_clip_cut_within_speech_does_not_rest_at_its_ends():
    assert rest_share(silence(1, 0.3), RATE).max() == 0
    assert rest_share(silence(0, 0.3, 1), RATE).max() == 0
    assert rest_share(silence(1, 1.5), RATE)[-1] == 1


def test_silence_alone_is_rest_and_a_click_does_not_wake_the_mouth():
    assert rest_share(np.ones(10), RATE).min() == 1
    click = np.ones(100)
    click[50:53] = 0
    assert rest_share(click, RATE).min() == 1


def test_a_stretch_rests_as_the_whole_take_does():
    whole_silence = silence(1.5, 0.7, 1.0, 0.3, 0.8, 1.6, 1.0)
    whole = rest_share(whole_silence, RATE)
    part = rest_share(whole_silence[40:300], RATE, starts=False)
    assert np.allclose(part[60:-50], whole[100:250])


def spoken(*phones, each_s=0.08):
    times = [(i * each_s, (i + 1) * each_s, phone) for i, phone in enumerate(phones)]
    return np.exp(posteriors_from_phones(times, len(phones) * each_s))


def test_phones_that_change_are_a_voice_and_so_is_a_vowel_that_is_held():
    assert voice_share(spoken(*("AA", "T", "IY", "S", "OW", "N") * 3), RATE).min() > 0.99
    assert voice_share(spoken("AA", each_s=2.0), RATE).min() > 0.99


def test_silence_is_no_noise():
    assert voice_share(spoken("SIL", each_s=2.0), RATE).min() == 1


@pytest.mark.parametrize("likely", [0.1, 0.3])
def test_a_vowel_that_the_ear_doubts_and_that_never_changes_is_noise(likely):
    steady = np.full((100, len(PHONES)), (1 - likely) / (len(PHONES) - 1))
    steady[:, PHONES.index("AA")] = likely
    assert voice_share(steady, RATE).max() < 0.01
