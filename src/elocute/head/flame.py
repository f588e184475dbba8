"""FLAME (Li, Bolkart, Black, Li and Romero 2017): its files, its equations, and a head of it.

The files of 2017, 2019, 2020 and 2023 are one layout: a pickled dict of arrays, some of them
chumpy objects. They come with a licence of their own and are never needed.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from elocute.array_types import Float64Array
from elocute.errors import HeadError
from elocute.files.pickles.closed_pickle import SparseMatrix, read_pickle
from elocute.head.skinning import blended, chained
from elocute.numerics.rotation_vectors import to_matrices
from elocute.one_line_repr import one_line

IDENTITY_COUNT = 300  # of the 400 components; the rest are expressions
VERTICES_MAX, COMPONENTS_MAX, JOINTS_MAX = 200_000, 1000, 64
JOINT_NAMES = ("root", "neck", "jaw", "eyeLeft", "eyeRight")
BLOCK = 64  # frames computed at once
_KEYS = ("v_template", "shapedirs", "posedirs", "J_regressor", "weights", "kintree_table", "f")


@dataclass(frozen=True, eq=False)
class FlameModel:
    """A FLAME model as its file holds it; +Y up, +Z out of the face.

    Coefficients of identity and expression are standard deviations of either sign.

    Parameters
    ----------
    template : (vertex, 3) float64
        Metres.
    identity_basis : (vertex, 3, identity) float64
        Metres per standard deviation.
    expression_basis : (vertex, 3, expression) float64
        Metres per standard deviation.
    pose_basis : (vertex, 3, 9 · (joints - 1)) float64
        Metres per entry of R - I.
    joint_regressor : (joint, vertex) float64
        Joint positions are this times the vertices.
    skin_weights : (vertex, joint) float64
        Rows sum to one.
    parents : tuple of int
        The index of each joint's parent, which comes before it; -1 for none.
    triangles : (face, 3) int32
        Vertex indices.

    Raises
    ------
    HeadError
        Where parts do not fit each other or are not finite.
    """

    template: Float64Array
    identity_basis: Float64Array
    expression_basis: Float64Array
    pose_basis: Float64Array
    joint_regressor: Float64Array
    skin_weights: Float64Array
    parents: tuple[int, ...]
    triangles: NDArray[np.int32]

    __repr__ = one_line

    def __post_init__(self) -> None:
        _check_shapes(self)
        _check_values(self)

    @property
    def vertex_count(self) -> int:
        return len(self.template)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """FLAME's five, or numbers for another skeleton."""
        count = len(self.parents)
        if count == len(JOINT_NAMES):
            return JOINT_NAMES
        return tuple(f"joint{index}" for index in range(count))


def flame_vertices(
    model: FlameModel,
    shape: ArrayLike = (),
    expression: ArrayLike = (),
    pose: ArrayLike = (),
    translation: ArrayLike = (0.0, 0.0, 0.0),
) -> Float64Array:
    """FLAME's equations, in double precision.

    Parameters
    ----------
    model : FlameModel
        The model.
    shape : (identity,) or (frame, identity)
        Standard deviations, at most as many as the model has.
    expression : (expression,) or (frame, expression)
        Standard deviations, at most as many as the model has.
    pose : (3 · joint,) or (frame, 3 · joint)
        Rotation vectors in radians: root, neck, jaw, left eye, right eye; () for the zero pose.
    translation : (3,) or (frame, 3)
        Metres.

    Returns
    -------
    (frame, vertex, 3) float64
        Metres. An argument without frames holds for all of them.

    Raises
    ------
    HeadError
        Where sizes do not fit.

    References
    ----------
    Li et al. 2017, section 4: T_S = T + Σ β S + Σ ψ E, joints J = 𝒥 · T_S,
    T_P = T_S + Σ (R(θ) - I) P over all joints but the root, then linear blend skinning
    W(T_P, J, θ), and the translation.
    """
    joints = len(model.parents)
    rows_of = {
        "shape": _rows(shape, "shape", model.identity_basis.shape[2]),
        "expression": _rows(expression, "expression", model.expression_basis.shape[2]),
        "pose": _rows(pose, "pose", 3 * joints, exactly=np.size(pose) > 0),
        "translation": _rows(translation, "translation", 3, exactly=True),
    }
    counts = {len(rows) for rows in rows_of.values()} - {1}
    if len(counts) > 1:
        found = ", ".join(f"{len(rows)} of {name}" for name, rows in rows_of.items())
        raise HeadError.about("FLAME", found=f"frames {found}", allowed="as many, or one for all")
    frames = counts.pop() if counts else 1
    shapes, expressions, poses, shifts = (
        np.broadcast_to(rows, (frames, rows.shape[1])) for rows in rows_of.values()
    )
    result = np.empty((frames, model.vertex_count, 3))
    for start in range(0, frames, BLOCK):
        part = slice(start, start + BLOCK)
        result[part] = _posed(model, shapes[part], expressions[part], poses[part])
        result[part] += shifts[part, None]
    return result


def load_flame(path: str | Path, *, identity_count: int = IDENTITY_COUNT) -> FlameModel:
    """Read a FLAME `.pkl` (2017, 2019, 2020 or 2023) without running anything in it.

    Parameters
    ----------
    path : str or Path
        The file.
    identity_count : int
        The first so many of its components are identity, the rest expression; a file with fewer has
        no expressions.

    Returns
    -------
    FlameModel

    Raises
    ------
    InputError
        For a file that is not such a pickle.
    HeadError
        For parts that are missing or do not fit.
    """
    if identity_count < 0:
        raise HeadError.about("identity_count", found=str(identity_count), allowed="0 or more")
    stored = read_pickle(path)
    missing = [key for key in _KEYS if not isinstance(stored, dict) or key not in stored]
    if missing:
        raise HeadError.about(
            path,
            found=f"no {', '.join(missing)}",
            allowed="a FLAME model (.pkl)",
            remedy="get one from flame.is.tue.mpg.de, or use the built-in head",
        )
    try:
        return _model_of(stored, identity_count)
    except HeadError as error:
        raise HeadError.about(path, found=str(error)) from error


def _model_of(stored: dict[Any, Any], identity_count: int) -> FlameModel:
    for key, allowed in (("bs_style", "lbs"), ("bs_type", "lrotmin")):
        value = stored.get(key, allowed)
        if not isinstance(value, str) or value != allowed:
            raise HeadError(f"{key} is not {allowed}; allowed: {allowed}")
    template = _numbers(stored, "v_template", 2)
    if not 3 <= len(template) <= VERTICES_MAX:
        raise HeadError(f"{len(template)} vertices; allowed: 3 to {VERTICES_MAX}")
    components = _numbers(stored, "shapedirs", 3)
    triangles = _whole(stored, "f")
    if triangles.min(initial=0) < 0 or triangles.max(initial=0) >= len(template):
        raise HeadError(f"faces that point past {len(template)} vertices")
    weights = _numbers(stored, "weights", 2)
    if len(weights) != len(template) or not 1 <= weights.shape[1] <= JOINTS_MAX:
        raise HeadError(
            f"weights are {weights.shape}; allowed: ({len(template)}, up to {JOINTS_MAX} joints)"
        )
    return FlameModel(
        template=template,
        identity_basis=components[:, :, :identity_count],
        expression_basis=components[:, :, identity_count:],
        pose_basis=_numbers(stored, "posedirs", 3),
        joint_regressor=_regressor(stored["J_regressor"], (weights.shape[1], len(template))),
        skin_weights=weights,
        parents=_parents(_whole(stored, "kintree_table")),
        triangles=triangles.astype(np.int32),
    )


def _numbers(stored: dict[Any, Any], key: str, axes: int) -> Float64Array:
    values = stored[key]
    if not isinstance(values, np.ndarray) or values.ndim != axes or values.dtype.kind not in "iuf":
        raise HeadError(f"{key} is {_told(values)}; allowed: numbers with {axes} axes")
    return values.astype(np.float64, order="C")


def _whole(stored: dict[Any, Any], key: str) -> NDArray[np.int64]:
    values = stored[key]
    if not isinstance(values, np.ndarray) or values.ndim != 2 or values.dtype.kind not in "iu":
        raise HeadError(f"{key} is {_told(values)}; allowed: whole numbers with 2 axes")
    return values.astype(np.int64)


def _regressor(values: Any, shape: tuple[int, int]) -> Float64Array:
    """The joint regressor, dense: its size is known to be small before it is unfolded."""
    if isinstance(values, SparseMatrix | np.ndarray) and values.shape == shape:
        if isinstance(values, SparseMatrix):
            return values.dense()
        return _numbers({"J_regressor": values}, "J_regressor", 2)
    raise HeadError(f"J_regressor is {_told(values)}; allowed: {shape}")


def _told(value: Any) -> str:
    """What an entry is, for a message."""
    if isinstance(value, SparseMatrix):
        return f"a sparse matrix {value.shape}"
    return f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else type(value).__name__


def _parents(table: NDArray[np.int64]) -> tuple[int, ...]:
    """Row 0 names the parents, row 1 the joints; the root's parent is 2³² - 1 or -1."""
    if len(table) != 2 or table.shape[1] > JOINTS_MAX:
        raise HeadError(f"kintree_table is {table.shape}; allowed: (2, joints)")
    columns = {int(joint): column for column, joint in enumerate(table[1])}
    return tuple(columns.get(int(parent), -1) for parent in table[0])


def _check_shapes(model: FlameModel) -> None:
    vertices, joints = len(model.template), len(model.parents)
    identity, expression = model.identity_basis.shape[-1], model.expression_basis.shape[-1]
    expected = {
        "template": (vertices, 3),
        "identity_basis": (vertices, 3, identity),
        "expression_basis": (vertices, 3, expression),
        "pose_basis": (vertices, 3, 9 * (joints - 1)),
        "joint_regressor": (joints, vertices),
        "skin_weights": (vertices, joints),
        "triangles": (len(model.triangles), 3),
    }
    for name, shape in expected.items():
        actual = getattr(model, name).shape
        if actual != shape:
            raise HeadError(f"{name} is {actual}; allowed: {shape}")
    if identity + expression > COMPONENTS_MAX:
        raise HeadError(f"{identity + expression} components; allowed: up to {COMPONENTS_MAX}")
    orphans = [j for j, parent in enumerate(model.parents) if not -1 <= parent < j]
    if not joints or model.parents[0] != -1 or orphans:
        raise HeadError("joints out of order; allowed: a root first, parents before children")


def _check_values(model: FlameModel) -> None:
    for name in (
        "template",
        "identity_basis",
        "expression_basis",
        "pose_basis",
        "joint_regressor",
        "skin_weights",
    ):
        if not np.isfinite(getattr(model, name)).all():
            raise HeadError(f"{name} is not finite; allowed: finite numbers")
    if np.abs(model.skin_weights.sum(axis=1) - 1).max(initial=0) > 1e-3:
        raise HeadError("skin weights that do not sum to one")
    triangles = model.triangles
    if not len(triangles) or triangles.min() < 0 or triangles.max() >= len(model.template):
        raise HeadError(f"faces that point past {len(model.template)} vertices, or none")


def _rows(values: ArrayLike, name: str, most: int, exactly: bool = False) -> Float64Array:
    """(1 or frame, number): one row per frame, or one for all."""
    try:
        rows = np.atleast_2d(np.asarray(values, np.float64))
    except (TypeError, ValueError) as error:
        raise HeadError.about("FLAME", found=f"{name} that is not an array of numbers") from error
    fits = rows.shape[-1] == most if exactly else rows.shape[-1] <= most
    if rows.ndim != 2 or not len(rows) or not fits or not np.isfinite(rows).all():
        allowed = f"(frames, {'' if exactly else 'up to '}{most}), finite"
        raise HeadError.about("FLAME", found=f"{name} {rows.shape}", allowed=allowed)
    return rows


def _posed(
    model: FlameModel, shape: Float64Array, expression: Float64Array, pose: Float64Array
) -> Float64Array:
    """(frame, vertex, 3) before the translation; all arguments (frame, …)."""
    joints = len(model.parents)
    if not pose.shape[1]:
        pose = np.zeros((len(pose), 3 * joints))
    shaped = model.template + _sum(model.identity_basis, shape)
    shaped += _sum(model.expression_basis, expression)
    centres = model.joint_regressor @ shaped
    local = to_matrices(pose.reshape(-1, joints, 3))
    bent = (local[:, 1:] - np.eye(3)).reshape(len(pose), -1)
    shaped += _sum(model.pose_basis, bent)
    posed = blended(shaped, *chained(local, centres, model.parents), model.skin_weights)
    return np.asarray(posed, np.float64)


def _sum(basis: Float64Array, coefficients: Float64Array) -> Float64Array:
    """(frame, vertex, 3): Σ_k coefficients[frame, k] · basis[vertex, axis, k]."""
    count = coefficients.shape[1]
    used = basis[:, :, :count].reshape(basis.shape[0] * basis.shape[1], count)
    return (coefficients @ used.T).reshape(len(coefficients), *basis.shape[:2])
