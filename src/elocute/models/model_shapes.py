"""The shapes that a model moves: its basis, its rig, and curves of the built-in head."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.articulation.phone_targets import curve_names
from elocute.errors import ModelError
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.numerics.bounded_least_squares import solve_box_rows
from elocute.numerics.ridge import ridge_projection, with_ridge

RIDGE = 1e-5  # of the mean squared length of a shape: decides between shapes that look alike


def basis_of(components: tuple[str, ...], basis: Float32Array | None) -> Float32Array:
    """The shapes that a model's weights apply to: its own basis, or the built-in head's components.

    Raises ModelError for a component that the built-in head has no shape for.

    Returns
    -------
    (component, vertex, 3) float32
        Metres.
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


def with_own_shapes(
    head: HeadModel, basis: Float32Array, names: tuple[str, ...], path: Path
) -> HeadModel:
    """A head that a model's own shapes (component, vertex, 3), m, move, with one name for each.

    The path of the model's file is for messages. Raises ModelError for a head with another number
    of vertices.
    """
    if head.vertex_count != basis.shape[1]:
        raise ModelError.about(
            f"head {head.name!r}",
            found=f"{head.vertex_count} vertices",
            allowed=f"{basis.shape[1]}, the topology that {path.name} was trained in",
        )
    return replace(head, expression_names=names, expression_basis=basis)


def speech_names() -> tuple[str, ...]:
    """The built-in head's shapes that speech uses."""
    return tuple(name for name in load_builtin_head().expression_names if name in curve_names())


def as_builtin(weights: Float32Array, basis: Float32Array) -> Float32Array:
    """The curves of the built-in head whose vertices come nearest to those of a model's shapes.

    Weights (frame, component) are of shapes (component, vertex, 3), m, in the built-in topology;
    ModelError is raised for another. Bounded least squares, since curves below 0 mean nothing to a
    rig.

    Returns
    -------
    (frame, curve) float32
        0 to 1, in the order of `speech_names`.
    """
    shapes = _flat(speech_names())
    if basis.shape[1] * 3 != shapes.shape[1]:
        raise ModelError.about(
            "model",
            found=f"shapes of {basis.shape[1]} vertices",
            allowed=f"{shapes.shape[1] // 3}, those of the built-in head",
        )
    gram = with_ridge(shapes @ shapes.T, RIDGE)
    sides = weights.astype(np.float64) @ (
        basis.reshape(len(basis), -1).astype(np.float64) @ shapes.T
    )
    return solve_box_rows(gram, sides, 0.0, 1.0).astype(np.float32)


def to_shapes(values: Float32Array, names: tuple[str, ...], basis: Float32Array) -> Float32Array:
    """Project weights (frame, name) of built-in shapes onto another basis, by vertices.

    Least squares; the basis (component, vertex, 3) is in the built-in topology, m.

    Returns
    -------
    (frame, component) float32
        Weights of `basis`.
    """
    shapes = basis.reshape(len(basis), -1).astype(np.float64)
    onto = _flat(names) @ ridge_projection(shapes)
    return (values @ onto).astype(np.float32)


@lru_cache(4)
def _flat(names: tuple[str, ...]) -> NDArray[np.float64]:
    """(curve, 3 · vertex) m."""
    head = load_builtin_head()
    places = [head.expression_names.index(name) for name in names]
    return head.expression_basis[places].reshape(len(places), -1).astype(np.float64)
