"""What a character's own shapes do to its mouth, measured on the mesh in its file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from elocute.array_types import Float64Array, IntArray
from elocute.errors import ElocuteError, HeadError
from elocute.files.gltf_arrays import GltfArrays
from elocute.files.mesh_parts import document_parts
from elocute.head.character import Character, Control
from elocute.motion.control_fit import MeasuredMouth, is_of_mouth
from elocute.motion.mouth_seam import find_seam

TRIED = 3
"""Shapes that open the jaw, on which a seam is looked for, the widest first."""


def mouth_controls(character: Character) -> list[Control]:
    """What moves a character's mouth: all that is fitted, or else what takes curves of a mouth."""
    fitted = [each for each in character.controls if each.fitted]
    return fitted or [each for each in character.controls if any(map(is_of_mouth, each.looks))]


def measured_mouth(character: Character) -> MeasuredMouth | None:
    """Measure a character's mouth.

    Parameters
    ----------
    character : Character
        The character.

    Returns
    -------
    MeasuredMouth or None
        What `mouth_controls` do; None where its mesh cannot be read, or has no lips that these
        part.
    """
    controls = mouth_controls(character)
    openers = [each for each in controls if each.binds and each.looks.get("jawOpen", 0.0) > 0]
    openers.sort(key=lambda each: -each.looks["jawOpen"])
    try:
        with np.errstate(all="ignore"):
            return _measured(_Mesh(character), openers[:TRIED], controls)
    # It speaks without: nothing else needs its vertices, which may be damaged or packed.
    except (ElocuteError, ArithmeticError, ValueError, TypeError, LookupError, MemoryError):
        return None


def _measured(mesh: _Mesh, openers: list[Control], controls: list[Control]) -> MeasuredMouth | None:
    for opener in openers:
        seam = find_seam(mesh.points, mesh.triangles, -mesh.moved(opener)[:, 1])
        if seam is not None:
            used, corners = np.unique(seam.corners, return_inverse=True)
            at = corners.reshape(seam.corners.shape)
            rows = np.stack([seam.measures(mesh.moved(each, used)[at]) for each in controls])
            return MeasuredMouth(seam, rows) if np.isfinite(rows).all() else None
    return None


class _Mesh:
    """The meshes of a character that are moved, in one space: x to its left, y up, z ahead."""

    def __init__(self, character: Character) -> None:
        document = character.document
        name = Path(character.name)
        self._parts = document_parts(document, name, HeadError, nodes=character.nodes)
        self._arrays, self._meshes = GltfArrays(document), document.records("meshes")
        angle = np.radians(character.facing_deg)
        self._axes = np.array(
            [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        )
        self._starts = np.cumsum([0, *(len(part.vertices) for part in self._parts)])
        self.points = np.concatenate([part.vertices for part in self._parts]) @ self._axes
        triangles = [p.triangles + at for p, at in zip(self._parts, self._starts, strict=False)]
        self.triangles = np.concatenate(triangles)

    def moved(self, control: Control, used: IntArray | None = None) -> Float64Array:
        """(vertex, 3) of a control in full; used: rising, of all vertices."""
        found = []
        for part, start in zip(self._parts, self._starts, strict=False):
            origin, rows = part.origin, np.arange(len(part.vertices))
            assert origin is not None
            if used is not None:
                rows = used[(used >= start) & (used < start + len(rows))] - start
            total = np.zeros((len(rows), 3))
            targets = self._meshes[origin.mesh]["primitives"][origin.primitive].get("targets", [])
            for mesh, target, share in control.binds:
                if mesh == origin.mesh and "POSITION" in targets[target] and len(rows):
                    values = self._arrays.values(targets[target]["POSITION"])
                    total += share * values[origin.rows[rows], :3]
            found.append(np.einsum("vab,vb->va", origin.linear[rows], total))
        return np.concatenate(found) @ self._axes
