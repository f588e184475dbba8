"""`doctor` really decodes, hears and draws; what is broken is said, with a remedy."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import elocute
from elocute.cli.commands.doctor import _tested
from tests.support.commands import Result, run_apart

HERE = Path(elocute.__file__).parents[1]


def doctor(*also: str, before: Path = HERE) -> Result:
    """Run it in a Python that finds modules in the folder `before` first."""
    path = os.pathsep.join((str(before), str(HERE)))
    return run_apart("doctor", *also, env=os.environ | {"PYTHONPATH": path})


def test_everything_works_here():
    result = doctor("--json")
    assert (result.returncode, result.stderr) == (0, "")
    record = json.loads(result.stdout)
    assert record["mp3"].startswith("works (0.5")
    assert record["network"] == "works (25 frames of 40 phones)"
    assert record["mp4"].startswith("works (5 pictures drawn and read, 0.5")
    assert record["viewer"].endswith("MB)")
    assert record["espeak-ng"].startswith(("works (", "not there: "))


@pytest.mark.parametrize(
    ("module", "broken"),
    [("av", ("mp3", "mp4")), ("onnxruntime", ("network",)), ("soundfile", ("mp3",))],
)
def test_a_library_that_does_not_load_is_named(tmp_path, module, broken):
    """A real broken installation: the module is found and fails as one without its library."""
    (tmp_path / module).mkdir()
    (tmp_path / module / "__init__.py").write_text("raise ImportError('libgone.so.7: no file')")
    result = doctor("--json", before=tmp_path)
    record = json.loads(result.stdout)
    assert result.returncode == 1
    for name in broken:
        assert record[name].startswith("broken: libgone.so.7: no file; pip install"), record[name]
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith("elocute: ") and all(name in line for name in broken)


def test_versions_stand_beside_the_tested_range():
    assert _tested("19.0.2", "<20,>=12") == "tested: <20,>=12"
    assert _tested("20.0", "<20,>=12").startswith("untested")
    assert _tested("2.13.0+cpu", "==2.13.0") == "tested: ==2.13.0"
    assert _tested("1.26.0rc1", ">=1.26,<3") == "tested: >=1.26,<3"
    assert _tested("0.9.10", ">=0.10").startswith("untested")
