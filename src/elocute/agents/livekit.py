"""A generator for LiveKit's avatar runner: speech goes through it, curves by the data channel."""

# pyright: reportMissingImports=false

from __future__ import annotations

import json
from collections.abc import AsyncIterator
from typing import Unpack

from elocute.agents.paced_face import BLOCK_S, MESSAGE, PacedFace
from elocute.errors import needs_extra
from elocute.models.take_settings import StreamOptions

with needs_extra("a face in LiveKit", "livekit"):
    from livekit import rtc
    from livekit.agents.voice.avatar import AudioSegmentEnd, VideoGenerator


class FaceGenerator(VideoGenerator):
    """Gives an agent of LiveKit a face that pages draw.

    Where others send pictures, this sends curves: one packet a frame by the room's data channel,
    under the topic "elocute-face", not repeated where it is lost. It is the JSON `{"type":
    "elocute-face", "version": 1, "frame": 12, "time_s": 0.4, "head_deg": {…}, "curves": {…}}`. The
    voice is held back by the look-ahead, so that a frame and its sound leave together. The face
    also moves while nobody speaks. It never gives a picture.

    Parameters
    ----------
    room : rtc.Room
        Whose participants get the curves.
    fps : float
        Frames per second.
    lookahead : float
        How long the voice is held back, s, as `elocute.stream` takes it.
    shapes : str
        Whose names curves have: "arkit", "vrm" for the expressions of VRM 1.0, or "elocute".
    **settings
        Style, strength, life, mood, identity and seed, as `elocute.stream` takes them.

    Raises
    ------
    InputError
        For settings out of range.

    Examples
    --------
    ::

        output = QueueAudioOutput(sample_rate=24000)
        sizes = AvatarOptions(64, 64, video_fps=30, audio_sample_rate=24000, audio_channels=1)
        face = FaceGenerator(room)
        await AvatarRunner(room, audio_recv=output, video_gen=face, options=sizes).start()
        session.output.audio = output
    """

    def __init__(
        self,
        room: rtc.Room,
        *,
        fps: float = 30.0,
        lookahead: float = 0.25,
        shapes: str = "arkit",
        **settings: Unpack[StreamOptions],
    ) -> None:
        self._room = room
        self._face: PacedFace[rtc.AudioFrame | AudioSegmentEnd] = PacedFace(
            fps=fps, lookahead=lookahead, shapes=shapes, **settings
        )
        self.lost = 0
        """How many frames of the face could not be sent."""

    async def push_audio(self, frame: rtc.AudioFrame | AudioSegmentEnd) -> None:
        """Take speech, and the end of what is said."""
        if isinstance(frame, AudioSegmentEnd):
            self._face.end()
            self._face.follow(frame)
            return
        # In short pieces: the runner waits while one is heard, and the face would wait with it.
        rate, channels = frame.sample_rate, frame.num_channels
        data, size = bytes(frame.data), round(rate * BLOCK_S) * channels * 2
        for piece in (data[at : at + size] for at in range(0, len(data), size)):
            part = rtc.AudioFrame(piece, rate, channels, len(piece) // (2 * channels))
            self._face.say(piece, rate, channels, part)

    def clear_buffer(self) -> None:
        """Fall silent at once."""
        self._face.interrupt()

    def __aiter__(self) -> AsyncIterator[rtc.AudioFrame | AudioSegmentEnd]:
        return self._parts()

    async def _parts(self) -> AsyncIterator[rtc.AudioFrame | AudioSegmentEnd]:
        async for moment in self._face.moments():
            if moment.message:
                await self._send(json.dumps(moment.message, separators=(",", ":")))
            for item in moment.items:
                yield item

    async def _send(self, message: str) -> None:
        if not self._room.isconnected():
            self.lost += 1
            return
        try:
            await self._room.local_participant.publish_data(message, reliable=False, topic=MESSAGE)
        except rtc.participant.PublishDataError:
            self.lost += 1
