"""Expressions fold the skin where they push it together, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from elocute.head import HeadModel, load_builtin_head, resolve_identity
from elocute.head.folds import ZONES, Folds
from elocute.head.looks import Look, dress
from elocute.head.looks.folds import fold_depth, fold_lines, folds_of
from elocute.head.looks.pictures import decoded
from elocute.head.looks.subdivision import finer_face
from elocute.head.surface import Surface, surface_arrays, surfaces_of_arrays
from elocute.motion.motion import Motion


@pytest.fixture(scope="module")
def head() -> HeadModel:
    return load_builtin_head()


@pytest.fixture(scope="module")
def worn(head: HeadModel) -> HeadModel:
    return dress(head, Look())


@pytest.fixture(scope="module")
def folds(worn: HeadModel) -> Folds:
    found = folds_of(worn)
    assert found is not None
    return found


def both(name: str, weight: float = 1.0) -> dict[str, float]:
    return {f"{name}Left": weight, f"{name}Right": weight}


def posed(head: HeadModel, weights: dict[str, float]) -> np.ndarray:
    shift = np.tensordot(head.expression_vector(weights), head.expression_basis, 1)
    return head.template + shift


def strong(folds: Folds, head: HeadModel, weights: dict[str, float]) -> dict[str, float]:
    """Strengths by the kind of zone: the lesser of its sides."""
    found = folds.strengths(head.template, posed(head, weights))
    kinds: dict[str, float] = {}
    for name, strength in zip(folds.names, found, strict=True):
        kind = name.removesuffix("Left").removesuffix("Right").removesuffix("Middle")
        kinds[kind] = min(kinds.get(kind, 1.0), float(strength))
    return kinds


def test_at_rest_nothing_folds_whoever_it_is(head: HeadModel, folds: Folds) -> None:
    for seed in range(20):
        one = head.with_identity(resolve_identity(str(seed)))
        assert not folds.strengths(one.template, one.template).any()


def test_turns_of_the_head_fold_nothing(head: HeadModel, folds: Folds) -> None:
    turns = np.tile(np.array([1.0, 0, 0, 0], np.float32), (1, len(head.joint_names), 1))
    turns[0, head.joint_names.index("head")] = [0.9, 0.25, 0.3, 0.2]
    turns[0] /= np.linalg.norm(turns[0], axis=1, keepdims=True)
    still = np.zeros((1, len(head.expression_names)), np.float32)
    (points,) = Motion(head, still, 30.0, turns).vertices()
    assert np.abs(points - head.template).max() > 0.02
    assert folds.strengths(head.template, points).max() < 0.01


@pytest.mark.parametrize(
    ("weights", "folded", "smooth"),
    [
        pytest.param(
            {"browInnerUp": 1.0, **both("browOuterUp")},
            ("forehead",),
            ("glabella", "crow", "nasolabial", "bunny", "chin", "lips", "marionette"),
            id="brows up",
        ),
        pytest.param(
            both("browDown"), ("glabella",), ("forehead", "crow", "nasolabial", "bunny"), id="frown"
        ),
        pytest.param(
            both("mouthSmile"),
            ("nasolabial", "crow"),
            ("forehead", "glabella", "marionette", "lips"),
            id="smile",
        ),
        pytest.param(both("noseSneer"), ("bunny",), ("forehead", "glabella", "lips"), id="sneer"),
        pytest.param(both("mouthFrown"), ("marionette",), ("forehead", "nasolabial"), id="sulk"),
        pytest.param({"mouthPucker": 1.0}, ("lips",), ("forehead", "nasolabial"), id="pucker"),
    ],
)
def test_an_expression_folds_its_own_zones(
    head: HeadModel,
    folds: Folds,
    weights: dict[str, float],
    folded: tuple[str, ...],
    smooth: tuple[str, ...],
) -> None:
    for seed in (None, 3, 8):
        one = head if seed is None else head.with_identity(resolve_identity(str(seed)))
        found = strong(folds, one, weights)
        assert min(found[kind] for kind in folded) > 0.4
        assert max(found[kind] for kind in smooth) < 0.05


def test_a_squint_shows_beside_the_eyes(head: HeadModel, folds: Folds) -> None:
    assert strong(folds, head, both("eyeSquint"))["crow"] > 0.15
    assert strong(folds, head, both("eyeBlink"))["crow"] < 0.05


def test_one_side_folds_alone(head: HeadModel, folds: Folds) -> None:
    found = folds.strengths(head.template, posed(head, {"browOuterUpLeft": 1.0}))
    sides = dict(zip(folds.names, found, strict=True))
    assert sides["foreheadLeft"] > 0.8
    assert sides["foreheadRight"] < 0.05


def test_older_skin_folds_deeper(head: HeadModel) -> None:
    for course in (fold_depth, fold_lines):
        years = [course(age) for age in (18, 30, 45, 60, 80)]
        assert years == sorted(years)
        assert years[-1] == 1.0
    young, old = (dress(head, Look(age=age)).surfaces["skin"] for age in (20, 74))
    assert young.folds == old.folds
    assert 0.2 < young.fold_depth < 0.25 * old.fold_depth


def test_masks_cover_the_face_and_share_what_lies_between(worn: HeadModel, folds: Folds) -> None:
    masks = folds.masks_at(np.arange(worn.vertex_count)).astype(float) / 255
    assert masks.shape == (worn.vertex_count, ZONES)
    assert masks.reshape(-1, 2, ZONES // 2).sum(-1).max() < 1.01
    own = finer_face()
    assert not masks[own.count + own.more :].any()  # nothing worn folds
    assert (masks.max(0) > 0.9).all()


def test_the_picture_of_folds_is_small_and_smooth_in_between(worn: HeadModel) -> None:
    data = worn.surfaces["skin"].folds
    assert len(data) < 150_000
    values = decoded(data).astype(int)
    assert np.median(np.abs(values - 128), axis=(0, 1)).max() <= 1
    assert (values < 60).any((0, 1)).all()


def test_bare_heads_and_other_meshes_have_none(head: HeadModel, worn: HeadModel) -> None:
    assert folds_of(head) is None
    few = replace(worn.surfaces["skin"], folds=b"")
    assert folds_of(replace(worn, surfaces={"skin": few})) is None


def test_files_keep_folds_and_earlier_ones_have_none() -> None:
    given = Surface(folds=b"picture", fold_depth=0.7, fold_lines=0.2)
    stored = surface_arrays({"skin": given})
    assert surfaces_of_arrays(stored)["skin"] == given
    text = stored["surface/0"].tobytes().decode()
    earlier = text.replace(', "fold_depth": 0.7, "fold_lines": 0.2', "").encode()
    assert len(earlier) < len(text)
    found = surfaces_of_arrays({"surface/0": np.frombuffer(earlier, np.uint8)})["skin"]
    assert found == Surface()
