"""Synchrony: from which offset people notice that sound and picture are apart.

A sound's lag is felt with an error, x + N(0, σ²), and called early below one bound and late above
another; bounds and σ are fitted by maximum likelihood, a share of answers being lapses. The point
of subjective synchrony is the middle of the bounds; an offset beyond a bound is noticed more often
than not.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import needs_extra
from elocute.evaluation.confidence_intervals import NO_INTERVAL, ConfidenceInterval
from elocute.study.design.design import SYNC_ANSWERS, Condition, Design
from elocute.study.report.answers import Answer
from elocute.study.report.plots import FAINT, MARKERS, SERIES, finish
from elocute.study.report.report_parts import Cell, Plot, Section, Table
from elocute.study.statistics.proportions import wilson_interval

LAPSES = 0.02
"""Share of answers that are given at random, as is usual in such fits (Wichmann and Hill 2001)."""


@dataclass(frozen=True)
class SyncCurve:
    """What is felt at each offset."""

    # Bounds in ms: below the one a sound is called early, above the other late.
    early: float
    late: float
    sd: float  # σ in ms

    @property
    def middle(self) -> float:
        """The point of subjective synchrony, ms."""
        return (self.early + self.late) / 2

    def shares(self, offsets: NDArray[np.float64]) -> NDArray[np.float64]:
        """Shares of early, together and late, (offset, 3)."""
        from scipy.special import ndtr

        early = ndtr((self.early - offsets) / self.sd)
        late = ndtr((offsets - self.late) / self.sd)
        sure = np.stack([early, 1 - early - late, late], axis=-1)
        return LAPSES / 3 + (1 - LAPSES) * np.clip(sure, 1e-9, 1)


def fit_sync_curve(
    offsets: NDArray[np.float64], counts: NDArray[np.float64], start: SyncCurve | None = None
) -> SyncCurve:
    """Fit the curve.

    Parameters
    ----------
    offsets : (offset,)
        In ms; above 0 the sound is later than the picture.
    counts : (offset, 3)
        Answers early, together and late.
    start : SyncCurve, optional
        Where the search begins.

    Returns
    -------
    SyncCurve

    Raises
    ------
    MachineError
        Where scipy is missing.
    """
    with needs_extra("a report", "study"):
        from scipy.optimize import minimize
    span = max(float(np.ptp(offsets)), 20.0)
    start = start or SyncCurve(-span / 4, span / 4, span / 4)

    def curve(at: NDArray[np.float64]) -> SyncCurve:
        low, width, sd = at[0], np.exp(at[1]), np.exp(at[2])
        return SyncCurve(float(low), float(low + width), float(sd))

    def loss(at: NDArray[np.float64]) -> float:
        return -float((counts * np.log(curve(at).shares(offsets))).sum())

    at = [start.early, np.log(max(start.late - start.early, 1.0)), np.log(max(start.sd, 1.0))]
    bounds = [(-3 * span, 3 * span), (0.0, np.log(6 * span)), (0.0, np.log(6 * span))]
    fit = minimize(loss, np.array(at), method="L-BFGS-B", bounds=bounds)
    fit = minimize(loss, fit.x, method="Nelder-Mead", bounds=bounds)
    return curve(fit.x)


def sync_section(design: Design, answers: Sequence[Answer]) -> Section:
    """What people noticed, by offset, of a study of kind "sync"."""
    series = _series(design)
    confidence = design.analysis.confidence
    rows: list[list[Cell]] = []
    fits: list[list[Cell]] = []
    curves: list[tuple[str, NDArray[np.float64], NDArray[np.float64], SyncCurve | None]] = []
    for title, offset_of in series.items():
        of_it = [each for each in answers if each.left in offset_of]
        offsets = np.array(sorted(set(offset_of.values())))
        by_person = _counts(of_it, offset_of, offsets)
        counts = by_person.sum(axis=0)
        for offset, row in zip(offsets, counts, strict=True):
            total = int(row.sum())
            shares = [wilson_interval(int(each), total, confidence) for each in row]
            rows.append([title, float(offset), total, *shares])
        fitted = None
        if len(offsets) > 2 and counts.sum() >= 10:
            fitted = fit_sync_curve(offsets, counts)
            fits.append([title, *_bounds(offsets, by_person, fitted, confidence)])
        curves.append((title, offsets, counts, fitted))
    columns = ("clips", "sound later by, ms", "answers", "early, %", "together, %", "late, %")
    tables = [Table("sync", "Answers by offset", columns, rows)]
    if fits:
        columns = ("clips", "synchrony felt at, ms", "early below, ms", "late above, ms")
        note = f"Intervals are over people; lapses are taken as {LAPSES:.0%} of answers."
        tables.append(Table("sync_bounds", "Bounds", (*columns, "deviation, ms"), fits, note))
    description = "; ".join(
        f"{t}: early below {c.early:.0f} ms, late above {c.late:.0f} ms"
        for t, _, _, c in curves
        if c
    )
    plot = Plot("sync", "Offsets noticed", description, lambda axes: _draw(axes, curves), 3.4)
    return Section("Synchrony", [], [plot], tables)


def _series(design: Design) -> dict[str, dict[str, float]]:
    """Conditions that differ in their offset only, with their offsets."""
    alike: dict[Condition, list[Condition]] = defaultdict(list)
    for each in design.judged:
        alike[replace(each, name="x", offset_ms=0.0)].append(each)
    series = {}
    for members in alike.values():
        title = min(members, key=lambda each: abs(each.offset_ms)).name
        series[title] = {each.name: each.offset_ms for each in members}
    return series


def _counts(
    answers: Sequence[Answer], offset_of: dict[str, float], offsets: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(person, offset, answer)."""
    people = sorted({each.participant for each in answers})
    person = {name: k for k, name in enumerate(people)}
    place = {offset: k for k, offset in enumerate(offsets.tolist())}
    counts = np.zeros((len(people), len(offsets), 3))
    for each in answers:
        at = person[each.participant], place[offset_of[each.left]]
        counts[*at, SYNC_ANSWERS.index(each.answer)] += 1
    return counts


def _bounds(
    offsets: NDArray[np.float64],
    by_person: NDArray[np.float64],
    fitted: SyncCurve,
    confidence: float,
) -> list[Cell]:
    """Middle, bounds and deviation with intervals: people as clusters, by the sandwich."""
    from scipy.stats import t

    at = np.array([fitted.early, fitted.late, fitted.sd])

    def slopes(at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Of each person's log-likelihood, (person, 3)."""
        columns = []
        for step in np.eye(3):
            logs = [np.log(SyncCurve(*at + sign * step).shares(offsets)) for sign in (1, -1)]
            columns.append((by_person * (logs[0] - logs[1]) / 2).sum(axis=(1, 2)))
        return np.stack(columns, axis=1)

    people = len(by_person)
    values = np.array([fitted.middle, *at])
    if people < 3 or fitted.sd <= 2:
        return [replace(NO_INTERVAL, value=float(each)) for each in values]
    curve = np.stack(
        [(slopes(at + step).sum(axis=0) - slopes(at - step).sum(axis=0)) / 2 for step in np.eye(3)]
    )
    inverse = np.linalg.pinv(-(curve + curve.T) / 2)
    each = slopes(at)
    covariance = inverse @ (each.T @ each) @ inverse * people / (people - 1)
    mixes = np.array([[0.5, 0.5, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    errors = np.sqrt(np.maximum(np.diag(mixes @ covariance @ mixes.T), 0))
    reach = float(t.ppf(0.5 + confidence / 2, people - 1)) * errors
    return [
        ConfidenceInterval(float(value), float(value - r), float(value + r))
        for value, r in zip(values, reach, strict=True)
    ]


def _draw(axes: Any, curves: Sequence[tuple[str, Any, Any, SyncCurve | None]]) -> None:
    for place, (title, offsets, counts, fitted) in enumerate(curves):
        colour, marker = SERIES[place % len(SERIES)], MARKERS[place % len(MARKERS)]
        totals = np.maximum(counts.sum(axis=1), 1)
        axes.plot(offsets, 100 * counts[:, 1] / totals, marker, color=colour, label=title, ms=5)
        if fitted:
            fine = np.linspace(offsets.min(), offsets.max(), 200)
            axes.plot(fine, 100 * fitted.shares(fine)[:, 1], color=colour, lw=1.6)
    axes.axvline(0, color=FAINT, lw=1, zorder=0)
    axes.set_ylim(-3, 103)
    axes.set_xlabel("sound later than picture by, ms")
    axes.set_ylabel("“together”, %")
    if len(curves) > 1:
        axes.legend(frameon=False)
    finish(axes)
