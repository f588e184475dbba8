"""Tables as files: what stands in a CSV, what LaTeX makes of it, what is refused."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from elocute.cli.outputs import plan_files
from elocute.cli.tables import check_tables, write_tables
from elocute.errors import InputError, OutputError
from elocute.evaluation.confidence_intervals import NO_INTERVAL, ConfidenceInterval

COLUMNS = ["name", "clips", "error mm²", "p"]
ROWS = [
    ["50 %_a", 3, ConfidenceInterval(1.23456, 1.0, 2.5), 0.0125],
    ["b", 4, NO_INTERVAL, None],
    ["c", 5, NO_INTERVAL, float("nan")],
]


def write(path: Path) -> None:
    """As a command does: planned from its inputs, then written."""
    plan = plan_files([path.parent / "corpus"], [path], False, False)
    write_tables(plan, check_tables([path]), COLUMNS, ROWS)


def test_an_interval_has_three_columns_in_a_csv(tmp_path: Path) -> None:
    write(tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        first, second, third = csv.DictReader(file)
    assert first == {
        "name": "50 %_a",
        "clips": "3",
        "error mm²": "1.23456",
        "error mm² low": "1.0",
        "error mm² high": "2.5",
        "p": "0.0125",
    }
    assert second["error mm²"] == second["error mm² low"] == second["p"] == third["p"] == ""


def test_latex_is_a_whole_tabular(tmp_path: Path) -> None:
    write(tmp_path / "t.tex")
    lines = (tmp_path / "t.tex").read_text(encoding="utf-8").splitlines()
    assert lines == [
        r"\begin{tabular}{lrrr}",
        r"\toprule",
        r"name & clips & error mm$^2$ & p \\",
        r"\midrule",
        r"50 \%\_a & 3 & $1.23$ [$1$, $2.5$] & $0.0125$ \\",
        r"b & 4 & -- & -- \\",
        r"c & 5 & -- & -- \\",
        r"\bottomrule",
        r"\end{tabular}",
    ]


def test_other_suffixes_are_refused_and_files_of_others_kept(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.csv or \.tex"):
        check_tables([tmp_path / "t.csv", tmp_path / "t.xlsx"])
    assert check_tables(None) == []
    (tmp_path / "t.csv").write_text("mine")
    with pytest.raises(OutputError, match="not made from"):
        write(tmp_path / "t.csv")
    assert (tmp_path / "t.csv").read_text() == "mine"
