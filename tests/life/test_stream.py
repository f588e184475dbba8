"""Life from the sound: the same sound lives the same life, however it comes in."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.head.identity import identity_names, resolve_identity
from elocute.life import Life, LifeStream, resolve_mood
from elocute.life.director import (
    BLINK,
    BROW_L,
    BROW_R,
    CHANNELS,
    CHEEK_L,
    DOWN,
    INNER,
    NOD,
    SQUINT,
    TILT,
    TURN,
    WIDE,
)
from elocute.life.ground import Ground
from elocute.life.people import AVERAGE, person_of
from elocute.life.prosody import LEVEL, PITCH, ROW_RATE, VOICING, ProsodyStream
from elocute.life.prosody_events import EventFinder, PhraseEnd, PhraseStart, Syllable

RATE = 16000
HEAD = [NOD, TURN, TILT]
UPPER_FACE = [INNER, BROW_L, BROW_R, DOWN, WIDE, SQUINT, CHEEK_L]


@pytest.fixture(scope="module")
def people():
    return {who: person_of(resolve_identity(who)) for who in identity_names()}


@pytest.fixture(scope="module")
def speech(speech_wav) -> Waveform:
    return read_audio(speech_wav, sample_rate=RATE)


def lived(samples, rate=RATE, block=None, life=Life(), **options):  # noqa: B008
    """Rows of life (row, channel) for a sound, pushed in blocks."""
    stream, block = LifeStream(rate, life, **options), block or len(samples)
    rows = [stream.push(samples[at : at + block]) for at in range(0, len(samples), block)]
    return np.concatenate([*rows, stream.flush()])


def blink_times(rows):
    shut = rows[:, BLINK] > 0.45
    return np.flatnonzero(shut[1:] & ~shut[:-1]) / ROW_RATE


def voice(hz, seconds=1.0):
    """A buzz with the harmonics of a voice."""
    times = np.arange(round(seconds * RATE)) / RATE
    waves = [np.sin(2 * np.pi * hz * k * times) / k for k in range(1, 9)]
    return np.sum(waves, axis=0).astype(np.float32) / 8


@pytest.mark.parametrize("hz", [85.0, 120.0, 210.0, 380.0])
def test_pitch_and_voicing_of_a_voice(hz):
    rows = np.concatenate([*ProsodyStream().push(voice(hz))])[5:-5]
    assert rows[:, PITCH] == pytest.approx(12 * np.log2(hz / 100), abs=0.2)
    assert rows[:, VOICING].min() > 0.9


def test_noise_and_silence_have_no_voice():
    noise = np.random.default_rng(0).normal(0, 0.1, RATE * 3).astype(np.float32)
    rows = np.concatenate([*ProsodyStream().push(noise)])
    assert rows[:, VOICING].mean() < 0.1 and rows[:, LEVEL].std() < 3
    silent = np.concatenate([*ProsodyStream().push(np.zeros(RATE, np.float32))])
    assert silent[:, VOICING].max() == 0 and silent[:, LEVEL].max() < -150


def test_phrases_begin_and_end_where_somebody_speaks():
    """Half a second of rest, a second of a voice, a second of rest."""
    rest = np.zeros(RATE // 2, np.float32)
    finder, events = EventFinder(), []
    stream = ProsodyStream()
    for batch in stream.push(np.concatenate([rest, voice(120), rest, rest])):
        events += finder.push(batch)
    (start,) = [e for e in events if isinstance(e, PhraseStart)]
    (end,) = [e for e in events if isinstance(e, PhraseEnd)]
    assert start.row == pytest.approx(50, abs=4) and end.row == pytest.approx(150, abs=4)


def syllables_of(samples):
    finder, events = EventFinder(), []
    for batch in ProsodyStream().push(samples):
        events += finder.push(batch)
    return [e for e in events if isinstance(e, Syllable)]


def test_a_louder_higher_syllable_stands_out(speech):
    syllables = syllables_of(speech.samples)
    assert 2 < len(syllables) / speech.duration_s < 6
    assert min(e.prominence for e in syllables) < 0.4 < 0.8 < max(e.prominence for e in syllables)


@pytest.mark.parametrize("who", ["mean", "ben"])
@pytest.mark.parametrize("block", [160, 777, 16000])
def test_however_a_sound_is_cut_it_lives_the_same_bit_for_bit(speech, people, block, who):
    whole = lived(speech.samples, person=people[who])
    assert np.array_equal(lived(speech.samples, block=block, person=people[who]), whole)


def test_a_row_comes_within_the_look_ahead(speech):
    stream, given = LifeStream(RATE, Life()), 0
    for at in range(0, len(speech.samples), 160):
        given += len(stream.push(speech.samples[at : at + 160]))
        assert (at + 160) / RATE - given / ROW_RATE <= stream.lookahead_s
    assert stream.lookahead_s < 1.1


@pytest.mark.parametrize("gain", [0.5, 0.03, 1.7])
def test_a_louder_recording_lives_the_same_life(speech, gain):
    changed = lived(speech.samples * np.float32(gain)) - lived(speech.samples)
    assert np.abs(changed).max() < 1e-4


def test_other_sounds_blink_at_other_times(speech):
    """Once every film blinked at 4.03 and 8.27 s, whatever was said."""
    first, second = lived(speech.samples), lived(speech.samples[RATE:])
    assert len(blink_times(first)) >= 3
    apart = np.abs(blink_times(first)[:, None] - blink_times(second)[None])
    assert apart.min(axis=1).max() > 0.3


def test_some_short_clips_blink_and_some_do_not(speech):
    clips = [speech.samples[at : at + 2 * RATE] for at in range(0, 9 * RATE, RATE)]
    counts = [len(blink_times(lived(clip))) for clip in clips]
    assert 0 < sum(count > 0 for count in counts) < len(clips)


def test_the_head_moves_as_far_as_people_do_and_never_drifts_away(speech):
    """A minute of speech: standard deviations as in docs/measurements/life.md, no trend."""
    rows = lived(np.tile(speech.samples, 6))[:, HEAD]
    nod, turn, tilt = rows.std(axis=0)
    assert 0.8 < nod < 2.5 and 0.8 < turn < 3 and 0.3 < tilt < 2
    assert np.abs(rows).max() < 12
    assert np.abs(rows[-1000:].mean(axis=0) - rows[:1000].mean(axis=0)).max() < 2


def test_head_motion_is_smooth(speech):
    """Next to nothing above 8 Hz, and no step from row to row."""
    rows = lived(np.tile(speech.samples, 3))[:, HEAD].astype(np.float64)
    power = np.abs(np.fft.rfft((rows - rows.mean(0)) * np.hanning(len(rows))[:, None], axis=0)) ** 2
    hz = np.fft.rfftfreq(len(rows), 1 / ROW_RATE)
    assert (power[hz > 8].sum(axis=0) < 0.01 * power.sum(axis=0)).all()
    assert np.abs(np.diff(rows, 2, axis=0)).max() < 0.2  # degrees


def test_brows_go_with_stress(speech):
    """On about a third of the accents they are well up, and higher than on other syllables."""
    samples = np.tile(speech.samples, 3)
    brows = lived(samples)[:, INNER]
    at = {True: [], False: []}
    for syllable in syllables_of(samples):
        at[syllable.prominence >= 0.5].append(brows[syllable.row : syllable.row + 12].max())
    stressed, others = np.array(at[True]), np.array(at[False])
    assert 0.2 < (stressed > 0.3).mean() < 0.65
    assert stressed.mean() > 1.3 * others.mean()


def test_the_upper_face_never_twitches(speech):
    """Brows need a tenth of a second for a third of their way, and more to come down."""
    rows = lived(np.tile(speech.samples, 3)).astype(np.float64)[:, UPPER_FACE]
    tenth = rows[10:] - rows[:-10]
    assert tenth.max() < 0.45 and tenth.min() > -0.4
    assert np.abs(np.diff(rows, 2, axis=0)).max() < 0.02
    assert rows.min() > -1e-6 and rows.max() < 1


def test_people_who_say_the_same_live_each_in_their_own_way(speech, people):
    blinks = {who: blink_times(lived(speech.samples, person=one)) for who, one in people.items()}
    assert np.array_equal(blinks["mean"], blink_times(lived(speech.samples)))
    assert len({tuple(times) for times in blinks.values()}) == len(blinks)
    assert all(1 <= len(times) <= 10 for times in blinks.values())
    others = [lived(speech.samples, person=people[who])[:, INNER] for who in ("ada", "ben")]
    assert np.abs(others[0] - others[1]).max() > 0.2


def test_a_person_is_made_of_a_face(people):
    assert people["mean"] == AVERAGE and len(set(people.values())) == len(people)
    ada = resolve_identity("ada")
    padded = person_of(np.concatenate([ada, np.zeros(9, np.float32)]))
    assert padded.salt == pytest.approx(people["ada"].salt)
    for one in people.values():
        assert 0.7 < one.blink_rate < 1.4 and 0.85 < one.blink_length < 1.15
        assert 0.8 < one.brows < 1.2 and abs(one.lean) < 0.15


def test_a_long_silence_is_alive_but_calm():
    rows = lived(np.zeros(30 * RATE, np.float32))
    assert 0.1 < rows[:, TURN].std() < 1.5
    assert 3 <= len(blink_times(rows)) <= 15
    assert np.abs(rows[:100, HEAD]).max() < 1.2 and np.abs(rows[:, HEAD]).max() < 10


def test_fewer_blinks_where_fewer_are_wanted(speech):
    minute = np.tile(speech.samples, 6)
    every, half, none = (blink_times(lived(minute, life=Life(blinks=b))) for b in (1.0, 0.5, 0.0))
    assert len(none) == 0 < len(half) < len(every)
    assert set(half) <= set(every)
    assert len(blink_times(lived(minute, mood=resolve_mood("angry")))) < len(every)


def test_nothing_is_drawn_for_two_samples():
    rows = lived(np.array([0.1, -0.1], np.float32))
    ground = Ground(CHANNELS, AVERAGE).rows(0, len(rows)).astype(np.float32)
    assert rows.shape[1] == len(CHANNELS) and np.array_equal(rows, ground)


def test_memory_stays_bounded(speech):
    stream, held = LifeStream(RATE, Life()), []
    tracemalloc.start()
    try:
        for second in range(60):
            stream.push(speech.samples[:RATE])
            if second in (9, 59):
                held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert held[1] - held[0] < 50_000
