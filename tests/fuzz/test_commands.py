"""A sample of cases through the command line: 2 or 1, one line, no traceback, nothing left."""

from __future__ import annotations

import importlib.util
import sys

import pytest

from tests.fuzz.fuzzing.cases import Reader
from tests.fuzz.fuzzing.commands import COMMANDS
from tests.fuzz.fuzzing.forks import FATAL
from tests.fuzz.fuzzing.server import Server

if not sys.platform.startswith("linux"):
    pytest.skip("cases are judged in forks with limits of Linux", allow_module_level=True)


@pytest.mark.slow
@pytest.mark.parametrize("reader", COMMANDS, ids=lambda reader: reader.name)
def test_commands_refuse_in_one_line(server: Server, reader: Reader):
    for name in reader.needs:
        if importlib.util.find_spec(name) is None:
            pytest.skip(f"needs {name}")
    assert server.check(reader.name) == []
    result = server.run(reader.name, 0, reader.short)
    faults = [each for each in result["findings"] if each["verdict"] in FATAL]
    assert result["done"] == reader.short and not faults, "\n".join(
        f"case {f['number']}: {f['verdict']} {f['type']} {f['message'][:300]}" for f in faults[:5]
    )
