"""The table of answers: what a study ends in and a report begins with. One row for each answer."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from datetime import datetime
from pathlib import Path
from typing import Any

from elocute.errors import StudyError, needs_extra
from elocute.files.atomic import write_atomically
from elocute.files.delimited import DelimitedTable
from elocute.files.json_records import read_record
from elocute.files.parquet_size import unpacked_bytes
from elocute.files.reading import FileKind, open_regular, read_text
from elocute.study.design.design import KINDS, WORD_MAX
from elocute.study.design.trials import Shown

ROLES = ("test", "qualification", "catch", "practice")
SUFFIXES = (".csv", ".json", ".parquet")
FILE_MAX_BYTES = 500_000_000
CSV_FILE = FileKind("a .csv of answers", FILE_MAX_BYTES, StudyError)
ROWS_MAX = 5_000_000
FORMAT = "elocute answers"
_DOTTED = re.compile(r"[a-z0-9_.-]{1,300}")
_NAME = re.compile(r"[a-z0-9_-]{0,64}")


@dataclass(frozen=True)
class Answer:
    """One answer of one person.

    Attributes
    ----------
    participant : str
        An opaque name, the same in all of a person's rows.
    group : int
        Block of the assignment, from 1.
    order : int
        Position in the participant's sequence, from 1.
    trial : str
        Name of the trial, the same for all who saw it.
    kind : str
        One of `design.KINDS`.
    role : str
        One of `ROLES`.
    stimulus : str
        Sound, face and view: `sentence01.dana.front`.
    reference : str
        Condition of the reference clip, or "".
    left, right : str
        Conditions at either side; `right` is "" where one video is judged.
    answer : str
        The condition that was chosen, a number from 0 to 100, or a word.
    correct : str
        What the answer should be, where that is known, else "".
    seconds : float
        From the first playable frame to the answer.
    replays : int
        How often it was played again.
    answered_at : str
        UTC, ISO 8601 with milliseconds.

    Raises
    ------
    StudyError
        For a value of another type or that no study writes.
    """

    participant: str
    group: int
    order: int
    trial: str
    kind: str
    role: str
    stimulus: str
    reference: str
    left: str
    right: str
    answer: str
    correct: str
    seconds: float
    replays: int
    answered_at: str

    def __post_init__(self) -> None:
        for name, fits, allowed in (
            ("participant", _is(_DOTTED, self.participant), "a to z, 0 to 9, _ . -"),
            ("trial", _is(_DOTTED, self.trial), "a to z, 0 to 9, _ . -"),
            ("stimulus", _is(_DOTTED, self.stimulus), "a to z, 0 to 9, _ . -"),
            ("reference", _is(_NAME, self.reference), "a condition, or nothing"),
            ("left", bool(self.left) and _is(_NAME, self.left), "a condition"),
            ("right", _is(_NAME, self.right), "a condition, or nothing"),
            ("kind", self.kind in KINDS, ", ".join(KINDS)),
            ("role", self.role in ROLES, ", ".join(ROLES)),
            ("answer", 0 < len(self.answer) <= WORD_MAX, f"1 to {WORD_MAX} characters"),
            ("correct", len(self.correct) <= WORD_MAX, f"up to {WORD_MAX} characters"),
            ("group", 0 <= self.group < 1e6, "0 to 1000000"),
            ("order", 1 <= self.order < 1e6, "1 to 1000000"),
            ("replays", 0 <= self.replays < 1e6, "0 to 1000000"),
            ("seconds", math.isfinite(self.seconds) and self.seconds >= 0, "0 or more"),
            ("answered_at", _is_time(self.answered_at), "a time such as 2026-01-31T12:00:00.000Z"),
        ):
            if not fits:
                value = repr(getattr(self, name))[:WORD_MAX]
                raise StudyError.about(f"`{name}`", found=value, allowed=allowed)


COLUMNS = tuple(each.name for each in fields(Answer))
"""In the order of every file."""
NUMBERS = {"group": int, "order": int, "replays": int, "seconds": float}
"""Columns that are no texts. Of whole ones pandas may write 3.0."""


def _is(pattern: re.Pattern[str], text: object) -> bool:
    return isinstance(text, str) and pattern.fullmatch(text) is not None


def _is_time(text: str) -> bool:
    try:
        return datetime.fromisoformat(text).tzinfo is not None
    except (TypeError, ValueError):
        return False


def answer_to(
    shown: Shown,
    answer: str,
    *,
    participant: str,
    group: int,
    seconds: float,
    replays: int,
    answered_at: str,
) -> Answer:
    """A person's answer to a trial that they were shown, as a row of the table."""
    trial = shown.trial
    return Answer(
        participant,
        group,
        shown.order,
        trial.name,
        trial.kind,
        trial.role,
        trial.stimulus,
        trial.reference,
        shown.left,
        shown.right,
        answer,
        trial.correct,
        seconds,
        replays,
        answered_at,
    )


def answers_text(answers: Iterable[Answer], suffix: str) -> str:
    """Answers as the text of a file with the suffix ".csv" or ".json"."""
    rows = [asdict(each) for each in answers]
    if suffix == ".json":
        return json.dumps({"format": FORMAT, "version": 1, "answers": rows}, indent=1) + "\n"
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def write_answers(answers: Sequence[Answer], path: str | Path) -> None:
    """Write a table of answers.

    Parameters
    ----------
    answers : sequence of Answer
        Rows.
    path : str or Path
        .csv, .json or .parquet; a file of that name is replaced.

    Raises
    ------
    StudyError
        For another suffix.
    MachineError
        For .parquet without pyarrow.
    OutputError
        For a place that cannot be written.
    """
    suffix = _suffix(Path(path))
    if suffix == ".parquet":
        parquet, arrow = _pyarrow()
        columns = {name: [getattr(each, name) for each in answers] for name in COLUMNS}
        kinds = {int: arrow.int64(), float: arrow.float64()}
        schema = arrow.schema(
            [
                (name, kinds[NUMBERS[name]] if name in NUMBERS else arrow.string())
                for name in COLUMNS
            ]
        )
        with write_atomically(path) as draft:
            parquet.write_table(arrow.table(columns, schema=schema), draft)
        return
    with write_atomically(path) as draft:
        draft.write_text(answers_text(answers, suffix), encoding="utf-8", newline="")


def read_answers(path: str | Path) -> list[Answer]:
    """Read a table of answers, of this server or of any other study.

    Parameters
    ----------
    path : str or Path
        .csv, .json or .parquet with the columns of `Answer`, in any order.

    Returns
    -------
    list of Answer
        In the file's order.

    Raises
    ------
    StudyError
        For a file that cannot be read, a column that is missing and a value that does not fit, with
        its row.
    MachineError
        For .parquet without pyarrow.
    """
    path = Path(path)
    suffix = _suffix(path)
    rows = {".csv": _csv_rows, ".json": _json_rows, ".parquet": _parquet_rows}[suffix](path)
    return [_answer(path, place, row) for place, row in enumerate(rows, 1)]


def _suffix(path: Path) -> str:
    if path.suffix.lower() not in SUFFIXES:
        raise StudyError.about(path, found=f"suffix {path.suffix!r}", allowed=", ".join(SUFFIXES))
    return path.suffix.lower()


def _answer(path: Path, place: int, row: Mapping[str, Any]) -> Answer:
    values: dict[str, Any] = {}
    for name in COLUMNS:
        value = row.get(name)
        if value is None:
            raise StudyError.about(f"{path} row {place}", found=f"no `{name}`", allowed=_ALLOWED)
        kind = NUMBERS.get(name, str)
        try:
            values[name] = kind(value if kind is str else float(value))
            if kind is int and values[name] != float(value):
                raise ValueError("no whole number")
        except (ValueError, OverflowError, TypeError):
            raise StudyError.about(
                f"{path} row {place} `{name}`",
                found=repr(value)[:WORD_MAX],
                allowed="a whole number" if kind is int else "a number",
            ) from None
    try:
        return Answer(**values)
    except StudyError as error:
        raise StudyError(f"{path} row {place} {error}") from None


_ALLOWED = f"the columns {', '.join(COLUMNS)}"


def _csv_rows(path: Path) -> list[dict[str, Any]]:
    text = read_text(path, CSV_FILE)
    try:
        table = DelimitedTable.of(text)
        missing = [name for name in COLUMNS if name not in table.names]
        if missing:
            raise StudyError.about(
                path, found=f"no column `{missing[0]}`", allowed=", ".join(COLUMNS)
            )
        rows = [dict(zip(table.names, row, strict=False)) for _, row in table.rows()]
    except csv.Error as problem:
        raise StudyError.about(path, found=str(problem), allowed="a .csv of answers") from None
    return [row | {"seconds": table.number_text(row.get("seconds", ""))} for row in rows]


def _json_rows(path: Path) -> list[dict[str, Any]]:
    allowed = f'{{"format": "{FORMAT}", "version": 1, "answers": […]}}'
    record = read_record(path, FileKind(allowed, FILE_MAX_BYTES, StudyError))
    rows = record.get("answers")
    fits = record.get("format") == FORMAT
    if not fits or not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise StudyError.about(path, found="something else", allowed=allowed)
    return rows


def _parquet_rows(path: Path) -> list[dict[str, Any]]:
    parquet, arrow = _pyarrow()
    allowed = "a .parquet of answers"
    with open_regular(path, FileKind(allowed, FILE_MAX_BYTES, StudyError)) as file:
        try:
            unpacked = unpacked_bytes(file)
            if unpacked > FILE_MAX_BYTES:
                raise ValueError(f"{unpacked} bytes unpacked")
            file.seek(0)
            table = parquet.read_table(file)
        except (ValueError, OSError, arrow.ArrowException) as problem:
            raise StudyError.about(path, found=str(problem), allowed=allowed) from None
    missing = [name for name in COLUMNS if name not in table.column_names]
    if missing:
        raise StudyError.about(path, found=f"no column `{missing[0]}`", allowed=_ALLOWED)
    return table.select(list(COLUMNS)).to_pylist()


def _pyarrow() -> tuple[Any, Any]:
    with needs_extra("a .parquet of answers", "study"):
        import pyarrow
        import pyarrow.parquet
    return pyarrow.parquet, pyarrow
