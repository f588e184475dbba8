"""Plots of reports, drawn on axes of matplotlib in colours that a page may change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from elocute.evaluation.confidence_intervals import ConfidenceInterval

INK, FAINT, BAND = "#111213", "#a1a2a3", "#e1e2e3"
SERIES = ("#1f6fb1", "#c2571a", "#2a8a5b", "#8a4fb0", "#b08a1f")
"""Told apart by lightness and by marker too."""
MARKERS = "osD^v"


def plot_intervals(
    axes: Any,
    names: Sequence[str],
    series: Mapping[str, Sequence[ConfidenceInterval]],
    *,
    middle: float | None = None,
    band: tuple[float, float] | None = None,
    percent: bool = False,
) -> None:
    """Estimates with their intervals, a row for each name, the first at the top.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where to draw.
    names : sequence of str
        Of the rows.
    series : mapping of str to sequence of ConfidenceInterval
        An interval for each row, by what it is.
    middle : float, optional
        Where a line stands: no difference.
    band : tuple of float, optional
        What is shaded: as good as no difference.
    percent : bool
        Whether values are shares.
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
    """Only the axes that say something.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Where was drawn.
    percent : bool
        Whether shares are along x.
    """
    axes.spines[["top", "right"]].set_visible(False)
    if percent:
        low, high = axes.get_xlim()
        axes.set_xlim(max(low, -2), min(high, 102))
