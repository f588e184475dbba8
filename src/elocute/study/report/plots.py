"""Plots of reports, drawn on axes of matplotlib in colours that a page may change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from elocute.evaluation.confidence_intervals import ConfidenceInterval
from elocute.study.report.report_parts import Plot, Table

INK, FAINT, BAND = "#111213", "#a1a2a3", "#e1e2e3"
SERIES = ("#1f6fb1", "#c2571a", "#2a8a5b", "#8a4fb0", "#b08a1f")
"""Told apart by lightness and by marker too."""
MARKERS = "osD^v"


def interval_plot(
    table: Table,
    names: Sequence[str],
    series: Mapping[str, Sequence[ConfidenceInterval]],
    along: str,
    *,
    height: float,
    number: str = ".2f",
    limits: tuple[float, float] | None = None,
    percent: bool = False,
    **marks: Any,
) -> Plot:
    """A table's estimates with their intervals, told by those of the last series.

    `along` names the axis, `number` is the format of what is told, and `marks` are `middle` and
    `band` as for `_draw_intervals`.
    """
    description = "; ".join(
        f"{name} {100 * each.value:.0f} %" if percent else f"{name} {each.value:{number}}"
        for name, each in zip(names, list(series.values())[-1], strict=True)
    )

    def draw(axes: Any) -> None:
        _draw_intervals(axes, names, series, percent=percent, **marks)
        if limits:
            axes.set_xlim(*limits)
        axes.set_xlabel(along)

    return Plot(table.name, table.title, description, draw, height)


def _draw_intervals(
    axes: Any,
    names: Sequence[str],
    series: Mapping[str, Sequence[ConfidenceInterval]],
    *,
    middle: float | None = None,
    band: tuple[float, float] | None = None,
    percent: bool = False,
) -> None:
    """Estimates with their intervals, a row for each name, the first at the top.

    `middle` draws a line where there is no difference, `band` shades what is as good as none, and
    values are shares where `percent` says so.
    """
    factor = 100 if percent else 1
    if band:
        axes.axvspan(factor * band[0], factor * band[1], color=BAND, zorder=0, lw=0)
    if middle is not None:
        axes.axvline(factor * middle, color=FAINT, lw=1, zorder=1)
    step = 0.26
    for place, (title, intervals) in enumerate(series.items()):
        off = (place - (len(series) - 1) / 2) * step
        for row, each in enumerate(intervals):
            if each.value != each.value:
                continue
            low, high = (each.low, each.high) if each.low == each.low else (each.value,) * 2
            axes.errorbar(
                factor * each.value,
                row + off,
                xerr=[[factor * (each.value - low)], [factor * (high - each.value)]],
                fmt=MARKERS[place],
                color=SERIES[place],
                ms=5,
                lw=1.6,
                capsize=3,
                label=title if title and row == 0 else None,
            )
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    finish(axes, percent=percent)
    if len(series) > 1:
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.0), ncols=len(series), frameon=False)
        axes.set_ylim(len(names) - 0.4, -1.1)


def finish(axes: Any, *, percent: bool = False) -> None:
    """Only the axes that say something; with `percent`, shares are along x."""
    axes.spines[["top", "right"]].set_visible(False)
    if percent:
        low, high = axes.get_xlim()
        axes.set_xlim(max(low, -2), min(high, 102))
