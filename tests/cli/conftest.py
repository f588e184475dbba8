"""`elocute` in this process, as fixtures: dozens of new processes would take their time."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.support import commands
from tests.support.commands import Result


@pytest.fixture(scope="session")
def run() -> Callable[..., Result]:
    """run("info", FILE): whatever comes of it."""
    return commands.run_here


@pytest.fixture(scope="session")
def cli() -> Callable[..., Result]:
    """cli("info", FILE) succeeds and says nothing on stderr."""
    return commands.succeeds


@pytest.fixture(scope="session")
def refused() -> Callable[..., None]:
    """refused("info", FILE, says="no such file") leaves with code 2 and one line."""
    return commands.refused
