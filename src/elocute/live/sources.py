"""Sources of live sound: blocks of samples, each when it was heard."""

from __future__ import annotations

import queue
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.audio.pcm import PcmBytes
from elocute.audio.read import read_audio
from elocute.errors import InputError, MachineError, needs_extra

BLOCK_S = 0.02


def file_blocks(path: Path, rate: int) -> Iterator[Float32Array]:
    """A recording at its own pace. Raises AudioError."""
    samples, size = read_audio(path, sample_rate=rate).samples, round(rate * BLOCK_S)
    started = time.monotonic()
    for at in range(0, len(samples), size):
        block = samples[at : at + size]
        time.sleep(max(0.0, started + (at + len(block)) / rate - time.monotonic()))
        yield block


def pcm_blocks(rate: int, stream: IO[bytes] | None = None) -> Iterator[NDArray[np.int16]]:
    """Mono samples of 16 bits, little-endian, from standard input, until it ends."""
    source, size, pcm = stream or sys.stdin.buffer, 2 * round(rate * BLOCK_S), PcmBytes()
    while data := source.read(size):
        yield pcm.push(data)[:, 0]


def microphone_blocks(rate: int) -> Iterator[Float32Array]:
    """The default microphone, which is opened at once, without end.

    Raises MachineError without the extra or PortAudio, InputError where there is no microphone.
    """
    with needs_extra("a microphone", "live"):
        try:
            import sounddevice
        except OSError as error:  # the package is there, the library is not
            raise MachineError(
                "a microphone needs PortAudio; install it: the system's package libportaudio2"
            ) from error
    blocks: queue.Queue[Float32Array] = queue.Queue()

    def take(samples: Any, *_: Any) -> None:
        blocks.put(samples[:, 0].copy())

    try:
        microphone = sounddevice.InputStream(
            rate, round(rate * BLOCK_S), channels=1, dtype="float32", callback=take
        )
        microphone.start()
    except sounddevice.PortAudioError as error:
        fault = str(error).split("\n")[0][:80]
        raise InputError.about("microphone", found=fault, allowed="one that works") from error
    return _blocks_of(microphone, blocks)


def _blocks_of(microphone: Any, blocks: queue.Queue[Float32Array]) -> Iterator[Float32Array]:
    with microphone:
        while True:
            yield blocks.get()
