"""What every test may ask for."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The data folder; tests that need it are marked `shared_data`."""
    path = Path(os.environ.get("ELOCUTE_SHARED_DATA", ROOT.parent / "shared" / "data"))
    if not path.is_dir():
        pytest.skip(f"needs the data folder {path}")
    return path


@pytest.fixture(scope="session")
def speech_wav() -> Path:
    """The example that ships: eleven seconds at most, 32 kHz, mono, with rests at both ends."""
    return ROOT / "src" / "elocute" / "assets" / "example.flac"


@pytest.fixture(scope="session")
def need() -> Callable[[object, str], None]:
    """Skip for a missing system package, but fail where everything must be there (CI)."""

    def check(there: object, what: str) -> None:
        if there:
            return
        if os.environ.get("ELOCUTE_REQUIRE_SYSTEM"):
            pytest.fail(f"{what} is missing, and ELOCUTE_REQUIRE_SYSTEM says it must be there")
        pytest.skip(f"needs {what}")

    return check
