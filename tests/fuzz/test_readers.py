"""Every reader under seeded mutations: whatever a file holds, an error is ours, soon and small.

The same cases every time; `benchmarks/fuzz.py` goes on from there, for as long as one likes.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import pytest

from tests.fuzz.fuzzing.cases import Files, Reader
from tests.fuzz.fuzzing.forks import FATAL
from tests.fuzz.fuzzing.found import FOUND
from tests.fuzz.fuzzing.readers import READERS, usable
from tests.fuzz.fuzzing.server import Server

if not sys.platform.startswith("linux"):
    pytest.skip("cases are judged in forks with limits of Linux", allow_module_level=True)

SHORT = [reader for reader in READERS if reader.short]
HERE = {reader.name for reader in usable()}


@pytest.mark.slow
@pytest.mark.parametrize("reader", SHORT, ids=lambda reader: reader.name)
def test_mutations_are_read_or_refused(server: Server, reader: Reader):
    if reader.name not in HERE:
        pytest.skip(f"needs {', '.join(reader.needs)}")
    assert server.check(reader.name) == [], "seeds are valid, or mutations of them test nothing"
    result = server.run(reader.name, 0, reader.short)
    assert result["done"] == reader.short and result["read"] + result["refused"] > 0
    faults = [each for each in result["findings"] if each["verdict"] in FATAL]
    told = "\n".join(
        f"case {f['number']}: {f['verdict']} {f['type']} {f['where']} {f['message'][:200]}"
        for f in faults[:10]
    )
    assert not faults, (
        f"{len(faults)} of {result['done']}; say: python -m benchmarks.fuzz --show\n{told}"
    )


@pytest.mark.parametrize("name", FOUND)
def test_what_was_found_once_stays_mended(server: Server, name: str):
    reader, make = FOUND[name]
    if reader not in HERE:
        pytest.skip("needs a package that is not here")
    make_files: Callable[[], Files] = make
    verdict = server.judge(reader, make_files())
    assert verdict["verdict"] in ("read", "refused"), verdict
