"""Measures what a character's own shapes do to its mouth, on the mesh in its file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float64Array, IntArray
from elocute.errors import ElocuteError, HeadError
from elocute.head.character import Character, Control
from elocute.meshes.gltf_arrays import GltfArrays
from elocute.meshes.parts import document_parts
from elocute.motion.control_fit import is_of_mouth
from elocute.motion.mouth_seam import MeasuredMouth, find_mouth

OPENERS = 3
"""Shapes that open the jaw widest, by which together a mouth is found."""


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
        With the effects of `mouth_controls`; None where its mesh cannot be read, or has no lips
        that these part.
    """
    controls = mouth_controls(character)
    openers = [each for each in controls if each.binds and each.looks.get("jawOpen", 0.0) > 0]
    openers.sort(key=lambda each: -each.looks["jawOpen"])
    try:
        with np.errstate(all="ignore"):
            mesh = _Mesh(character)
            drop = -np.sum([mesh.moved(each)[:, 1] for each in openers[:OPENERS]], axis=0)
            mouth = find_mouth(
                mesh.points,
                mesh.triangles,
                drop,
                lambda used: np.stack([mesh.moved(each, used) for each in controls]),
            )
        return mouth if mouth is not None and np.isfinite(mouth.effects).all() else None
    # It speaks without: nothing else needs its vertices, which may be damaged or packed.
    except (ElocuteError, ArithmeticError, ValueError, TypeError, LookupError, MemoryError):
        return None


class _Mesh:
    """The meshes of a character that are moved, in one space: x to its left, y up, z ahead."""

    def __init__(self, character: Character) -> None:
        document = character.document
        plain: dict[str, Any] = {"images": []}
        plain["materials"] = [{} for _ in document.records("materials")]
        bare = replace(document, record=document.record | plain)
        parts = [(p, p.origin) for p in document_parts(bare, Path(character.name), HeadError)]
        self._parts = [(p, at) for p, at in parts if at and at.node in character.nodes]
        self._arrays, self._meshes = GltfArrays(document), document.records("meshes")
        self._axes = character.axes
        self._starts = np.cumsum([0, *(len(part.vertices) for part, _ in self._parts)])
        self.points = np.concatenate([part.vertices for part, _ in self._parts]) @ self._axes
        self.triangles = np.concatenate(
            [p.triangles + at for (p, _), at in zip(self._parts, self._starts, strict=False)]
        )

    def moved(self, control: Control, used: IntArray | None = None) -> Float64Array:
        """(vertex, 3) of a control in full; used: rising, of all vertices."""
        found = []
        for (part, origin), start in zip(self._parts, self._starts, strict=False):
            rows = np.arange(len(part.vertices))
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
