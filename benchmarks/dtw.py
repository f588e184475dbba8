"""Dynamic time warping against librosa and tslearn: one thread, path included, warm.

    python -m benchmarks.dtw

Both views (frame, 39) from the example that ships; squared Euclidean distances here, Euclidean
in the others (their own). Median of many. Targets: 3 times librosa, 1.5 times tslearn.
"""

from __future__ import annotations

import json
import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[variable] = "1"

import librosa
import numpy as np
from tslearn.metrics import dtw_path

from elocute.alignment.dtw import dtw, squared_distances
from elocute.audio.read import read_audio
from elocute.audio.spectral import log_mel

SIZES, BANDS = (100, 300, 1000), 39
EXAMPLE = Path(__file__).parents[1] / "src" / "elocute" / "assets" / "example.flac"
RUNS = {100: 60, 300: 30, 1000: 12}


def main() -> None:
    sound = read_audio(EXAMPLE).resample(16000)
    frames = log_mel(sound.samples, 16000, BANDS).astype(np.float32)
    frames = np.ascontiguousarray((frames - frames.mean(axis=0)) / frames.std(axis=0))
    stretched = frames[np.round(np.linspace(0, len(frames) - 1, 2 * max(SIZES))).astype(int)]
    rows = []
    for size in SIZES:
        source, target = stretched[:size], stretched[size // 3 : size // 3 + size]
        row = {
            "frames": size,
            "elocute_ms": timed(lambda s=source, t=target: dtw(squared_distances(s, t)), size),
            "librosa_ms": timed(lambda s=source, t=target: librosa.sequence.dtw(s.T, t.T), size),
            "tslearn_ms": timed(lambda s=source, t=target: dtw_path(s, t), size),
        }
        row["over_librosa"] = row["librosa_ms"] / row["elocute_ms"]
        row["over_tslearn"] = row["tslearn_ms"] / row["elocute_ms"]
        rows.append(row)
        print("  ".join(f"{name} {value:9.3f}" for name, value in row.items()))
    print(json.dumps(rows))


def timed(run: Callable[[], object], size: int) -> float:
    """Median milliseconds of this thread's own time, so that a busy machine counts for little."""
    run()
    spans = []
    for _ in range(RUNS[size]):
        started = time.thread_time()
        run()
        spans.append(time.thread_time() - started)
    return 1000 * statistics.median(spans)


if __name__ == "__main__":
    main()
