"""The suffix chooses the writer; what cannot be written says so at once."""

import importlib
import inspect

import pytest

from elocute.errors import OutputError
from elocute.export.registry import WRITERS, check_suffix, write


@pytest.mark.parametrize("name", ["talk.avi", "talk", "talk.wav", ".glb"])
def test_an_unknown_suffix_names_those_there_are(name):
    with pytest.raises(OutputError, match=r"\.glb") as caught:
        check_suffix(name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", sorted(WRITERS))
def test_a_missing_folder_is_refused_and_nothing_is_made(motion, tmp_path, suffix):
    with pytest.raises(OutputError, match="mkdir"):
        write(motion, tmp_path / "none" / f"talk{suffix}")
    assert list(tmp_path.iterdir()) == []


def test_suffixes_may_be_upper_case():
    assert check_suffix("TALK.GLB") == ".glb"


@pytest.mark.parametrize(
    ("name", "options", "told"),
    [
        (
            "talk.csv",
            {"size": (64, 64)},
            "talk.csv: `size` is not an option of .csv; allowed: none",
        ),
        ("talk.glb", {"size": (64, 64)}, "`size` is not an option of .glb; allowed: `profile`"),
        ("talk.mp4", {"title": "a"}, "not an option of .mp4; allowed: `size`, `backend`, `view`"),
        (
            "talk.png",
            {"size": (1, 64)},
            "`size`: (1, 64); allowed: 2 numbers, each 64 to 4096 pixels",
        ),
        (
            "talk.png",
            {"view": "above"},
            "`view`: 'above'; allowed: front, three-quarter",
        ),
        ("talk.html", {"title": 3}, "`title`: 3; allowed: a text"),
    ],
)
def test_an_option_that_a_format_does_not_have_is_refused(motion, tmp_path, name, options, told):
    with pytest.raises(OutputError) as caught:
        write(motion, tmp_path / name, **options)
    assert told in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", sorted(WRITERS))
def test_a_writer_takes_what_its_format_says(suffix):
    """The registry and the writer's signature agree."""
    known = WRITERS[suffix]
    writer = getattr(importlib.import_module(f"elocute.export.{known.module}"), known.function)
    taken = inspect.signature(writer).parameters
    assert {"motion", "path", "sound", "progress"} <= set(taken)
    assert ("options" in taken) == (known.options is not None)
    assert ("overwrite" in taken) == known.sound_beside
