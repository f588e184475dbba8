"""What a character's own shapes do to its mouth, measured on the mesh in its file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import ElocuteError, HeadError
from elocute.files.draco_gltf import draco_arrays, has_draco
from elocute.files.gltf_arrays import GltfArrays
from elocute.files.mesh_part import MeshPart
from elocute.files.mesh_parts import document_parts
from elocute.head.character import Character, Control
from elocute.motion.control_fit import MeasuredMouth
from elocute.motion.mouth_seam import MouthSeam, find_seam

TRIED = 3
"""Shapes that open the jaw, on which a seam is looked for."""


def measured_mouth(character: Character, controls: Sequence[Control]) -> MeasuredMouth | None:
    """Measure a character's mouth.

    Parameters
    ----------
    character : Character
        The character.
    controls : sequence of Control
        Of its mouth.

    Returns
    -------
    MeasuredMouth or None
        None where its mesh cannot be read, or has no lips that part.
    """
    openers = sorted(controls, key=lambda each: -each.looks.get("jawOpen", 0.0))[:TRIED]
    try:
        mesh = _Mesh(character)
        for opener in openers:
            if opener.binds and opener.looks.get("jawOpen", 0.0) > 0:
                seam = find_seam(mesh.points, mesh.triangles, -mesh.moved(opener)[:, 1])
                if seam is not None:
                    return _measured(mesh, seam, controls)
    except (ElocuteError, ValueError, MemoryError):  # what is moved is known without it
        return None
    return None


def _measured(mesh: _Mesh, seam: MouthSeam, controls: Sequence[Control]) -> MeasuredMouth:
    rows = [seam.measures(mesh.moved(control)[seam.corners]) for control in controls]
    return MeasuredMouth(seam, np.stack(rows))


class _Mesh:
    """The meshes of a character that are moved, in one space: x to its left, y up, z ahead."""

    def __init__(self, character: Character) -> None:
        document = character.document
        name = Path(character.name)
        self._parts = document_parts(document, name, HeadError, nodes=character.nodes)
        packed = has_draco(document)
        self._arrays = draco_arrays(document, name, HeadError) if packed else GltfArrays(document)
        self._meshes = document.records("meshes")
        angle = np.radians(character.facing_deg)
        self._axes = np.array(
            [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
        )
        starts = np.cumsum([0, *(len(part.vertices) for part in self._parts)])
        self.points = np.concatenate([part.vertices for part in self._parts]) @ self._axes
        self.triangles = np.concatenate(
            [part.triangles + at for part, at in zip(self._parts, starts, strict=False)]
        )

    def moved(self, control: Control) -> Float64Array:
        """(vertex, 3) of a control in full."""
        return np.concatenate([self._part(part, control) for part in self._parts]) @ self._axes

    def _part(self, part: MeshPart, control: Control) -> Float64Array:
        origin, total = part.origin, np.zeros((len(part.vertices), 3))
        assert origin is not None
        targets = self._meshes[origin.mesh]["primitives"][origin.primitive].get("targets", [])
        for mesh, target, share in control.binds:
            if mesh == origin.mesh and "POSITION" in targets[target]:
                total += share * self._arrays.values(targets[target]["POSITION"])[origin.rows]
        return np.einsum("vab,vb->va", origin.linear, total)
