"""Characters with shapes of their own: what a fit leaves of the mouth, few shapes or many.

python -m benchmarks.characters
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import elocute
from elocute.head.preset_shapes import OCULUS_SHAPES, SILENT, VRM_MOUTH
from elocute.motion.control_fit import fit_controls
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.mouth_measures import measure_mouth

EXAMPLE = Path(elocute.__file__).parent / "assets" / "example.flac"
USED = 0.02
WITHOUT_CLOSE = [name for name in ARKIT_NAMES if name.startswith(("jaw", "mouth", "tongue"))]
WITHOUT_CLOSE.remove("mouthClose")
SETS: dict[str, list[dict[str, float]]] = {
    "15 visemes of Oculus": [look for name, look in OCULUS_SHAPES.items() if name != SILENT],
    "5 vowels of a VRM": list(VRM_MOUTH.values()),
    "ARKit without `mouthClose`": [{name: 1.0} for name in WITHOUT_CLOSE],
    "a jaw alone": [{"jawOpen": 1.0}],
}


def main() -> None:
    motion = elocute.animate(EXAMPLE, model="articulation", life=0).motion
    own = measure_mouth(motion)["opening_mm"]
    print(
        "| shapes | skin off, mm | opening off, mm | r | size | closed, mm at most "
        "| shapes at a time | largest step |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name, looks in SETS.items():
        fit = fit_controls(motion, looks)
        mixes = np.stack([motion.head.expression_vector(look) for look in looks])
        had = measure_mouth(replace(motion, weights=fit.weights @ mixes))["opening_mm"]
        print(
            f"| {name} | {fit.skin_mm:.2f} | {fit.opening_mm:.2f} "
            f"| {np.corrcoef(had, own)[0, 1]:.3f} | {had.std() / own.std():.2f} "
            f"| {fit.closed_mm:.2f} | {(fit.weights > USED).sum(axis=1).mean():.1f} "
            f"| {np.abs(np.diff(fit.weights, axis=0)).max():.2f} |"
        )
    step = np.abs(np.diff(motion.weights, axis=0)).max()
    print(f"\nThe motion's own curves step by {step:.2f} at most.")


if __name__ == "__main__":
    main()
