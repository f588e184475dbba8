"""Live speech: however it is cut, a stream gives what the whole sound gives."""

from __future__ import annotations

import math
import threading
import tracemalloc
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

import elocute
from elocute.array_types import Float32Array
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.errors import InputError
from elocute.head.builtin import load_builtin_head
from elocute.models.curve_stream import CurveStream
from elocute.models.feature_extraction import blocks_of
from elocute.models.registry import DEFAULT_MODEL, model_names, open_model
from elocute.models.streaming import Frame
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.mouth_measures import measure_mouth

MODELS = model_names()
SOON_S = 0.25
NEAR = 1e-5


@pytest.fixture(scope="module")
def speech(speech_wav) -> Waveform:
    """Speech with a second of real silence in its middle."""
    sound = read_audio(speech_wav, sample_rate=48000).samples
    parts = [sound[48_000:120_000], np.zeros(48_000, np.float32), sound[168_000:240_000]]
    return Waveform(np.concatenate(parts), 48000)


@dataclass(frozen=True)
class Streamed:
    """Curves of a sound that came in blocks, what is promised of them, and how late they came."""

    curves: Float32Array
    lookahead_s: float
    late_s: list[float]


def streamed(name: str, sound: Waveform, block: int, fps: float = 60.0, **options: Any) -> Streamed:
    """A sound pushed in blocks of so many samples."""
    model = open_model(name)
    level = model.sound_level(sound)
    live = CurveStream(model, sound.sample_rate, fps=fps, level=level, **options)
    pieces, late_s = [], []
    for at in range(0, len(sound.samples), block):
        pieces.append(live.push(sound.samples[at : at + block]))
        late_s.append((at + block) / sound.sample_rate - live.frames_given / fps)
    pieces.append(live.flush())
    curves = np.concatenate([piece.values for piece in pieces if piece is not None])
    return Streamed(curves, live.lookahead_s, late_s)


@pytest.fixture(scope="module")
def whole(speech) -> Callable[[str, str], Float32Array]:
    """Curves by a model, with contacts "auto" or "off", of the whole speech; made once."""
    return cache(
        lambda name, contacts: (
            elocute.animate(speech, model=name, contacts=contacts, life=0).curves.values
        )
    )


@pytest.fixture(scope="module")
def live(speech) -> Callable[[str, int, str], Streamed]:
    """The same from a stream, in blocks of so many samples."""
    return cache(lambda name, block, contacts: streamed(name, speech, block, contacts=contacts))


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize(
    ("block", "contacts"), [(480, "auto"), (4801, "auto"), (48000, "auto"), (4801, "off")]
)
def test_a_stream_gives_what_the_whole_sound_gives(whole, live, name, block, contacts):
    given, wanted = live(name, block, contacts).curves, whole(name, contacts)
    assert given.shape == wanted.shape
    assert np.abs(given - wanted).max() < NEAR


@pytest.mark.parametrize("name", MODELS)
def test_the_bare_output_is_another(live, name):
    assert np.abs(live(name, 4801, "off").curves - live(name, 4801, "auto").curves).max() > 0.1


@pytest.mark.parametrize("name", MODELS)
def test_blocks_of_a_millisecond_too(speech, name):
    sound = Waveform(speech.samples[:72_000], 48000)
    whole = elocute.animate(sound, model=name, life=0).curves.values
    assert np.abs(streamed(name, sound, 48).curves - whole).max() < NEAR


@pytest.mark.parametrize(("rate", "fps"), [(44100, 60.0), (48000, 24.0), (16000, 29.97)])
def test_at_any_rate_of_sound_and_frames(speech, rate, fps):
    sound = speech.resample(rate)
    whole = elocute.animate(sound, fps=fps, life=0).curves.values
    live = streamed(DEFAULT_MODEL, sound, rate // 7, fps).curves
    assert live.shape == whole.shape
    assert np.abs(live - whole).max() < NEAR


@pytest.mark.parametrize("name", MODELS)
def test_a_frame_comes_after_the_declared_look_ahead_and_no_later(live, name):
    stream = live(name, 480, "auto")
    assert stream.lookahead_s < 1.5
    assert max(stream.late_s) <= stream.lookahead_s + 0.01
    assert min(stream.late_s[200:]) > 0.2  # and it does look ahead


def test_without_the_level_the_recurrent_model_does_not_depend_on_the_blocks(speech):
    def live(block):
        stream = CurveStream(open_model("crnn"), 48000)
        parts = [
            stream.push(speech.samples[at : at + block])
            for at in range(0, len(speech.samples), block)
        ]
        return np.concatenate([p.values for p in (*parts, stream.flush()) if p is not None])

    assert np.abs(live(480) - live(48000)).max() < NEAR


def test_the_public_call(speech):
    live = elocute.stream(rate=48000, fps=60)
    frames = []
    for at in range(0, len(speech.samples), 4800):
        frames += live.push(speech.samples[at : at + 4800])
    frames += live.flush()
    take = elocute.animate(speech)
    assert len(frames) == take.motion.frame_count
    assert frames[90].time_s == pytest.approx(1.5)
    values, turns = (np.stack([getattr(f, n) for f in frames]) for n in ("values", "rotations"))
    assert np.abs(values - take.motion.weights).max() < NEAR
    assert np.abs(turns - take.motion.rotations).max() < NEAR
    assert frames[90]["jawOpen"] == pytest.approx(take.curves["jawOpen"][90], abs=NEAR)
    with pytest.raises(KeyError):
        frames[0]["noSuchCurve"]
    assert "\n" not in repr(frames[0]) + repr(live)


def test_sixteen_bit_integers_are_taken(speech):
    integers = np.round(speech.samples[:48000] * 32767).astype(np.int16)
    live = elocute.stream()
    assert len([*live.push(integers), *live.flush()]) == 60


@pytest.mark.parametrize("channels", [1, 2])
def test_bytes_are_samples_of_sixteen_bits_however_they_are_cut(speech, channels):
    integers = np.round(speech.samples[:48000] * 32767).astype("<i2")
    data = np.repeat(integers[:, None], channels, axis=1).tobytes()
    live = elocute.stream(48000, lookahead=SOON_S, channels=channels)
    frames = [
        frame for at in range(0, len(data), 1001) for frame in live.push(data[at : at + 1001])
    ]
    array = elocute.stream(48000, lookahead=SOON_S)
    wanted = [*array.push(np.repeat(integers[:, None], 2, axis=1)), *array.flush()]
    frames += live.flush()
    assert len(frames) == 60
    for one, other in zip(frames, wanted, strict=True):
        np.testing.assert_array_equal(one.values, other.values)


def test_what_is_interrupted_within_a_sample_leaves_nothing_of_it(speech):
    data = np.round(speech.samples[:48000] * 32767).astype("<i2").tobytes()
    whole, cut = (elocute.stream(48000, lookahead=SOON_S) for _ in range(2))
    for live, end in ((whole, 48000), (cut, 48001)):
        live.push(data[:end])
        live.interrupt()
    for one, other in zip(whole.push(data), cut.push(data), strict=True):
        np.testing.assert_array_equal(one.values, other.values)


def test_nothing_moves_the_mouth_before_anybody_speaks(speech):
    live = elocute.stream(48000, lookahead=SOON_S, life=0)
    frames = [*live.idle(1.0), *live.push(speech.samples), *live.flush()]
    waiting = np.stack([frame.values for frame in frames if frame.time_s < 0.8])
    assert len(waiting) == 48
    assert opening_mm(waiting, frames[0].names).max() < 0.3


@pytest.mark.parametrize("lookahead", [SOON_S, "exact"])
def test_an_interrupted_mouth_comes_to_rest_and_can_speak_again(speech, lookahead):
    live = elocute.stream(48000, lookahead=lookahead)
    frames = [*live.push(speech.samples[: 4 * 48000])]
    spoken = len(frames)
    live.interrupt()
    for _ in range(100):
        frames += live.idle(0.02)
    shown = next(frame for frame in frames[:spoken] if frame["jawOpen"] > 0.15)
    times = [frame.time_s for frame in frames]
    assert times == pytest.approx(np.arange(len(frames)) / 60)
    values = np.stack([frame.values for frame in frames])
    fading = values[spoken - 1 : spoken + 8]
    assert np.abs(np.diff(fading, axis=0)).max() < np.abs(np.diff(values[:spoken], axis=0)).max()
    rest = opening_mm(values[spoken + 8 :], frames[0].names)
    assert rest.max() < 0.3
    assert np.ptp(np.stack([frame.rotations for frame in frames[spoken:]]), axis=0).max() > 1e-3
    before = len(frames)
    frames += live.push(speech.samples)
    assert max(frame["jawOpen"] for frame in frames[before:]) > 0.1
    live.interrupt(shown)
    (first, *_) = [frame for _ in range(100) for frame in live.idle(0.02)]
    assert first["jawOpen"] == pytest.approx(shown["jawOpen"], rel=0.2)


def test_a_long_silence_rests_and_the_end_may_come_at_any_time():
    live = elocute.stream()
    assert [*live.push(np.zeros(1, np.float32)), *live.flush()] == []  # too short to be sound
    live = elocute.stream()
    frames = [*live.push(np.zeros(48000 * 4, np.float32)), *live.flush()]
    assert len(frames) == 240
    assert max(frame["jawOpen"] for frame in frames) == 0
    for count in (2, 100, 5000):
        live = elocute.stream()
        frames = [*live.push(np.zeros(count, np.float32)), *live.flush()]
        assert len(frames) == max(1, math.ceil(count / 800))


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (np.zeros((2, 100), np.float32), "shape"),
        (np.zeros(10, np.int64), "int64"),
        (np.full(10, np.nan, np.float32), "NaN"),
        (np.full(10, 3000.0), "3000"),
    ],
)
def test_what_is_no_sound_is_refused(given, found):
    with pytest.raises(InputError, match=found):
        elocute.stream().push(given)


def test_nothing_comes_after_the_end_and_settings_have_ranges():
    live = elocute.stream()
    live.flush()
    with pytest.raises(InputError, match="new stream"):
        live.push(np.zeros(10, np.float32))
    out_of_range: list[dict[str, Any]] = [
        {"fps": 0.5},
        {"fps": 1000},
        {"strength": 3},
        {"rate": 3},
        {"channels": 0},
        {"channels": 1.5},
        {"model": "nobody"},
        {"life": -1},
        {"mood": "happy:2"},
    ]
    for wrong in out_of_range:
        with pytest.raises(InputError):
            elocute.stream(**wrong)
    with pytest.raises(InputError, match="no styles"):
        elocute.stream(model="crnn", style="broad")


@pytest.mark.parametrize("name", MODELS)
def test_memory_stays_bounded(speech, name):
    """What a stream holds after 24 seconds is what it holds after ten."""
    live = CurveStream(open_model(name), 16000, fps=30.0)
    block = speech.resample(16000).samples[:16000]
    tracemalloc.start()
    try:
        held = []
        for second in range(24):
            live.push(block)
            if second in (9, 23):
                held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert held[1] - held[0] < 300_000


def test_a_long_sound_is_made_into_features_piece_by_piece():
    """Features take far more memory than the sound they are of."""
    sound = Waveform(np.arange(700 * 4000, dtype=np.float32) / 3e6, 4000)
    blocks = [block for block, _ in blocks_of(sound).blocks]
    assert [len(block) for block in blocks] == [1_200_000, 1_200_000, 400_000]
    assert np.array_equal(np.concatenate(blocks), sound.samples)
    assert [share for _, share in blocks_of(sound).blocks][-1] == 1.0


def test_threads_that_push_at_once_lose_no_sound():
    """Of silence, in which the order of blocks makes no difference: every frame comes once."""
    opened, block, times = (
        elocute.stream(16_000, "articulation", fps=50),
        np.zeros(800, np.float32),
        [],
    )

    def push() -> None:
        for _ in range(10):
            times.extend(frame.time_s for frame in opened.push(block))

    threads = [threading.Thread(target=push) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    times.extend(frame.time_s for frame in opened.flush())
    assert sorted(times) == pytest.approx(np.arange(100) / 50)


def opening_mm(frames: Float32Array, names: tuple[str, ...]) -> Float32Array:
    motion = motion_from_curves(load_builtin_head(), Curves(frames, names, 60.0))
    return measure_mouth(motion)["opening_mm"]


@pytest.fixture(scope="module")
def soon(speech: Waveform) -> list[Frame]:
    """Frames that did not wait, of sound in blocks of 20 ms."""
    stream = elocute.stream(48000, lookahead=SOON_S)
    frames = []
    for at in range(0, len(speech.samples), 960):
        for frame in stream.push(speech.samples[at : at + 960]):
            assert (at + 960) / 48000 - frame.time_s <= SOON_S
            frames.append(frame)
    return [*frames, *stream.flush()]


def test_frames_that_do_not_wait_open_and_shut_the_mouth_as_exact_ones(speech, soon):
    exact = elocute.animate(speech, life=0).curves
    names = soon[0].names
    ours = opening_mm(np.stack([frame.values for frame in soon]), names)
    theirs = opening_mm(exact.values, exact.names)
    assert len(ours) == len(theirs)
    assert np.corrcoef(ours, theirs)[0, 1] > 0.9
    shut = np.flatnonzero(np.diff(theirs < 0.1, prepend=False, append=False)).reshape(-1, 2)
    seals = [(start, stop) for start, stop in shut if start and stop - start <= 12]  # no rests
    assert len(seals) >= 3
    assert all(ours[start - 2 : stop + 2].min() < 0.2 for start, stop in seals)


@pytest.mark.parametrize("lookahead", [SOON_S, 0.45])
def test_frames_that_do_not_wait_are_the_same_however_sound_is_cut(speech, lookahead):
    def given(*cuts: int) -> list[Frame]:
        stream = elocute.stream(48000, lookahead=lookahead)
        parts = np.split(speech.samples[: 3 * 48000], cuts)
        return [frame for part in parts for frame in stream.push(part)] + [*stream.flush()]

    frames, soon = given(70_001), given(*range(960, 3 * 48000, 960))
    assert len(frames) == len(soon) == 180
    for one, other in zip(frames, soon, strict=True):
        np.testing.assert_allclose(one.values, other.values, atol=NEAR)
        np.testing.assert_allclose(one.rotations, other.rotations, atol=NEAR)


@pytest.mark.parametrize(
    ("model", "lookahead", "allowed"),
    [
        ("talkers", 0.1, r"exact, or 0\.21 to 10 s"),
        ("talkers", "soon", r"exact, or 0\.21 to 10 s"),
        ("voca", 0.5, r"exact \(voca"),
    ],
)
def test_a_look_ahead_that_cannot_be_is_refused(model, lookahead, allowed):
    with pytest.raises(InputError, match=f"`lookahead`: .*allowed: {allowed}"):
        elocute.stream(16000, model, lookahead=lookahead)


def test_phones_that_an_engine_tells_move_the_mouth_before_they_are_heard():
    """Events of a speech engine come with its sound, or before it."""
    live = elocute.stream(24000, lookahead=SOON_S, life=0)
    frames = [*live.idle(1.0)]
    phones = [(0.0, 0.1, "M"), (0.1, 0.3, "AA"), (0.3, 0.42, "B"), (0.42, 0.7, "AA")]
    live.expect(phones)
    for _ in range(75):
        frames += live.idle(0.02)
    opening = opening_mm(np.stack([frame.values for frame in frames]), frames[0].names)
    times = np.array([frame.time_s for frame in frames]) - 1.0
    for start_s, end_s, phone in phones:
        inside = opening[(times >= start_s + 0.03) & (times < end_s - 0.05)]
        assert inside.max() < 0.1 if phone in "MB" else inside.max() > 8
    assert opening[times < -0.1].max() < 0.1
    assert opening[times > 1.1].max() < 0.3
    assert np.abs(np.diff(opening)).max() < 9  # no jump at the end of what was told


def test_a_model_without_phones_expects_none():
    with pytest.raises(InputError, match="takes crnn alone"):
        elocute.stream(model="crnn", contacts="off").expect([(0.0, 0.1, "M")])
    with pytest.raises(InputError, match="up to 600 s"):
        elocute.stream().expect([(0.0, 1e9, "M")])
