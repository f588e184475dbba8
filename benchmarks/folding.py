"""What ARKit's 52 shapes leave of the speech shapes: as files fold them, and as well as can be.

python -m benchmarks.folding
"""

from __future__ import annotations

import numpy as np

from elocute.export.shape_profiles import NEAREST
from elocute.head.builtin import load_builtin_head
from elocute.motion.curves import ARKIT_NAMES
from elocute.numerics.bounded_least_squares import solve_box

RIDGE = 1e-3  # of the mean squared length of a shape


def main() -> None:
    head = load_builtin_head()
    shapes = head.expression_basis.reshape(len(head.expression_names), -1).astype(float)
    arkit = shapes[[head.expression_index(name) for name in ARKIT_NAMES]]
    gram = arkit @ arkit.T
    gram += RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
    print("| shape | folded, largest mm | mean | least squares, largest mm | mean |")
    print("|---|---|---|---|---|")
    for name, parts in NEAREST.items():
        shape = shapes[head.expression_index(name)]
        shares = np.array([parts.get(each, 0.0) for each in ARKIT_NAMES])
        best = solve_box(gram, arkit @ shape, np.zeros(len(arkit)), np.ones(len(arkit)))
        moved = np.linalg.norm(shape.reshape(-1, 3), axis=1) > 0
        cells = []
        for weights in (shares, best):
            apart = np.linalg.norm((shape - weights @ arkit).reshape(-1, 3), axis=1) * 1000
            cells += [f"{apart.max():.1f}", f"{apart[moved].mean():.1f}"]
        print(f"| `{name}` | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
