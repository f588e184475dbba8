"""Lets a mesh without shapes speak on its own vertices.

parts of a file → joined (seams closed, lips left apart) → a head with its materials
  → 68 landmarks on its vertices → carrying.adopt, with teeth, tongue, lashes and brows
  → a head, or the same file with the shapes in it (shapes_in_file)
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.carrying import Adoption, adopt, with_attached_parts
from elocute.adoption.face_lines import EdgeGraph
from elocute.adoption.registration import FIT_MM
from elocute.array_types import Float64Array
from elocute.capture.scanned_head import detected_landmarks
from elocute.corpus.length_units import UNITS, fitting_unit, is_head_sized, longest_side
from elocute.errors import ElocuteWarning, HeadError
from elocute.head.builtin import load_builtin_head
from elocute.head.mesh import FILE_MAX_BYTES, head_from_arrays
from elocute.head.model import HeadModel
from elocute.head.normals import vertex_normals
from elocute.head.surface import MOST, Surface
from elocute.meshes.gltf_document import SUFFIXES as GLTF_SUFFIXES, GltfDocument, read_gltf
from elocute.meshes.mesh_file import MeshPart, picture_bytes
from elocute.meshes.parts import document_parts, read_mesh_parts
from elocute.numerics.rigid_alignment import similarity_between
from elocute.registration.landmarks import JAW_LINE, read_landmarks
from elocute.registration.scan_file import read_scan, unit_m

VERTICES_MAX = 200_000
PART_MIN = 200
"""Vertices of a part that may be a face."""
OFF_MAX_M = 0.006
"""How far landmarks may lie off the mesh, in the median."""
FACING_M = 0.002
"""What a lip's edge that faces the other way counts for, as a distance."""
ROUGHNESS = 0.6
SIZE_MAX = 4.0
"""How many times larger or smaller than the built-in face one may be."""
INNER_UPPER, INNER_LOWER = (61, 62, 63), (65, 66, 67)


@dataclass(frozen=True, eq=False)
class MeshAdoption:
    """A mesh that has taken over the built-in head's shapes, and where its vertices come from.

    Attributes
    ----------
    adoption : Adoption
        Its head has the mesh's materials and pictures.
    document : GltfDocument or None
        The glTF file that the parts are from.
    parts : tuple of MeshPart
        Of the file.
    places : tuple of (vertex,) int64
        For each part, the head's vertex that each of its vertices became.
    closing : (vertex, 3) float64
        What closed the lips, in the head's space, metres.
    to_scene : (3, 3) float64
        From directions in the head's space, metres, to the file's scene in its unit.
    """

    adoption: Adoption
    document: GltfDocument | None
    parts: tuple[MeshPart, ...]
    places: tuple[NDArray[np.int64], ...]
    closing: Float64Array
    to_scene: Float64Array


def open_mesh_head(
    path: str | Path, landmarks: str | Path | None = None, unit: str | None = None
) -> Adoption:
    """A mesh's own vertices with the built-in head's shapes.

    Parameters
    ----------
    path : str or Path
        An .obj, .ply, .stl, .glb, .gltf, .vrm or .fbx of a head at rest, whose lips are apart
        in the mesh: touching or nearly, but not grown together.
    landmarks : str or Path, optional
        Its 68 landmarks in its unit, as `elocute.capture.read_landmarks` takes them. Without them
        they are detected, if the extra `video` is installed.
    unit : str, optional
        m, mm, cm, dm or inch; by default the one in which the mesh has the size of a head.

    Returns
    -------
    Adoption
        Its head has the mesh's materials and pictures. Eyeballs turn, teeth and tongue move with
        the jaw, lashes and brows with the skin.

    Raises
    ------
    HeadError
        For a file that is no such mesh, of no size of a head, or with landmarks that are missing,
        off the mesh or not those of a face; CaptureError for a file of landmarks that is none.
    """
    return adopt_mesh(path, landmarks, unit).adoption


def adopt_mesh(
    path: str | Path, landmarks: str | Path | None = None, unit: str | None = None
) -> MeshAdoption:
    """As `open_mesh_head`, with what leads back to the file."""
    path, document = Path(path), None
    if path.suffix.lower() in GLTF_SUFFIXES:
        document = read_gltf(path, error=HeadError)
        parts = document_parts(document, path, HeadError)
    else:
        parts = read_mesh_parts(path, max_bytes=FILE_MAX_BYTES, error=HeadError)
    metres = _fitting_unit(path, parts) if unit is None else unit_m(unit)
    head, place = _head_of_parts(path, parts, metres)
    if landmarks is not None:
        marks = read_landmarks(landmarks, metres)
    else:
        scan = read_scan(path)
        scan = replace(scan, points=metres * scan.points, unit_m=metres)
        marks = detected_landmarks(load_builtin_head(), scan)
    marked = nearest_vertices(head, marks.points, str(path))
    upright, turn = _upright(replace(head, landmarks=marked), path)
    adoption = adopt(load_builtin_head(), upright)
    adoption = replace(adoption, head=with_attached_parts(adoption))
    ends = np.cumsum([len(part.vertices) for part in parts])[:-1]
    return MeshAdoption(
        adoption,
        document,
        parts,
        tuple(np.split(place, ends)),
        adoption.head.template.astype(np.float64) - upright.template,
        turn.T / metres,
    )


def _head_of_parts(
    path: Path, parts: Sequence[MeshPart], metres: float
) -> tuple[HeadModel, NDArray[np.intp]]:
    """Parts as one head with their materials and pictures, and the vertex that each became.

    metres: in the unit of the parts. Raises HeadError for too many vertices or materials.
    """
    count = sum(len(part.vertices) for part in parts)
    if count > VERTICES_MAX or len(parts) > MOST:
        raise HeadError.about(
            path,
            found=f"{count} vertices, {len(parts)} materials",
            allowed=f"up to {VERTICES_MAX} and {MOST}",
        )
    points = metres * np.concatenate([part.vertices for part in parts])
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    triangles = np.concatenate(
        [part.triangles + start for part, start in zip(parts, starts, strict=False)]
    )
    first, place = joined(points, triangles)
    corners = place[triangles]
    kept = (np.sort(corners, axis=1)[:, :-1] != np.sort(corners, axis=1)[:, 1:]).all(axis=1)
    material = np.repeat(np.arange(len(parts)), [len(part.triangles) for part in parts])[kept]
    uv = np.concatenate(
        [np.zeros((len(part.vertices), 2)) if part.uv is None else part.uv for part in parts]
    )
    colors = np.concatenate(
        [np.full_like(part.colors, 255) if part.picture else part.colors for part in parts]
    )
    names = _unlike(part.name or "part" for part in parts)
    head = head_from_arrays(path.stem, points[first], corners[kept])
    own = np.concatenate([triangles, triangles[:, 2:]], axis=1)[kept]
    dressed = replace(
        head,
        uv=uv.astype(np.float32),
        uv_quads=own.astype(np.int32),
        material=material.astype(np.uint8),
        material_names=names,
        vertex_color=colors[first],
        surfaces={name: _surface(part) for name, part in zip(names, parts, strict=True)},
    )
    return dressed, place


def _surface(part: MeshPart) -> Surface:
    picture = picture_bytes(part.picture) if part.picture else b""
    return Surface(color=picture, opacity=part.opacity, roughness_factor=ROUGHNESS, both_sides=True)


def _unlike(names: Iterable[str]) -> tuple[str, ...]:
    """Names of which no two are the same."""
    unlike_names: list[str] = []
    for name in names:
        number, unlike = 1, name
        while unlike in unlike_names:
            number, unlike = number + 1, f"{name} {number + 1}"
        unlike_names.append(unlike)
    return tuple(unlike_names)


def _fitting_unit(path: Path, parts: Sequence[MeshPart]) -> float:
    size = longest_side(np.concatenate([part.vertices for part in parts]))
    if is_head_sized(size):
        return 1.0
    unit = fitting_unit(size)
    if not unit:
        raise HeadError.about(
            path,
            found=f"a size of {size:.4g}",
            allowed="a head in m, mm, cm, dm or inch",
            remedy="cut the head off its body, or scale it to metres",
        )
    return UNITS[unit]


def joined(
    points: Float64Array, triangles: NDArray[np.int64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Vertices that a seam doubled made one, while lips and lids that touch stay two.

    Corners (triangle, 3) become one where their triangles have an edge in common. A vertex
    (joined,) for each that is left, and which of them each vertex (vertex,) became.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    raw = np.ascontiguousarray(points.astype(np.float32)).view(np.dtype((np.void, 12))).ravel()
    at = np.unique(raw, return_inverse=True)[1].ravel()
    after = np.roll(triangles, -1, axis=1)
    starts, ends = triangles.ravel(), after.ravel()
    forward = at[starts] < at[ends]
    low, high = np.where(forward, starts, ends), np.where(forward, ends, starts)
    edges = at[low] * (int(at.max()) + 1) + at[high]
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    faces = np.repeat(np.cross(b - a, c - a), 3, axis=0)
    order = np.argsort(edges, kind="stable")
    one, other = order[:-1], order[1:]
    here = edges[one] == edges[other]
    one, other = one[here], other[here]
    # Where more than two triangles meet, as where lips touch, those that face the same way go on.
    which = np.unique(edges, return_inverse=True)[1].ravel()
    crowded = np.bincount(which)[which[one]] > 2
    along = ~crowded | (np.einsum("ea,ea->e", faces[one], faces[other]) > 0)
    one, other = one[along], other[along]
    links = np.concatenate([low[one], high[one]]), np.concatenate([low[other], high[other]])
    count = len(points)
    matrix = coo_matrix((np.ones(len(links[0]), bool), links), (count, count))
    group = connected_components(matrix, directed=False)[1]
    _, first, place = np.unique(group, return_index=True, return_inverse=True)
    return first, place.ravel()


def _upright(head: HeadModel, path: Path) -> tuple[HeadModel, Float64Array]:
    """The head with y up and z ahead, and the right angles (3, 3) that turned its rows so.

    Raises HeadError for landmarks that are not a face's, and a face inside out.
    """
    builtin, marks = load_builtin_head(), head.landmarks
    inner = range(17, 68)
    points = head.template[marks[inner]].astype(np.float64)
    own = builtin.template[builtin.landmarks[inner]].astype(np.float64)
    similar = similarity_between(own, points, np.ones(len(own)))
    off = np.sqrt(np.square(similar(own) - points).sum(axis=1).mean()) / max(similar.scale, 1e-6)
    if not (1000 * off <= FIT_MM and 1 / SIZE_MAX < similar.scale < SIZE_MAX):
        raise HeadError.about(
            path,
            found=f"landmarks {1000 * off:.1f} mm off those of a face",
            allowed=f"up to {FIT_MM:g} mm, in iBUG's order",
        )
    turn, left = np.zeros((3, 3)), similar.rotation.copy()
    for _ in range(3):
        row, column = np.unravel_index(np.argmax(np.abs(left)), left.shape)
        turn[row, column] = np.sign(left[row, column])
        left[row], left[:, column] = 0, 0
    template = (head.template @ turn).astype(np.float32)
    ahead = vertex_normals(template, head.triangles)[marks[[28, 29, 30, 33]], 2].mean()
    if ahead < 0:
        raise HeadError.about(
            path, found="a face inside out", allowed="triangles that face outwards"
        )
    middle = template.mean(axis=0, keepdims=True)
    return replace(head, template=template, joint_positions=middle), turn


def _nearest_part(head: HeadModel, points: Float64Array) -> NDArray[np.intp]:
    """The vertices of the connected part that landmarks (68, 3) m are nearest to."""
    from scipy.spatial import KDTree

    template = head.template.astype(np.float64)
    parts = EdgeGraph(template, head.triangles).parts
    sizes = np.bincount(parts)
    best, least = np.arange(len(template)), np.inf
    for part in np.flatnonzero(sizes >= PART_MIN):
        members = np.flatnonzero(parts == part)
        off = float(np.square(KDTree(template[members]).query(points)[0]).mean())
        if off < least:
            best, least = members, off
    return best


def _with_jaw(points: Float64Array, known: NDArray[np.bool_], name: str) -> Float64Array:
    """Landmarks (68, 3) m with those that are unknown where the built-in face has them."""
    builtin = load_builtin_head()
    own = builtin.template[builtin.landmarks].astype(np.float64)
    similar = similarity_between(own[known], points[known], np.ones(int(known.sum())))
    warnings.warn(
        f"{name}: {int((~known).sum())} landmarks of the jaw are not given; they are taken where "
        "the built-in face has them",
        ElocuteWarning,
        stacklevel=2,
    )
    return np.where(known[:, None], points, similar(own))


def nearest_vertices(head: HeadModel, points: Float64Array, name: str) -> NDArray[np.int32]:
    """The (68,) vertices of landmarks (68, 3) m; a lip's edge faces the other lip.

    All lie on the part that is nearest to them together: lashes and teeth are near, too.

    Raises HeadError where landmarks are missing or off the mesh.
    """
    from scipy.spatial import KDTree

    known = np.asarray(np.isfinite(points).all(axis=1), np.bool_)
    if known[len(JAW_LINE) :].all() and not known[: len(JAW_LINE)].any():
        points = _with_jaw(points, known, name)
    elif not known.all():
        missing = int((~known).sum())
        raise HeadError.about(
            name,
            found=f"{68 - missing} of 68 landmarks",
            allowed="all",
            remedy="give them in a file",
        )
    template = head.template.astype(np.float64)
    skin = _nearest_part(head, points)
    tree = KDTree(template[skin])
    away, nearest = (np.asarray(each) for each in tree.query(points))
    chosen = skin[nearest].astype(np.int32)
    off = float(np.median(away))
    if off > OFF_MAX_M:
        raise HeadError.about(
            name,
            found=f"landmarks {1000 * off:.1f} mm off the mesh",
            allowed=f"up to {1000 * OFF_MAX_M:g} mm, in the unit of the mesh",
        )
    up = points[27] - points[8]
    up /= max(float(np.linalg.norm(up)), 1e-9)
    normals = vertex_normals(template, head.triangles) @ up
    for rows, facing in ((INNER_UPPER, -1.0), (INNER_LOWER, 1.0)):
        for row in rows:
            near = skin[tree.query_ball_point(points[row], away[row] + FACING_M)]
            cost = np.linalg.norm(template[near] - points[row], axis=1)
            chosen[row] = near[np.argmin(cost - FACING_M * facing * normals[near])]
    return chosen
