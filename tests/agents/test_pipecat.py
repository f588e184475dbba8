"""A real pipeline of Pipecat: real speech goes through it, and a face comes out beside."""

# pyright: reportMissingImports=false

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import elocute

pytest.importorskip("pipecat", reason="pipecat-ai is missing: `scripts/matrix.py agents` has it")

from pipecat.frames.frames import (
    Frame,
    InputAudioRawFrame,
    InterruptionFrame,
    OutputTransportMessageUrgentFrame,
    TTSAudioRawFrame,
    TTSStartedFrame,
    TTSStoppedFrame,
    TTSTextFrame,
)
from pipecat.processors.frameworks.rtvi import RTVIServerMessageFrame
from pipecat.tests.utils import run_test

from elocute.agents import FaceProcessor

RATE = 24000


@pytest.fixture(scope="module")
def voice(speech_wav: Path) -> list[TTSAudioRawFrame]:
    """A second and a half of speech in frames of 0.2 s, as voices give them: all at once."""
    samples = elocute.read_audio(speech_wav, sample_rate=RATE).samples[: RATE * 3 // 2]
    pcm = (samples * 32767).astype(np.int16).tobytes()
    return [TTSAudioRawFrame(pcm[at : at + 9600], RATE, 1) for at in range(0, len(pcm), 9600)]


def run(frames: Sequence[Frame], processor: FaceProcessor, **options: bool) -> list[Frame]:
    return list(asyncio.run(run_test(processor, frames_to_send=frames, **options))[0])


@pytest.fixture(scope="module")
def pushed() -> list[Frame]:
    """What the processor of `spoken` gave on, in that order; in queues messages overtake sound."""
    return []


@pytest.fixture(scope="module")
def spoken(pushed: list[Frame], voice: list[TTSAudioRawFrame]) -> list[Frame]:
    word = TTSTextFrame("one", text_type="word")
    word.pts = 10**9
    face = FaceProcessor()
    face.add_event_handler("on_after_push_frame", lambda _, frame: pushed.append(frame))
    return run([TTSStartedFrame(), *voice, word, TTSStoppedFrame()], face)


def messages(frames: Sequence[Frame]) -> list[dict]:
    return [frame.data for frame in frames if isinstance(frame, RTVIServerMessageFrame)]


def test_the_voice_goes_through_as_it_came(spoken: list[Frame], voice: list) -> None:
    rest = [frame for frame in spoken if not isinstance(frame, RTVIServerMessageFrame)]
    heard = [frame for frame in rest if isinstance(frame, TTSAudioRawFrame)]
    assert b"".join(frame.audio for frame in heard) == b"".join(frame.audio for frame in voice)
    names = [type(frame).__name__ for frame in rest if frame not in heard]
    assert names == ["TTSStartedFrame", "TTSTextFrame", "TTSStoppedFrame"]
    assert isinstance(rest[0], TTSStartedFrame) and rest[-3] is heard[-1]
    assert rest[-2].pts == 1_250_000_000  # a word is shown with its sound


@pytest.mark.usefixtures("spoken")
def test_each_piece_of_the_voice_leaves_with_its_face(pushed: list[Frame]) -> None:
    times, leaves_s = [0.0], []
    for frame in pushed:
        if isinstance(frame, RTVIServerMessageFrame):
            times.append(frame.data["time_s"])
        elif isinstance(frame, TTSAudioRawFrame):
            leaves_s.append(times[-1])
    for number, at_s in enumerate(leaves_s[1:], 1):
        assert -0.14 <= at_s - leaves_s[0] - number * 0.2 <= 0.04
    assert np.allclose(np.diff(times[1:]), 1 / 30, atol=2e-4)


def test_curves_are_those_of_the_voice(spoken: list[Frame], voice: list) -> None:
    sound = np.frombuffer(b"".join(frame.audio for frame in voice), np.int16)
    wanted = [
        frame["jawOpen"] for frame in elocute.stream(RATE, fps=30, lookahead=0.25).push(sound)
    ]
    jaws = [message["curves"].get("jawOpen", 0.0) for message in messages(spoken)]
    assert messages(spoken)[0]["type"] == "elocute-face"
    # A few frames of silence went before the voice; how many is the machine's business.
    close = [
        np.corrcoef(jaws[late:][:count], wanted[:count])[0, 1]
        for late in range(15)
        if (count := min(len(jaws) - late, len(wanted))) > 15
    ]
    assert max(jaws) > 0.15 and max(close) > 0.95


def test_an_interruption_ends_voice_and_words(voice: list[TTSAudioRawFrame]) -> None:
    face, pushed = FaceProcessor(), []

    async def interrupt(processor: FaceProcessor, frame: Frame) -> None:
        pushed.append(frame)
        if isinstance(frame, TTSAudioRawFrame):
            await processor.queue_frame(InterruptionFrame())

    face.add_event_handler("on_after_push_frame", interrupt)
    run([TTSStartedFrame(), *voice, TTSStoppedFrame()], face)
    at = next(n for n, frame in enumerate(pushed) if isinstance(frame, InterruptionFrame))
    heard = [frame for frame in pushed if isinstance(frame, TTSAudioRawFrame)]
    assert 0 < len(heard) < len(voice)
    behind = {type(frame).__name__ for frame in pushed[at:]}
    assert behind <= {"InterruptionFrame", "RTVIServerMessageFrame", "EndFrame"}


def test_the_user_s_voice_is_heard_and_goes_on(voice: list[TTSAudioRawFrame]) -> None:
    user = [InputAudioRawFrame(frame.audio, RATE, 1) for frame in voice]
    seen = run([*user, voice[0]], FaceProcessor())
    assert [frame for frame in seen if isinstance(frame, InputAudioRawFrame)] == user
    assert max(message["curves"].get("jawOpen", 0.0) for message in messages(seen)) < 0.1


def test_a_page_gets_server_messages(voice: list[TTSAudioRawFrame]) -> None:
    seen = run(voice[:3], FaceProcessor(life=0.5, mood="happy"), enable_rtvi=True)
    told = [
        frame.message
        for frame in seen
        if isinstance(frame, OutputTransportMessageUrgentFrame)
        and frame.message["type"] == "server-message"
    ]
    assert len(told) > 10 and told[0]["data"]["type"] == "elocute-face"
    assert told[0]["data"]["curves"]


def test_settings_are_checked() -> None:
    with pytest.raises(elocute.InputError, match="lookahead"):
        FaceProcessor(lookahead=0.01)
