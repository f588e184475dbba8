"""Ratings: mean opinion scores, and ratings beside a reference as in MUSHRA."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from elocute.errors import needs_extra
from elocute.evaluation.confidence_intervals import NO_INTERVAL, ConfidenceInterval
from elocute.study.design.design import Design
from elocute.study.report.answers import Answer
from elocute.study.report.plots import interval_plot
from elocute.study.report.report_parts import Cell, Section, Table
from elocute.study.statistics.proportions import corrected
from elocute.study.statistics.two_way import codes_of, degrees_of, mean_over

WORDS = 5
"""Steps of a mean opinion score: 0, 25, 50, 75 and 100 of the table are 1 to 5."""


def rating_section(design: Design, answers: Sequence[Answer]) -> Section:
    """Means with intervals over people and stimuli, and differences within people and stimuli."""
    mos = design.study.scale == "mos"
    names = [each.name for each in design.judged]
    confidence = design.analysis.confidence
    means, rows = [], []
    for name in names:
        of_it = [each for each in answers if each.left == name]
        mean, _ = _mean([_value(each, mos) for each in of_it], of_it, confidence)
        means.append(mean)
        rows.append(_row(design, name, [_value(each, mos) for each in of_it], of_it, mean))
    unit = "1 to 5" if mos else "0 to 100"
    columns = ("condition", "as", "answers", "people", "mean", "median", "deviation")
    table = Table("ratings", f"Ratings, {unit}", columns, rows)
    texts = [
        "Intervals of means are over people and stimuli (two-way clustering, Student's t). "
        "Differences are taken within each person and stimulus and tested with t; equivalence by "
        f"two one-sided tests with a margin of {design.analysis.margin:g} of the scale."
    ]
    if not mos:
        texts.append(
            "After ITU-R BS.1534-3, whoever rates the hidden reference below 90 in more than 15 % "
            "of the items is left out (see Exclusions)."
        )
    limits, height = (1, WORDS) if mos else (0, 100), 1.0 + 0.4 * len(names)
    along = f"mean rating, {unit}"
    plot = interval_plot(table, names, {"": means}, along, height=height, limits=limits)
    return Section("Ratings", texts, [plot], [table, _differences(design, answers, mos)])


def _value(answer: Answer, mos: bool) -> float:
    value = float(answer.answer)
    return 1 + value * (WORDS - 1) / 100 if mos else value


def _mean(
    values: Sequence[float], answers: Sequence[Answer], confidence: float
) -> tuple[ConfidenceInterval, float]:
    people = [each.participant for each in answers]
    return mean_over(values, people, [each.stimulus for each in answers], confidence)


def _row(
    design: Design,
    name: str,
    values: list[float],
    answers: Sequence[Answer],
    mean: ConfidenceInterval,
) -> list[Cell]:
    condition = design.condition(name)
    part = "hidden reference" if name == design.comparisons.reference else "condition"
    if condition.still or condition.mismatched:
        part = "anchor"
    people = len({each.participant for each in answers})
    median = float(np.median(values)) if values else None
    spread = float(np.std(values, ddof=1)) if len(values) > 1 else None
    return [name, part, len(values), people, mean, median, spread]


def _differences(design: Design, answers: Sequence[Answer], mos: bool) -> Table:
    rules = design.analysis
    scale = (WORDS - 1) if mos else 100
    rated = {(each.left, each.participant, each.stimulus): _value(each, mos) for each in answers}
    baseline = rules.baseline
    differences = []
    for pair in design.pairs:
        one, other = pair[::-1] if pair[0] == baseline else pair
        places = [
            (person, stimulus)
            for name, person, stimulus in rated
            if name == one and (other, person, stimulus) in rated
        ]
        apart = [rated[one, *place] - rated[other, *place] for place in places]
        differences.append((one, other, len(apart), *_difference(apart, places, rules, scale)))
    p_values = corrected([each[4] for each in differences], rules.correction)
    rows: list[list[Cell]] = [
        [one, other, count, mean, p, same]
        for (one, other, count, mean, _, same), p in zip(differences, p_values, strict=True)
    ]
    columns = ("condition", "minus", "pairs of answers", "difference", "p", "p equivalent")
    return Table("rating_differences", "Differences", columns, rows)


def _difference(
    apart: Sequence[float], places: Sequence[tuple[str, str]], rules: Any, scale: float
) -> tuple[ConfidenceInterval, float, float]:
    """A mean difference, the p-value that it is none, and that it is beyond the margin."""
    with needs_extra("a report", "study"):
        from scipy.stats import t
    if not apart:
        return NO_INTERVAL, float("nan"), float("nan")
    people, stimuli = (codes_of([place[k] for place in places]) for k in (0, 1))
    mean, error = mean_over(apart, people, stimuli, rules.confidence)
    if not error > 0:
        return mean, float("nan"), float("nan")
    degrees, margin = degrees_of(people, stimuli), rules.margin * scale
    p = 2 * t.sf(abs(mean.value) / error, degrees)
    same = max(
        t.sf((mean.value + margin) / error, degrees), t.cdf((mean.value - margin) / error, degrees)
    )
    return mean, float(p), float(same)
