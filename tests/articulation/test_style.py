"""Styles by name and from files."""

import json

import pytest

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
