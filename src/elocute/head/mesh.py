"""Heads made from a mesh file or arrays, without named places."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.meshes.mesh_file import SUFFIXES as MESH_SUFFIXES, read_mesh_file

FILE_MAX_BYTES = 500_000_000
HEIGHT_RANGE_M = (0.12, 0.6)  # of a head with or without its neck
SKIN_SRGB = (206, 162, 142)
UNITS_M = {"millimetres": 1e-3, "centimetres": 1e-2, "decimetres": 0.1, "inches": 0.0254}


def read_mesh(path: str | Path) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Read a mesh, its vertices in the order of the file.

    Parameters
    ----------
    path : str or Path
        An .obj or .ply file.

    Returns
    -------
    points : (vertex, 3) float32
        Metres.
    triangles : (triangle, 3) int32
        Vertex indices.

    Raises
    ------
    HeadError
        For a file that is not a mesh, and one whose height in metres does not suit a head; the
        message names the unit that would fit.
    """
    path = Path(path)
    if path.suffix.lower() not in MESH_SUFFIXES:
        raise HeadError.about(
            path,
            found=f"suffix {path.suffix!r}",
            allowed=f"{' or '.join(MESH_SUFFIXES)} up to 500 MB",
        )
    parts = read_mesh_file(path, max_bytes=FILE_MAX_BYTES, error=HeadError)
    # What single precision cannot hold becomes infinite, and is refused below.
    with np.errstate(over="ignore"):
        points, faces = parts.vertices.astype(np.float32), parts.triangles.astype(np.int32)
    if len(points) < 4 or not len(faces) or not np.isfinite(points).all():
        raise HeadError.about(
            path, found=f"{len(points)} vertices, {len(faces)} faces", allowed="a finite mesh"
        )
    _check_size(path, float(np.ptp(points[:, 1])))
    return points, faces


def head_from_mesh(path: str | Path) -> HeadModel:
    """A mesh file (.obj or .ply) as a head; raises as `read_mesh`.

    Where the topology is the same, it is the built-in head with that neutral face; otherwise a head
    that names no places.
    """
    points, faces = read_mesh(path)
    builtin = load_builtin_head()
    if len(points) == builtin.vertex_count:
        return with_template(builtin, points, Path(path).stem)
    return head_from_arrays(Path(path).stem, points, faces)


def head_from_arrays(
    name: str,
    template: NDArray[np.floating],
    faces: NDArray[np.integer],
    *,
    expression_names: tuple[str, ...] = (),
    expression_basis: NDArray[np.floating] | None = None,
    notice: str = "",
) -> HeadModel:
    """A head with one colour, one joint and no named places.

    Parameters
    ----------
    name : str
        Of the head.
    template : (vertex, 3)
        Metres.
    faces : (face, 3 or 4)
        Vertex indices.
    expression_names : tuple of str
        One per expression.
    expression_basis : (expression, vertex, 3), optional
        Metres.
    notice : str
        Licence and origin.

    Returns
    -------
    HeadModel
        Its landmarks, lips and regions are empty, so mouth measures refuse it.

    Raises
    ------
    HeadError
        For indices out of range and numbers that are not finite.
    """
    vertices, nothing = len(template), np.zeros(0, np.int32)
    if expression_basis is None:
        expression_basis = np.zeros((0, vertices, 3))
    quads = faces if faces.shape[1] == 4 else np.concatenate([faces, faces[:, 2:]], axis=1)
    return HeadModel(
        name=name,
        template=template.astype(np.float32),
        quads=quads.astype(np.int32),
        uv=np.zeros((1, 2), np.float32),
        uv_quads=np.zeros((len(faces), 4), np.int32),
        identity_basis=np.zeros((0, vertices, 3), np.float32),
        expression_names=expression_names,
        expression_basis=np.ascontiguousarray(expression_basis, np.float32),
        joint_names=("head",),
        joint_parents=(-1,),
        joint_positions=template.mean(axis=0, keepdims=True).astype(np.float32),
        joint_identity_basis=np.zeros((0, 1, 3), np.float32),
        skin_weights=np.ones((vertices, 1), np.float32),
        landmarks=nothing,
        lip_rings=np.zeros((0, 0), np.int32),
        outer_lip_upper=nothing,
        outer_lip_lower=nothing,
        inner_lip_upper=nothing,
        inner_lip_lower=nothing,
        outer_corners=nothing,
        inner_corners=nothing,
        regions={},
        material=np.zeros(len(faces), np.uint8),
        material_names=("skin",),
        vertex_color=np.tile(np.array(SKIN_SRGB, np.uint8), (vertices, 1)),
        occlusion=np.ones(vertices, np.float32),
        mirror=nothing,
        notice=notice,
    )


def with_template(head: HeadModel, template: NDArray[np.float32], name: str) -> HeadModel:
    """The same rig with another neutral face; joints move with the vertices around them.

    The head has no identity space.

    Parameters
    ----------
    head : HeadModel
        The rig.
    template : (vertex, 3) float32
        Metres.
    name : str
        What messages call the new head.

    Raises
    ------
    HeadError
        For another number of vertices.
    """
    if template.shape != head.template.shape:
        raise HeadError.about(
            f"head {name!r}",
            found=f"{len(template)} vertices",
            allowed=f"{head.vertex_count}, the topology of {head.name!r}",
        )
    moved = template - head.template
    weights = head.skin_weights / np.maximum(head.skin_weights.sum(axis=0), 1e-9)
    return replace(
        head,
        template=template.astype(np.float32),
        joint_positions=(head.joint_positions + weights.T @ moved).astype(np.float32),
        identity_basis=head.identity_basis[:0],
        joint_identity_basis=head.joint_identity_basis[:0],
        tone_basis=head.tone_basis[:0],
        trait_basis=head.trait_basis[:0],
    )


def _check_size(path: Path, height: float) -> None:
    low, high = HEIGHT_RANGE_M
    if low <= height <= high:
        return
    fitting = [name for name, unit in UNITS_M.items() if low <= height * unit <= high]
    remedy = f"it looks like {' or '.join(fitting)}: scale it to metres" if fitting else ""
    raise HeadError.about(
        path, found=f"a height of {height:g}", allowed=f"{low} to {high} m", remedy=remedy
    )
