"""Styles by name and from files."""

import json

import pytest

from elocute.articulation.phone_times import read_phone_times
from elocute.articulation.style import STYLES, Style, resolve_style
from elocute.errors import InputError


def test_a_style_comes_by_name_or_as_itself():
    assert resolve_style("calm") is STYLES["calm"]
    assert resolve_style(STYLES["broad"]) is STYLES["broad"]


def test_a_style_comes_from_a_json_file(tmp_path):
    path = tmp_path / "mine.json"
    path.write_text(json.dumps({"amplitude": 1.3, "rounding": 0.5}))
    assert resolve_style(str(path)) == Style(amplitude=1.3, rounding=0.5)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", "JSON"),
        ("[1]", "JSON of a list"),
        ('{"loudness": 1}', "loudness"),
        ('{"amplitude": "big"}', "amplitude"),
        ('{"amplitude": 99}', "0 to 2"),
        ("[" * 100_000, "100 kB"),
    ],
)
def test_a_bad_style_file_is_refused_by_name(tmp_path, text, says):
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(InputError, match=says) as caught:
        resolve_style(str(path))
    assert "\n" not in str(caught.value) and "bad.json" in str(caught.value)


def test_an_unknown_style_names_those_there_are():
    with pytest.raises(InputError, match="calm"):
        resolve_style("operatic")


def test_phone_times_are_read_and_checked(tmp_path):
    path = tmp_path / "phones.csv"
    path.write_text("start_s,end_s,phone\n0.1,0.2,AA1\n0.2,0.3,p\n")
    assert read_phone_times(path) == [(0.1, 0.2, "AA"), (0.2, 0.3, "P")]
    path.write_text("start_s,end_s,phone\n0.3,0.2,AA\n")
    with pytest.raises(InputError, match="row 2"):
        read_phone_times(path)
    path.write_text("a,b\n")
    with pytest.raises(InputError, match="first row"):
        read_phone_times(path)
    with pytest.raises(InputError, match="no such file"):
        read_phone_times(tmp_path / "none.csv")
