"""Intelligibility: which words people saw and heard, by condition, noise and pair of words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from elocute.study.design.design import Condition, Design
from elocute.study.report.answers import Answer
from elocute.study.report.plots import interval_plot
from elocute.study.report.report_parts import Cell, Section, Table
from elocute.study.statistics.mixed_logit import fit_mixed_logit
from elocute.study.statistics.preferences import MIXED_MIN, mixed_share
from elocute.study.statistics.proportions import binomial_p, corrected, wilson_interval

LOG_MAX = 12.0
"""Of odds that are told."""
CONFUSIONS_MAX = 400
"""Rows of a table of answers by word."""


def word_section(design: Design, answers: Sequence[Answer]) -> Section:
    """Shares of words that were right, against chance and against the baseline.

    Trials without a right answer are told apart.
    """
    scored = [each for each in answers if each.correct]
    names = [each.name for each in design.judged]
    confidence, correction = design.analysis.confidence, design.analysis.correction
    wilsons, mixeds, p_values, rows = [], [], [], []
    for name in names:
        of_it = [each for each in scored if each.left == name]
        yes = [each.answer == each.correct for each in of_it]
        chance = _chance(design, of_it)
        wilsons.append(wilson_interval(sum(yes), len(yes), confidence))
        mixeds.append(mixed_share(yes, of_it, confidence).share)
        p_values.append(binomial_p(sum(yes), len(yes), chance, "greater") if yes else float("nan"))
        sound = _sound(design.condition(name))
        rows.append([name, sound, len(yes), wilsons[-1], mixeds[-1], chance, None])
    for row, p in zip(rows, corrected(p_values, correction), strict=True):
        row[-1] = p
    columns = ("condition", "sound", "answers", "right, %", "mixed model, %", "by chance, %")
    table = Table("words", "Words understood", (*columns, "p above chance"), rows)
    series = {"mixed model": mixeds, "all answers": wilsons}
    height = 1.2 + 0.45 * len(names)
    plot = interval_plot(table, names, series, "words right, %", height=height, percent=True)
    tables = [table]
    against = _against_baseline(design, scored)
    if against:
        tables.append(against)
    tables.append(_confusions(design, answers))
    return Section("Intelligibility", [], [plot], tables)


def _sound(condition: Condition) -> str:
    if condition.silent:
        return "none"
    return "clear" if condition.snr_db is None else f"{condition.snr_db:g} dB"


def _chance(design: Design, answers: Sequence[Answer]) -> float:
    """The mean over answers of one in the number of words offered; a quarter where unknown."""
    counts = {each.name: len(each.choices) for each in design.stimuli.sounds}
    shares = [1 / (counts.get(each.stimulus.partition(".")[0], 0) or 4) for each in answers]
    return float(np.mean(shares)) if shares else float("nan")


def _against_baseline(design: Design, scored: Sequence[Answer]) -> Table | None:
    """Each condition against the baseline with the same sound, by a mixed model of both."""
    baseline = design.analysis.baseline
    if not baseline:
        return None
    effects: list[tuple[str, float, float, float, float]] = []
    confidence = design.analysis.confidence
    for name in (each.name for each in design.judged if each.name != baseline):
        both = [each for each in scored if each.left in (name, baseline)]
        people = [each.participant for each in both]
        if len(set(people)) < MIXED_MIN or len({each.left for each in both}) < 2:
            continue
        other = np.array([float(each.left == name) for each in both])
        fitted = fit_mixed_logit(
            np.array([float(each.answer == each.correct) for each in both]),
            np.stack([np.ones(len(both)), other], axis=1),
            {"people": people, "stimuli": [each.stimulus for each in both]},
        )
        low, high = fitted.interval(1, confidence)
        effects.append((name, float(fitted.effects[1]), low, high, fitted.p_value(1)))
    p_values = corrected([each[-1] for each in effects], design.analysis.correction)
    rows: list[list[Cell]] = [
        [name, *np.exp(np.clip(interval, -LOG_MAX, LOG_MAX)).tolist(), p]
        for (name, *interval, _), p in zip(effects, p_values, strict=True)
    ]
    columns = ("condition", f"odds against {baseline}", "low", "high", "p")
    return Table("words_baseline", "Against the baseline, by a mixed model", columns, rows)


def _confusions(design: Design, answers: Sequence[Answer]) -> Table:
    """What was answered to each word; to pairs of sound and picture that differ (McGurk), too."""
    seen = {each.name: each.seen for each in design.stimuli.sounds}
    counts = Counter(
        (each.left, each.stimulus.partition(".")[0], each.correct, each.answer) for each in answers
    )
    totals: Counter[tuple[str, str]] = Counter()
    for (condition, sound, _, _), count in counts.items():
        totals[condition, sound] += count
    rows: list[list[Cell]] = [
        [
            condition,
            sound,
            "differs" if seen.get(sound) else "same",
            correct or "none",
            answer,
            wilson_interval(count, totals[condition, sound], design.analysis.confidence),
        ]
        for (condition, sound, correct, answer), count in sorted(counts.items())
    ]
    more = len(rows) - CONFUSIONS_MAX
    return Table(
        "word_answers",
        "What was answered",
        ("condition", "sound", "picture", "right", "answered", "of its answers, %"),
        rows[:CONFUSIONS_MAX],
        f"{more} more rows are left out." if more > 0 else "",
    )
