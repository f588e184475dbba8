"""Pearson's correlation, against SciPy's."""

import numpy as np
import pytest
from scipy.stats import pearsonr

from elocute.numerics.correlation import pearson

ONE = np.sin(np.arange(40) / 3)
TWO = ONE + np.random.default_rng(0).normal(0, 0.5, 40)


def test_it_equals_scipys():
    assert pearson(ONE, TWO) == pytest.approx(pearsonr(ONE, TWO)[0])
    assert pearson(1e-9 * ONE, 1e6 + TWO) == pytest.approx(pearsonr(ONE, TWO)[0])
    assert pearson(ONE, 5 - 2 * ONE) == pytest.approx(-1)


@pytest.mark.parametrize("still", [0.0, 1.0, 0.1, 1e6 / 3])
def test_what_does_not_change_correlates_with_nothing(still: float):
    assert pearson(ONE, np.full(40, still)) == 0 == pearson(np.full(40, still), ONE)
