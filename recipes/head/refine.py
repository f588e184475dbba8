"""Finer faces where MakeHuman's skin is coarse: the skull, whose outline would show corners.

The new vertices lie on the same limit surface as the old ones. They are mixtures of skin
vertices, so they follow every identity and expression like the other attached parts.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from recipes.head.anatomy import Anatomy
from recipes.head.topology import limit_stencil

EDGE_M = 0.0135
"""Faces with a longer edge are cut in four."""
BELOW_EYES_M = 0.10
"""The neck stays as it is from here down."""
Edge = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Refinement:
    mixture: sp.csr_matrix  # (new vertex, skin vertex)
    quads: np.ndarray  # (face, 4) all faces of the skin; new vertices from skin count on
    source: np.ndarray  # (face,) the coarse face it was cut from
    corner: np.ndarray  # (face, 4, 4) shares of the coarse face's corners in each corner
    mirror: np.ndarray  # (new vertex,)


def refine(anatomy: Anatomy, skin: np.ndarray, eye: np.ndarray) -> Refinement:
    """Cut the coarse faces of a symmetric template."""
    chosen = _coarse_faces(anatomy, skin, eye)
    edges = sorted({edge for face in chosen for edge in _edges(anatomy.skin_quads[face])})
    edge_vertex = {edge: anatomy.skin_count + k for k, edge in enumerate(edges)}
    first_centre = anatomy.skin_count + len(edges)
    centre_vertex = {face: first_centre + k for k, face in enumerate(chosen)}
    quads, source, corner = [], [], []
    for face, quad in enumerate(anatomy.skin_quads):
        for piece, shares in _pieces(quad, edge_vertex, centre_vertex.get(face)):
            quads.append(piece)
            source.append(face)
            corner.append(shares)
    return Refinement(
        _on_limit_surface(anatomy, edges, chosen),
        np.array(quads),
        np.array(source),
        np.array(corner),
        _mirror(anatomy, edges, chosen),
    )


def _coarse_faces(anatomy: Anatomy, skin: np.ndarray, eye: np.ndarray) -> list[int]:
    quads = anatomy.skin_quads
    sides = [np.linalg.norm(skin[quads[:, k]] - skin[quads[:, k - 1]], axis=1) for k in range(4)]
    centre = skin[quads].mean(1)
    coarse = (np.max(sides, 0) > EDGE_M) & (centre[:, 1] > eye[1] - BELOW_EYES_M)
    coarse &= ~np.isin(quads, anatomy.inner_mouth).any(1)
    by_corners = {frozenset(quad.tolist()): face for face, quad in enumerate(quads)}
    chosen = set(np.flatnonzero(coarse).tolist())
    chosen |= {by_corners[frozenset(anatomy.skin_mirror[quads[face]].tolist())] for face in chosen}
    return sorted(chosen)


def _edges(quad: np.ndarray) -> list[Edge]:
    return [_edge(quad[k], quad[(k + 1) % 4]) for k in range(4)]


def _edge(a: int, b: int) -> Edge:
    return (int(min(a, b)), int(max(a, b)))


def _pieces(quad: np.ndarray, edge_vertex: dict[Edge, int], centre: int | None):
    """Faces, with the coarse corners' shares, that replace one quad."""
    unit = np.eye(4)
    middles = [edge_vertex.get(edge) for edge in _edges(quad)]
    halves = [(unit[k] + unit[(k + 1) % 4]) / 2 for k in range(4)]
    if centre is not None:
        for k in range(4):
            piece = [quad[k], middles[k], centre, middles[k - 1]]
            yield piece, [unit[k], halves[k], unit.mean(0), halves[k - 1]]
        return
    outline = []
    for k in range(4):
        outline.append((int(quad[k]), unit[k]))
        if middles[k] is not None:
            outline.append((middles[k], halves[k]))
    if len(outline) > 4:
        # Begin at a new vertex: a fan from there leaves no sliver along a cut edge.
        start = next(k for k, (vertex, _) in enumerate(outline) if vertex not in quad)
        outline = outline[start:] + outline[:start]
    while len(outline) > 4:
        triangle = [outline[0], outline[1], outline[2], outline[2]]
        yield [vertex for vertex, _ in triangle], [shares for _, shares in triangle]
        del outline[1]
    yield [vertex for vertex, _ in outline], [shares for _, shares in outline]


def _on_limit_surface(anatomy: Anatomy, edges: list[Edge], faces: list[int]) -> sp.csr_matrix:
    """(new vertex, skin vertex): limit of one subdivision, written in limit positions.

    Skin is L c for control points c, new vertices are M c; so they are (M L⁻¹) skin.
    """
    from scipy.sparse.linalg import splu

    subdivide, fine_quads, edge_row, face_row = _subdivision(anatomy)
    limit = limit_stencil(fine_quads, anatomy.skin_count + len(edge_row) + len(face_row))
    rows = [edge_row[edge] for edge in edges] + [face_row[face] for face in faces]
    wanted = sp.csr_matrix((limit @ subdivide)[rows])
    solved = splu(anatomy.skin_stencil.T.tocsc()).solve(wanted.T.toarray()).T
    solved[np.abs(solved) < 2e-4] = 0
    solved /= solved.sum(1, keepdims=True)
    return sp.csr_matrix(solved)


def _subdivision(anatomy: Anatomy):
    """One Catmull-Clark step: matrix, quads, and the rows of edges and faces.

    Face point: mean of the corners. Edge point: mean of the edge's middle and the mean of both
    face points. Old point: (F + 2 E + (n - 3) v) / n. Rims follow the cubic spline.
    """
    quads, count = anatomy.skin_quads, anatomy.skin_count
    beside: dict[Edge, list[int]] = defaultdict(list)
    for face, quad in enumerate(quads):
        for edge in _edges(quad):
            beside[edge].append(face)
    ends = np.array(list(beside))
    inner = np.array([len(near) == 2 for near in beside.values()])
    faces = _table(np.arange(len(quads)).repeat(4), quads.ravel(), 0.25, count)
    middles = _table(np.arange(len(ends)).repeat(2), ends.ravel(), 0.5, count)
    pairs = [(k, face) for k, near in enumerate(beside.values()) if len(near) == 2 for face in near]
    rows, near = np.array(pairs).T
    from_faces = _table(rows, near, 0.25, len(quads), len(ends)) @ faces
    edge_points = sp.diags(np.where(inner, 0.5, 1.0)) @ middles + from_faces

    touching = _table(quads.ravel(), np.arange(len(quads)).repeat(4), 1.0, len(quads), count)
    leaving = _table(ends.ravel(), np.arange(len(ends)).repeat(2), 1.0, len(ends), count)
    n = np.asarray(leaving.sum(1)).ravel()
    on_rim = _table(ends[~inner].ravel(), np.flatnonzero(~inner).repeat(2), 1.0, len(ends), count)
    rim = np.asarray(on_rim.sum(1)).ravel() > 0
    whole = np.where(rim, 0, 1 / n**2)
    old = sp.diags(whole) @ (touching @ faces + 2 * leaving @ middles)
    old = old + sp.diags(np.where(rim, 0.5, (n - 3) / n)) + 0.25 * on_rim @ middles

    face_row = {face: count + face for face in range(len(quads))}
    edge_row = {edge: count + len(quads) + k for k, edge in enumerate(beside)}
    fine = []
    for face, quad in enumerate(quads):
        around = [edge_row[edge] for edge in _edges(quad)]
        for k in range(4):
            fine.append([quad[k], around[k], face_row[face], around[k - 1]])
    return sp.vstack([old, faces, edge_points]).tocsr(), np.array(fine), edge_row, face_row


def _table(rows, columns, value: float, width: int, height: int | None = None) -> sp.csr_matrix:
    height = int(rows.max()) + 1 if height is None else height
    return sp.csr_matrix((np.full(len(rows), value), (rows, columns)), shape=(height, width))


def _mirror(anatomy: Anatomy, edges: list[Edge], faces: list[int]) -> np.ndarray:
    partner = anatomy.skin_mirror
    edge_place = {edge: k for k, edge in enumerate(edges)}
    face_place = {
        frozenset(anatomy.skin_quads[face].tolist()): len(edges) + k for k, face in enumerate(faces)
    }
    mirror = [edge_place[_edge(partner[a], partner[b])] for a, b in edges]
    mirror += [face_place[frozenset(partner[anatomy.skin_quads[face]].tolist())] for face in faces]
    return np.array(mirror)
