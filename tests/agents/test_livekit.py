"""LiveKit's own avatar runner, output and audio source, with a face between.

Its server is a program that is not had here: a room that keeps what is published stands for it.
"""

# pyright: reportMissingImports=false

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import elocute

pytest.importorskip(
    "livekit", reason="livekit-agents is missing: `scripts/matrix.py agents` has it"
)

from livekit import rtc
from livekit.agents.voice.avatar import (
    AudioSegmentEnd,
    AvatarOptions,
    AvatarRunner,
    QueueAudioOutput,
)
from livekit.rtc.participant import PublishDataError

from elocute.agents import FaceGenerator

RATE = 24000
PACKET_MAX = 1300
"""Bytes of a packet that LiveKit passes on undivided."""


class Room(rtc.EventEmitter[str]):
    """A room that is connected, and what was published in it."""

    def __init__(self) -> None:
        super().__init__()
        self.packets: list[tuple[bytes, bool, str]] = []
        self.tracks: list[str] = []
        self.is_full = False
        self.local_participant = self

    def isconnected(self) -> bool:
        return True

    async def publish_data(self, payload: str, *, reliable: bool, topic: str) -> None:
        if self.is_full:
            raise PublishDataError("full")
        self.packets.append((payload.encode(), reliable, topic))

    async def publish_track(self, track: rtc.LocalAudioTrack, options: Any) -> Room:
        self.tracks.append(track.name)
        return self

    async def wait_for_subscription(self) -> None:
        pass


@pytest.fixture(scope="module")
def voice(speech_wav: Path) -> rtc.AudioFrame:
    """A second and a half of speech that came at once."""
    samples = elocute.read_audio(speech_wav, sample_rate=RATE).samples[: RATE * 3 // 2]
    return rtc.AudioFrame((samples * 32767).astype(np.int16).tobytes(), RATE, 1, len(samples))


async def speak(room: Room, voice: rtc.AudioFrame, interrupt_s: float | None = None) -> list[Any]:
    """What LiveKit's own output says about a voice that was played through a runner."""
    output = QueueAudioOutput(sample_rate=RATE)
    options = AvatarOptions(64, 64, video_fps=30, audio_sample_rate=RATE, audio_channels=1)
    face = FaceGenerator(room)  # type: ignore[arg-type]
    runner = AvatarRunner(room, audio_recv=output, video_gen=face, options=options)  # type: ignore[arg-type]
    finished: list[Any] = []
    over = asyncio.Event()
    output.on("playback_finished", lambda event: (finished.append(event), over.set()))
    await runner.start()
    await output.capture_frame(voice)
    output.flush()
    if interrupt_s is not None:
        await asyncio.sleep(interrupt_s)
        output.clear_buffer()
    await asyncio.wait_for(over.wait(), 60)
    await runner.aclose()
    return finished


@pytest.fixture(scope="module")
def spoken(voice: rtc.AudioFrame) -> tuple[Room, list[Any]]:
    room = Room()
    return room, asyncio.run(speak(room, voice))


def test_the_voice_is_played_to_its_end(spoken: tuple[Room, list[Any]]) -> None:
    room, (finished,) = spoken
    assert finished.playback_position == pytest.approx(1.5) and not finished.interrupted
    assert "avatar_audio" in room.tracks


def test_curves_go_by_the_data_channel(
    spoken: tuple[Room, list[Any]], voice: rtc.AudioFrame
) -> None:
    packets = spoken[0].packets
    assert {(reliable, topic) for _, reliable, topic in packets} == {(False, "elocute-face")}
    assert max(len(payload) for payload, _, _ in packets) <= PACKET_MAX
    messages = [json.loads(payload) for payload, _, _ in packets]
    assert [message["frame"] for message in messages] == list(range(len(messages)))
    jaws = [message["curves"].get("jawOpen", 0.0) for message in messages]
    stream = elocute.stream(RATE, fps=30, lookahead=0.25)
    wanted = [frame["jawOpen"] for frame in stream.push(np.frombuffer(voice.data, np.int16))]
    close = [
        np.corrcoef(jaws[late:][:count], wanted[:count])[0, 1]
        for late in range(15)
        if (count := min(len(jaws) - late, len(wanted))) > 15
    ]
    assert max(jaws) > 0.15 and max(close) > 0.95


def test_an_interruption_ends_the_voice(voice: rtc.AudioFrame) -> None:
    (finished,) = asyncio.run(speak(Room(), voice, interrupt_s=0.9))
    assert finished.interrupted and finished.playback_position < 1.4


def test_frames_that_cannot_be_sent_are_counted(voice: rtc.AudioFrame) -> None:
    async def generate() -> FaceGenerator:
        room = Room()
        room.is_full = True
        face = FaceGenerator(room)  # type: ignore[arg-type]
        await face.push_audio(voice)
        await face.push_audio(AudioSegmentEnd())
        async for part in face:
            if isinstance(part, AudioSegmentEnd):
                break
        return face

    assert asyncio.run(generate()).lost > 30


def test_settings_are_checked() -> None:
    with pytest.raises(elocute.InputError, match="mood"):
        FaceGenerator(Room(), mood="bored")  # type: ignore[arg-type]
