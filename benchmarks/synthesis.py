"""Speed, memory and size of the way from sound to motion and out.

    python -m benchmarks.synthesis

Process CPU seconds on one thread, medians; the matrix-product floor is measured in the same run.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np

EXAMPLE = Path(__file__).parents[1] / "src/elocute/assets/example.flac"
START = "from elocute.cli import main; main()"


def cpu_s(work: Callable[[], object], repeats: int = 7) -> float:
    """Median CPU seconds of a call, once warmed up."""
    work()
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return float(np.median(times))


def wall_s(*arguments: str, repeats: int = 5) -> float:
    """Median wall seconds of a fresh process."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        subprocess.run([sys.executable, "-c", START, *arguments], check=True, capture_output=True)
        times.append(time.perf_counter() - begun)
    return float(np.median(times))


def row(name: str, value: float, unit: str, target: str) -> None:
    print(f"| {name} | {value:.4g} {unit} | {target} |", flush=True)


def synthesis() -> None:
    from elocute.animation import animate
    from elocute.audio.read import read_audio
    from elocute.audio.waveform import Waveform

    samples = read_audio(EXAMPLE, sample_rate=16000).samples
    samples = np.tile(samples, 7)
    for seconds in (1, 10, 60):
        sound = Waveform(samples[: seconds * 16000], 16000)
        cost = cpu_s(lambda sound=sound: animate(sound)) / seconds
        row(f"sound to motion, {seconds} s", cost, "CPU s per s", "<= 0.015")


def expansion() -> None:
    from elocute.animation import animate

    motion = animate(EXAMPLE).motion
    weights = motion.weights[np.arange(600) % motion.frame_count]
    motion = type(motion)(motion.head, weights, 60)
    used = np.abs(weights).max(axis=0) > 0
    basis = motion.head.expression_basis[used].reshape(int(used.sum()), -1)
    floor = cpu_s(lambda: weights[:, used] @ basis)
    row("600 frames to vertices", cpu_s(motion.vertices) / floor, "x matrix product", "<= 2.5")


def writing() -> None:
    from elocute.animation import animate
    from elocute.audio.read import read_audio
    from elocute.audio.waveform import Waveform
    from elocute.export.gltf import glb_bytes, write_glb
    from elocute.export.meshes import write_obj

    samples = np.tile(read_audio(EXAMPLE, sample_rate=16000).samples, 2)[:160000]
    motion = animate(Waveform(samples, 16000)).motion
    with tempfile.TemporaryDirectory() as room:
        path = Path(room) / "talk.glb"
        begun = time.perf_counter()
        write_glb(motion, path)
        row("10 s .glb, first in a process", time.perf_counter() - begun, "s", "")
        row("10 s .glb", cpu_s(lambda: write_glb(motion, path)), "CPU s", "< 0.1")
        row(".glb size", len(glb_bytes(motion)) / 1e6, "MB", "")
        short = type(motion)(motion.head, motion.weights[:20], motion.fps)
        write_obj(short, Path(room) / "talk.obj")
        one = sum(p.stat().st_size for p in (Path(room) / "talk.obj").iterdir()) / 20
        ratio = one * motion.frame_count / path.stat().st_size
        row("OBJ sequence / .glb", ratio, "x", ">= 50")


def start_up() -> None:
    with tempfile.TemporaryDirectory() as room:
        import soundfile

        samples, rate = soundfile.read(EXAMPLE)
        soundfile.write(f"{room}/clip.wav", samples[: 3 * rate], rate)
        row("elocute --help", wall_s("--help"), "s wall", "< 0.4")
        row(
            "3 s clip to .npz, cold",
            wall_s("animate", f"{room}/clip.wav", "-o", f"{room}/t.npz"),
            "s wall",
            "< 1.2",
        )


def memory() -> None:
    """Peak of a process that animates an hour."""
    import resource

    import soundfile

    with tempfile.TemporaryDirectory() as room:
        samples, rate = soundfile.read(EXAMPLE, dtype="int16")
        with soundfile.SoundFile(f"{room}/hour.flac", "w", rate, 1, "PCM_16") as file:
            for _ in range(3600 * rate // len(samples) + 1):
                file.write(samples)
        begun = time.perf_counter()
        subprocess.run(
            [sys.executable, "-c", START, "animate", f"{room}/hour.flac", "-o", f"{room}/t.npz"],
            check=True,
            capture_output=True,
        )
        row("one hour to .npz", time.perf_counter() - begun, "s wall", "")
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1e6
        row("one hour, peak memory", peak, "GB", "< 1")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.parse_args()
    print("| what | measured | target |\n|---|---|---|")
    start_up()
    synthesis()
    expansion()
    writing()
    memory()
