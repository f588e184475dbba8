"""Live streams: look-ahead, time per second of sound, and the distance from the whole sound.

python -m benchmarks.streaming [SPEECH] [--block-ms 10]
python -m benchmarks.streaming [SPEECH] --lookahead 0.3    how late frames come that do not wait
python -m benchmarks.streaming [SPEECH] --lookahead 0.3 --streams 16    of many, at their own pace
python -m benchmarks.streaming [SPEECH] --lookahead 0.3 --hours 1    of a long one, at full speed
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.models.curve_stream import CurveStream
from elocute.models.feature_extraction import extract_features
from elocute.models.protocol import FrameSpan
from elocute.models.registry import model_names, open_model
from elocute.models.streaming import stream
from elocute.numerics.resampling import frames_in

SPEECH = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
FPS = 60.0


def measured(name: str, sound: Waveform, block: int) -> str:
    """One row of the table."""
    model = open_model(name)
    heard, duration_s = extract_features(model, sound)
    span = FrameSpan.whole(frames_in(duration_s, FPS), FPS)
    whole = model.curves(heard, model.style("plain"), span).values
    live = CurveStream(model, sound.sample_rate, fps=FPS, level=model.sound_level(sound))
    pieces, late_s = [], 0.0
    started = time.process_time()
    for at in range(0, len(sound.samples), block):
        pieces.append(live.push(sound.samples[at : at + block]))
        late_s = max(late_s, (at + block) / sound.sample_rate - live.frames_given / FPS)
    pieces.append(live.flush())
    spent = (time.process_time() - started) / sound.duration_s
    apart = np.abs(np.concatenate([p.values for p in pieces if p is not None]) - whole).max()
    return f"| {name} | {model.lookahead_s:.2f} | {late_s:.2f} | {spent:.3f} | {apart:.1e} |"


def soon(lookahead: float, sound: Waveform, block: int) -> str:
    """One row of the table of frames that do not wait; of the public call, with all of a face."""
    live, late_s, pushes_s = stream(sound.sample_rate, lookahead=lookahead), [], []
    started = time.process_time()
    for at in range(0, len(sound.samples), block):
        pushed = time.perf_counter()
        frames = list(live.push(sound.samples[at : at + block]))
        pushes_s.append(time.perf_counter() - pushed)
        known_s = min(len(sound.samples), at + block) / sound.sample_rate
        late_s += [known_s + pushes_s[-1] - frame.time_s for frame in frames]
    spent = (time.process_time() - started) / sound.duration_s
    shares = " | ".join(f"{value:.3f}" for value in np.percentile(late_s, [50, 95, 99, 100]))
    return f"| {lookahead:g} | {shares} | {1000 * np.percentile(pushes_s, 99):.1f} | {spent:.3f} |"


def together(lookahead: float, sound: Waveform, block: int, count: int, seconds: float) -> str:
    """One row of the table of streams of one process, each at its own pace."""
    lives = [stream(sound.sample_rate, lookahead=lookahead, seed=k) for k in range(count)]
    late_s: list[float] = []
    spent, began = time.process_time(), time.monotonic()
    blocks = round(seconds * sound.sample_rate / block)
    for number in range(blocks):
        samples = np.take(sound.samples, number * block + np.arange(block), mode="wrap")
        time.sleep(max(0.0, began + (number + 1) * block / sound.sample_rate - time.monotonic()))
        for live in lives:
            frames = list(live.push(samples))
            now_s = time.monotonic() - began
            late_s += [now_s - frame.time_s for frame in frames]
    spent = (time.process_time() - spent) / seconds
    shares = " | ".join(f"{value:.3f}" for value in np.percentile(late_s, [50, 99, 100]))
    missed = sum(late > lookahead + 1 / FPS for late in late_s)
    return f"| {count} | {lookahead:g} | {shares} | {missed} of {len(late_s)} | {spent:.2f} |"


def long(lookahead: float, sound: Waveform, block: int, hours: float) -> str:
    """One row of the table of long streams: memory after a tenth and at the end, and frames."""
    live, frames, memory, last_s = stream(sound.sample_rate, lookahead=lookahead), 0, [], 0.0
    blocks = round(hours * 3600 * sound.sample_rate / block)
    started = time.process_time()
    for number in range(blocks):
        samples = np.take(sound.samples, number * block + np.arange(block), mode="wrap")
        for frame in live.push(samples):
            frames, last_s = frames + 1, frame.time_s
        if number + 1 in (blocks // 10, blocks):
            status = Path("/proc/self/status").read_text()
            memory.append(int(status.split("VmRSS:")[1].split()[0]) / 1000)
    early, late = memory
    spent = (time.process_time() - started) / (hours * 3600)
    off_s = blocks * block / sound.sample_rate - live.lookahead_s - last_s
    shown = f"{early:.1f} | {late:.1f} | {100 * (late / early - 1):.2f}"
    return f"| {hours:g} | {lookahead:g} | {shown} | {frames} | {1000 * off_s:.0f} | {spent:.3f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("speech", type=Path, nargs="?", default=SPEECH)
    parser.add_argument("--block-ms", type=float, default=10.0)
    parser.add_argument("--lookahead", type=float, nargs="+", help="of frames that do not wait, s")
    parser.add_argument(
        "--streams", type=int, nargs="+", default=[], help="at once, of one process"
    )
    parser.add_argument("--seconds", type=float, default=60.0, help="that they speak")
    parser.add_argument("--hours", type=float, help="of one long stream")
    given = parser.parse_args()
    sound = read_audio(given.speech, sample_rate=48000)
    block = round(given.block_ms / 1000 * sound.sample_rate)
    if given.hours:
        print("| hours | look-ahead, s | MB early | MB late | more, % | frames | ms behind | CPU |")
        print("|---|---|---|---|---|---|---|---|")
        for lookahead in given.lookahead or [0.3]:
            print(long(lookahead, sound, block, given.hours))
        return
    if given.streams:
        print("| streams | look-ahead, s | late by, s: median | 99 % | most | too late | CPU |")
        print("|---|---|---|---|---|---|---|")
        for lookahead in given.lookahead or [0.3]:
            for count in given.streams:
                print(together(lookahead, sound, block, count, given.seconds))
        return
    if given.lookahead:
        print("| look-ahead, s | late by, s: median | 95 % | 99 % | most | push, 99 %, ms | CPU |")
        print("|---|---|---|---|---|---|---|")
        for lookahead in given.lookahead:
            print(soon(lookahead, sound, block))
        return
    print("| model | declared look-ahead, s | observed, s | CPU s per s | from the whole |")
    print("|---|---|---|---|---|")
    for name in model_names():
        print(measured(name, sound, block))


if __name__ == "__main__":
    main()
