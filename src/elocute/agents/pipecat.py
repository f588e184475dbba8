"""A processor for Pipecat: speech goes through it, and curves come out beside.

It stands between the voice and the transport's output. Curves are sent as RTVI server messages,
which arrive in a page as `onServerMessage`.
"""

# pyright: reportMissingImports=false

from __future__ import annotations

import asyncio
from typing import Any, Unpack

from elocute.agents.paced_face import BLOCK_S, PacedFace
from elocute.errors import needs_extra
from elocute.models.take_settings import StreamOptions

with needs_extra("a face in Pipecat", "pipecat"):
    from pipecat.frames.frames import (
        CancelFrame,
        EndFrame,
        Frame,
        InputAudioRawFrame,
        InterruptionFrame,
        StartFrame,
        SystemFrame,
        TTSAudioRawFrame,
        TTSStoppedFrame,
    )
    from pipecat.processors.frame_processor import FrameDirection, FrameProcessor
    from pipecat.processors.frameworks.rtvi import RTVIServerMessageFrame


class FaceProcessor(FrameProcessor):
    """Gives an agent of Pipecat a face.

    Each frame of the face is an `RTVIServerMessageFrame` whose data is `{"type": "elocute-face",
    "version": 1, "frame": 12, "time_s": 0.4, "head_deg": {…}, "curves": {"jawOpen": 0.2, …}}`. The
    voice is held back by the look-ahead, so that a frame and its sound leave together; all else
    that follows the voice keeps its place behind it. The face also moves while nobody speaks,
    and listens to what comes in. An interruption ends speech and mouth at once.

    Parameters
    ----------
    fps : float
        Frames per second.
    lookahead : float
        How long the voice is held back, s, as `elocute.stream` takes it.
    shapes : str
        Whose names curves have: "arkit", "vrm" for the expressions of VRM 1.0, or "elocute".
    name : str, optional
        Of the processor.
    **settings
        Style, strength, life, mood, identity and seed, as `elocute.stream` takes them.

    Raises
    ------
    InputError
        For settings out of range.

    Examples
    --------
    ::

        pipeline = Pipeline([..., tts, FaceProcessor(mood="happy"), transport.output()])
    """

    def __init__(
        self,
        *,
        fps: float = 30.0,
        lookahead: float = 0.25,
        shapes: str = "arkit",
        name: str | None = None,
        **settings: Unpack[StreamOptions],
    ) -> None:
        super().__init__(name=name)
        self._face: PacedFace[Frame] = PacedFace(
            fps=fps, lookahead=lookahead, shapes=shapes, **settings
        )
        self._moving: Any = None

    async def cleanup(self) -> None:
        """Let the face rest, at the end of the pipeline."""
        await self._stop()
        await super().cleanup()

    async def process_frame(self, frame: Frame, direction: FrameDirection) -> None:
        """Take a frame of the pipeline; speech and what follows it is passed on when it is due."""
        await super().process_frame(frame, direction)
        if isinstance(frame, TTSAudioRawFrame) and direction is FrameDirection.DOWNSTREAM:
            self._face.say(frame.audio, frame.sample_rate, frame.num_channels, frame)
            return
        await self._heed(frame)
        if not self._passes(frame, direction):
            if frame.pts is not None:  # words are shown when they are heard
                frame.pts += round(self._face.lookahead_s * 1e9)
            self._face.follow(frame)
            return
        await self.push_frame(frame, direction)
        if isinstance(frame, StartFrame):
            self._moving = self.create_task(self._move())

    async def _heed(self, frame: Frame) -> None:
        """What a frame that is no speech means for the face."""
        if isinstance(frame, InputAudioRawFrame):
            self._face.hear(frame.audio, frame.sample_rate, frame.num_channels)
        elif isinstance(frame, InterruptionFrame):
            await self._interrupt()
        elif isinstance(frame, CancelFrame):
            await self._stop()
        elif isinstance(frame, EndFrame):
            while self._moving and not self._face.is_idle:
                await asyncio.sleep(BLOCK_S)
            await self._stop()
        elif isinstance(frame, TTSStoppedFrame):
            self._face.end()

    def _passes(self, frame: Frame, direction: FrameDirection) -> bool:
        """Whether nothing that is held has to go before it."""
        upstream = direction is FrameDirection.UPSTREAM
        return upstream or isinstance(frame, SystemFrame | EndFrame) or self._face.is_idle

    async def _move(self) -> None:
        async for moment in self._face.moments():
            if moment.message:
                await self.push_frame(RTVIServerMessageFrame(data=moment.message))
            for frame in moment.items:
                await self.push_frame(frame)

    async def _interrupt(self) -> None:
        """Drop what is held, but what no interruption may drop."""
        for frame in self._face.interrupt():
            if not frame.interruptible:
                await self.push_frame(frame)

    async def _stop(self) -> None:
        if self._moving:
            await self.cancel_task(self._moving)
            self._moving = None
