"""`fuzzing` is a package of its own beside the tests; the benchmark runs it too."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.fuzz.fuzzing.server import Server


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One for each worker of the tests: it imports what readers need once."""
    with Server(tmp_path_factory.mktemp("fuzz")) as server:
        yield server
