"""Neutral faces from mesh files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import HeadError
from elocute.files.meshes import SUFFIXES as MESHES
from elocute.files.meshes import read_mesh_file
from elocute.head.bare import bare_head
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel

FILE_MAX_BYTES = 500_000_000
HEIGHT_RANGE_M = (0.12, 0.6)  # of a head with or without its neck
UNITS_M = {"millimetres": 1e-3, "centimetres": 1e-2, "decimetres": 0.1, "inches": 0.0254}


def read_mesh(path: str | Path) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """(vertex, 3) m and (triangle, 3) of an .obj or .ply, vertices in the order of the file.

    Raises HeadError for a file that is no mesh, and one whose size is no head's in metres,
    naming the unit that would fit.
    """
    path = Path(path)
    if path.suffix.lower() not in MESHES:
        raise HeadError.about(
            path, found=f"suffix {path.suffix!r}", allowed=f"{' or '.join(MESHES)} up to 500 MB"
        )
    parts = read_mesh_file(path, max_bytes=FILE_MAX_BYTES, error=HeadError)
    # Beyond what single precision holds is infinite, and told below.
    with np.errstate(over="ignore"):
        points, faces = parts.vertices.astype(np.float32), parts.triangles.astype(np.int32)
    if len(points) < 4 or not len(faces) or not np.isfinite(points).all():
        raise HeadError.about(
            path, found=f"{len(points)} vertices, {len(faces)} faces", allowed="a finite mesh"
        )
    _check_size(path, float(np.ptp(points[:, 1])))
    return points, faces


def mesh_head(path: str | Path) -> HeadModel:
    """A mesh as a head: the built-in head with that neutral face where the topology is its own,
    one that names no places where it is not. Raises HeadError."""
    points, faces = read_mesh(path)
    builtin = load_builtin_head()
    if len(points) == builtin.vertex_count:
        return with_template(builtin, points, Path(path).stem)
    return bare_head(Path(path).stem, points, faces)


def with_template(head: HeadModel, template: NDArray[np.float32], name: str) -> HeadModel:
    """The same rig with another neutral face (vertex, 3) m; joints move with their surroundings.

    Raises HeadError for another number of vertices.
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
