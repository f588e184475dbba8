"""A small captured corpus and recordings of its words: real synthetic voices, exact times."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def wild(tmp_path_factory: pytest.TempPathFactory, need: Callable[[object, str], None]) -> Path:
    """What recipes/build_words.py makes: 4 words, three captured speakers, 24 recordings."""
    import shutil

    for name in ("flite", "festival", "espeak-ng"):
        need(shutil.which(name), name)
    pytest.importorskip("pocketsphinx", reason="needs the extra `wild`")
    folder = tmp_path_factory.mktemp("wild") / "words"
    command = [sys.executable, ROOT / "recipes" / "build_words.py", folder, "--words", "4",
               "--speakers", "3"]  # fmt: skip
    subprocess.run([str(part) for part in command], check=True, capture_output=True, cwd=ROOT)
    return folder
