"""How long `elocute align` takes for two clips by each method, compiling aside and with it.

    python -m benchmarks.align_time [--seconds 3]

Each method runs in a process of its own, twice: the first call holds imports and compiling, the
second does not, and is given in seconds of processor time too, which a busy machine changes less.
The clips are the start of the shipped example and the same said a tenth more slowly.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

EXAMPLE = Path(__file__).parents[1] / "src" / "elocute" / "assets" / "example.flac"
METHODS = ("dtw", "softdtw", "ctw", "dctw", "cca-soft", "dcaw")


def measure(method: str, seconds: float) -> dict[str, float]:
    """Seconds of the first and of the second call, and the score."""
    begun = time.perf_counter()
    from elocute.alignment.methods import align
    from elocute.alignment.sound_views import speech_view
    from elocute.audio.read import read_audio
    from elocute.audio.waveform import Waveform

    sound = read_audio(EXAMPLE).resample(16000)
    cut = Waveform(sound.samples[: int(seconds * 16000)], 16000)
    slow = Waveform(cut.samples, round(16000 / 1.1)).resample(16000)
    views = [speech_view(cut), speech_view(slow)]
    align(views, method)
    first = time.perf_counter() - begun
    begun, worked = time.perf_counter(), time.process_time()
    found = align(views, method)
    return {
        "first_s": first,
        "again_s": time.perf_counter() - begun,
        "cpu_s": time.process_time() - worked,
        "score": found.score,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--method", choices=METHODS)
    given = parser.parse_args()
    if given.method:
        print(json.dumps(measure(given.method, given.seconds)))
        return
    print(f"{'method':10} {'first s':>8} {'again s':>8} {'CPU s':>8} {'score':>6}")
    for method in METHODS:
        command = [sys.executable, "-m", "benchmarks.align_time"]
        command += ["--method", method, "--seconds", str(given.seconds)]
        row = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
        figures = f"{row['first_s']:8.2f} {row['again_s']:8.3f} {row['cpu_s']:8.3f}"
        print(f"{method:10} {figures} {row['score']:6.3f}", flush=True)


if __name__ == "__main__":
    main()
