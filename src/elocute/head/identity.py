"""Identities of the built-in head: faces by name, seed or a file of coefficients."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError
from elocute.files.json_records import finite_number, read_record
from elocute.head.model import HeadModel
from elocute.one_line_repr import brief

IDENTITY_COUNT = 50
COEFFICIENT_MAX = 5.0
SAMPLE_SPREAD = 0.85
"""Standard deviation of a random face: a little under one, so that few look odd."""
SAMPLE_LIMIT = 2.5
"""Standard deviations that no coefficient of a random face lies beyond."""
IDENTITY_SEED_MAX = 999_999_999
"""The greatest seed of a random face: nine digits, as users type it."""
COUNT_MAX = 100_000
FILE_MAX_BYTES = 100_000

NAMED_PATH = Path(__file__).parent / "assets" / "identities.json"


def sample_identity(seed: int) -> NDArray[np.float32]:
    """Coefficients of a random face of the built-in head.

    Parameters
    ----------
    seed : int
        The same seed gives the same face.

    Returns
    -------
    (50,) float32
        Standard deviations.
    """
    drawn = np.random.default_rng(seed).normal(0.0, SAMPLE_SPREAD, IDENTITY_COUNT)
    return np.clip(drawn, -SAMPLE_LIMIT, SAMPLE_LIMIT).astype(np.float32)


def identity_names() -> tuple[str, ...]:
    """Names that `resolve_identity` knows."""
    return ("mean", *_named())


@cache
def _named() -> dict[str, list[float]]:
    return json.loads(NAMED_PATH.read_text(encoding="utf-8"))


def resolve_identity(choice: str, head: HeadModel | None = None) -> NDArray[np.float32]:
    """The coefficients of a face.

    Parameters
    ----------
    choice : str
        "mean", a name, a whole number (the seed of a random face), or a JSON file that holds
        {"identity": [50 numbers from -5 to 5]}.
    head : HeadModel, optional
        Another head with identities than the built-in one. It has no names, and a file may give
        only its first coefficients.

    Returns
    -------
    (identity,) float32
        Standard deviations; 50 for the built-in head.

    Raises
    ------
    HeadError
        For an unknown name, or a file that holds no coefficients.
    """
    count = IDENTITY_COUNT if head is None else len(head.identity_basis)
    if choice == "mean":
        return np.zeros(count, np.float32)
    names = _named() if head is None else {}
    if choice in names:
        return np.array(names[choice], np.float32)
    if choice.isascii() and choice.isdigit() and len(choice) <= len(str(IDENTITY_SEED_MAX)):
        seed = int(choice)
        return sample_identity(seed) if head is None else sample_identities(head, 1, seed)[0]
    if choice.lower().endswith(".json"):
        return read_identity(Path(choice), 1 if head else count, count)
    known = ", ".join(("mean", *names))
    raise HeadError.about(
        f"identity {choice[:60]!r}",
        found="unknown",
        allowed=f"{known}, a whole number from 0 to {IDENTITY_SEED_MAX}, a .json file",
    )


def read_identity(
    path: Path, least: int = IDENTITY_COUNT, most: int = IDENTITY_COUNT
) -> NDArray[np.float32]:
    """(identity,) from a JSON file, `least` to `most` numbers. Raises HeadError."""
    count = f"{least}" if least == most else f"{least} to {most}"
    allowed = f'{{"identity": [{count} numbers from -5 to 5]}}'
    stored = read_record(path, max_bytes=FILE_MAX_BYTES, allowed=allowed, error=HeadError)
    given = stored.get("identity")
    found = [finite_number(value) for value in given] if isinstance(given, list) else [None]
    if None in found:
        raise HeadError.about(path, found="not one list of numbers", allowed=allowed)
    numbers = np.array(found, np.float64)
    if numbers.ndim != 1 or not least <= numbers.size <= most:
        found = f"{numbers.size} numbers" if numbers.ndim == 1 else "not one list of numbers"
        raise HeadError.about(path, found=found, allowed=allowed)
    wrong = ~(np.abs(numbers) <= COEFFICIENT_MAX)  # also true for NaN
    if wrong.any():
        place = int(np.argmax(wrong))
        raise HeadError.about(
            path, found=f"identity[{place}] is {numbers[place]:g}", allowed=allowed
        )
    return numbers.astype(np.float32)


def sample_identities(head: HeadModel, count: int, seed: int) -> NDArray[np.float32]:
    """Coefficients of random faces: normal, standard deviation 0.85, drawn again beyond ±2.5.

    Parameters
    ----------
    head : HeadModel
        With an identity space.
    count : int
        How many faces, 1 to 100000.
    seed : int
        0 to 999999999. The first faces of a seed stay the same when more are asked for.

    Returns
    -------
    (count, identity) float32
        Standard deviations.

    Raises
    ------
    HeadError
        For a head without an identity space, and for a count or seed out of range.
    """
    components = len(head.identity_basis)
    if not components:
        raise HeadError.about(
            f"head {head.name!r}", found="has no identity space", allowed="a head with one"
        )
    ranges = {"count": (count, 1, COUNT_MAX), "seed": (seed, 0, IDENTITY_SEED_MAX)}
    for name, (value, low, high) in ranges.items():
        if not low <= value <= high:
            raise HeadError.about(f"`{name}`", found=brief(value), allowed=f"{low} to {high}")
    return np.stack([_drawn(components, seed, number) for number in range(count)])


def _drawn(components: int, seed: int, number: int) -> NDArray[np.float32]:
    rng = np.random.default_rng([seed, number])
    values = rng.normal(0.0, SAMPLE_SPREAD, components)
    while (wild := np.abs(values) > SAMPLE_LIMIT).any():
        values[wild] = rng.normal(0.0, SAMPLE_SPREAD, int(wild.sum()))
    return values.astype(np.float32)
