"""Audio2Face-3D's gRPC service, for programs that were made for NVIDIA's.

A client sends a header, pieces of sound and an end; it gets the names of ARKit's shapes in
PascalCase, their weights frame by frame with the sound of each, an event, and a status. Messages
are those of the packages `nvidia-ace` and `nvidia-audio2face-3d`.
"""

from __future__ import annotations

import asyncio
import hmac
import math
import os
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.waveform import check_rate
from elocute.errors import AudioError, ElocuteError, InputError, OutputError, needs_extra
from elocute.export.arkit_csv import COLUMNS
from elocute.live.live_frame import LiveFrame
from elocute.live.sound_of_frames import SoundOfFrames
from elocute.models.streaming import Frame, Stream

os.environ.setdefault("GRPC_VERBOSITY", "NONE")  # its core would print what is told by an error
with needs_extra("the service of Audio2Face-3D", "a2f"):
    import grpc
    import grpc.aio
    from google.protobuf.message import DecodeError
    from nvidia_ace.animation_pb2 import (
        AnimationData,
        AudioWithTimeCode,
        FloatArrayWithTimeCode,
        SkelAnimation,
        SkelAnimationHeader,
    )
    from nvidia_ace.audio_pb2 import AudioHeader
    from nvidia_ace.status_pb2 import Status
    from nvidia_audio2face_3d.messages_pb2 import (
        END_OF_A2F_AUDIO_PROCESSING,
        A2F3DAnimationDataStream,
        A2F3DAnimationDataStreamHeader,
        AudioWithEmotionStream,
        AudioWithEmotionStreamHeader,
        Event,
    )

PORT = 52000
SERVICE, METHOD = "nvidia_ace.services.a2f_controller.v1.A2FControllerService", "ProcessAudioStream"
HEALTH = "grpc.health.v1.Health"
"""By which clients and balancers ask whether a service is up."""
NAMES = tuple(name[0].upper() + name[1:] for name in COLUMNS)
MESSAGE_MAX = 16 << 20
STREAMS_MAX = 16
SOUND_MAX_S = 3600.0
IDLE_S = 60.0
"""A client that sends nothing, or takes nothing, for longer is sent away."""
PIECE_S = 0.2
"""Sound is animated in pieces, so that the first frames of a long message do not wait for its
last."""

StreamOpener = Callable[[int], Stream]
"""What opens a stream of `elocute.stream` for sound of a rate."""


@dataclass(frozen=True)
class _Shaping:
    """What a client asks for beyond the face: factors and offsets (shape,), and whether to clip."""

    factors: Float32Array
    offsets: Float32Array
    clips: bool
    left_out: list[str] = field(default_factory=list)

    def weights(self, frame: LiveFrame) -> Float32Array:
        """(shape,) weights in the order of `NAMES`."""
        values = np.fromiter(frame.arkit.values(), np.float32, len(NAMES))
        values = values * self.factors + self.offsets
        return np.clip(values, 0, 1) if self.clips else values


class A2FService:
    """Answers clients of Audio2Face-3D, each with a stream of its own.

    Parameters
    ----------
    open_stream : callable
        Opens a stream for sound of a rate.
    token : str
        What clients have to send as `authorization: Bearer TOKEN`; "" is nothing.
    idle_s : float
        How long a client may do nothing, s.
    """

    def __init__(
        self, open_stream: StreamOpener, *, token: str = "", idle_s: float = IDLE_S
    ) -> None:
        self._open_stream, self._token, self._idle_s = open_stream, token, idle_s
        self._server: Any = None

    async def start(self, host: str, port: int) -> int:
        """Listen; returns the port, which is a free one for 0. Raises OutputError."""
        self._server = grpc.aio.server(
            options=[
                ("grpc.max_receive_message_length", MESSAGE_MAX),
                ("grpc.so_reuseport", 0),  # else a second service would share the port unseen
            ],
            maximum_concurrent_rpcs=STREAMS_MAX,
        )
        # Messages are decoded here, since what gRPC cannot decode it logs with a traceback.
        handler = grpc.stream_stream_rpc_method_handler(
            self._answer,
            response_serializer=A2F3DAnimationDataStream.SerializeToString,
        )
        health = grpc.unary_unary_rpc_method_handler(_health)
        self._server.add_generic_rpc_handlers(
            [
                grpc.method_handlers_generic_handler(SERVICE, {METHOD: handler}),
                grpc.method_handlers_generic_handler(HEALTH, {"Check": health}),
            ]
        )
        place = f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
        try:
            opened = self._server.add_insecure_port(place)
        except RuntimeError as error:
            raise OutputError.about(
                place, found="a port that cannot be listened on", allowed="a free one"
            ) from error
        await self._server.start()
        return opened

    async def stop(self) -> None:
        """End all streams."""
        await self._server.stop(None)

    async def _answer(self, _: Any, context: Any) -> None:
        try:
            self._check_token(context)
            async for answer in self._answers(self._messages(context)):
                await asyncio.wait_for(context.write(answer), self._idle_s)
        except _NoTokenError as error:
            fault = grpc.StatusCode.UNAUTHENTICATED, str(error)
        except TimeoutError:
            fault = grpc.StatusCode.DEADLINE_EXCEEDED, f"nothing happened for {self._idle_s:g} s"
        except ElocuteError as error:
            fault = grpc.StatusCode.INVALID_ARGUMENT, str(error)
        except MemoryError:
            fault = grpc.StatusCode.RESOURCE_EXHAUSTED, "this machine has no memory left"
        else:
            return
        await context.abort(*fault)

    def _check_token(self, context: Any) -> None:
        """Raise _NoTokenError for a client that does not know it."""
        told = dict(context.invocation_metadata() or ()).get("authorization", "")
        scheme, _, token = str(told).partition(" ")
        same = hmac.compare_digest(token.encode("utf-8", "replace"), self._token.encode())
        if self._token and not (scheme == "Bearer" and same):
            raise _NoTokenError(
                "no token, or another; allowed: `authorization: Bearer TOKEN` in the metadata"
            )

    async def _messages(self, context: Any) -> AsyncIterator[AudioWithEmotionStream]:
        """The client's messages up to its end. Raises InputError for bytes that are none."""
        while True:
            data = await asyncio.wait_for(context.read(), self._idle_s)
            if data is grpc.aio.EOF:  # pyright: ignore[reportAttributeAccessIssue]
                return
            try:
                message = AudioWithEmotionStream.FromString(data)
            except DecodeError as error:
                raise InputError.about(
                    "message", found="bytes that are none", allowed="AudioWithEmotionStream"
                ) from error
            yield message
            if message.HasField("end_of_audio"):
                return

    async def _answers(
        self, messages: AsyncIterator[AudioWithEmotionStream]
    ) -> AsyncIterator[A2F3DAnimationDataStream]:
        """All that is sent for what a client sends. Raises InputError, AudioError."""
        header = await anext(messages, None)
        if header is None or not header.HasField("audio_stream_header"):
            raise _about("first message", header, "audio_stream_header")
        wanted = header.audio_stream_header
        rate, shaping = _rate_of(wanted.audio_header), _shaping_of(wanted)
        stream = await asyncio.to_thread(self._open_stream, rate)
        yield A2F3DAnimationDataStream(
            animation_data_stream_header=A2F3DAnimationDataStreamHeader(
                audio_header=AudioHeader(
                    audio_format=AudioHeader.AUDIO_FORMAT_PCM,
                    channel_count=1,
                    samples_per_second=rate,
                    bits_per_sample=16,
                ),
                skel_animation_header=SkelAnimationHeader(blend_shapes=NAMES),
                start_time_code_since_epoch=time.time(),
            )
        )
        take = _Take(stream, shaping)
        async for message in messages:
            if message.HasField("end_of_audio"):
                break
            if not message.HasField("audio_with_emotion"):
                raise _about("message", message, "audio_with_emotion or end_of_audio")
            if message.audio_with_emotion.emotions and "emotions" not in shaping.left_out:
                shaping.left_out.append("emotions")
            for piece in take.pieces(message.audio_with_emotion.audio_buffer):
                for answer in await asyncio.to_thread(take.push, piece):
                    yield answer
        for answer in await asyncio.to_thread(take.flush):
            yield answer
        yield A2F3DAnimationDataStream(event=Event(event_type=END_OF_A2F_AUDIO_PROCESSING))
        yield A2F3DAnimationDataStream(status=take.status())


@contextmanager
def serving(service: A2FService, host: str, port: int) -> Iterator[int]:
    """The service in a thread of its own, until the block ends; gives the port. Raises OutputError.

    No signal can meet the event loop there, which would lose what a handler raises.
    """
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()
    try:
        yield asyncio.run_coroutine_threadsafe(service.start(host, port), loop).result()
    finally:
        asyncio.run_coroutine_threadsafe(service.stop(), loop).result()
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.close()


async def _health(*_: Any) -> bytes:
    """That it serves, in the two bytes that gRPC's health messages have for it."""
    return b"\x08\x01"


class _NoTokenError(Exception):
    """A client that may not ask."""


class _Take:
    """The sound and the frames of one client."""

    def __init__(self, stream: Stream, shaping: _Shaping) -> None:
        self._stream, self._shaping = stream, shaping
        self._sound = SoundOfFrames(stream.sample_rate, stream.fps)
        self._frames = 0

    def pieces(self, pcm: bytes) -> Iterator[bytes]:
        """Pieces of at most `PIECE_S`. Raises AudioError for too long a sound."""
        rate = self._stream.sample_rate
        size = 2 * round(PIECE_S * rate)
        for at in range(0, len(pcm), size):
            self._sound.add(pcm[at : at + size])
            yield pcm[at : at + size]
            if self._sound.taken > SOUND_MAX_S * rate:
                raise AudioError.about(
                    "sound", found=f"more than {SOUND_MAX_S:g} s", allowed="a stream for a scene"
                )

    def push(self, piece: bytes) -> list[A2F3DAnimationDataStream]:
        """The frames that are certain with another piece."""
        return [self._animation(frame) for frame in self._stream.push(piece)]

    def flush(self) -> list[A2F3DAnimationDataStream]:
        """The remaining frames; the last one has all sound that is left."""
        frames = list(self._stream.flush())
        return [self._animation(frame, is_last=frame is frames[-1]) for frame in frames]

    def status(self) -> Status:
        """How it went, and what was asked for in vain."""
        if not self._frames:
            return Status(code=Status.WARNING, message="no sound came: there is no frame")
        left_out = ", ".join(self._shaping.left_out)
        return Status(code=Status.SUCCESS, message=f"left out: {left_out}" if left_out else "")

    def _animation(self, frame: Frame, *, is_last: bool = False) -> A2F3DAnimationDataStream:
        began_s, sound = self._sound.next_frame(is_last=is_last)
        live = LiveFrame(self._frames, self._stream.fps, frame)
        self._frames += 1
        weights = FloatArrayWithTimeCode(
            time_code=frame.time_s, values=self._shaping.weights(live).tolist()
        )
        return A2F3DAnimationDataStream(
            animation_data=AnimationData(
                skel_animation=SkelAnimation(blend_shape_weights=[weights]),
                audio=AudioWithTimeCode(time_code=began_s, audio_buffer=sound),
            )
        )


def _about(what: str, message: Any, allowed: str) -> InputError:
    found = message.WhichOneof("stream_part") if message is not None else "the end"
    return InputError.about(what, found=found or "an empty message", allowed=allowed)


def _rate_of(header: AudioHeader) -> int:
    """The rate of a client's sound. Raises InputError, AudioError."""
    if header.audio_format != AudioHeader.AUDIO_FORMAT_PCM:
        raise InputError.about("audio_format", found=str(header.audio_format), allowed="PCM")
    for name, allowed in (("channel_count", 1), ("bits_per_sample", 16)):
        if getattr(header, name) != allowed:
            raise InputError.about(
                name, found=str(getattr(header, name)), allowed=f"{allowed}, as in Audio2Face-3D"
            )
    return check_rate("samples_per_second", header.samples_per_second)


def _shaping_of(header: AudioWithEmotionStreamHeader) -> _Shaping:
    """What a client asks for of the shapes, and what has no meaning here. Raises InputError."""
    wanted = header.blendshape_params
    left_out = [
        name
        for name in ("face_params", "emotion_params", "emotion_post_processing_params")
        if header.HasField(name)
    ]
    factors = _by_name(wanted.bs_weight_multipliers, 1.0, left_out)
    offsets = _by_name(wanted.bs_weight_offsets, 0.0, left_out)
    return _Shaping(factors, offsets, wanted.enable_clamping_bs_weight, left_out)


def _by_name(values: Mapping[str, float], usual: float, left_out: list[str]) -> Float32Array:
    """(shape,) numbers for `NAMES`; other names are noted. Raises InputError."""
    for name, value in values.items():
        if not math.isfinite(value):
            raise InputError.about(f"{name[:40]}", found=str(value), allowed="a finite number")
        if name not in NAMES and name[:40] not in left_out and len(left_out) < len(NAMES):
            left_out.append(name[:40])
    return np.array([values.get(name, usual) for name in NAMES], np.float32)
