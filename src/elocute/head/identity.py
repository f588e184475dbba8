"""Identities of the built-in head: faces by name, seed or a file of coefficients."""

from __future__ import annotations

import json
import math
import os
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import FloatArray
from elocute.errors import HeadError
from elocute.files.json_records import finite_number, read_record
from elocute.files.reading import FileKind, path_of
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.one_line_repr import brief

PRINCIPAL_COUNT, LOCAL_COUNT = 50, 27
"""Components of the built-in head: of whole heads, then of places of the face. Files of the first
versions have the former alone, and mean zero by the rest."""
IDENTITY_COUNT = PRINCIPAL_COUNT + LOCAL_COUNT
COEFFICIENT_MAX = 5.0
SAMPLE_SPREAD = 0.85
"""Standard deviation of a random face: a little under one, so that few look odd."""
SAMPLE_LIMIT = 2.5
"""Standard deviations beyond which no coefficient of a random face is drawn."""
WOMAN, MAN, OWN_SEX = 0.05, 0.95, 0.15
"""Sex of random faces on the scale of a head's `trait_basis`, and how much of their own deviation
from 0.5 they keep besides. As drawn, most would lie halfway."""
TONE_SPREAD = 1.3
"""How much further apart skin tones are than drawn, and with them what goes with tone in a face."""
YOUNGEST, OLDEST = 20.0, 72.0
"""Years between which the ages of random faces spread. As drawn, half would be children."""
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
    (77,) float32
        Standard deviations.
    """
    drawn = np.random.default_rng(seed).normal(0.0, SAMPLE_SPREAD, IDENTITY_COUNT)
    return _grown(np.clip(drawn, -SAMPLE_LIMIT, SAMPLE_LIMIT), load_builtin_head())


def identity_names() -> tuple[str, ...]:
    """Names that `resolve_identity` knows."""
    return ("mean", *_named())


@cache
def _named() -> dict[str, list[float]]:
    return json.loads(NAMED_PATH.read_text(encoding="utf-8"))


def identity_choice(identity: str | int | Path) -> str:
    """A name, a seed, or the path of a JSON file of coefficients, as the text that
    `resolve_identity` takes.

    Raises HeadError for a path that cannot be that of such a file.
    """
    if isinstance(identity, os.PathLike):
        identity = path_of(identity, HeadError)
    return brief(identity) if isinstance(identity, int) else str(identity)


def resolve_identity(choice: str, head: HeadModel | None = None) -> NDArray[np.float32]:
    """The coefficients of a face.

    Parameters
    ----------
    choice : str
        "mean", a name, a whole number (the seed of a random face), or a JSON file that holds
        {"identity": [50 to 77 numbers from -5 to 5]}; those that it leaves out are zero.
    head : HeadModel, optional
        Another head with identities than the built-in one. It has no names, and a file may give
        only its first coefficients.

    Returns
    -------
    (identity,) float32
        Standard deviations; 77 for the built-in head.

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
        return _seeded(int(choice), head)
    if choice.lower().endswith(".json"):
        if head is not None:
            return read_identity(Path(choice), 1, count)
        coefficients = read_identity(Path(choice))
        return np.pad(coefficients, (0, count - len(coefficients)))
    known = ", ".join(("mean", *names))
    raise HeadError.about(
        f"identity {choice[:60]!r}",
        found="unknown",
        allowed=f"{known}, a whole number from 0 to {IDENTITY_SEED_MAX}, a .json file",
    )


def _seeded(seed: int, head: HeadModel | None) -> NDArray[np.float32]:
    return sample_identity(seed) if head is None else sample_identities(head, 1, seed)[0]


def seeded_identities(first: int, count: int, head: HeadModel | None = None) -> NDArray[np.float32]:
    """Coefficients of the faces that `resolve_identity` knows by consecutive seeds.

    Parameters
    ----------
    first : int
        Seed of the first face, 0 to 999999999.
    count : int
        How many faces, 1 to 100000.
    head : HeadModel, optional
        Another head with identities than the built-in one.

    Returns
    -------
    (count, identity) float32
        Standard deviations.

    Raises
    ------
    HeadError
        For a head without an identity space, and for a count or seed out of range.
    """
    _check_range("count", count, 1, COUNT_MAX)
    _check_range("seed", first, 0, IDENTITY_SEED_MAX + 1 - count)
    return np.stack([_seeded(seed, head) for seed in range(first, first + count)])


def read_identity(
    path: Path, least: int = PRINCIPAL_COUNT, most: int = IDENTITY_COUNT
) -> NDArray[np.float32]:
    """(identity,) from a JSON file, `least` to `most` numbers. Raises HeadError."""
    count = f"{least}" if least == most else f"{least} to {most}"
    allowed = f'{{"identity": [{count} numbers from -5 to 5]}}'
    stored = read_record(path, FileKind(allowed, FILE_MAX_BYTES, HeadError))
    listed = stored.get("identity")
    values = [finite_number(value) for value in listed] if isinstance(listed, list) else [None]
    if None in values:
        raise HeadError.about(path, found="not one list of numbers", allowed=allowed)
    numbers = np.array(values, np.float64)
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

    Faces of a head that knows their traits are women and men of 20 to 72 years then.

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
    _check_range("count", count, 1, COUNT_MAX)
    _check_range("seed", seed, 0, IDENTITY_SEED_MAX)
    drawn = (_drawn(components, seed, number) for number in range(count))
    return np.stack([_grown(one, head) for one in drawn])


def _check_range(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise HeadError.about(f"`{name}`", found=brief(value), allowed=f"{low} to {high}")


def _grown(drawn: FloatArray, head: HeadModel) -> NDArray[np.float32]:
    """The same face as a woman or man, whichever is nearer, of an age that keeps its rank."""
    if not len(head.trait_basis):
        return drawn.astype(np.float32)
    bases = np.vstack([head.tone_basis, head.trait_basis]).astype(np.float64)
    mean, slopes = bases[:, 0], bases[:, 1:]
    known = drawn[: slopes.shape[1]]
    tone, sex, years = mean + slopes @ known
    spread = SAMPLE_SPREAD * float(np.linalg.norm(slopes[2]))
    rank = (1 + math.erf((years - mean[2]) / (spread * math.sqrt(2)))) / 2
    wanted = [
        mean[0] + TONE_SPREAD * (tone - mean[0]),
        (MAN if sex > 0.5 else WOMAN) + OWN_SEX * (sex - 0.5),
        YOUNGEST + (OLDEST - YOUNGEST) * rank,
    ]
    # The least change of the whole face is what people of that tone, sex and age have in common.
    change = np.linalg.pinv(slopes) @ (np.array(wanted) - [tone, sex, years])
    return np.r_[known + change, drawn[len(known) :]].astype(np.float32)


def _drawn(components: int, seed: int, number: int) -> NDArray[np.float64]:
    """The built-in head's local components come last: the others stay what they were before."""
    rng = np.random.default_rng([seed, number])
    local = LOCAL_COUNT if components == IDENTITY_COUNT else 0
    parts = [_tame(rng, components - local), _tame(rng, local)]
    return np.concatenate(parts)


def _tame(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    values = rng.normal(0.0, SAMPLE_SPREAD, count)
    while (wild := np.abs(values) > SAMPLE_LIMIT).any():
        values[wild] = rng.normal(0.0, SAMPLE_SPREAD, int(wild.sum()))
    return values
