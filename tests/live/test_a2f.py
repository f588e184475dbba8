"""The service of Audio2Face-3D, asked by NVIDIA's own client."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import elocute
from elocute.export.arkit_csv import COLUMNS
from elocute.live.live_frame import LiveFrame
from tests.support.browser import eventually
from tests.support.commands import run_apart

pytest.importorskip("nvidia_audio2face_3d", reason="nvidia-audio2face-3d is missing")

import grpc
from nvidia_ace.audio_pb2 import AudioHeader
from nvidia_ace.status_pb2 import Status
from nvidia_audio2face_3d.audio2face_pb2_grpc import A2FControllerServiceStub
from nvidia_audio2face_3d.messages_pb2 import (
    AudioWithEmotion,
    AudioWithEmotionStream,
    AudioWithEmotionStreamHeader,
    BlendShapeParameters,
    EmotionWithTimeCode,
    FaceParameters,
)

from elocute.live import a2f
from elocute.live.a2f import METHOD, SERVICE, A2FService, serving

RATE = 16000
PCM: dict[str, Any] = {
    "audio_format": AudioHeader.AUDIO_FORMAT_PCM,
    "channel_count": 1,
    "samples_per_second": RATE,
    "bits_per_sample": 16,
}


def open_stream(rate: int) -> Any:
    return elocute.stream(rate, fps=30, lookahead=0.25)


@contextmanager
def opened(**settings: Any) -> Iterator[grpc.Channel]:
    """A channel to a service in a thread of its own."""
    with (
        serving(A2FService(open_stream, **settings), "127.0.0.1", 0) as port,
        grpc.insecure_channel(f"127.0.0.1:{port}") as channel,
    ):
        yield channel


@pytest.fixture(scope="module")
def channel() -> Iterator[grpc.Channel]:
    with opened() as channel:
        yield channel


@pytest.fixture(scope="module")
def pcm(speech_wav: Path) -> bytes:
    """A second and a half of speech."""
    samples = elocute.read_audio(speech_wav, sample_rate=RATE).samples[: RATE * 3 // 2]
    return (samples * 32767).astype("<i2").tobytes()


def header(**parts: Any) -> AudioWithEmotionStream:
    sound = AudioHeader(**{**PCM, **parts.pop("sound", {})})
    return AudioWithEmotionStream(
        audio_stream_header=AudioWithEmotionStreamHeader(audio_header=sound, **parts)
    )


def sound(data: bytes, **more: Any) -> AudioWithEmotionStream:
    return AudioWithEmotionStream(audio_with_emotion=AudioWithEmotion(audio_buffer=data, **more))


END = AudioWithEmotionStream(end_of_audio=AudioWithEmotionStream.EndOfAudio())


def ask(channel: grpc.Channel, messages: Iterable[AudioWithEmotionStream]) -> list[Any]:
    return list(A2FControllerServiceStub(channel).ProcessAudioStream(iter(messages), timeout=120))


@pytest.fixture(scope="module")
def answers(channel: grpc.Channel, pcm: bytes) -> list[Any]:
    """What comes for speech in pieces that end in the middle of a sample."""
    pieces = [pcm[at : at + 3333] for at in range(0, len(pcm), 3333)]
    return ask(channel, [header(), *map(sound, pieces), END])


def frames_of(answers: list[Any]) -> list[Any]:
    return [each.animation_data for each in answers if each.HasField("animation_data")]


def weights_of(answers: list[Any]) -> np.ndarray:
    return np.array(
        [data.skel_animation.blend_shape_weights[0].values for data in frames_of(answers)]
    )


def test_answers_come_in_the_order_of_the_protocol(answers: list[Any]) -> None:
    first, *frames, event, status = answers
    told = first.animation_data_stream_header
    assert told.audio_header == AudioHeader(**PCM)
    names = list(told.skel_animation_header.blend_shapes)
    assert len(names) == 52 and {"EyeBlinkLeft", "JawOpen", "MouthPucker", "TongueOut"} <= set(
        names
    )
    assert told.start_time_code_since_epoch > 1.7e9
    assert all(frame.HasField("animation_data") for frame in frames) and len(frames) == 45
    assert event.HasField("event") and event.event.event_type == 0
    assert status.status.code == Status.SUCCESS and status.status.message == ""


def test_weights_are_those_of_a_stream(answers: list[Any], pcm: bytes) -> None:
    stream = open_stream(RATE)
    frames = [*stream.push(np.frombuffer(pcm, "<i2")), *stream.flush()]
    wanted = [list(LiveFrame(n, 30, frame).arkit.values()) for n, frame in enumerate(frames)]
    names = answers[0].animation_data_stream_header.skel_animation_header.blend_shapes
    assert [name[0].lower() + name[1:] for name in names] == list(COLUMNS)
    assert weights_of(answers) == pytest.approx(np.array(wanted), abs=1e-5)
    assert weights_of(answers)[:, list(COLUMNS).index("jawOpen")].max() > 0.15


def test_times_and_sound_go_with_the_frames(answers: list[Any], pcm: bytes) -> None:
    frames = frames_of(answers)
    times = [data.skel_animation.blend_shape_weights[0].time_code for data in frames]
    assert times == pytest.approx(np.arange(45) / 30)
    assert [data.audio.time_code for data in frames] == pytest.approx(times, abs=1e-4)
    assert b"".join(data.audio.audio_buffer for data in frames) == pcm


def test_a_client_that_listens_gets_frames_while_it_speaks(
    channel: grpc.Channel, pcm: bytes
) -> None:
    heard = threading.Event()

    def messages() -> Iterator[AudioWithEmotionStream]:
        yield header()
        yield sound(pcm)
        assert heard.wait(60)  # before the end was told
        yield END

    stream = A2FControllerServiceStub(channel).ProcessAudioStream(messages(), timeout=120)
    early = 0
    for answer in stream:
        early += answer.HasField("animation_data") and not heard.is_set()
        if early == 30:
            heard.set()
    assert heard.is_set()


def test_shapes_are_weighed_as_the_client_asks(
    channel: grpc.Channel, answers: list[Any], pcm: bytes
) -> None:
    asked = BlendShapeParameters(
        bs_weight_multipliers={"JawOpen": 10.0, "Chin": 2.0},
        bs_weight_offsets={"MouthPucker": 0.25},
        enable_clamping_bs_weight=True,
    )
    happy = EmotionWithTimeCode(time_code=0, emotion={"joy": 1.0})
    told = ask(
        channel,
        [
            header(blendshape_params=asked, face_params=FaceParameters()),
            sound(pcm, emotions=[happy]),
        ],
    )
    before, after = weights_of(answers), weights_of(told)
    jaw, pucker = (list(COLUMNS).index(name) for name in ("jawOpen", "mouthPucker"))
    assert after[:, jaw] == pytest.approx(np.clip(10 * before[:, jaw], 0, 1), abs=1e-4)
    assert after[:, pucker] == pytest.approx(np.clip(before[:, pucker] + 0.25, 0, 1), abs=1e-4)
    assert told[-1].status.message == "left out: face_params, Chin, emotions"


def test_no_sound_is_told(channel: grpc.Channel) -> None:
    answers = ask(channel, [header(), END])
    assert answers[-1].status.code == Status.WARNING and "no sound" in answers[-1].status.message


@pytest.mark.parametrize(
    ("messages", "told"),
    [
        ([], "first message: the end; allowed: audio_stream_header"),
        ([sound(b"")], "first message: audio_with_emotion; allowed: audio_stream_header"),
        ([AudioWithEmotionStream()], "first message: an empty message"),
        ([header(), header()], "message: audio_stream_header; allowed: audio_with_emotion or"),
        ([header(sound={"channel_count": 2})], "channel_count: 2; allowed: 1"),
        ([header(sound={"bits_per_sample": 32})], "bits_per_sample: 32; allowed: 16"),
        ([header(sound={"samples_per_second": 3})], "sample rate 3 Hz"),
        ([header(sound={"audio_format": 7})], "audio_format: 7; allowed: PCM"),
        (
            [
                header(
                    blendshape_params=BlendShapeParameters(
                        bs_weight_offsets={"JawOpen": float("nan")}
                    )
                )
            ],
            "JawOpen: nan; allowed: a finite number",
        ),
    ],
)
def test_what_is_no_stream_ends_with_a_status(
    channel: grpc.Channel, messages: list[Any], told: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(grpc.RpcError) as caught:
        ask(channel, messages)
    error: Any = caught.value
    assert error.code() == grpc.StatusCode.INVALID_ARGUMENT
    assert told in error.details() and "\n" not in error.details()
    assert capfd.readouterr().err == ""


def test_bytes_that_are_no_message_end_with_a_status(
    channel: grpc.Channel, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    call = channel.stream_stream(f"/{SERVICE}/{METHOD}", None, None)
    random = np.random.default_rng(0)
    for _ in range(50):
        noise = [random.bytes(int(size)) for size in random.integers(1, 400, 3)]
        with pytest.raises(grpc.RpcError) as caught:
            list(call(iter([header().SerializeToString(), *noise]), timeout=60))
        error: Any = caught.value
        assert error.code() == grpc.StatusCode.INVALID_ARGUMENT
    assert capfd.readouterr().err == "" and not caplog.records


def test_a_message_that_is_too_large_is_refused(channel: grpc.Channel) -> None:
    with pytest.raises(grpc.RpcError) as caught:
        ask(channel, [header(), sound(bytes(a2f.MESSAGE_MAX + 1)), END])
    error: Any = caught.value
    assert error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED


def test_a_sound_without_end_is_ended(
    channel: grpc.Channel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(a2f, "SOUND_MAX_S", 0.5)
    with pytest.raises(grpc.RpcError) as caught:
        ask(channel, [header(), sound(bytes(RATE)), sound(bytes(2)), END])
    error: Any = caught.value
    assert "more than 0.5 s" in error.details()


def test_a_client_that_does_nothing_is_sent_away() -> None:
    with opened(idle_s=0.3) as channel:
        waits = threading.Event()

        def messages() -> Iterator[AudioWithEmotionStream]:
            yield header()
            waits.wait(60)

        with pytest.raises(grpc.RpcError) as caught:
            ask(channel, messages())
        waits.set()
    error: Any = caught.value
    assert error.code() == grpc.StatusCode.DEADLINE_EXCEEDED
    assert error.details() == "nothing happened for 0.3 s"


def test_more_clients_than_there_may_be_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(a2f, "STREAMS_MAX", 1)
    with opened() as channel:
        ends = threading.Event()

        def messages() -> Iterator[AudioWithEmotionStream]:
            yield header()
            ends.wait(60)

        first = A2FControllerServiceStub(channel).ProcessAudioStream(messages(), timeout=120)
        assert next(first).HasField("animation_data_stream_header")
        with pytest.raises(grpc.RpcError) as caught:
            ask(channel, [header(), END])
        ends.set()
        assert list(first)[-1].HasField("status")
        assert eventually(lambda: _is_let_in(channel))  # the place is free again
    error: Any = caught.value
    assert error.code() == grpc.StatusCode.RESOURCE_EXHAUSTED


def _is_let_in(channel: grpc.Channel) -> bool:
    try:
        return bool(ask(channel, [header(), END]))
    except grpc.RpcError:
        return False


def test_it_says_that_it_is_up(channel: grpc.Channel) -> None:
    check = channel.unary_unary("/grpc.health.v1.Health/Check", None, None)
    assert check(b"", timeout=60) == b"\x08\x01"  # HealthCheckResponse(status=SERVING)


def test_a_token_is_asked_for() -> None:
    with opened(token="secret") as channel:
        stub = A2FControllerServiceStub(channel)
        for metadata in ((), (("authorization", "Bearer other"),), (("authorization", "secret"),)):
            with pytest.raises(grpc.RpcError) as caught:
                list(stub.ProcessAudioStream(iter([header(), END]), metadata=metadata))
            error: Any = caught.value
            assert error.code() == grpc.StatusCode.UNAUTHENTICATED
        known = (("authorization", "Bearer secret"),)
        assert list(stub.ProcessAudioStream(iter([header(), END]), metadata=known))


def test_clients_that_go_away_leave_the_service_as_it_was(
    channel: grpc.Channel,
    pcm: bytes,
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    for _ in range(5):
        stream = A2FControllerServiceStub(channel).ProcessAudioStream(
            iter([header(), sound(pcm), END])
        )
        next(stream)
        stream.cancel()
    assert len(frames_of(ask(channel, [header(), sound(pcm), END]))) == 45
    assert capfd.readouterr().err == "" and not caplog.records


def test_the_command_serves_until_it_is_interrupted(pcm: bytes) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "elocute", "a2f", "--port", str(port), "--fps", "25"]
    environment = {**os.environ, "ELOCUTE_LIVE_TOKEN": ""}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as service:
        assert service.stderr is not None
        try:
            assert service.stderr.readline() == f"elocute: Audio2Face-3D at 127.0.0.1:{port}\n"
            with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
                assert len(frames_of(ask(channel, [header(), sound(pcm[:RATE]), END]))) == 13
            done = run_apart("a2f", "--port", port)
            assert done.returncode == 2 and done.stderr.count("\n") == 1
            assert "cannot be listened on" in done.stderr
            service.send_signal(signal.SIGINT)
            assert service.communicate(timeout=60)[1] == ""
            assert service.returncode == 0
        finally:
            service.kill()
