"""The fuzzer itself: the same cases always, forms that hold, and nothing bad that it misses."""

from __future__ import annotations

import io
import json
import os
import signal
import sys
import time
import warnings
import zipfile
from pathlib import Path
from random import Random

import numpy as np
import pytest

from elocute.errors import InputError
from tests.fuzz.fuzzing import forks, judging, worker
from tests.fuzz.fuzzing.cases import Reader, case, load_seeds
from tests.fuzz.fuzzing.mutations import KINDS, mutate
from tests.fuzz.fuzzing.readers import READERS
from tests.fuzz.fuzzing.seeds import place

if not sys.platform.startswith("linux"):
    pytest.skip("cases are judged in forks with limits of Linux", allow_module_level=True)


def write_bytes(folder: Path) -> None:
    (place(folder, "one") / "file").write_bytes(bytes(range(64)))


def a_reader(read) -> Reader:
    """A reader of 64 bytes that does as it is told."""
    return Reader(
        "told", write_bytes, lambda folder, out: read(folder / "file", out), {"*": "bytes"}
    )


def verdicts(read, tmp_path: Path, cases: int = 3) -> dict[str, int]:
    """What the fuzzer makes of a reader; and every case is run, whatever the others did."""
    reader = a_reader(read)
    write_bytes(tmp_path / "seeds")
    result = worker._run(reader, tmp_path / "seeds", 0, cases, 1e9, "")
    assert result["done"] == cases and result["next"] == cases
    return {name: result[name] for name in forks.VERDICTS if result[name]}


def refuse(path: Path, out: Path) -> None:
    raise InputError.about(path, found="nothing")


def test_a_reader_that_refuses_is_at_peace(tmp_path: Path):
    assert verdicts(refuse, tmp_path, 50) == {}


def test_an_error_of_others_is_an_escape(tmp_path: Path):
    assert verdicts(lambda path, out: {}["a"], tmp_path) == {"escape": 3}


class TwoLinesError(InputError):
    """Of this package, whose errors are else made one line."""

    def __str__(self) -> str:
        return "one\ntwo"


def test_two_lines_are_one_too_many(tmp_path: Path):
    def read(path: Path, out: Path) -> None:
        raise TwoLinesError("one")

    assert verdicts(read, tmp_path) == {"lines": 3}


def test_files_left_behind_are_seen(tmp_path: Path):
    def read(path: Path, out: Path) -> None:
        (out / "half").touch()
        refuse(path, out)

    assert verdicts(read, tmp_path) == {"left": 3}


def test_memory_is_seen_taken_or_refused(tmp_path: Path):
    taken = verdicts(lambda path, out: len(b"x" * 1_500_000_000), tmp_path / "a", 1)
    refused = verdicts(lambda path, out: bytearray(10**14), tmp_path / "b", 1)

    def hidden(path: Path, out: Path) -> None:
        try:
            np.zeros(10**14)
        except MemoryError as error:
            raise InputError("too large") from error

    assert taken == refused == verdicts(hidden, tmp_path / "c", 1) == {"memory": 1}


def test_a_crash_is_told_apart_and_the_rest_goes_on(tmp_path: Path):
    def read(path: Path, out: Path) -> None:
        if path.read_bytes()[:1] != b"\0":
            os.kill(os.getpid(), signal.SIGSEGV)

    reader = a_reader(read)
    write_bytes(tmp_path)
    seeds = load_seeds(reader, tmp_path)
    firsts = [case(reader, seeds, number)[1]["file"][:1] for number in range(40)]
    result = worker._run(reader, tmp_path, 0, 40, 1e9, "")
    assert result["crash"] == sum(first != b"\0" for first in firsts) > 0
    assert result["done"] == 40 and all(each["alone"] for each in result["findings"])


def test_a_crash_that_needs_cases_before_it_is_traced_to_the_first(tmp_path: Path):
    seen: list[bytes] = []

    def read(path: Path, out: Path) -> None:
        seen.append(path.read_bytes())
        if len(seen) == 3:
            os.abort()

    result = worker._run(a_reader(read), _seeded(tmp_path), 0, 3, 1e9, "")
    (finding,) = result["findings"]
    assert (finding["number"], finding["alone"], finding["first"]) == (2, False, 0)


def test_what_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(judging, "PROCESSOR_S", 0.2)
    monkeypatch.setattr(judging, "WAITING_S", 0.4)

    def spin(path: Path, out: Path) -> None:
        while True:
            pass

    assert verdicts(spin, tmp_path / "a", 1) == {"hang": 1}
    assert verdicts(lambda path, out: time.sleep(60), tmp_path / "b", 1) == {"hang": 1}


def _seeded(folder: Path) -> Path:
    write_bytes(folder)
    return folder


def test_the_smallest_case_of_a_kind_is_kept_and_shrunk(tmp_path: Path):
    def read(path: Path, out: Path) -> None:
        if b"\x05" in path.read_bytes():
            raise KeyError("five")

    reader = a_reader(read)
    worker._run(reader, _seeded(tmp_path / "seeds"), 0, 30, 1e9, str(tmp_path / "kept"))
    (kept,) = (tmp_path / "kept" / "told").iterdir()
    finding = json.loads((kept / "finding.json").read_text())
    assert finding["type"] == "KeyError" and "KeyError: 'five'" in finding["trace"]
    assert b"\x05" in (kept / "files" / "file").read_bytes()
    shrunk = worker._shrink(reader, tmp_path / "seeds", finding["number"])
    assert bytes.fromhex(shrunk["files"]["file"]) == b"\x05"


def test_a_number_is_a_case_for_ever(tmp_path: Path):
    reader = a_reader(refuse)
    seeds = load_seeds(reader, _seeded(tmp_path))
    twice = [[case(reader, seeds, number) for number in range(200)] for _ in range(2)]
    assert twice[0] == twice[1]
    assert len({files["file"] for _, files in twice[0]}) > 150


@pytest.mark.parametrize("kind", KINDS)
def test_mutations_of_anything_give_bytes(kind: str):
    rng = Random(kind)
    for data in (b"", b"{}", b"PK\x05\x06", rng.randbytes(500)):
        for _ in range(100):
            assert isinstance(mutate(rng, data, kind, (data, b"other")), bytes)


def test_forms_outlive_mutations():
    """Archives keep their checksums and JSON its brackets, so that what lies inside is reached."""
    rng, out = Random(0), io.BytesIO()
    np.savez(out, a=np.arange(6.0), texts=np.frombuffer(b'{"fps": 30}', np.uint8))
    whole = 0
    for _ in range(100):
        data = KINDS["npz"][0](rng, out.getvalue())
        with warnings.catch_warnings(), zipfile.ZipFile(io.BytesIO(data)) as archive:
            warnings.simplefilter("ignore")
            whole += archive.testzip() is None
    assert whole == 100
    parsed = 0
    for _ in range(100):
        text = KINDS["json"][0](rng, b'{"identity": [1, 2], "name": {"a": "b"}}')
        try:
            json.loads(text)
            parsed += 1
        except (ValueError, RecursionError):
            pass
    assert parsed > 70


def test_names_are_there_once():
    assert len({reader.name for reader in READERS}) == len(READERS)
