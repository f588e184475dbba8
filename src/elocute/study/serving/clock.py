"""A clock that never goes back."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable


class SteadyClock:
    """Seconds since 1970 that never go back, though the machine's clock may be set back.

    What it is asked for is how long somebody watched, and a time that is written beside an answer.
    """

    def __init__(self, wall: Callable[[], float] = time.time) -> None:
        self._wall, self._lock = wall, threading.Lock()
        self._last, self._at = wall(), time.monotonic()

    def __call__(self) -> float:
        """The time now: the machine's, or what has passed since the last one that was later."""
        with self._lock:
            at = time.monotonic()
            self._last = max(self._wall(), self._last + at - self._at)
            self._at = at
            return self._last
