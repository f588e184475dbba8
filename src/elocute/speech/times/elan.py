"""Reads ELAN's annotations (.eaf), and the tables that it exports."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from xml.etree.ElementTree import Element

import numpy as np

from elocute.errors import InputError
from elocute.files.delimited import DelimitedTable
from elocute.speech.times.labels import Label, Labels, clock_seconds, seconds_of
from elocute.speech.times.tier_choice import TierChoice

ROOT = "ANNOTATION_DOCUMENT"
BEGINS, ENDS = (
    tuple(f"{edge}_time_-_{form}" for form in ("hh:mm:ss.ms", "ss.msec", "msec"))
    for edge in ("begin", "end")
)
"""Names of columns in an export that has them."""
_TIME = re.compile(r"\d+:\d\d:\d\d\.\d+|\d+(?:\.\d+)?")


def parse_eaf(
    root: Element, choice: TierChoice, sorted_out: Callable[[list[Label]], Labels]
) -> Labels:
    """Labels of a tier whose annotations have times. Raises InputError."""
    slots = {each.get("TIME_SLOT_ID"): each.get("TIME_VALUE") for each in root.iter("TIME_SLOT")}
    times = {slot: _milliseconds(value) for slot, value in slots.items() if slot and value}
    media = root.find(".//MEDIA_DESCRIPTOR")
    later = _milliseconds((media.get("TIME_ORIGIN") if media is not None else None) or "0")
    tiers = [
        (tier.get("TIER_ID", ""), _aligned([*tier.iter("ALIGNABLE_ANNOTATION")], times, later))
        for tier in root.iter("TIER")
    ]
    labels = choice.labels([(name, rows) for name, rows in tiers if rows], sorted_out)
    notes = [f"the sound begins {later:g} s before ELAN's times"] if later else []
    return replace(labels, notes=[*labels.notes, *notes])


def _aligned(annotations: list[Element], times: Mapping[str, float], later: float) -> list[Label]:
    """The annotations of a tier; the times that nobody set part what lies between others evenly."""
    ends = [tuple(each.get(f"TIME_SLOT_REF{n}", "") for n in (1, 2)) for each in annotations]
    slots = list(dict.fromkeys(slot for pair in ends for slot in pair))
    set_at = [at for at, slot in enumerate(slots) if slot in times]
    if annotations and not set_at:
        raise InputError.about("annotations of ELAN", found="no times", allowed="some with times")
    values = np.interp(range(len(slots)), set_at or [0], [times[slots[at]] for at in set_at] or [0])
    seconds = dict(zip(slots, map(float, values), strict=True))
    texts = [(each.findtext("ANNOTATION_VALUE") or "").strip() for each in annotations]
    return [
        (seconds[start] + later, seconds[end] + later, text)
        for (start, end), text in zip(ends, texts, strict=True)
    ]


def _milliseconds(value: str) -> float:
    is_whole = re.fullmatch("[0-9]{1,12}", value) is not None
    return seconds_of(int(value) if is_whole else value, "time of ELAN, ms", 0.001)


def elan_table(text: str) -> DelimitedTable | None:
    """The table of an export without names of its columns; None for any other text.

    Tier and speaker come first, then begin, end and duration, each in as many formats, and last
    what is said.
    """
    cells = text.partition("\n")[0].rstrip("\r").split("\t")
    times, formats = cells[2:-1], len(cells[2:-1]) // 3
    if not times or len(times) != 3 * formats or not all(map(_TIME.fullmatch, times)):
        return None
    clocks = map(clock_seconds, times[::formats])
    begin, end, length = (
        float(time) if at is None else at for at, time in zip(clocks, times[::formats], strict=True)
    )
    if abs(begin + length - end) > 0.002:
        return None
    unit, others = "ms" if times[0].isdigit() else "s", [""] * (formats - 1)
    spans = [f"start_{unit}", *others, f"end_{unit}", *others, *others, ""]
    return DelimitedTable(("tier", "speaker", *spans, "label"), "\t", text, 0)


def tier_columns(names: Sequence[str]) -> list[str]:
    """The columns beside the times of an export with names, a tier each; none of other tables."""
    times = ("begin_time_-_", "end_time_-_", "duration_-_")
    is_export = any(name in BEGINS for name in names)
    return [name for name in names if is_export and name and not name.startswith(times)]
