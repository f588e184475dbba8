"""How many landmarks have to be clicked: ICT-FaceKit's head registered from some of its own 68.

    python -m benchmarks.clicked_landmarks ../shared/data/ict_facekit/FaceXModel

Errors are distances from where ICT-FaceKit's authors put the landmarks, which is not in all places
where ours are (their brows lie higher): of those that the page asks for, and of those that it does
not ask for and only the first row is given, lips and nose apart from brows. A click is
off by a normal error of 0, 1 or 2 mm along each axis, then put on the nearest vertex; the mean of
three seeds.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
from scipy.spatial import KDTree

from elocute.capture.scans.landmark_page import KEY_LANDMARKS
from elocute.head.builtin import load_builtin_head
from elocute.registration.landmarks import Landmarks
from elocute.registration.register import register_neutral
from elocute.registration.scan import Scan
from recipes.heads_speak import ict_parts

JAW, BROWS_END, SEEDS = 17, 27, 3
FEW = 20
"""What the page calls enough."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="FaceXModel of ICT-FaceKit")
    given = parser.parse_args()
    points, faces, places = ict_parts(given.folder)
    skin = faces["M_Face"]
    used, corners = np.unique(skin, return_inverse=True)
    surface = 0.01 * points[used]
    scan = Scan("ict", surface, corners.reshape(skin.shape).astype(np.int32))
    truth = 0.01 * points[places]
    tree, head = KDTree(surface), load_builtin_head()
    other = np.setdiff1d(np.arange(JAW, 68), KEY_LANDMARKS)
    groups = [np.array(KEY_LANDMARKS), other[other >= BROWS_END], other[other < BROWS_END]]
    print("| clicked | off by, mm | asked for, mean mm | other lips, nose | brows | surface | s |")
    print("|---|---|---|---|---|---|---|")
    rows = {"all 68": np.arange(68), "the page's 30": np.array(KEY_LANDMARKS)}
    rows |= {f"the first {FEW} of these": rows["the page's 30"][:FEW], "none": np.arange(0)}
    for name, chosen in rows.items():
        for off_mm in (0, 1, 2) if len(chosen) else (0,):
            found, start = [], time.process_time()
            for seed in range(SEEDS if off_mm else 1):
                noise = np.random.default_rng(seed).normal(0, 1e-3 * off_mm, truth.shape)
                clicked = surface[tree.query(truth + noise)[1]]
                marks = np.full((68, 3), np.nan)
                marks[chosen] = clicked[chosen]
                _, fit = register_neutral(head, scan, Landmarks(marks, np.ones(68)))
                if fit.lost:
                    print(f"| {name} | {off_mm} | lost: {fit.lost} | | | | |")
                    continue
                away = 1000 * np.linalg.norm(fit.vertices[head.landmarks] - truth, axis=1)
                found.append([*(away[group].mean() for group in groups), fit.surface.face_median])
            if found:
                told = " | ".join(f"{each:.2f}" for each in np.mean(found, axis=0))
                spent = (time.process_time() - start) / len(found)
                print(f"| {name} | {off_mm} | {told} | {spent:.1f} |", flush=True)


if __name__ == "__main__":
    main()
