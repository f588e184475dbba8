"""Preferences between conditions: by pair, by condition, and on one scale for all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from elocute.evaluation.confidence_intervals import NO_INTERVAL, ConfidenceInterval
from elocute.study.design.design import Design
from elocute.study.report.answers import Answer
from elocute.study.report.plots import interval_plot
from elocute.study.report.report_parts import Cell, Plot, Section, Table
from elocute.study.statistics.bradley_terry import fit_bradley_terry
from elocute.study.statistics.mixed_logit import MixedLogit, fit_mixed_logit, marginal_share
from elocute.study.statistics.proportions import (
    binomial_p,
    corrected,
    equivalence_p,
    wilson_interval,
)

MIXED_MIN = 4
"""People or stimuli below which nothing is said of people and stimuli in general."""


@dataclass(frozen=True)
class MixedShare:
    """A share as the mixed model has it: of people and stimuli in general, seen on either side."""

    share: ConfidenceInterval  # NaN where there are too few people or stimuli
    p: float  # of the hypothesis that it is a half
    logit: float  # the effect, of the person and stimulus in the middle
    sds: dict[str, float]  # how far people and stimuli differ, in logits
    # The interval that two one-sided tests look at: of 90 % where the other is of 95 %.
    narrow: ConfidenceInterval = NO_INTERVAL


NO_MIXED = MixedShare(NO_INTERVAL, float("nan"), float("nan"), {})


def mixed_share(
    yes: Sequence[bool],
    answers: Sequence[Answer],
    confidence: float,
    lefts: Sequence[bool] | None = None,
) -> MixedShare:
    """The share of yes over people and stimuli in general; `NO_MIXED` for too few people.

    Where `lefts` says whether yes was the left side, a liking for one side is allowed for.
    """
    people = [each.participant for each in answers]
    stimuli = [each.stimulus for each in answers]
    if len(set(people)) < MIXED_MIN:
        return NO_MIXED
    groups: dict[str, Sequence[str]] = {"people": people}
    if len(set(stimuli)) >= MIXED_MIN:
        groups["stimuli"] = stimuli
    columns: list[Any] = [np.ones(len(people))]
    if lefts is not None and 0 < sum(lefts) < len(lefts):
        columns.append(np.where(lefts, 0.5, -0.5))
    model = fit_mixed_logit(np.asarray(yes, np.float64), np.stack(columns, axis=1), groups)
    return MixedShare(
        _share(model, confidence),
        model.p_value(0),
        float(model.effects[0]),
        model.sds,
        _share(model, 2 * confidence - 1),
    )


def _share(model: MixedLogit, confidence: float) -> ConfidenceInterval:
    sd = float(np.hypot.reduce(list(model.sds.values())))
    low, high = model.interval(0, confidence)
    return ConfidenceInterval(
        *(marginal_share(each, sd) for each in (float(model.effects[0]), low, high))
    )


@dataclass(frozen=True)
class PairResult:
    """What people chose between two conditions."""

    # Conditions; shares are of the first.
    first: str
    second: str
    # How often the first was chosen, answers, and who gave them.
    count: int
    total: int
    people: int
    wilson: ConfidenceInterval  # share as if answers were independent
    p: float  # exact binomial test against a half
    mixed: MixedShare  # over people and stimuli in general
    equivalence: float  # p-value of equivalence by two one-sided exact tests
    # Whether the mixed model's interval, at the confidence that two one-sided tests take, lies
    # within the margin.
    within: bool


def pair_result(design: Design, pair: tuple[str, str], answers: Sequence[Answer]) -> PairResult:
    """What people chose between two conditions; the share told is that of the first.

    Answers may be of any conditions; those of the pair are used.
    """
    rules = design.analysis
    of_pair = [each for each in answers if {each.left, each.right} == set(pair)]
    yes = [each.answer == pair[0] for each in of_pair]
    lefts = [each.left == pair[0] for each in of_pair]
    count, total = sum(yes), len(yes)
    mixed = mixed_share(yes, of_pair, rules.confidence, lefts)
    low, high = mixed.narrow.low, mixed.narrow.high
    return PairResult(
        *pair,
        count=count,
        total=total,
        people=len({each.participant for each in of_pair}),
        wilson=wilson_interval(count, total, rules.confidence),
        p=binomial_p(count, total),
        mixed=mixed,
        equivalence=equivalence_p(count, total, rules.margin),
        within=bool(low >= 0.5 - rules.margin and high <= 0.5 + rules.margin),
    )


def pair_results(design: Design, answers: Sequence[Answer]) -> list[PairResult]:
    """`pair_result` of all pairs of the design, the baseline second where there is one."""
    baseline = design.analysis.baseline
    ordered = [(b, a) if a == baseline else (a, b) for a, b in design.pairs]
    return [pair_result(design, pair, answers) for pair in ordered]


def preference_section(design: Design, answers: Sequence[Answer]) -> Section:
    """Everything about preferences, of a study of kind "binary" and the answers that are kept."""
    results = pair_results(design, answers)
    tables = [_pair_table(design, results), _condition_table(design, answers)]
    plots = [_pair_plot(design, tables[0], results)]
    strengths = _strengths(design, answers)
    if strengths:
        tables.append(strengths[0])
        plots.append(strengths[1])
    tables += [_spread_table(results), _side_table(design, answers)]
    return Section("Preference", _preference_texts(design), plots, tables)


def _preference_texts(design: Design) -> list[str]:
    rules = design.analysis
    percent = f"{100 * rules.confidence:g} %"
    return [
        "Shares are of the condition named first. The interval of all answers is Wilson's "
        f"({percent}) and the test beside it is the exact binomial one; both take answers as "
        "independent, which those of one person are not. The mixed-effects logistic model takes "
        "people and stimuli as drawn from many and allows for sides: its share and interval are "
        "of people and stimuli in general, and are the ones to cite. p-values are corrected by "
        f"{_corrected(design)} over the tests of one table.",
        f"Two conditions count as equivalent where the share lies within "
        f"{100 * (0.5 - rules.margin):g} to {100 * (0.5 + rules.margin):g} %: by two one-sided "
        "exact tests of all answers, and by the mixed model.",
    ]


def _corrected(design: Design) -> str:
    names = {"holm": "Holm", "bonferroni": "Bonferroni", "benjamini-hochberg": "Benjamini–Hochberg"}
    return names.get(design.analysis.correction, "nothing (as the study says)")


def _pair_table(design: Design, results: Sequence[PairResult]) -> Table:
    correction = design.analysis.correction
    exact = corrected([each.p for each in results], correction)
    mixed = corrected([each.mixed.p for each in results], correction)
    rows: list[list[Cell]] = [
        [
            each.first,
            each.second,
            each.total,
            each.people,
            each.wilson,
            p,
            each.mixed.share,
            p_mixed,
            each.equivalence,
            "yes" if each.within else "no",
        ]
        for each, p, p_mixed in zip(results, exact, mixed, strict=True)
    ]
    columns = ("condition", "against", "answers", "people", "all answers, %", "p exact")
    columns += ("mixed model, %", "p mixed", "p equivalent", "equivalent")
    return Table("preference_pairs", "Preference by pair", columns, rows)


def _pair_plot(design: Design, table: Table, results: Sequence[PairResult]) -> Plot:
    names = [f"{each.first} over {each.second}" for each in results]
    series = {
        "mixed model": [each.mixed.share for each in results],
        "all answers": [each.wilson for each in results],
    }
    margin = design.analysis.margin
    return interval_plot(
        table,
        names,
        series,
        "share that prefers the first, %",
        height=1.2 + 0.5 * len(results),
        middle=0.5,
        band=(0.5 - margin, 0.5 + margin),
        percent=True,
    )


def _condition_table(design: Design, answers: Sequence[Answer]) -> Table:
    names = [each.name for each in design.judged]
    shown = [[each for each in answers if name in (each.left, each.right)] for name in names]
    counts = [
        sum(each.answer == name for each in of_it) for name, of_it in zip(names, shown, strict=True)
    ]
    p_values = corrected(
        [binomial_p(count, len(of_it)) for count, of_it in zip(counts, shown, strict=True)],
        design.analysis.correction,
    )
    rows: list[list[Cell]] = [
        [name, len(of_it), wilson_interval(count, len(of_it), design.analysis.confidence), p]
        for name, of_it, count, p in zip(names, shown, counts, p_values, strict=True)
    ]
    return Table(
        "preference_conditions",
        "How often each condition was chosen, against all that it met",
        ("condition", "answers", "chosen, %", "p exact"),
        rows,
    )


def _strengths(design: Design, answers: Sequence[Answer]) -> tuple[Table, Plot] | None:
    strengths = fit_bradley_terry(
        [each.left for each in answers],
        [each.right for each in answers],
        [each.answer == each.left for each in answers],
        [each.participant for each in answers],
        [each.stimulus for each in answers],
    )
    if strengths is None:
        return None
    order = sorted(strengths.names, key=lambda name: -strengths.values[strengths.names.index(name)])
    confidence = design.analysis.confidence
    intervals = [strengths.interval(name, confidence) for name in order]
    against = design.analysis.baseline
    columns: tuple[str, ...] = ("condition", "strength, logits")
    rows: list[list[Cell]] = [[name, each] for name, each in zip(order, intervals, strict=True)]
    if against in strengths.names:
        others = [name for name in order if name != against]
        p_values = corrected(
            [strengths.p_value(name, against) for name in others], design.analysis.correction
        )
        p_of = dict(zip(others, p_values, strict=True))
        columns += (f"above {against}, logits", "p")
        for row, name in zip(rows, order, strict=True):
            apart = strengths.interval(name, confidence, against) if name != against else None
            row += [apart, p_of.get(name)]
    note = (
        "Strengths add up to 0; a difference of 1 is a preference of 73 %. Intervals are over "
        "people and stimuli (two-way clustering). "
        f"The left side counts {strengths.side:+.2f} logits."
    )
    table = Table("strengths", "Bradley–Terry strengths", columns, rows, note)
    height = 1.0 + 0.4 * len(order)
    return table, interval_plot(
        table, order, {"": intervals}, "strength, logits", height=height, number="+.2f", middle=0.0
    )


def _spread_table(results: Sequence[PairResult]) -> Table:
    rows: list[list[Cell]] = [
        [each.first, each.second, each.mixed.logit]
        + [each.mixed.sds.get(group) for group in ("people", "stimuli")]
        for each in results
    ]
    return Table(
        "preference_spread",
        "The mixed models",
        ("condition", "against", "effect, logits", "people, logits", "stimuli, logits"),
        rows,
        "Standard deviations of what people and stimuli add to the effect.",
    )


def _side_table(design: Design, answers: Sequence[Answer]) -> Table:
    lefts = sum(each.answer == each.left for each in answers)
    share = wilson_interval(lefts, len(answers), design.analysis.confidence)
    rows: list[list[Cell]] = [[len(answers), share, binomial_p(lefts, len(answers))]]
    return Table(
        "sides", "How often the left side was chosen", ("answers", "left, %", "p exact"), rows
    )


def style_section(design: Design, answers: Sequence[Answer]) -> Section:
    """Whose manner of speaking people recognised, of a study of kind "style"."""
    wanted = [_shown_style(design, each) for each in answers]
    rules = design.analysis
    rows: list[list[Cell]] = []
    p_exact, p_mixed, names, wilsons, mixeds = [], [], [], [], []
    cases: list[tuple[str, str]] = [("all", "")]
    cases += [(right, "") for right in sorted({*wanted})]
    cases += [(one, other) for pair in design.pairs for one, other in (pair, pair[::-1])]
    for right, wrong in cases:
        chosen = [
            (each, style)
            for each, style in zip(answers, wanted, strict=True)
            if (right == "all" or style == right)
            and (not wrong or wrong in (each.left, each.right))
        ]
        if not chosen:
            continue
        yes = [each.answer == style for each, style in chosen]
        lefts = [each.left == style for each, style in chosen]
        mixed = mixed_share(yes, [each for each, _ in chosen], rules.confidence, lefts)
        wilson = wilson_interval(sum(yes), len(yes), rules.confidence)
        names.append(f"{right} against {wrong}" if wrong else f"{right}")
        wilsons.append(wilson)
        mixeds.append(mixed.share)
        p_exact.append(binomial_p(sum(yes), len(yes)))
        p_mixed.append(mixed.p)
        rows.append([right, wrong or "any", len(yes), wilson, None, mixed.share, None])
    for row, exact, mixed_p in zip(
        rows,
        corrected(p_exact, rules.correction),
        corrected(p_mixed, rules.correction),
        strict=True,
    ):
        row[4], row[6] = exact, mixed_p
    columns = ("style shown", "against", "answers", "recognised, %", "p exact")
    table = Table(
        "styles",
        "Styles recognised",
        (*columns, "mixed model, %", "p mixed"),
        rows,
        "The reference clip speaks in the style shown; guessing recognises a half.",
    )
    series = {"mixed model": mixeds, "all answers": wilsons}
    height = 1.2 + 0.4 * len(names)
    plot = interval_plot(
        table, names, series, "recognised, %", height=height, middle=0.5, percent=True
    )
    return Section("Style recognition", [], [plot], [table, _side_table(design, answers)])


def _shown_style(design: Design, answer: Answer) -> str:
    """The condition whose manner the reference shows."""
    if answer.correct:
        return answer.correct
    of_reference = next(
        (each.reference_for for each in design.conditions if each.name == answer.reference), ""
    )
    return of_reference or answer.reference
