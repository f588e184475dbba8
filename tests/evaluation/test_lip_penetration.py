"""Gaps and penetration of lips, against hulls of SciPy and lips moved by known distances."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from elocute.errors import HeadError
from elocute.evaluation.lip_penetration import lip_contact
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import sample_identities
from elocute.head.model import HeadModel
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.motion import Motion


@pytest.fixture(scope="module")
def head() -> HeadModel:
    return load_builtin_head()


def visemes(head: HeadModel) -> Motion:
    """A frame for each viseme."""
    weights = [head.expression_vector(shapes) for shapes in VISEME_SHAPES.values()]
    return Motion(head, np.stack(weights).astype(np.float32), 30)


def still(head: HeadModel, frames: int = 1) -> Motion:
    return Motion(head, np.zeros((frames, len(head.expression_names)), np.float32), 30)


def moved(head: HeadModel, vertices: Any, offset_mm: tuple[float, float, float]) -> HeadModel:
    """The same head with some vertices of its neutral face elsewhere."""
    template = head.template.copy()
    template[vertices] += np.array(offset_mm, np.float32) / 1000
    return replace(head, template=template)


def hull_depth_mm(head: HeadModel, vertices: Any) -> float:
    """How far a vertex of the lips lies inside the hull of a tooth, by SciPy's Qhull."""
    from scipy.spatial import ConvexHull

    lips, depth = vertices[np.unique(head.lip_rings[:9])], 0.0
    for jaw in ("teeth_upper", "teeth_lower"):
        for crown in vertices[head.regions[jaw]].reshape(14, -1, 3):
            planes = ConvexHull(crown).equations
            depth = max(depth, -(lips @ planes[:, :3].T + planes[:, 3]).max(axis=1).min())
    return 1000 * float(depth)


def test_depths_in_teeth_are_those_of_convex_hulls(head: HeadModel) -> None:
    found, wanted = [], []
    biting = moved(head, head.regions["teeth_upper"], (0, 0, 2))  # else no lip is in a tooth
    for coefficients in sample_identities(head, 3, seed=5):
        motion = visemes(biting.with_identity(1.5 * coefficients))
        found += lip_contact(motion).tooth_depth_mm.tolist()
        for weights in motion.weights:
            shape = np.tensordot(weights, motion.head.expression_basis, 1)
            wanted.append(hull_depth_mm(head, motion.head.template + shape))
    assert max(wanted) > 0.5
    np.testing.assert_allclose(found, wanted, atol=0.05)


def test_open_and_closed_visemes(head: HeadModel) -> None:
    motion = visemes(head)
    gap = dict(zip(VISEME_SHAPES, lip_contact(motion).gap_mm, strict=True))
    assert gap["PP"] < gap["sil"] <= 0.1
    assert gap["aa"] > gap["E"] > gap["ih"] > gap["FF"] > 0.5


@pytest.mark.parametrize("lifted_mm", [1.0, 3.0])
def test_a_lip_that_is_lifted_leaves_that_much_open(head: HeadModel, lifted_mm: float) -> None:
    upper = head.lip_rings[:, [*range(27, 38), *range(12)]].ravel()
    rest = lip_contact(still(head))
    open_head = lip_contact(still(moved(head, upper, (0, lifted_mm, 0))))
    assert open_head.gap_mm - rest.gap_mm == pytest.approx([lifted_mm], abs=0.3)
    assert open_head.lip_depth_mm[0] < rest.lip_depth_mm[0]


@pytest.mark.parametrize("raised_mm", [2.0, 4.0])
def test_a_lip_that_is_pushed_into_the_other_is_found(head: HeadModel, raised_mm: float) -> None:
    lower = head.lip_rings[:, 13:26].ravel()
    contact = lip_contact(still(moved(head, lower, (0, raised_mm, 0))))
    assert contact.gap_mm[0] < 0
    assert 0.5 * raised_mm < contact.lip_depth_mm[0] < raised_mm + 1


def test_a_gap_beside_the_middle_counts(head: HeadModel) -> None:
    """One side alone: the mean over the middle, as `measure_mouth` takes it, hardly sees it."""
    side = head.lip_rings[:, 5:10].ravel()
    assert lip_contact(still(moved(head, side, (0, 2, 0)))).gap_mm[0] > 1


def test_frames_do_not_depend_on_how_many_there_are(head: HeadModel) -> None:
    motion = visemes(head)
    long = replace(motion, weights=np.tile(motion.weights, (9, 1)))
    for once, often in zip(
        vars(lip_contact(motion)).values(), vars(lip_contact(long)).values(), strict=True
    ):
        np.testing.assert_allclose(np.tile(once, 9), often, atol=1e-4)


def test_heads_without_lips_or_teeth_are_refused(head: HeadModel, python2: Any, tmp_path) -> None:
    from elocute.head.registry import open_head

    (tmp_path / "flame.pkl").write_bytes(python2.dumps(python2.flame()))
    with pytest.raises(HeadError, match="no list of its lips and teeth"):
        lip_contact(still(open_head(tmp_path / "flame.pkl")))
    regions = {name: places for name, places in head.regions.items() if "teeth" not in name}
    with pytest.raises(HeadError, match="no list of its teeth; allowed: a head that names both"):
        lip_contact(still(replace(head, regions=regions)))
