"""A sequence of 3D scans becomes motion, and the error is known, since the scans are simulated.

python examples/capture.py out/capture --seconds 0.5

Needs the extra `capture`. With scans of your own, begin at `capture_scans`.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import elocute
from elocute.capture import BatchSettings, Scanner, SequenceMetadata, capture_scans, simulate_scans

CLIP = Path(elocute.__file__).parent / "assets" / "example.flac"


def main() -> None:
    parser = argparse.ArgumentParser(description="Scan a talking head and register the scans.")
    parser.add_argument("output", nargs="?", default="out/capture", type=Path)
    parser.add_argument("--seconds", default=0.5, type=float)
    parser.add_argument("--points", default=60_000, type=int, help="of each scan")
    given = parser.parse_args()

    given.output.mkdir(parents=True, exist_ok=True)
    # A head speaks before a scanner in software. The first frame shows the resting face.
    take = elocute.animate(CLIP, fps=30, identity="esi", life=0)
    frames = round(given.seconds * take.motion.fps)
    motion = replace(take.motion, weights=take.motion.weights[:frames])
    metadata = SequenceMetadata(subject="esi", sentence="hello", neutral=0)
    scans = given.output / "scans"
    simulate_scans(motion, scans, scanner=Scanner(points=given.points), metadata=metadata)

    # The registered frames, in zero pose and in the topology of the built-in head.
    results = capture_scans(scans, given.output / "captured", BatchSettings(jobs=1))
    for result in results:
        print(f"{result.name}: {result.failed or 'registered'}")
    captured = given.output / "captured" / "sequences" / "esi.hello" / "motion.npy"
    lips = elocute.load_builtin_head().regions["lips"]
    apart = np.load(captured)[:, lips] - np.load(scans / "truth" / "zero.npy")[:, lips]
    print(f"lips: {1000 * np.linalg.norm(apart, axis=2).mean():.2f} mm from where they truly are")


if __name__ == "__main__":
    main()
