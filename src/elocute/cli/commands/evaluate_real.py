"""`elocute evaluate real`: predicted lips against those of real talkers."""

from __future__ import annotations

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.name_lists import read_names
from elocute.cli.outputs import plan_files
from elocute.cli.progress import progress_bar

if TYPE_CHECKING:
    from elocute.cli.tables import Cell
    from elocute.evaluation.tracked_mouth_scores import MouthScore, TrackedMouthReport
    from elocute.motion.curves import Curves

WIDE = 24  # of names of measures


def real_command(
    folder: Path = typer.Argument(
        ...,
        help="Folder of NAME.npz (tracked mouth) and NAME.ogg, or with manifest.json and clips/.",
    ),
    names: Path | None = typer.Option(None, help="Text file of the names to use; all by default."),
    style: str = options.StyleName,
    strength: float = options.Strength,
    model: str = options.Model,
    contacts: str = options.ContactsMeasured,
    mix: str = options.Mix,
    per_clip: bool = typer.Option(False, help="Also print every clip."),
    per_talker: bool = typer.Option(False, help="Also print every language and talker."),
    table: list[Path] | None = options.Table,
    overwrite: bool = options.OverwriteTable,
    no_clobber: bool = options.KeepTable,
    as_json: bool = options.Json,
) -> None:
    """Compare predicted lips with real talkers': correlation, amplitude, closures, rests."""
    from elocute.animation import animate
    from elocute.cli.tables import check_tables, write_tables
    from elocute.evaluation.tracked_mouth_scores import evaluate_tracked_mouths, heard_speech
    from elocute.head.builtin import load_builtin_head
    from elocute.motion.mouth_measures import measure_as_tracked

    files = check_tables(table)
    plan = plan_files((folder,), files, overwrite, no_clobber)
    wanted, shown = read_names(names), options.contacts_measured(contacts)
    eye_distance_mm = 1000 * load_builtin_head().eye_distance_m

    def predict(sound: Path, contacts: str) -> Curves:
        settings = {"style": style, "strength": strength, "model": model, "mix": mix}
        return measure_as_tracked(animate(sound, contacts=contacts, life=0, **settings).motion)

    by_contacts = {}
    for each in shown:
        with progress_bar(f"measuring, contacts {each}", as_json) as progress:
            by_contacts[each] = evaluate_tracked_mouths(
                folder,
                lambda sound, each=each: predict(sound, each),
                eye_distance_mm,
                names=wanted,
                speech=heard_speech,
                progress=progress,
            )
    write_tables(plan, files, *_table(by_contacts, Path(model).name))
    if as_json:
        for each, report in by_contacts.items():
            print(json.dumps(_record(each, report, per_clip)))
        return
    for each, report in by_contacts.items():
        title = f"contacts {each}" if len(by_contacts) > 1 else ""
        if per_clip:
            _show_clips(report.clips, title)
        if per_talker:
            _show_groups(report, title)
    _show_summaries(by_contacts)


def _record(contacts: str, report: TrackedMouthReport, per_clip: bool) -> dict[str, object]:
    """JSON has no NaN: what could not be measured is null."""
    record = {
        "contacts": contacts,
        "summary": _finite(asdict(report.summary)),
        "groups": [_finite(asdict(group)) for group in report.groups[1:]],
    }
    clips = [_finite(asdict(clip)) for clip in report.clips] if per_clip else None
    return record if clips is None else {**record, "clips": clips}


def _finite(values: dict[str, object]) -> dict[str, object]:
    return {name: None if value != value else value for name, value in values.items()}


def _table(
    reports: dict[str, TrackedMouthReport], model: str
) -> tuple[list[str], list[list[Cell]]]:
    from elocute.evaluation.tracked_mouth_scores import GroupScore

    names = [field.name for field in fields(GroupScore)]
    rows = [
        [model, contacts, *(getattr(group, name) for name in names)]
        for contacts, report in reports.items()
        for group in report.groups
    ]
    return ["model", "contacts", *names], rows


def _show_clips(scores: list[MouthScore], title: str) -> None:
    for score in scores:
        print(
            f"{score.name:12} opening r {score.opening_best_r:5.2f}"
            f" at {score.opening_lag_s:+.2f} s  closures {score.closures_met}/{score.closures}"
            f"  false {score.false_met}/{score.others}  {title}".rstrip()
        )


def _show_groups(report: TrackedMouthReport, title: str) -> None:
    for group in report.groups[1:]:
        print(
            f"{group.group:24} {group.takes:5} clips  opening r {group.opening_best_r:5.2f}"
            f" width {group.width_best_r:5.2f}  amplitude {group.amplitude_p50:4.2f}"
            f" {group.amplitude_p99:4.2f}  shut {group.shut:4.2f} ({group.real_shut:4.2f})"
            f"  {title}".rstrip()
        )


def _show_summaries(reports: dict[str, TrackedMouthReport]) -> None:
    """A line for each measure, a column for each of --contacts."""
    if len(reports) > 1:
        print(f"{'contacts':{WIDE}}", *(f"{each:>8}" for each in reports))
    columns = [asdict(report.summary) for report in reports.values()]
    for name in columns[0]:
        values = [column[name] for column in columns]
        if name == "group" or all(value is None or value != value for value in values):
            continue
        cells = [f"{value:.3f}" if isinstance(value, float) else f"{value}" for value in values]
        print(f"{name:{WIDE}}", *(f"{cell:>8}" if len(cells) > 1 else cell for cell in cells))
