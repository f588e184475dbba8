"""The table of answers: written and read in each format, and refused where a value does not fit."""

import csv
from dataclasses import replace

import pytest

from elocute.errors import StudyError
from elocute.study.report.answers import COLUMNS, SUFFIXES, Answer, read_answers, write_answers

ROW = Answer(
    participant="p1",
    group=1,
    order=1,
    trial="one.mean.front.ours.theirs",
    kind="binary",
    role="test",
    stimulus="one.mean.front",
    reference="",
    left="ours",
    right="theirs",
    answer="ours",
    correct="",
    seconds=2.25,
    replays=0,
    answered_at="2026-01-31T12:00:00.000Z",
)
ROWS = [ROW, replace(ROW, order=2, kind="intelligibility", right="", answer='Bär, "x"')]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_written_is_read_again(tmp_path, suffix):
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"answers{suffix}"
    write_answers(ROWS, path)
    assert read_answers(path) == ROWS
    write_answers([], path)
    assert read_answers(path) == []


def test_a_table_that_excel_saved_elsewhere_in_the_world_is_read(tmp_path):
    path = tmp_path / "answers.csv"
    write_answers(ROWS, path)
    with path.open(newline="") as file:
        rows = [[cell.replace("2.25", "2,25") for cell in row] for row in csv.reader(file)]
    with path.open("w", newline="", encoding="utf-8-sig") as file:
        csv.writer(file, delimiter=";").writerows(rows)
    assert read_answers(path) == ROWS


def test_whole_numbers_as_pandas_saves_them(tmp_path):
    path = tmp_path / "answers.csv"
    write_answers(ROWS, path)
    rows = list(csv.DictReader(path.read_text().splitlines()))
    with path.open("w") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(row | {"order": f"{row['order']}.0"} for row in rows)
    assert read_answers(path) == ROWS
    path.write_text(path.read_text().replace(f",{ROWS[0].order}.0,", ",1.5,", 1))
    with pytest.raises(StudyError, match=r"`order`: '1\.5'; allowed: a whole number"):
        read_answers(path)


WRONG = {
    "participant": "<script>",
    "kind": "quaternary",
    "role": "boss",
    "left": "",
    "right": "../x",
    "answer": "",
    "seconds": "-1",
    "order": "0",
    "replays": "many",
    "answered_at": "yesterday",
    "group": "1e999",
}


@pytest.mark.parametrize("column", WRONG)
def test_a_value_that_no_study_writes_is_refused_with_its_row(tmp_path, column):
    path = tmp_path / "answers.csv"
    write_answers(ROWS, path)
    rows = list(csv.DictReader(path.read_text().splitlines()))
    rows[1][column] = WRONG[column]
    with path.open("w") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    with pytest.raises(StudyError, match=f"row 2 `{column}`"):
        read_answers(path)


def test_a_missing_column_is_named(tmp_path):
    path = tmp_path / "answers.csv"
    path.write_text("participant,order\np1,1\n")
    with pytest.raises(StudyError, match="no column `group`"):
        read_answers(path)


def test_columns_may_stand_in_any_order_beside_others(tmp_path):
    path = tmp_path / "answers.csv"
    write_answers(ROWS, path)
    rows = list(csv.DictReader(path.read_text().splitlines()))
    with path.open("w") as file:
        writer = csv.DictWriter(file, ["age", *reversed(COLUMNS)])
        writer.writeheader()
        writer.writerows({**row, "age": "30"} for row in rows)
    assert read_answers(path) == ROWS


@pytest.mark.parametrize(
    ("name", "data"),
    [("a.json", b"[]"), ("a.parquet", b"PAR1"), ("a.csv", b"\xff"), ("a.txt", b"")],
)
def test_another_file_is_refused(tmp_path, name, data):
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(StudyError, match=name):
        read_answers(path)
