"""Formats values as USD's text form (.usda) has them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.errors import printable

NUMBER = "%.6g"


def quoted(text: str) -> str:
    """A string or token."""
    plain = printable(text).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{plain}"'


def identifier(name: str) -> str:
    """The name of a prim: letters, digits and underscores, no digit first."""
    plain = re.sub(r"\W", "_", name, flags=re.ASCII)
    return plain if re.match(r"[A-Za-z_]", plain) else f"_{plain}"


def tokens(names: Iterable[str]) -> str:
    """An array of strings or tokens."""
    return f"[{', '.join(map(quoted, names))}]"


def numbers(values: ArrayLike) -> str:
    """An array of numbers."""
    flat = np.ravel(np.asarray(values))
    kind = "%d" if np.issubdtype(flat.dtype, np.integer) else NUMBER
    return f"[{', '.join((kind,) * len(flat)) % tuple(flat.tolist())}]"


def tuples(rows: ArrayLike) -> str:
    """An array of tuples: points, quaternions (w first), texture coordinates."""
    table = np.asarray(rows, float)
    one = f"({', '.join((NUMBER,) * table.shape[1])})"
    return f"[{', '.join((one,) * len(table)) % tuple(table.ravel().tolist())}]"


def matrix(rows: NDArray[Any]) -> str:
    """A 4 x 4 matrix whose last row is the shift, as USD wants it."""
    return f"( {', '.join(tuples([row])[1:-1] for row in rows)} )"


def samples(values: Mapping[int, str], indent: str) -> str:
    """Values by time code."""
    lines = "".join(f"{indent}    {code}: {value},\n" for code, value in values.items())
    return f"{{\n{lines}{indent}}}"
