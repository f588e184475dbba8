"""The mouth of the built-in head in millimetres: closed, open, against its teeth, left and right.

    python -m benchmarks.head

What docs/cards/head.md says under "Measured"; tests/head holds the limits.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from elocute.array_types import FloatArray
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import sample_identity
from elocute.head.model import HeadModel
from elocute.head.viseme_shapes import VISEME_SHAPES

PEOPLE, SOME = 200, (0, 1, 2)
MIDDLE = slice(4, 9)  # columns of the lips whose mean is an opening
LEFT_IS_RIGHT = np.array([-1.0, 1.0, 1.0])


def gaps_mm(head: HeadModel, vertices: FloatArray) -> FloatArray:
    """(..., column) upper lip above lower; negative where they overlap."""
    upper, lower = vertices[..., head.inner_lip_upper, 1], vertices[..., head.inner_lip_lower, 1]
    return 1000 * (upper - lower)


def viseme(head: HeadModel, name: str) -> FloatArray:
    return np.tensordot(head.expression_vector(VISEME_SHAPES[name]), head.expression_basis, 1)


def deepest_mm(head: HeadModel, vertices: FloatArray) -> float:
    """How far a vertex of the lips lies inside the hull of a tooth, at most."""
    lips, depth = vertices[np.unique(head.lip_rings[:9])], 0.0
    for jaw in ("teeth_upper", "teeth_lower"):
        for crown in vertices[head.regions[jaw]].reshape(14, -1, 3):
            planes = ConvexHull(crown).equations
            depth = max(depth, -(lips @ planes[:, :3].T + planes[:, 3]).max(axis=1).min())
    return 1000 * depth


def mirror_mm(head: HeadModel) -> float:
    """How far the template is from its mirror image, at most."""
    other = head.template[head.mirror] * LEFT_IS_RIGHT
    return 1000 * float(np.linalg.norm(head.template - other, axis=1).max())


def main() -> None:
    head = load_builtin_head()
    rng, count = np.random.default_rng(1), len(head.identity_basis)
    drawn = rng.normal(size=(PEOPLE, count)).astype(np.float32)
    everyone = head.template + np.tensordot(drawn, head.identity_basis, 1)
    for what, moved in (("at rest", everyone), ("p, b, m", everyone + viseme(head, "PP"))):
        gaps = gaps_mm(head, moved)
        print(f"| {what}, {PEOPLE} identities, gap | {gaps.min():.2f} to {gaps.max():.2f} mm |")
    faces = [head.template, *(head.identity_template(sample_identity(who)) for who in SOME)]
    depth = max(deepest_mm(head, f + viseme(head, name)) for f in faces for name in VISEME_SHAPES)
    print(f"| a lip inside a tooth, every viseme, {len(faces)} faces | {depth:.2f} mm |")
    opened = {
        name: float(gaps_mm(head, head.template + viseme(head, name))[MIDDLE].mean())
        for name in VISEME_SHAPES
    }
    ordered = sorted(opened.items(), key=lambda item: -item[1])
    print(f"| openings | {', '.join(f'{name} {mm:.1f}' for name, mm in ordered)} mm |")
    print(f"| template against its mirror image | {mirror_mm(head):.4f} mm |")


if __name__ == "__main__":
    main()
