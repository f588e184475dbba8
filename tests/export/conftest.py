"""A short take that every writer is given."""

from __future__ import annotations

import pytest

from elocute.animation import Animation, animate


@pytest.fixture(scope="session")
def take(speech_wav) -> Animation:
    """The shipped example, animated at 30 fps."""
    return animate(speech_wav, fps=30, life=0)


@pytest.fixture(scope="session")
def motion(take):
    return take.motion
