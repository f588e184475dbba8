"""How answers change in the course of a session: speed, obvious items, agreement with others."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np

from elocute.evaluation.confidence_intervals import NO_INTERVAL, ConfidenceInterval
from elocute.study.design.design import Design
from elocute.study.report.answers import Answer
from elocute.study.report.exclusions import Kept
from elocute.study.report.plots import SERIES, finish
from elocute.study.report.report_parts import Cell, Plot, Section, Table
from elocute.study.statistics.proportions import wilson_interval

PARTS = 5


def learning_section(design: Design, kept: Kept) -> Section:
    """Answers by fifths of each person's sequence."""
    parts = _parts(kept.tests)
    alike = _as_others(kept.tests) if design.study.kind != "rating" else {}
    confidence = design.analysis.confidence
    rows: list[list[Cell]] = []
    seconds: list[float] = []
    agreeing: list[ConfidenceInterval] = []
    for number in range(PARTS):
        of_part = [each for each, part in zip(kept.tests, parts, strict=True) if part == number]
        took = [each.seconds for each in of_part]
        told = [alike[id(each)] for each in of_part if id(each) in alike]
        agreeing.append(wilson_interval(sum(told), len(told), confidence) if told else NO_INTERVAL)
        seconds.append(float(np.median(took)) if took else float("nan"))
        quarter = float(np.quantile(took, 0.25)) if took else None
        late = float(np.quantile(took, 0.75)) if took else None
        again = float(np.mean([each.replays for each in of_part])) if took else None
        rows.append([number + 1, len(of_part), seconds[-1], quarter, late, again, agreeing[-1]])
    columns = ("fifth", "answers", "median time, s", "quarter below, s", "quarter above, s")
    columns += ("replays", "as most others, %")
    table = Table(
        "learning",
        "In the course of a session",
        columns,
        rows,
        "Fifths of each person's test trials in their order. As most others: the answer that more "
        "than half of the others gave to the same trial.",
    )
    told = "; ".join(f"fifth {k + 1}: {each:.1f} s" for k, each in enumerate(seconds))
    plot = Plot("learning", table.title, told, lambda axes: _draw(axes, seconds, agreeing), 2.8)
    return Section("Learning and fatigue", [], [plot], [table, _repeat_table(design, kept)])


def _parts(tests: Sequence[Answer]) -> list[int]:
    """Which fifth of the person's test answers each is in."""
    of_person: dict[str, list[int]] = defaultdict(list)
    for each in tests:
        of_person[each.participant].append(each.order)
    rank = {
        (person, order): (place * PARTS) // len(orders)
        for person, orders in of_person.items()
        for place, order in enumerate(sorted(orders))
    }
    return [rank[each.participant, each.order] for each in tests]


def _as_others(tests: Sequence[Answer]) -> dict[int, bool]:
    """By answer: whether it is what most others gave; without ties and trials of one person."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for each in tests:
        counts[each.trial][each.answer] += 1
    alike = {}
    for each in tests:
        others = counts[each.trial].copy()
        others[each.answer] -= 1
        total = others.total()
        most, count = max(others.items(), key=lambda item: item[1])
        if 2 * count > total:
            alike[id(each)] = each.answer == most
    return alike


def _repeat_table(design: Design, kept: Kept) -> Table:
    if design.study.kind == "rating":
        apart = [abs(float(a.answer) - float(b.answer)) for a, b in kept.repeats]
        value = float(np.mean(apart)) if apart else None
        rows: list[list[Cell]] = [[len(apart), value]]
        columns = ("trials seen twice", "mean difference, points of 100")
        return Table("repeats", "Agreement with oneself", columns, rows)
    alike = sum(first.answer == second.answer for first, second in kept.repeats)
    share = wilson_interval(alike, len(kept.repeats), design.analysis.confidence)
    rows = [[len(kept.repeats), share]]
    columns = ("trials seen twice", "answered alike, %")
    return Table("repeats", "Agreement with oneself", columns, rows)


def _draw(axes: Any, seconds: Sequence[float], agreeing: Sequence[ConfidenceInterval]) -> None:
    places = np.arange(1, PARTS + 1)
    axes.plot(places, seconds, "o-", color=SERIES[0], lw=1.6, ms=5, label="median time, s")
    axes.set_xticks(places)
    axes.set_xlabel("fifth of the session")
    axes.set_ylabel("median time, s")
    axes.set_ylim(0, 1.2 * max((each for each in seconds if each == each), default=1.0))
    finish(axes)
    if all(each.value != each.value for each in agreeing):
        return
    right = axes.twinx()
    right.plot(
        places, [100 * each.value for each in agreeing], "s--", color=SERIES[1], lw=1.6, ms=5
    )
    right.set_ylim(0, 100)
    right.set_ylabel("as most others, % (squares)")
    right.spines[["top", "left"]].set_visible(False)
