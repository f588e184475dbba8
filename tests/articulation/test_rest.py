"""Rest in pauses, and the breath before speech."""

import numpy as np

from elocute.articulation.rest import KNOWN_EDGE_S, breath_share, rest_share

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


def test_a_breath_is_drawn_before_speech_after_a_long_pause():
    breath = breath_share(silence(1, 1.2, 1), RATE)
    assert breath[110 - 15 : 110 - 12].min() > 0.9
    assert breath[:85].max() == 0 and breath[110:].max() == 0
    assert breath_share(silence(1, 0.2, 1), RATE).max() == 0
    assert 0 < breath_share(silence(1, 0.42, 1), RATE).max() < 0.9


def test_a_known_text_begins_and_ends_at_rest():
    rest = rest_share(silence(0, 0.2, 1, 0.12), RATE, edge_s=KNOWN_EDGE_S)
    assert rest[0] == 1 and rest[-1] == 1 and rest[11:60].max() == 0
