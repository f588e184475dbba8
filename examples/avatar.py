"""Blocks of sound become ARKit curves, frame by frame, as an avatar in a game needs them.

python examples/avatar.py speech.wav > frames.jsonl

Each line is a frame: its time and the curves that are not zero. A game would read a microphone
and send the lines over a socket.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import elocute

CLIP = Path(elocute.__file__).parent / "assets" / "example.flac"


def microphone(speech: Path, block_s: float = 0.02) -> Iterator[np.ndarray]:
    """The recording in blocks of 20 ms, as a sound card would give them."""
    samples = elocute.read_audio(speech, sample_rate=48000).samples
    size = round(48000 * block_s)
    for start in range(0, len(samples), size):
        yield samples[start : start + size]


def send(frame) -> None:
    curves = {
        name: round(float(value), 4)
        for name, value in zip(frame.names, frame.values, strict=True)
        if value
    }
    print(json.dumps({"time_s": round(frame.time_s, 4), "curves": curves}))


def main() -> None:
    parser = argparse.ArgumentParser(description="Stream ARKit curves.")
    parser.add_argument("speech", nargs="?", default=CLIP, type=Path)
    given = parser.parse_args()

    live = elocute.stream(rate=48000, fps=60, style="crisp")
    for block in microphone(given.speech):
        for frame in live.push(block):
            send(frame)
    for frame in live.flush():  # what was waiting for more sound
        send(frame)
    print(f"each frame came {live.lookahead_s:.2f} s after its sound", file=sys.stderr)


if __name__ == "__main__":
    main()
