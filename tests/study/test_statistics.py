"""Statistics of reports against published examples and other people's code, and known truth."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elocute.study.statistics.agreement import alpha_interval
from elocute.study.statistics.bradley_terry import connected, fit_bradley_terry
from elocute.study.statistics.mixed_logit import fit_mixed_logit, marginal_share
from elocute.study.statistics.proportions import (
    binomial_p,
    corrected,
    equivalence_p,
    wilson_interval,
)
from elocute.study.statistics.two_way import mean_over, two_way_covariance

# Bovine pleuropneumonia (Lesnoff et al. 2004), as lme4 has it: herd, cases, size, period.
HERDS = """1 2 14 1,1 3 12 2,1 4 9 3,1 0 5 4,2 3 22 1,2 1 18 2,2 1 21 3,3 8 22 1,3 2 16 2,3 0 16 3,
3 2 20 4,4 2 10 1,4 0 10 2,4 2 9 3,4 0 6 4,5 5 18 1,5 0 25 2,5 0 24 3,5 1 4 4,6 3 17 1,6 0 17 2,
6 0 18 3,6 1 20 4,7 8 16 1,7 1 10 2,7 3 9 3,7 0 5 4,8 12 34 1,9 2 9 1,9 0 6 2,9 0 8 3,9 0 6 4,
10 1 22 1,10 1 22 2,10 0 18 3,10 2 22 4,11 0 25 1,11 5 27 2,11 3 22 3,11 1 22 4,12 2 10 1,12 1 8 2,
12 0 6 3,12 0 5 4,13 1 21 1,13 2 24 2,13 0 19 3,13 0 23 4,14 11 19 1,14 0 2 2,14 0 3 3,14 0 2 4,
15 1 19 1,15 1 15 2,15 1 15 3,15 0 15 4"""
# American League, 1987 (Agresti 1990, table 10.10): each row's wins against each column.
TEAMS = ("milwaukee", "detroit", "toronto", "newyork", "boston", "cleveland", "baltimore")
WINS = (
    (0, 7, 9, 7, 7, 9, 11),
    (6, 0, 7, 5, 11, 9, 9),
    (4, 6, 0, 7, 7, 8, 12),
    (6, 8, 6, 0, 6, 7, 10),
    (6, 2, 6, 7, 0, 7, 12),
    (4, 4, 5, 6, 6, 0, 6),
    (2, 4, 1, 3, 1, 7, 0),
)
# Krippendorff (2011), "Computing Krippendorff's alpha-reliability", data of its section C.
NONE = None
RATERS = (
    (1, 2, 3, 3, 2, 1, 4, 1, 2, NONE, NONE, NONE),
    (1, 2, 3, 3, 2, 2, 4, 1, 2, 5, NONE, 3),
    (NONE, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, NONE),
    (1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, NONE),
)


def rated() -> tuple[list[int], list[int]]:
    pairs = [(unit, value) for row in RATERS for unit, value in enumerate(row) if value is not None]
    return [unit for unit, _ in pairs], [value for _, value in pairs]


@pytest.mark.parametrize(
    ("level", "published"), [("nominal", 0.743), ("ordinal", 0.815), ("interval", 0.849)]
)
def test_alpha_as_krippendorff_computes_it(level, published):
    units, values = rated()
    found = alpha_interval(units, values, level, 0.95)
    assert found.value == pytest.approx(published, abs=6e-4)
    assert found.low < found.value < found.high <= 1


def test_alpha_of_two_observers_as_krippendorff_computes_it():
    """Section A of the same text: ten articles, two observers, α = 0.095."""
    one, other = "0100000010", "1110010000"
    units = [*range(10), *range(10)]
    found = alpha_interval(units, [*one, *other], "nominal", 0.95)
    assert found.value == pytest.approx(0.095, abs=6e-4)


def test_alpha_of_one_answer_each_and_of_answers_all_alike_is_not_a_number():
    for units, values in ((["a", "b"], ["x", "y"]), (["a", "a"], ["x", "x"]), ([], [])):
        assert math.isnan(alpha_interval(units, values, "nominal", 0.95).value)


def test_the_mixed_model_of_herds_is_that_of_lme4():
    """glmer(cbind(incidence, size - incidence) ~ period + (1 | herd), binomial, cbpp)."""
    rows = np.array([list(map(int, row.split())) for row in HERDS.replace("\n", "").split(",")])
    period = rows[:, 3]
    fixed = np.stack([np.ones(len(rows)), period == 2, period == 3, period == 4], axis=1)
    found = fit_mixed_logit(rows[:, 1], fixed, {"herd": rows[:, 0]}, rows[:, 2], penalised=False)
    assert found.effects == pytest.approx([-1.3983, -0.9919, -1.1282, -1.5797], abs=2e-3)
    assert found.errors == pytest.approx([0.2312, 0.3032, 0.3228, 0.4220], rel=0.02)
    assert found.sds["herd"] == pytest.approx(0.6421, abs=2e-3)
    ways = sum(math.log(math.comb(n, k)) for k, n in rows[:, 1:3].tolist())
    assert found.log_likelihood + ways == pytest.approx(-92.0266, abs=2e-3)


def crossed(seed: int, people: int = 50, stimuli: int = 24) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    who, what = np.divmod(np.arange(people * stimuli), stimuli)
    logit = 0.8 + rng.normal(0, 0.9, people)[who] + rng.normal(0, 0.5, stimuli)[what]
    return who, what, (rng.random(len(who)) < 1 / (1 + np.exp(-logit))).astype(float)


def test_the_mixed_model_recovers_known_effects():
    found = []
    for seed in range(6):
        who, what, yes = crossed(seed)
        found.append(fit_mixed_logit(yes, np.ones((len(yes), 1)), {"who": who, "what": what}))
    assert np.mean([each.effects[0] for each in found]) == pytest.approx(0.8, abs=0.15)
    assert np.mean([each.sds["who"] for each in found]) == pytest.approx(0.9, abs=0.12)
    assert np.mean([each.sds["what"] for each in found]) == pytest.approx(0.5, abs=0.12)
    assert all(each.converged for each in found)


def test_the_mixed_model_lies_by_that_of_statsmodels():
    glm = pytest.importorskip("statsmodels.genmod.bayes_mixed_glm")
    who, what, yes = crossed(1)
    members = np.concatenate([np.eye(50)[who], np.eye(24)[what]], axis=1)
    groups = np.repeat([0, 1], [50, 24])
    fixed = np.ones((len(yes), 1))
    theirs = glm.BinomialBayesMixedGLM(yes, fixed, members, groups, vcp_p=1, fe_p=5).fit_vb()
    ours = fit_mixed_logit(yes, fixed, {"who": who, "what": what})
    assert ours.effects[0] == pytest.approx(theirs.fe_mean[0], abs=0.1)
    assert list(ours.sds.values()) == pytest.approx(np.exp(theirs.vcp_mean), rel=0.2)
    assert ours.errors[0] > theirs.fe_sd[0]  # theirs are too small: why the model is our own


def test_answers_all_alike_give_wide_bounds_and_no_error():
    found = fit_mixed_logit(np.ones(40), np.ones((40, 1)), {"who": np.arange(40) // 4})
    low, high = found.interval(0, 0.95)
    assert np.isfinite([low, high]).all() and found.effects[0] > 2


def test_a_share_over_people_who_differ_is_nearer_a_half():
    rng = np.random.default_rng(0)
    drawn = 1 / (1 + np.exp(-(1.0 + 1.5 * rng.standard_normal(400_000))))
    assert marginal_share(1.0, 1.5) == pytest.approx(drawn.mean(), abs=2e-3)
    assert marginal_share(1.0, 0.0) == pytest.approx(1 / (1 + math.exp(-1)))


def test_strengths_are_those_that_agresti_prints():
    left, right, won = [], [], []
    for row, wins in zip(TEAMS, WINS, strict=True):
        for column, count in zip(TEAMS, wins, strict=True):
            left += [row] * count
            right += [column] * count
            won += [1] * count
    games = list(range(len(won)))
    found = fit_bradley_terry(left, right, won, games, games, side=False)
    assert found is not None
    relative = [found.interval(team, 0.95, "baltimore").value for team in TEAMS]
    assert relative == pytest.approx([1.58, 1.44, 1.29, 1.25, 1.11, 0.68, 0.0], abs=6e-3)
    assert found.values.sum() == pytest.approx(0, abs=1e-9)


def test_strengths_lie_by_the_logistic_regression_of_statsmodels():
    api = pytest.importorskip("statsmodels.api")
    rng = np.random.default_rng(2)
    who, yes = np.arange(600) // 12, []
    sides = [(("a", "b"), ("b", "c"), ("c", "a"))[k] for k in rng.integers(0, 3, 600)]
    strength = {"a": 0.9, "b": 0.2, "c": -0.4}
    for one, other in sides:
        logit = strength[one] - strength[other] + 0.3
        yes.append(float(rng.random() < 1 / (1 + math.exp(-logit))))
    left, right = zip(*sides, strict=True)
    found = fit_bradley_terry(left, right, yes, who, np.zeros(600, int))
    columns = np.array([[(a == n) - (b == n) for n in "ab"] + [1] for a, b in sides], dtype=float)
    model = api.GLM(np.array(yes), columns, family=api.families.Binomial())
    theirs = model.fit(cov_type="cluster", cov_kwds={"groups": who}, use_correction=False)
    assert found is not None
    for place, name in enumerate("ab"):
        ours = found.interval(name, 0.95, "c")
        assert ours.value == pytest.approx(theirs.params[place], abs=2e-3)
        reach = (ours.high - ours.low) / 2 / 2.0096  # Student's t at 49 degrees
        assert reach == pytest.approx(theirs.bse[place], rel=0.03)
    assert found.side == pytest.approx(theirs.params[2], abs=2e-3)


def test_conditions_that_were_never_compared_have_no_common_scale():
    assert connected("abc", "ab", "bc")
    assert not connected("abcd", "ac", "bd")
    assert fit_bradley_terry("ac", "bd", [1, 0], [1, 2], [1, 2]) is None


def test_what_always_wins_is_strong_but_finite():
    found = fit_bradley_terry("aaaaaa", "bbbbbb", [1] * 6, [1, 1, 2, 2, 3, 3], [1, 2] * 3)
    assert found is not None and 2 < found.values[0] < 20


def test_wilson_intervals_by_their_formula():
    count, total, z = 83, 120, 1.959963984540054
    share = count / total
    middle = (share + z * z / (2 * total)) / (1 + z * z / total)
    reach = (
        z / (1 + z * z / total) * math.sqrt(share * (1 - share) / total + z * z / (4 * total**2))
    )
    found = wilson_interval(count, total, 0.95)
    assert (found.low, found.high) == pytest.approx((middle - reach, middle + reach))
    # Newcombe (1998), table I: 81 of 263.
    published = wilson_interval(81, 263, 0.95)
    assert (published.low, published.high) == pytest.approx((0.2553, 0.3662), abs=6e-5)
    assert math.isnan(wilson_interval(0, 0, 0.95).value)


def test_binomial_tests_by_sums_over_all_outcomes():
    def tail(count: int, total: int, share: float) -> float:
        return sum(
            math.comb(total, k) * share**k * (1 - share) ** (total - k)
            for k in range(count, total + 1)
        )

    assert binomial_p(17, 20) == pytest.approx(2 * tail(17, 20, 0.5))
    assert binomial_p(9, 20, 0.25, "greater") == pytest.approx(tail(9, 20, 0.25))
    assert equivalence_p(104, 200, 0.1) == pytest.approx(
        max(tail(104, 200, 0.4), 1 - tail(105, 200, 0.6))
    )
    assert math.isnan(binomial_p(0, 0))


def test_corrections_as_their_authors_print_them():
    # Benjamini and Hochberg (1995), section 3.3: 15 tests, of which four are findings at 0.05.
    given = [0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240]
    given += [0.4262, 0.5719, 0.6528, 0.7590, 1.0]
    assert sum(p <= 0.05 for p in corrected(given, "benjamini-hochberg")) == 4
    assert sum(p <= 0.05 for p in corrected(given, "bonferroni")) == 3
    # Holm's steps by hand, and a test that could not be made does not count.
    assert corrected([0.01, 0.04, 0.03, float("nan")], "holm")[:3] == pytest.approx(
        [0.03, 0.06, 0.06]
    )
    assert corrected([0.2, 0.3], "none") == [0.2, 0.3]
    assert corrected([], "holm") == []


def test_intervals_over_people_and_stimuli_hold_the_truth():
    """Where both differ, an interval over answers alone misses it more often than not."""
    rng = np.random.default_rng(5)
    held = narrow = 0
    for _ in range(200):
        who, what = np.divmod(np.arange(30 * 16), 16)
        values = 3 + rng.normal(0, 1, 30)[who] + rng.normal(0, 0.7, 16)[what]
        values = values + rng.normal(0, 1, len(who))
        found, _ = mean_over(values, who, what, 0.95)
        held += found.low <= 3 <= found.high
        narrow += abs(values.mean() - 3) < 1.96 * values.std() / math.sqrt(len(values))
    assert 0.91 <= held / 200 <= 0.99
    assert narrow / 200 < 0.6


def test_two_way_covariance_of_independent_rows_is_the_sum_of_squares():
    rng = np.random.default_rng(0)
    scores = rng.standard_normal((400, 1))
    found = two_way_covariance(scores, np.arange(400), np.arange(400))
    assert found[0, 0] == pytest.approx((scores**2).sum() * 400 / 399)
    assert math.isnan(mean_over([1.0, 2.0], ["a", "a"], ["s", "t"], 0.95)[0].low)
