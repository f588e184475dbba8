"""Heads that were not made here, given the built-in head's shapes.

registry             any head by name or file, ready to speak
motion_files         what moves a face, from any file: stored motions, curves, FLAME's parameters
characters           heads in glTF files and VRMs that bring shapes of their own
flame                FLAME: landmarks, eyes and jaw joint are known
own_mesh             a file's mesh with materials, on its own vertices
shapes_in_file       a mesh's own glTF file with the shapes in it
followers            teeth, tongue, lashes and brows beside the skin
carrying             a head and a face with landmarks in; the head's shapes on that face out
registration         the source laid over the face
shape_transfer       displacements carried over by correspondence; lips and lids meet
correspondence       the place on one surface that each vertex of another belongs to
face_lines           the edges of lips and lids, which both faces have
mesh_paths           ways along the edges of a mesh
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.adoption.carrying import Adoption, adopt
    from elocute.adoption.characters.open_character import open_character
    from elocute.adoption.flame import adopt_flame, with_flame_landmarks
    from elocute.adoption.motion_files import OpenedMotion, open_motion
    from elocute.adoption.own_mesh import MeshAdoption, adopt_mesh, open_mesh_head
    from elocute.adoption.registry import open_speaking_head
    from elocute.adoption.shapes_in_file import with_arkit_shapes

__all__ = [
    "Adoption",
    "MeshAdoption",
    "OpenedMotion",
    "adopt",
    "adopt_flame",
    "adopt_mesh",
    "open_character",
    "open_mesh_head",
    "open_motion",
    "open_speaking_head",
    "with_arkit_shapes",
    "with_flame_landmarks",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "carrying": ("Adoption", "adopt"),
        "characters.open_character": ("open_character",),
        "flame": ("adopt_flame", "with_flame_landmarks"),
        "motion_files": ("OpenedMotion", "open_motion"),
        "own_mesh": ("MeshAdoption", "adopt_mesh", "open_mesh_head"),
        "registry": ("open_speaking_head",),
        "shapes_in_file": ("with_arkit_shapes",),
    },
)
