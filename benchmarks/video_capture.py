"""How well a real talker's video becomes motion of the built-in head, and how fast.

    python -m benchmarks.video_capture DATA/grid_s1              # all its videos
    python -m benchmarks.video_capture DATA/grid_s1 --limit 5

Needs the extra `video`. The lips' gap is judged against what was tracked independently for the
data set (`clips/NAME.npz`), and closures against it too. Speed is CPU time of one process on one
thread with everything in it (reading, detecting, fitting): frames per CPU second of a core; two
cores work on two videos.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np

from elocute.capture.video.face_tracking import FaceTrack
from elocute.capture.video.video_to_motion import VideoCapture, capture_video
from elocute.motion.mouth_measures import measure_mouth

CLOSED = 0.02  # inner-lip gap in eye distances


def tracked_gap(folder: Path, name: str, track: FaceTrack) -> np.ndarray:
    """(frame,) as the data set has it, or as followed here; NaN where no face was."""
    path = folder / "clips" / f"{name}.npz"
    if not path.exists():
        return np.where(track.seen, track.lip_gap, np.nan)
    with np.load(path) as fields:
        gap = np.interp(
            np.arange(track.frame_count) / track.fps, fields["t"], fields["inner_opening_mean"]
        )
    return np.where(track.seen, gap, np.nan)


def judged(captured: VideoCapture, gap: np.ndarray) -> dict[str, float]:
    opening = measure_mouth(captured.motion)["opening_mm"]
    known = np.isfinite(gap)
    closed = known & (gap < CLOSED)
    jerk = np.abs(np.diff(opening[known], n=3)).mean()
    return {
        "lip miss": captured.lip_miss,
        "face miss": float(captured.fitted.miss[~captured.flagged].mean()),
        "r": float(np.corrcoef(opening[known], gap[known])[0, 1]),
        "closed": float((opening[closed] < 0.1).mean()),
        "open where closed, mm": float(opening[closed].max()),
        "jerk": float(jerk),
    }


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("data", type=Path, help="the folder grid_s1")
    options.add_argument("--limit", type=int, default=None)
    given = options.parse_args()
    videos = sorted((given.data / "video").glob("*.mpg"))[: given.limit]
    rows, frames, cpu_s, wall_s = [], 0, 0.0, 0.0
    for video in videos:
        cpu, wall = time.process_time(), time.perf_counter()
        captured = capture_video(video)
        cpu_s, wall_s = cpu_s + time.process_time() - cpu, wall_s + time.perf_counter() - wall
        frames += captured.track.frame_count
        rows.append(judged(captured, tracked_gap(given.data, video.stem, captured.track)))
        print(video.stem, " ".join(f"{k} {v:.4f}" for k, v in rows[-1].items()), flush=True)
    mean = {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}
    worst = {name: float(np.max([row[name] for row in rows])) for name in rows[0]}
    print(f"\n| {len(videos)} videos, {frames} frames | mean | worst | target |")
    print("|---|---|---|---|")
    print(
        f"| lip points beside those seen, share of the eye distance | {mean['lip miss']:.4f} "
        f"| {worst['lip miss']:.4f} | <= 0.02 |"
    )
    print(f"| all points | {mean['face miss']:.4f} | {worst['face miss']:.4f} | |")
    print(
        f"| gap of the inner lips against that tracked, r | {mean['r']:.3f} "
        f"| {min(row['r'] for row in rows):.3f} | >= 0.95 |"
    )
    print(
        f"| frames tracked as closed in which lips are closed | {mean['closed']:.4f} "
        f"| {min(row['closed'] for row in rows):.4f} | 1 |"
    )
    print(f"| frames per CPU second | {frames / cpu_s:.1f} | | |")
    print(f"| frames per second of the clock | {frames / wall_s:.1f} | | >= 20 on two cores |")


if __name__ == "__main__":
    main()
