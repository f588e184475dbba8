"""Malformed messages against the service of Audio2Face-3D, as many as wanted.

    python -m benchmarks.a2f --calls 100000

Each call sends up to four messages: random bytes, or valid ones cut, changed, repeated
or in another order. Printed are the statuses, the memory before and after, and whether a client is
answered afterwards as before.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import grpc
import numpy as np
from nvidia_ace.audio_pb2 import AudioHeader
from nvidia_audio2face_3d.messages_pb2 import (
    AudioWithEmotion,
    AudioWithEmotionStream,
    AudioWithEmotionStreamHeader,
    BlendShapeParameters,
)

import elocute
from elocute.live.a2f import METHOD, SERVICE, A2FService, serving

RATE = 16000
FINE = {grpc.StatusCode.OK, grpc.StatusCode.INVALID_ARGUMENT, grpc.StatusCode.RESOURCE_EXHAUSTED}
AT_ONCE = 8


def seeds() -> list[bytes]:
    """Valid messages: two headers, sound, and the end."""
    sound = AudioHeader(
        audio_format=AudioHeader.AUDIO_FORMAT_PCM,
        channel_count=1,
        samples_per_second=RATE,
        bits_per_sample=16,
    )
    shapes = BlendShapeParameters(bs_weight_multipliers={"JawOpen": 2.0, "Chin": 1.0})
    headers = (
        AudioWithEmotionStreamHeader(audio_header=sound),
        AudioWithEmotionStreamHeader(audio_header=sound, blendshape_params=shapes),
    )
    messages = [AudioWithEmotionStream(audio_stream_header=header) for header in headers]
    piece = AudioWithEmotion(audio_buffer=bytes(640))
    messages.append(AudioWithEmotionStream(audio_with_emotion=piece))
    messages.append(AudioWithEmotionStream(end_of_audio=AudioWithEmotionStream.EndOfAudio()))
    return [message.SerializeToString() for message in messages]


def malformed(random: np.random.Generator, known: list[bytes]) -> bytes:
    """A message that is not as it should be, or not where."""
    kind = random.integers(4)
    if kind == 0:
        return random.bytes(int(random.integers(0, 200)))
    data = bytearray(known[random.integers(len(known))])
    if kind == 1:
        return bytes(data[: random.integers(len(data))])
    if kind == 2:
        for place in random.integers(0, len(data), random.integers(1, 5)):
            data[place] = random.integers(256)
    return bytes(data)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--calls", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    service = A2FService(lambda rate: elocute.stream(rate, fps=30, lookahead=0.25))
    statuses: Counter[Any] = Counter()
    known, began = seeds(), time.monotonic()
    with (
        serving(service, "127.0.0.1", 0) as port,
        grpc.insecure_channel(f"127.0.0.1:{port}") as channel,
    ):
        call = channel.stream_stream(f"/{SERVICE}/{METHOD}", None, None)
        before, first_mb = answers_of(call, known), memory_mb()

        def send(seed: int) -> None:
            random = np.random.default_rng(seed)
            messages = [malformed(random, known) for _ in range(random.integers(1, 5))]
            if random.random() < 0.1:
                messages.insert(0, known[0])
            try:
                list(call(iter(messages), timeout=60))
                statuses[grpc.StatusCode.OK] += 1
            except grpc.RpcError as error:
                statuses[error.code()] += 1  # type: ignore[attr-defined]

        with ThreadPoolExecutor(AT_ONCE) as pool:
            numbers = range(given.seed, given.seed + given.calls)
            list(pool.map(send, numbers[: given.calls // 2]))
            half_mb = memory_mb()
            list(pool.map(send, numbers[given.calls // 2 :]))
        after = answers_of(call, known)
    for status, count in statuses.most_common():
        print(f"{status.name}: {count}")
    print(f"{given.calls} calls in {time.monotonic() - began:.0f} s")
    print(f"most memory: {first_mb:.0f} MB, after half {half_mb:.0f}, after all {memory_mb():.0f}")
    strange = set(statuses) - FINE
    if strange or after != before:
        raise SystemExit(f"strange: {strange or 'another answer afterwards'}")
    print("answered as before: yes")


def answers_of(call: Any, known: list[bytes]) -> list[bytes]:
    """What a good client gets, but the header, which has the time of day."""
    header, _, piece, end = known
    return list(call(iter([header, *[piece] * 50, end]), timeout=60))[1:]


def memory_mb() -> float:
    """The most memory that this process had so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    main()
