"""Settings of trainings: numbers within ranges."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from elocute.errors import ModelError


def check_ranges(config: Any, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Raises ModelError naming the first setting that is no number within its range."""
    for name, (low, high) in ranges.items():
        given = getattr(config, name)
        number = isinstance(given, int | float) and not isinstance(given, bool)
        if not (number and low <= given <= high):
            raise ModelError.about(
                f"training {name}", found=repr(given), allowed=f"{low:g} to {high:g}"
            )
