"""Whose face: by name, by seed, or from a file of coefficients."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError

COUNT = 50
FARTHEST = 5.0  # standard deviations
SPREAD = 0.8  # of a drawn face; at 1.0 one in ten looks odd
SEED_MAX = 2**32 - 1
FILE_MAX_BYTES = 65536

# Faces chosen by looking: name → seed.
NAMED: dict[str, int] = {
    "ada": 3, "ben": 7, "chen": 12, "dara": 19, "emil": 23, "fatou": 31, "grace": 42, "hugo": 57,
}  # fmt: skip


def sample_identity(seed: int) -> NDArray[np.float32]:
    """(50,) coefficients in standard deviations; the same for the same seed."""
    return (SPREAD * np.random.default_rng(seed).standard_normal(COUNT)).astype(np.float32)


def resolve_identity(given: str) -> NDArray[np.float32]:
    """(50,) coefficients of `mean`, a name of NAMED, a seed, or a file {"identity": [50 numbers]}.

    Raises HeadError naming what is allowed.
    """
    if given == "mean":
        return np.zeros(COUNT, np.float32)
    if given in NAMED:
        return sample_identity(NAMED[given])
    if given.isdecimal() and int(given) <= SEED_MAX:
        return sample_identity(int(given))
    if Path(given).suffix.lower() == ".json":
        return _read_identity(Path(given))
    raise HeadError.about(
        f"identity {given!r}", found="nobody of that name",
        allowed=f"mean, {', '.join(NAMED)}, a seed from 0 to {SEED_MAX}, or a .json file",
    )  # fmt: skip


def _read_identity(path: Path) -> NDArray[np.float32]:
    allowed = f'{{"identity": [{COUNT} numbers within ±{FARTHEST:g}]}}'
    try:
        if path.stat().st_size > FILE_MAX_BYTES:
            raise HeadError.about(path, found="more than 64 KiB", allowed=allowed)
        record = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise HeadError.about(path, found=f"cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        if isinstance(error, HeadError):
            raise
        raise HeadError.about(path, found="no JSON", allowed=allowed) from error
    values = record.get("identity") if isinstance(record, dict) else None
    if not isinstance(values, list) or len(values) != COUNT:
        size = f"{len(values)} numbers" if isinstance(values, list) else "no list `identity`"
        raise HeadError.about(path, found=size, allowed=allowed)
    for place, value in enumerate(values):
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (number and abs(value) <= FARTHEST):
            raise HeadError.about(path, found=f"{value!r} at place {place}", allowed=allowed)
    return np.array(values, np.float32)
