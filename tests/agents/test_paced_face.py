"""A face at the pace of a clock: nothing of a voice is lost, and it leaves with its own frame."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

import elocute
from elocute.agents.paced_face import SLACK_S, Moment, PacedFace
from elocute.errors import AudioError, InputError
from elocute.motion.curves import ARKIT_NAMES

FPS = 30
RATE = 16000
PIECE = RATE // 20


class Clock:
    """A clock that goes on by 20 ms whenever it is asked."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        self.now_s += 0.02
        return self.now_s


def pieces(speech_wav: Path, seconds: float = 1.0) -> list[bytes]:
    """Speech in pieces of 50 ms."""
    samples = elocute.read_audio(speech_wav, sample_rate=RATE).samples[: round(seconds * RATE)]
    pcm = (samples * 32767).astype(np.int16)
    return [pcm[at : at + PIECE].tobytes() for at in range(0, len(pcm), PIECE)]


def parts_of(moment: Moment[int]) -> list[dict | int]:
    return [*filter(None, [moment.message]), *moment.items]


def until(face: PacedFace[int], seconds: float, act: dict[int, object] | None = None) -> list:
    """All that is due up to a time of the face, as (item or message) in order.

    `act` has what is done once a moment of that number was seen.
    """
    seen: list = []

    async def watch() -> None:
        number = 0
        async for moment in face.moments():
            seen.extend(parts_of(moment))
            if act and number in act:
                act.pop(number)()  # type: ignore[operator]
            number += 1
            if moment.message and moment.message["time_s"] >= seconds:
                return

    asyncio.run(watch())
    return seen


def shown_before(seen: list, item: int) -> float:
    """The time of the last frame that came before an item."""
    return [each["time_s"] for each in seen[: seen.index(item)] if isinstance(each, dict)][-1]


def say_all(face: PacedFace[int], parts: Iterable[bytes], first: int = 0) -> None:
    for number, part in enumerate(parts, first):
        face.say(part, RATE, 1, number)


@pytest.fixture(scope="module")
def second(speech_wav: Path) -> list:
    """What is due while a second of speech is said that came at once, and what follows it."""
    face: PacedFace[int] = PacedFace(fps=FPS, clock=Clock())
    say_all(face, pieces(speech_wav))
    face.end()
    face.follow(99)
    seen = until(face, 1.2)
    assert face.is_idle
    return seen


def test_speech_leaves_with_the_frame_at_its_first_sample(second: list) -> None:
    assert [each for each in second if isinstance(each, int)] == [*range(20), 99]
    assert shown_before(second, 0) == 0
    for number in range(4, 20):  # later pieces a little before, so that a late one leaves no gap
        ahead_s = number * 0.05 - shown_before(second, number)
        assert -1 / FPS <= ahead_s <= SLACK_S + 0.001
    assert shown_before(second, 99) == pytest.approx(1 - SLACK_S, abs=0.07)


def test_frames_are_those_of_the_same_sound_in_a_stream(second: list, speech_wav: Path) -> None:
    messages = [each for each in second if isinstance(each, dict)]
    stream = elocute.stream(RATE, fps=FPS, lookahead=0.25)
    sound = np.frombuffer(b"".join(pieces(speech_wav)), np.int16)
    frames = [*stream.push(sound), *stream.push(np.zeros(RATE, np.int16))]
    assert max(message["curves"].get("jawOpen", 0) for message in messages) > 0.1
    for message, frame in zip(messages, frames, strict=False):
        assert message["type"] == "elocute-face" and message["time_s"] == round(frame.time_s, 4)
        assert message["curves"].get("jawOpen", 0) == pytest.approx(frame["jawOpen"], abs=1e-4)


def test_the_face_lives_while_nobody_speaks() -> None:
    face: PacedFace[int] = PacedFace(fps=FPS, clock=Clock())
    messages = until(face, 1.0)
    numbers = [message["frame"] for message in messages]
    assert numbers == list(range(len(numbers))) and len(numbers) >= 30
    turns = {tuple(message["head_deg"].values()) for message in messages}
    assert len(turns) > 5  # it moves


def test_the_face_listens_to_a_partner(speech_wav: Path) -> None:
    clock = Clock()
    face: PacedFace[int] = PacedFace(fps=FPS, clock=clock)
    said, seen = pieces(speech_wav, 4.5)[60:], []

    async def listen() -> None:
        given = 0
        async for moment in face.moments():
            seen.extend(parts_of(moment))
            while given < len(said) and clock.now_s >= given * 0.05:
                face.hear(said[given], RATE, 1)
                given += 1
            if len(seen) >= 60:
                return

    asyncio.run(listen())
    alone: PacedFace[int] = PacedFace(fps=FPS, clock=Clock())
    listening, resting = (
        np.array([[each["curves"].get(name, 0) for name in ARKIT_NAMES] for each in told[:60]])
        for told in (seen, until(alone, 2.0))
    )
    assert max(each["curves"].get("jawOpen", 0) for each in seen) < 0.08  # its lips rest
    # Lids, brows and gaze answer to the other.
    assert np.abs(listening - resting).max() > 0.1


def test_speech_after_a_pause_is_heard_with_its_face(speech_wav: Path) -> None:
    face: PacedFace[int] = PacedFace(fps=FPS, clock=Clock())
    parts = pieces(speech_wav, 0.2)
    say_all(face, parts)
    seen = until(face, 1.0)
    say_all(face, parts, 10)
    begun_s = max(each["time_s"] for each in seen if isinstance(each, dict))
    seen += until(face, 2.0)
    assert [each for each in seen if isinstance(each, int)] == [0, 1, 2, 3, 10, 11, 12, 13]
    assert 0.15 < shown_before(seen, 10) - begun_s < 0.4  # the look-ahead later, not at once


def test_speech_that_comes_as_slowly_as_it_is_heard_has_no_gaps(speech_wav: Path) -> None:
    clock = Clock()
    face: PacedFace[int] = PacedFace(fps=FPS, clock=clock)
    parts = pieces(speech_wav)
    seen: list = []

    async def talk() -> None:
        given = 0
        async for moment in face.moments():
            seen.extend(parts_of(moment))
            while given < len(parts) and clock.now_s >= given * 0.05 + 0.04 * (given % 2):
                face.say(parts[given], RATE, 1, given)  # every second one late
                given += 1
            if given == len(parts) and face.is_idle:
                return

    asyncio.run(talk())
    begun_s = shown_before(seen, 0)
    for number in range(4, 20):
        assert shown_before(seen, number) - begun_s <= number * 0.05 + 1 / FPS


def test_an_interruption_gives_back_what_was_not_heard(speech_wav: Path) -> None:
    face: PacedFace[int] = PacedFace(fps=FPS, clock=Clock())
    say_all(face, pieces(speech_wav, 2.0))
    given_back: list[int] = []
    seen = until(face, 0.8, {15: lambda: given_back.extend(face.interrupt())})
    heard = [each for each in seen if isinstance(each, int)]
    assert 0 < len(heard) < 38 and heard + given_back == list(range(40))
    assert face.is_idle


def test_an_interruption_shuts_the_mouth_at_once(speech_wav: Path) -> None:
    face: PacedFace[int] = PacedFace(fps=FPS, clock=Clock())
    say_all(face, pieces(speech_wav, 2.0))
    jaws: list[float] = []
    behind = 0

    async def talk() -> None:
        nonlocal behind
        async for moment in face.moments():
            if not moment.message:
                continue
            jaws.append(moment.message["curves"].get("jawOpen", 0.0))
            behind += bool(behind)
            if not behind and jaws[-1] > 0.15 and len(jaws) > 2:
                face.interrupt()
                behind = 1
            if behind > 12:
                return

    asyncio.run(talk())
    open_jaw, *after = jaws[-behind:]
    # Frames that are under way are shown; then it shuts within 0.12 s, without a jump.
    assert np.abs(np.diff([open_jaw, *after])).max() < 0.15
    assert max(after[8:]) < 0.08 < open_jaw


def test_a_stall_delays_and_drops_nothing(speech_wav: Path) -> None:
    clock = Clock()
    face: PacedFace[int] = PacedFace(fps=FPS, clock=clock)
    say_all(face, pieces(speech_wav))

    def stall() -> None:
        clock.now_s += 5

    seen = until(face, 1.2, {12: stall})
    assert [each for each in seen if isinstance(each, int)] == list(range(20))
    numbers = [each["frame"] for each in seen if isinstance(each, dict)]
    assert numbers == list(range(len(numbers)))


def test_stereo_of_another_rate_is_heard(second: list, speech_wav: Path) -> None:
    samples = elocute.read_audio(speech_wav, sample_rate=24000).samples[:24000]
    both = np.repeat((samples * 32767).astype(np.int16)[:, None], 2, axis=1)
    face: PacedFace[int] = PacedFace(fps=FPS, clock=Clock())
    face.say(both.tobytes() + b"\0", 24000, 2, 0)  # and half a sample
    told = until(face, 0.8)
    jaws = [
        [each["curves"].get("jawOpen", 0) for each in seen if isinstance(each, dict)][:24]
        for seen in (told, second)
    ]
    assert np.corrcoef(jaws)[0, 1] > 0.98


def test_settings_and_sound_that_cannot_be_are_refused() -> None:
    with pytest.raises(InputError, match="lookahead"):
        PacedFace(lookahead=0.01)
    face: PacedFace[int] = PacedFace()
    with pytest.raises(AudioError, match="sample rate 100 Hz"):
        face.say(b"", 100, 1, 0)
    with pytest.raises(AudioError, match="0 channels"):
        face.hear(b"", RATE, 0)
