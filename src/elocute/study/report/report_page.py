"""A report as one HTML page: no script, no request to anywhere, light and dark, for any reader."""

from __future__ import annotations

import html
import io
import re
from importlib.resources import files
from typing import Any

from elocute._version import __version__
from elocute.errors import needs_extra
from elocute.study.report.plots import BAND, FAINT, INK, SERIES
from elocute.study.report.report_parts import Plot, Report, Section, Table, is_text, shown

WIDTH_IN = 7.0
COLOURS = {
    INK: "ink",
    FAINT: "faint",
    BAND: "band",
    **{colour: f"s{place}" for place, colour in enumerate(SERIES)},
}
"""What colours of plots are called on the page, where they follow its light or dark."""
DASHES = 2 * "-"
"""Before the name of a property of a page."""


def page_text(report: Report) -> str:
    """A report as a page; whatever strangers wrote in it is shown and never markup.

    Raises MachineError where matplotlib is missing.
    """
    parts = {
        "TITLE": html.escape(report.title),
        "VERSION": __version__,
        "WARNINGS": "\n".join(
            f'<p class="warning" role="note">{html.escape(each)}</p>' for each in report.warnings
        ),
        "PARTS": "".join(
            f'<li><a href="#{_name(each.title)}">{html.escape(each.title)}</a></li>'
            for each in report.sections
        ),
        "FACTS": "".join(
            f"<dt>{html.escape(name)}</dt><dd>{html.escape(value)}</dd>"
            for name, value in report.facts
        ),
        "SECTIONS": "\n".join(_section(each) for each in report.sections),
    }
    page = files("elocute.study.report").joinpath("report_page.html").read_text(encoding="utf-8")
    # All at once: what is put in is never looked through again.
    return re.sub(r"@([A-Z]+)@", lambda found: parts[found[1]], page)


def _name(title: str) -> str:
    return re.sub(r"[^a-z]+", "-", title.lower())


def _section(section: Section) -> str:
    name = _name(section.title)
    parts = [f'<section aria-labelledby="{name}"><h2 id="{name}">{html.escape(section.title)}</h2>']
    parts += [f"<p>{html.escape(text)}</p>" for text in section.texts]
    parts += [_figure(plot) for plot in section.plots]
    parts += [_table(table) for table in section.tables]
    return "\n".join([*parts, "</section>"])


def _figure(plot: Plot) -> str:
    title = f"plot-{plot.name}"
    drawing = re.sub(
        r"<svg ",
        f'<svg role="img" aria-labelledby="{title}" aria-describedby="{title}-told" ',
        plot_svg(plot),
        count=1,
    )
    description = f'<desc id="{title}-told">{html.escape(plot.told)}</desc>'
    drawing = re.sub(r"(<svg [^>]*>)", lambda found: found[1] + description, drawing, count=1)
    caption = f'<figcaption id="{title}">{html.escape(plot.title)}</figcaption>'
    return f"<figure>{caption}{drawing}</figure>"


def plot_svg(plot: Plot) -> str:
    """A plot as `<svg …>…</svg>` in the page's colours and letters, the same for the same plot.

    Raises MachineError where matplotlib is missing.
    """
    text = io.StringIO()
    with drawing(plot.name) as pyplot:
        figure = pyplot.Figure(figsize=(WIDTH_IN, plot.height), layout="constrained")
        plot.draw(figure.add_subplot())
        figure.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg ") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r' (width|height)="[\d.]+pt"', "", svg, count=2)
    # Names of its parts are the plot's own: several stand on one page.
    svg = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{plot.name}-", svg)
    svg = svg.replace("font: ", "font-family: inherit; font: ")
    for colour, name in COLOURS.items():
        svg = svg.replace(colour, f"var({DASHES}{name})")
    return svg.strip()


class drawing:  # noqa: N801  used as a statement
    """Around work with matplotlib: letters stay letters, ink is the page's, nothing is shown."""

    def __init__(self, salt: str) -> None:
        self._settings: dict[Any, Any] = {
            "svg.fonttype": "none",
            "svg.hashsalt": salt,
            "pdf.fonttype": 42,
            "font.family": "sans-serif",
            "font.sans-serif": ["DejaVu Sans"],
            "font.size": 10.0,
            "axes.edgecolor": INK,
            "axes.labelcolor": INK,
            "axes.linewidth": 0.8,
            "text.color": INK,
            "xtick.color": INK,
            "ytick.color": INK,
            "text.parse_math": False,
        }

    def __enter__(self) -> Any:
        with needs_extra("a report", "study"):
            import matplotlib
            import matplotlib.figure
        self._context = matplotlib.rc_context(self._settings)
        self._context.__enter__()
        return matplotlib.figure

    def __exit__(self, *error: Any) -> None:
        self._context.__exit__(*error)


def _table(table: Table) -> str:
    words = [is_text(table, column) for column in range(len(table.columns))]
    head = "".join(
        f'<th scope="col"{"" if left else " class=n"}>{html.escape(name)}</th>'
        for name, left in zip(table.columns, words, strict=True)
    )
    body = "\n".join(_row(table, row, words) for row in table.rows)
    note = f'<p class="note">{html.escape(table.note)}</p>' if table.note else ""
    title = html.escape(table.title)
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{title}">'
        f"<table><caption>{title}</caption><thead><tr>{head}</tr></thead>"
        f"<tbody>\n{body}\n</tbody></table></div>{note}"
    )


def _row(table: Table, row: list[Any], words: list[bool]) -> str:
    cells = []
    for place, (cell, heading) in enumerate(zip(row, table.columns, strict=True)):
        text = html.escape(shown(cell, heading))
        side = "" if words[place] else " class=n"
        cells.append(
            f'<th scope="row"{side}>{text}</th>' if not place else f"<td{side}>{text}</td>"
        )
    return f"<tr>{''.join(cells)}</tr>"
