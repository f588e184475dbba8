"""A mix of a trained model's styles on disk: {"mix": {"NAME": share, …}}."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from elocute.errors import ModelError
from elocute.files.json_records import finite_number, read_record, write_record

FILE_MAX_BYTES = 65_536
SHARE_MOST = 1e9
ALLOWED = '{"mix": {"NAME": share, …}} with shares from 0, one above'


def read_mix(path: str | Path) -> dict[str, float]:
    """Shares that sum to one. Raises ModelError for a file that holds none."""
    path = Path(path)
    stored = read_record(path, max_bytes=FILE_MAX_BYTES, allowed=ALLOWED, error=ModelError)
    mix = stored.get("mix")
    if not isinstance(mix, dict) or not all(_is_share(share) for share in mix.values()):
        raise ModelError.about(path, found="no mix of styles", allowed=ALLOWED)
    total = sum(map(float, mix.values()))
    if total <= 0 or not math.isfinite(total):
        raise ModelError.about(path, found=f"shares that sum to {total:g}", allowed=ALLOWED)
    return {name: share / total for name, share in mix.items() if share > 0}


def write_mix(path: str | Path, mix: dict[str, float], more: dict[str, Any]) -> None:
    """Write a mix and whatever else belongs to it. Raises OutputError."""
    write_record(path, {"mix": mix, **more}, indent=1)


def _is_share(value: object) -> bool:
    number = finite_number(value)
    return number is not None and 0 <= number <= SHARE_MOST
