"""Which head: the built-in one or a file; and random faces of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError
from elocute.head.builtin import load_builtin_head
from elocute.head.flame import load_flame
from elocute.head.flame_head import flame_head
from elocute.head.identity import SAMPLE_SPREAD
from elocute.head.mesh import MESHES, head_from_mesh
from elocute.head.model import HeadModel
from elocute.head.store import load_head

BUILTIN = "builtin"
COEFFICIENT_LIMIT = 2.5
SEED_MAX = 999_999_999
COUNT_MAX = 100_000
ALLOWED = f"{BUILTIN}, a FLAME model (.pkl), a head (.npz) or a mesh (.obj, .ply)"


def open_head(choice: str | Path) -> HeadModel:
    """The head that a person names: "builtin", a FLAME .pkl, a stored .npz or a mesh.

    A mesh whose topology is the built-in head's is that head with another neutral face. Raises
    InputError.
    """
    if str(choice) == BUILTIN:
        return load_builtin_head()
    path = Path(choice)
    suffix = path.suffix.lower()
    if suffix == ".pkl":
        return flame_head(load_flame(path))
    if suffix == ".npz":
        return load_head(path)
    if suffix in MESHES:
        return head_from_mesh(path)
    found = f"suffix {suffix!r}" if suffix else "no such head"
    raise HeadError.about(str(choice), found=found, allowed=ALLOWED)


def sample_identities(head: HeadModel, count: int, seed: int) -> NDArray[np.float32]:
    """(count, identity) standard deviations of random faces; a seed always gives the same.

    Normal with a spread of 0.85, drawn again where beyond ±2.5. The first faces of a seed stay
    what they are when more are asked for. Raises HeadError for a head without an identity
    space, a count below 1 or a seed that is none.
    """
    components = len(head.identity_basis)
    if not components:
        raise HeadError.about(
            f"head {head.name!r}", found="has no identity space", allowed="a head with one"
        )
    for name, value, low, high in (("count", count, 1, COUNT_MAX), ("seed", seed, 0, SEED_MAX)):
        if not low <= value <= high:
            raise HeadError.about(name, found=str(value), allowed=f"{low} to {high}")
    return np.stack([_drawn(components, seed, number) for number in range(count)])


def _drawn(components: int, seed: int, number: int) -> NDArray[np.float32]:
    rng = np.random.default_rng([seed, number])
    values = rng.normal(0.0, SAMPLE_SPREAD, components)
    while (wild := np.abs(values) > COEFFICIENT_LIMIT).any():
        values[wild] = rng.normal(0.0, SAMPLE_SPREAD, int(wild.sum()))
    return values.astype(np.float32)
