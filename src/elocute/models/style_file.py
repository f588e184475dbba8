"""A mix of a trained model's styles on disk: {"mix": {"NAME": share, …}}."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from elocute.errors import ModelError
from elocute.files.atomic import write_atomically

FILE_MAX_BYTES = 65_536
SHARE_MOST = 1e9
ALLOWED = '{"mix": {"NAME": share, …}} with shares from 0, one above'


def read_mix(path: str | Path) -> dict[str, float]:
    """Shares that sum to one. Raises ModelError for a file that holds none."""
    path = Path(path)
    try:
        if path.stat().st_size > FILE_MAX_BYTES:
            raise ModelError.about(path, found="more than 64 KiB", allowed=ALLOWED)
        stored = json.loads(path.read_text(encoding="utf-8"))
    except ModelError:
        raise
    except OSError as error:
        raise ModelError.about(path, found=f"cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise ModelError.about(path, found="no JSON", allowed=ALLOWED) from error
    mix = stored.get("mix") if isinstance(stored, dict) else None
    if not isinstance(mix, dict) or not all(_is_share(share) for share in mix.values()):
        raise ModelError.about(path, found="no mix of styles", allowed=ALLOWED)
    total = sum(map(float, mix.values()))
    if total <= 0 or not math.isfinite(total):
        raise ModelError.about(path, found=f"shares that sum to {total:g}", allowed=ALLOWED)
    return {name: share / total for name, share in mix.items() if share > 0}


def write_mix(path: str | Path, mix: dict[str, float], more: dict[str, Any]) -> None:
    """Write a mix and whatever else belongs to it. Raises OutputError."""
    with write_atomically(path) as draft:
        text = json.dumps({"mix": mix, **more}, indent=1, allow_nan=False)
        draft.write_text(text + "\n", encoding="utf-8")


def _is_share(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return 0 <= value <= SHARE_MOST
