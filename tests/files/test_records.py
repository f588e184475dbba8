"""JSON whose numbers are numbers."""

from dataclasses import replace

import pytest

from elocute.errors import HeadError, InputError
from elocute.files.json_records import finite_number, parse_json, read_record, write_record
from elocute.files.reading import FileKind

RECORD = FileKind("a record", 100_000)


def test_a_record_comes_back(tmp_path):
    write_record(tmp_path / "a.json", {"name": "hana", "numbers": [1, -2.5, 3e4]})
    assert read_record(tmp_path / "a.json", RECORD) == {"name": "hana", "numbers": [1, -2.5, 3e4]}
    (tmp_path / "b.json").write_bytes(b"\xef\xbb\xbf{}")  # as Windows editors save it
    assert read_record(tmp_path / "b.json", RECORD) == {}


def test_brackets_in_texts_and_many_in_a_row_are_no_depth(tmp_path):
    record = {"a": "[{" * 500 + '"\\', "b": [[]] * 500, "c": "]]" * 500}
    write_record(tmp_path / "a.json", record)
    assert read_record(tmp_path / "a.json", RECORD) == record


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('{"a": NaN}', "NaN"),
        ('{"a": -Infinity}', "Infinity"),
        ('{"a": 1e999}', "beyond what a number holds"),
        ('{"a": ' + "9" * 400 + "}", "400 digits"),
        ('{"a": ' + "9" * 9000 + "}", "9000 digits"),
        ("[" * 50_000, "nested too deeply"),
        (f'{{"a": {"[" * 101}{"]" * 101}}}', "nested too deeply"),
        ('{"a":' * 200 + "[]" + "}" * 200, "nested too deeply"),
        ("[1, 2]", "JSON of a list"),
        ("{", "no JSON"),
        ("", "no JSON"),
    ],
)
def test_what_no_step_could_use_is_one_line(tmp_path, text, found):
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(HeadError) as caught:
        read_record(tmp_path / "a.json", replace(RECORD, error=HeadError))
    assert found in str(caught.value)
    assert len(str(caught.value)) < 500
    assert "\n" not in str(caught.value)


def test_bytes_that_are_no_text_are_one_line():
    with pytest.raises(InputError, match="no JSON"):
        parse_json(b"\xff\xfe{}", "sent", allowed="a record")


def test_only_finite_numbers_are_numbers():
    assert [finite_number(v) for v in (1, 2.5, True, "3", None, float("inf"), 10**400)] == [
        1.0,
        2.5,
        None,
        None,
        None,
        None,
        None,
    ]


def test_memory_is_known_before_a_text_is_parsed():
    """Empty lists take twenty times their text."""
    text = b"[" + b"[]," * 12_000_000 + b"[]]"
    with pytest.raises(InputError, match=r"no JSON .1.188 GB once it is read"):
        parse_json(text, "list", allowed="JSON")


def test_what_a_library_says_in_lines_is_one_line():
    assert str(HeadError("a.ply: cannot be read\n  at line 3\r\n")) == (
        "a.ply: cannot be read at line 3"
    )
    assert str(InputError("two  spaces of a name")) == "two  spaces of a name"
