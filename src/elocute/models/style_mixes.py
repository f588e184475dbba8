"""Styles of trained models: names, mixes, and files of mixes: {"mix": {"NAME": share, …}}.

The published mix of styles is a convex combination of outputs (VOCA 2019, section 7.2). Since the
decoder is linear, it is the same of vertices and of what the decoder is given. A style enters the
network before convolutions and a hyperbolic tangent, so a mix at the input is something else.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float32Array
from elocute.articulation.style import Style, parse_mix
from elocute.errors import ModelError
from elocute.files.json_records import finite_number, read_record, write_record
from elocute.files.reading import FileKind, path_of
from elocute.numerics.input_checks import check_kind
from elocute.one_line_repr import one_line

EVEN = "even"
"""The style that is all styles of a model in equal shares."""
SHARE_MOST = 1e9
INPUT_MOST = 100.0
ALLOWED = (
    '{"mix": {"NAME": share, …}} with shares from 0, one above, or {"vector": {"NAME": number}}'
)
MIX_FILE = FileKind(ALLOWED, 65_536, ModelError)


@dataclass(frozen=True, eq=False)
class MixedStyle:
    """What a trained model speaks in: inputs of its network, and the mix of their outputs.

    Parameters
    ----------
    inputs : (input, style) float32
        What the network is given; a style alone is 1 in its place and 0 elsewhere.
    shares : (input,) float32
        Of the output for each input; they sum to one.
    """

    inputs: Float32Array
    shares: Float32Array

    __repr__ = one_line

    @property
    def mixed_input(self) -> Float32Array:
        """(style,) share of each style, or the mix of inputs."""
        return self.shares @ self.inputs


def mix_of_shares(shares: Float32Array, *, outputs: bool) -> MixedStyle:
    """Styles in given shares.

    Parameters
    ----------
    shares : (style,) float32
        They sum to one.
    outputs : bool
        Whether the outputs of the styles are mixed; otherwise the network is given the mix.

    Returns
    -------
    MixedStyle
        With the inputs that have a share.
    """
    if not outputs:
        return MixedStyle(shares[None], np.ones(1, np.float32))
    used = np.flatnonzero(shares)
    return MixedStyle(np.eye(len(shares), dtype=np.float32)[used], shares[used])


def checked_style(given: str | Path | Style) -> str | Style:
    """A style as the methods of models take it.

    Parameters
    ----------
    given : str, Path or Style
        What the caller gave.

    Returns
    -------
    str or Style
        A path as text; everything else as it is.

    Raises
    ------
    InputError
        For anything but a name, a path or a Style.
    """
    check_kind("style", given, str | os.PathLike | Style, "a name, a mix, a .json file or a Style")
    return str(path_of(given)) if isinstance(given, os.PathLike) else given


def style_shares(given: str | Style, styles: tuple[str, ...], model: str) -> Float32Array:
    """(style,) shares: a name, a mix, or `even`; `plain` means even where no style has that name.

    A .json file holds a mix as `elocute style fit` writes it. Raises ModelError for a Style of
    the rule-based model and unknown names.
    """
    if isinstance(given, Style):
        raise ModelError.about(
            f"model {model}", found="a Style of the articulation model", allowed=", ".join(styles)
        )
    if given == EVEN or (given == "plain" and "plain" not in styles):
        return np.full(len(styles), 1 / len(styles), np.float32)
    if given.lower().endswith(".json") and given not in styles:
        return share_vector(read_mix(given), styles, model)
    return share_vector(parse_mix(given), styles, model)


def style_vector(given: str | Style, styles: tuple[str, ...], model: str) -> Float32Array | None:
    """(style,) the network's input that a .json file holds as a new style; None for a mix.

    Raises ModelError for a file that holds neither, and for unknown names.
    """
    if not isinstance(given, str) or not given.lower().endswith(".json") or given in styles:
        return None
    stored = _read(Path(given)).get("vector")
    if stored is None:
        return None
    if not isinstance(stored, dict) or not all(map(_is_input, stored.values())):
        raise ModelError.about(given, found="no style vector", allowed=ALLOWED)
    return share_vector({name: float(each) for name, each in stored.items()}, styles, model)


def share_vector(shares: Mapping[str, float], styles: tuple[str, ...], model: str) -> Float32Array:
    """(style,) of named shares. Raises ModelError for an unknown style."""
    vector = np.zeros(len(styles), np.float32)
    for name, share in shares.items():
        if name not in styles:
            raise ModelError.about(
                f"style {name[:60]!r}",
                found=f"not in {model}",
                allowed=", ".join(styles) + ", or a mix (a:0.7,b:0.3)",
            )
        vector[styles.index(name)] = share
    return vector


def read_mix(path: str | Path) -> dict[str, float]:
    """Read a mix of styles.

    Parameters
    ----------
    path : str or Path
        A .json file as `write_mix` writes it.

    Returns
    -------
    dict of str to float
        Shares above zero, which sum to one.

    Raises
    ------
    ModelError
        For a file that holds no mix.
    """
    path = Path(path)
    mix = _read(path).get("mix")
    if not isinstance(mix, dict) or not all(_is_share(share) for share in mix.values()):
        raise ModelError.about(path, found="no mix of styles", allowed=ALLOWED)
    total = sum(map(float, mix.values()))
    if total <= 0 or not math.isfinite(total):
        raise ModelError.about(path, found=f"shares that sum to {total:g}", allowed=ALLOWED)
    return {name: share / total for name, share in mix.items() if share > 0}


def write_mix(path: str | Path, mix: dict[str, float], more: dict[str, Any]) -> None:
    """Write a mix of styles as .json.

    Where `more` has a `vector`, a network is given that in place of the mix.

    Parameters
    ----------
    path : str or Path
        The file.
    mix : dict of str to float
        Share of each style.
    more : dict
        Further entries of the file.

    Raises
    ------
    OutputError
        For a place that cannot be written.
    """
    write_record(path, {"mix": mix, **more}, indent=1)


def _read(path: Path) -> dict[str, Any]:
    return read_record(path, MIX_FILE)


def _is_input(value: object) -> bool:
    number = finite_number(value)
    return number is not None and abs(number) <= INPUT_MOST


def _is_share(value: object) -> bool:
    number = finite_number(value)
    return number is not None and 0 <= number <= SHARE_MOST
