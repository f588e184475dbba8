"""A long sequence of simulated scans registered one after another, some of them spoilt.

    python -m benchmarks.tracking [--frames 1000] [--points 120000] [--without-landmarks]
                                   [--face rig|rich] [--start 0]

Every hundredth scan is not what it should be: a ball, only the back of the head, or a few stray
triangles. Asked: is a good scan ever lost, is a spoilt one ever taken for good, is the frame after
it found again, and do errors grow along the way. Frames follow one another as `elocute capture
scans` has them, but in one chain, never begun anew. A frame lasts about two seconds, half of
which is its simulation.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import elocute
from elocute.animation import animate
from elocute.array_types import Float64Array
from elocute.audio.read import read_audio
from elocute.capture.simulation.scan_simulator import Scanner, ScanSimulator
from elocute.errors import CaptureError
from elocute.head.builtin import load_builtin_head
from elocute.registration.accuracy import correspondence_mm
from elocute.registration.landmarks import Landmarks, no_landmarks
from elocute.registration.register import Registration, register_neutral, register_scan
from elocute.registration.scan import Scan
from elocute.registration.template import Template
from recipes.rich_faces.rich_face import take_from_sound

FPS = 60.0
STYLES = ("plain", "broad", "smiling", "rounded")
SPOILT_EVERY = 100


@dataclass(frozen=True, eq=False)
class Taken:
    """A scan, its landmarks, and true vertices (vertex, 3) m, or None where it is spoilt."""

    scan: Scan
    landmarks: Landmarks
    truth: Float64Array | None


def frames(count: int, scanner: Scanner, face: str, start: int) -> Iterator[Taken]:
    """The shipped example said in one style after another, by the rig or a face of flesh."""
    speech = Path(elocute.__file__).parent / "assets" / "example.flac"
    number = 0
    while number < count:
        style = STYLES[number // 500 % len(STYLES)]
        if face == "rich":
            motion = take_from_sound(read_audio(speech), fps=FPS, identity="7", style=style)
        else:
            motion = animate(
                speech, model="articulation", fps=FPS, identity="7", style=style, life=0
            ).motion
        stage = ScanSimulator(motion, scanner)
        for frame in range(start, min(stage.motion.frame_count, start + count - number)):
            taken = stage.frame(frame)
            scan = Scan(f"frame {number}", taken.points, taken.triangles)
            spoilt = number % SPOILT_EVERY == SPOILT_EVERY - 1
            yield Taken(
                spoil(scan, number // SPOILT_EVERY) if spoilt else scan,
                no_landmarks() if spoilt else taken.landmarks,
                None if spoilt else taken.truth.posed,
            )
            number += 1


def spoil(scan: Scan, kind: int) -> Scan:
    """A ball of the head's size, the back of the head alone, or a few triangles of it."""
    middle = scan.points.mean(axis=0)
    if kind % 3 == 0:
        away = scan.points - middle
        far = np.linalg.norm(away, axis=1, keepdims=True)
        return replace(scan, points=middle + away / far * 0.1)
    keep = (
        scan.points[:, 2] < middle[2] - 0.02 if kind % 3 == 1 else np.arange(len(scan.points)) < 40
    )
    return replace(scan, triangles=scan.triangles[keep[scan.triangles].all(axis=1)])


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--points", type=int, default=120_000)
    parser.add_argument("--noise-mm", type=float, default=0.1)
    parser.add_argument("--without-landmarks", action="store_true", help="but for the first")
    parser.add_argument("--face", choices=("rig", "rich"), default="rig", help="what is scanned")
    parser.add_argument("--start", type=int, default=0, help="first frame of each reading")
    arguments = parser.parse_args()
    scanner = Scanner(points=arguments.points, noise_mm=arguments.noise_mm)
    template: Template | None = None
    before: Registration | None = None
    rows, lost, taken_in, spoilt = [], [], [], 0
    for number, taken in enumerate(
        frames(arguments.frames, scanner, arguments.face, arguments.start)
    ):
        if template is None:
            template, _ = register_neutral(load_builtin_head(), taken.scan, taken.landmarks)
        landmarks = no_landmarks() if arguments.without_landmarks else taken.landmarks
        try:
            found = register_scan(template, taken.scan, landmarks, before)
            flag = found.lost
        except CaptureError as error:
            found, flag = None, str(error)
        if taken.truth is None:
            spoilt += 1
            if not flag:
                taken_in.append(number)
            before = None if flag else found
        elif flag or found is None:
            lost.append((number, flag))
            before = None
        else:
            before = found
            errors = correspondence_mm(template.head, found.vertices, taken.truth)
            rows.append(
                (
                    number,
                    found.surface.median,
                    found.surface.mean,
                    errors["face"],
                    errors["lips"],
                    found.seconds,
                )
            )
        if sys.stderr.isatty():
            print(f"\r{number + 1}/{arguments.frames}", end="", file=sys.stderr)
    report(np.array(rows), lost, taken_in, spoilt)


def report(
    rows: Float64Array, lost: list[tuple[int, str]], taken_in: list[int], spoilt: int
) -> None:
    """rows (frame, 6): number, surface median and mean, face and lips in mm, seconds."""
    good = len(rows) + len(lost)
    print(f"{good} good scans, lost: {len(lost)} {lost[:10]}")
    print(f"{spoilt} spoilt scans, taken for good: {len(taken_in)} {taken_in}")
    names = ("surface median", "surface mean", "face", "lips", "CPU s")
    parts = {"all": rows, "first 100": rows[:100], "last 100": rows[-100:]}
    after = rows[np.isin(rows[:, 0] % SPOILT_EVERY, [0])]
    parts["after a spoilt one"] = after
    print(f"{'':20}" + "".join(f"{name:>16}" for name in names))
    for name, part in parts.items():
        if len(part):
            print(f"{name:20}" + "".join(f"{value:16.3f}" for value in part[:, 1:].mean(axis=0)))
    print(f"{'worst':20}" + "".join(f"{value:16.3f}" for value in rows[:, 1:].max(axis=0)))


if __name__ == "__main__":
    main()
