"""Curves that give a mouth wanted in millimetres."""

import numpy as np
import pytest

from elocute.head.builtin import load_builtin_head
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.mouth_measures import MEASURES, measure_as_tracked
from elocute.motion.mouth_response import builtin_response, corrected_curves

NAMES = ("jawOpen", "mouthLowerDownLeft", "mouthLowerDownRight", "mouthPucker", "mouthSmileLeft")
FREE: dict[str, float] = dict.fromkeys(NAMES, 0.3)


def measured(values):
    return measure_as_tracked(
        motion_from_curves(load_builtin_head(), Curves(values, NAMES, 25))
    ).values


def test_the_response_is_what_the_head_does():
    values = np.random.default_rng(0).uniform(0, 0.4, (20, len(NAMES))).astype(np.float32)
    values[:, 0] += 0.2
    found = builtin_response(NAMES).measures(values)
    assert np.abs(found - measured(values)).max() < 0.35  # the width is not quite a straight line
    assert np.abs(found - measured(values))[:, 0].max() < 0.05


@pytest.mark.parametrize("opening_mm", [0.8, 3.0, 9.0, 18.0])
def test_lips_open_by_as_many_millimetres_as_wanted(opening_mm):
    response = builtin_response(NAMES)
    wanted = np.tile(response.rest, (3, 1))
    wanted[:, MEASURES.index("opening_mm")] = opening_mm
    start = np.array([[0, 0, 0, 0, 0], [0.6, 0, 0, 0, 0], [0.1, 0.2, 0.2, 0.5, 0]], np.float32)
    found = corrected_curves(response, start, wanted, FREE, {"opening_mm": 0.05})
    opened = measured(found)[:, 0]
    assert opened[:2] == pytest.approx(opening_mm, abs=0.12)
    # Puckered lips that nearly touch meet in the middle before they do beside it.
    assert opened[2] == pytest.approx(opening_mm, abs=0.9 if opening_mm < 2 else 0.12)
    assert found.min() >= 0 and found.max() <= 1


def test_what_is_right_already_is_left_alone_and_so_are_curves_without_freedom():
    response = builtin_response(NAMES)
    values = np.array([[0.3, 0.1, 0.1, 0.0, 0.0]], np.float32)
    same = corrected_curves(response, values, response.measures(values), FREE, {"opening_mm": 0.05})
    assert np.allclose(same, values, atol=1e-6)
    wanted = response.measures(values) + 3
    moved = corrected_curves(response, values, wanted, {"jawOpen": 0.3}, {"opening_mm": 0.05})
    assert moved[0, 0] > 0.4 and np.array_equal(moved[0, 1:], values[0, 1:])
