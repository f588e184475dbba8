"""A face that never freezes: what moves without a reason, and where eyes and mouths go."""

from __future__ import annotations

import numpy as np
import pytest

import elocute
from elocute.animation import animate
from elocute.audio.waveform import Waveform
from elocute.errors import InputError
from elocute.life import Life, LifeStream
from elocute.life.director import (
    BLINK,
    BROW_L,
    BROW_R,
    CHANNELS,
    CORNER,
    DOWN,
    FORCE,
    INNER,
    LIVELY,
    LOOK_DOWN,
    LOOK_LEFT,
    NOD,
    SIDE,
    TURN,
)
from elocute.life.ground import Ground
from elocute.life.people import AVERAGE
from elocute.life.prosody import ROW_RATE, ProsodyStream
from elocute.life.prosody_events import EventFinder, Hesitation, PhraseEnd, PhraseStart
from elocute.motion.mouth_measures import measure_mouth

RATE = 16000
SEEDS = range(8)


@pytest.fixture(scope="module")
def speech(speech_wav) -> Waveform:
    return elocute.read_audio(speech_wav, sample_rate=RATE)


def lived(samples, seed=0, listen=False):
    stream = LifeStream(RATE, Life(), person=AVERAGE.drawn(seed))
    return np.concatenate([stream.push(samples, listen), stream.flush()]).astype(np.float64)


def events_of(samples, kind):
    finder = EventFinder()
    found = [e for batch in ProsodyStream().push(samples) for e in finder.push(batch)]
    return [event for event in found if isinstance(event, kind)]


def off_listener(rows):
    """(row,) degrees."""
    looked = rows[:, [LOOK_DOWN, LOOK_LEFT]] + 0.15 * rows[:, [NOD, TURN]]
    return np.linalg.norm(looked, axis=1)


def frozen(motion):
    """Frames in which no weight changes by more than 1e-4 and no vertex by more than 1 µm."""
    still = np.abs(np.diff(motion.weights, axis=0)).max(axis=1) <= 1e-4
    for frame in np.flatnonzero(still):
        before, after = motion.vertices(frame, frame + 2)
        still[frame] = np.abs(after - before).max() <= 1e-6
    return int(still.sum())


@pytest.mark.parametrize("fps", [25, 30, 60])
@pytest.mark.parametrize("what", ["digital silence", "noise", "a tone", "one click"])
def test_nothing_that_is_no_speech_freezes_a_face(what, fps):
    samples = np.zeros(6 * RATE, np.float32)
    if what == "noise":
        samples[:] = np.random.default_rng(1).normal(0, 0.05, len(samples))
    elif what == "a tone":
        samples[:] = 0.2 * np.sin(2 * np.pi * 150 * np.arange(len(samples)) / RATE)
    elif what == "one click":
        samples[RATE] = 0.9
    assert frozen(animate(Waveform(samples, RATE), fps=fps).motion) == 0


@pytest.mark.parametrize("seed", [0, 7])
def test_nor_do_pauses_and_streams_end_in_a_still(speech, seed):
    live = elocute.stream(RATE, fps=60, seed=seed)
    sound = np.concatenate([speech.samples[: 4 * RATE], np.zeros(4 * RATE, np.float32)])
    frames = [*live.push(sound), *live.flush()]
    values = np.stack([np.concatenate([f.values, f.rotations.ravel()]) for f in frames])
    assert np.abs(np.diff(values, axis=0)).max(axis=1).min() > 1e-5
    whole = animate(Waveform(sound, RATE), seed=seed)
    assert frozen(whole.motion) == 0
    assert np.abs(whole.motion.weights - values[:, : whole.motion.weights.shape[1]]).max() < 1e-5


def test_the_ground_drifts_by_a_third_of_a_degree_and_never_jumps():
    rows = Ground(CHANNELS, AVERAGE).rows(0, 60_000)
    assert 0.2 < rows[:, NOD].std() < 0.4 and 0.2 < rows[:, TURN].std() < 0.4
    assert np.abs(np.diff(rows[:, :LOOK_LEFT], axis=0)).max() * ROW_RATE < 2  # degrees a second
    assert rows[:, INNER].min() > 0 and rows[:, INNER].max() < 0.1
    assert np.abs(np.diff(rows, axis=0)).max(axis=1).min() > 1e-5


def test_eyes_leave_the_listener_at_beginnings_and_are_back_at_ends(speech):
    """More than 8 degrees off in a tenth to a fifth of speech, over takes."""
    starts, ends = (events_of(speech.samples, kind) for kind in (PhraseStart, PhraseEnd))
    spoken = np.concatenate(
        [np.arange(a.row, b.row) for a, b in zip(starts, ends, strict=False) if b.row > a.row]
    )
    away = np.stack([off_listener(lived(speech.samples, seed)) > 8 for seed in range(24)])
    assert 0.10 < away[:, spoken].mean() < 0.20
    first = np.mean([away[:, each.row : each.row + 50].mean() for each in starts])
    phrases = [e for e in ends if isinstance(e, PhraseEnd) and e.length > 100]
    last = np.mean([away[:, each.row - 20 : each.row].mean() for each in phrases])
    assert first > 1.5 * last
    furthest = max(off_listener(lived(speech.samples, seed)).max() for seed in SEEDS)
    assert 10 < furthest < 22


def test_who_hesitates_looks_away():
    """Half a second of "uhm": an even voice that goes on and on."""
    times = np.arange(RATE) / RATE
    uhm = np.sum([np.sin(2 * np.pi * 120 * k * times) / k for k in range(1, 9)], axis=0) / 8
    rest = np.zeros(4 * RATE, np.float32)
    samples = np.concatenate([rest, uhm[: RATE * 6 // 10], rest[: RATE // 2]]).astype(np.float32)
    assert len(events_of(samples, Hesitation)) == 1
    away = [off_listener(lived(samples, seed))[400:500].max() > 8 for seed in SEEDS]
    assert sum(away) >= len(away) / 2


def test_nods_are_not_the_meter_of_the_voice(speech):
    level = np.sqrt(np.convolve(speech.samples**2, np.ones(1600) / 1600, "same"))[::160]
    rows = np.stack([lived(speech.samples, seed)[: len(level), NOD] for seed in SEEDS])
    loud = 20 * np.log10(level + 1e-6)
    loud = np.maximum(loud, loud.max() - 40)
    assert abs(np.mean([np.corrcoef(nod, loud)[0, 1] for nod in rows])) < 0.3


def test_brows_have_gestures_of_one_side_and_of_their_inner_ends(speech):
    sides, inner = [], []
    for seed in SEEDS:
        rows = lived(speech.samples, seed)
        sides.append(np.abs(rows[:, BROW_L] - rows[:, BROW_R]).max())
        inner.append((rows[:, INNER] - rows[:, [BROW_L, BROW_R]].max(axis=1)).max())
    assert 0.2 < max(sides) < 0.45 and max(inner) > 0.2


def test_takes_differ_by_their_seed_and_by_nothing_else(speech):
    shut = [lived(speech.samples, seed)[:, BLINK] > 0.45 for seed in SEEDS]
    assert len({tuple(np.flatnonzero(each)) for each in shut}) == len(shut)
    assert 15 < 60 * np.mean([(s[1:] & ~s[:-1]).sum() for s in shut]) / speech.duration_s < 45
    assert np.array_equal(lived(speech.samples), lived(speech.samples, 0))
    assert np.array_equal(lived(speech.samples, 3), lived(speech.samples, 3))


@pytest.mark.parametrize("wrong", [-1, 1.5, "two", True, 2**40])
def test_what_is_no_seed_is_refused(speech, wrong):
    for call in (lambda: animate(speech, seed=wrong), lambda: elocute.stream(RATE, seed=wrong)):
        with pytest.raises(InputError, match=r"`seed`.*allowed"):
            call()


def test_an_open_mouth_is_uneven_and_lips_that_meet_are_even(speech):
    """By half a millimetre, as people's (docs/measurements/life.md)."""
    even, uneven = (animate(speech, life=life, identity="ben") for life in ("asymmetry=0", 1))
    corners = even.motion.head.landmarks[[48, 54]]
    basis = even.motion.head.expression_basis[:, corners].astype(float)
    moved = (uneven.motion.weights - even.motion.weights) @ basis.reshape(len(basis), -1)
    aside = 1000 * moved.reshape(-1, 2, 3)[:, :, 0].mean(axis=1)
    assert 0.2 < aside.std() < 0.9 and np.abs(aside).max() < 2.5
    shut = measure_mouth(even.motion)["opening_mm"] < 0.05
    assert measure_mouth(uneven.motion)["opening_mm"][shut].max() < 0.1
    assert np.abs(aside[shut]).max() < 0.1
    for left, right in (("mouthLeft", "mouthRight"), ("jawLeft", "jawRight")):
        assert max(even.curves[left].max(), even.curves[right].max()) == 0
        assert np.minimum(uneven.curves[left], uneven.curves[right]).max() == 0
    lean = lived(speech.samples)[:, [SIDE, CORNER]]
    assert np.abs(lean).max() < 2.2


def forced(speech):
    """The same speech twice, the second time as with effort: louder and brighter."""
    bright = np.diff(speech.samples, prepend=np.float32(0)) * 4
    both = np.concatenate([speech.samples / 8, np.clip(bright, -1, 1)])
    return both.astype(np.float32)


def test_effort_is_heard_in_the_voice_and_not_in_the_gain(speech):
    rows, half = lived(forced(speech)), len(speech.samples) // 160
    assert rows[200 : half - 100, FORCE].mean() < 0.2
    assert rows[half + 300 :, FORCE].mean() > 0.5
    assert rows[half:, DOWN].max() > rows[:half, DOWN].max()
    louder = lived(forced(speech) / 4)
    assert np.abs(louder[:, [FORCE, LIVELY]] - rows[:, [FORCE, LIVELY]]).max() < 1e-3


def test_a_mood_from_the_voice_is_the_same_in_a_stream(speech):
    sound = Waveform(forced(speech)[: 14 * RATE], RATE)
    whole = animate(sound, mood="auto", fps=30)
    live = elocute.stream(RATE, mood="auto", fps=30)
    parts = [live.push(sound.samples[at : at + 4321]) for at in range(0, 14 * RATE, 4321)]
    frames = [frame for part in [*parts, live.flush()] for frame in part]
    assert np.abs(np.stack([f.values for f in frames]) - whole.motion.weights).max() < 1e-5
    turned = np.stack([f.rotations for f in frames]) - np.asarray(whole.motion.rotations)
    assert np.abs(turned).max() < 1e-5
    knit = whole.curves["browDownLeft"]
    assert knit[-60:].mean() > knit[60:240].mean() + 0.15
    assert animate(sound, mood="auto", fps=30, life=0).curves["browDownLeft"][-60:].mean() > 0.15


def test_who_listens_nods_at_the_end_of_phrases_looks_at_the_speaker_and_has_no_lips(speech):
    take = animate(speech, listen=True)
    lips = [n for n in take.curves.names if n.startswith(("mouth", "jaw", "tongue"))]
    assert take.curves.select(tuple(lips)).values.max() == 0
    assert frozen(take.motion) == 0 and not take.notes
    ends = [e.row for e in events_of(speech.samples, PhraseEnd)]
    after = np.zeros(len(lived(speech.samples)), bool)
    for row in ends:
        after[row + 20 : row + 140] = True
    takes = [lived(speech.samples, seed, listen=True) for seed in SEEDS]
    fast = [np.abs(np.gradient(rows[:, NOD])) * ROW_RATE > 8 for rows in takes]
    assert np.mean([each[after].mean() for each in fast]) > 2 * np.mean(
        [each[~after].mean() for each in fast]
    )
    assert np.mean([off_listener(rows) > 8 for rows in takes]) < 0.08


def test_a_stream_takes_turns(speech):
    """Lips move while it speaks, rest while it listens, however the sound is cut."""

    def made(block):
        live, frames = elocute.stream(RATE, fps=30), []
        for start, listen in ((0, False), (4, True), (8, False)):
            part = speech.samples[start * RATE : (start + 4) * RATE]
            for at in range(0, len(part), block):
                frames += live.push(part[at : at + block], listen=listen)
        return np.stack([f.values for f in [*frames, *live.flush()]]), frames[0].names

    values, names = made(4 * RATE)
    assert np.abs(made(1111)[0] - values).max() < 1e-5
    jaw = values[:, names.index("jawOpen")]
    assert jaw[15:115].max() > 0.15 and jaw[150:225].max() < 0.02 and jaw[250:].max() > 0.15


def test_listening_takes_no_text(speech):
    with pytest.raises(InputError, match="listen"):
        animate(speech, listen=True, text="a text")
