"""Styles of trained models: names, mixes and files as shares."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.style import Style, parse_mix
from elocute.errors import ModelError
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.models.style_file import read_mix
from elocute.numerics.given import check_kind

Array = NDArray[np.float32]
EVEN = "even"
"""The style that is all styles of a model in equal shares."""


def checked_style(given: str | Path | Style) -> str | Style:
    """A style as models take it. Raises InputError for what is no name, path or Style."""
    check_kind("style", given, str | os.PathLike | Style, "a name, a mix, a .json file or a Style")
    return str(given) if isinstance(given, os.PathLike) else given


def style_shares(given: str | Style, styles: tuple[str, ...], model: str) -> Array:
    """(style,) shares: a name, a mix, or `even`; `plain` is even where nobody is called so.

    A .json file holds a mix as `elocute style fit` writes it. Raises ModelError for a Style of
    the rule-based driver and names never learned.
    """
    if isinstance(given, Style):
        raise ModelError.about(
            f"model {model}", found="a Style of the articulation model", allowed=", ".join(styles)
        )
    if given == EVEN or (given == "plain" and "plain" not in styles):
        return np.full(len(styles), 1 / len(styles), np.float32)
    if given.lower().endswith(".json") and given not in styles:
        return mixed(read_mix(given), styles, model)
    return mixed(parse_mix(given), styles, model)


def mixed(shares: Mapping[str, float], styles: tuple[str, ...], model: str) -> Array:
    """(style,) of named shares. Raises ModelError for a style that was never learned."""
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


def basis_of(components: tuple[str, ...], basis: Array | None) -> Array:
    """(component, vertex, 3) m that a model's weights weigh: its own, or built-in shapes.

    Raises ModelError for a component that the built-in head has no shape for.
    """
    if basis is not None:
        return basis
    head = load_builtin_head()
    unknown = [name for name in components if name not in head.expression_names]
    if unknown:
        raise ModelError.about(
            "model",
            found=f"weights of {', '.join(unknown[:5])}",
            allowed="shapes of the built-in head",
        )
    return head.expression_basis[[head.expression_names.index(name) for name in components]]


def rigged(head: HeadModel, basis: Array, names: tuple[str, ...], path: Path) -> HeadModel:
    """`head` moved by a model's own shapes (component, vertex, 3) m.

    Raises ModelError where the head has another number of vertices.
    """
    if head.vertex_count != basis.shape[1]:
        raise ModelError.about(
            f"head {head.name!r}",
            found=f"{head.vertex_count} vertices",
            allowed=f"{basis.shape[1]}, the topology that {path.name} was trained in",
        )
    return replace(head, expression_names=names, expression_basis=basis)
