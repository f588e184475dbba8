"""Gives the built-in head's shapes to heads that were made elsewhere.

registry             any head by name or file, ready to speak
motion_files         what moves a face, from any file: stored motions, curves, FLAME's parameters
characters           heads in glTF files and VRMs that bring shapes of their own
flame                FLAME: landmarks, eyes and jaw joint are known
mesh_without_shapes  a file's mesh with materials, on its own vertices
shapes_in_file       a mesh's own glTF file with the shapes in it
carrying             a head and a face with landmarks in; the head's shapes on that face out, also
                     on teeth, tongue, lashes and brows
registration         the source laid over the face
shape_transfer       displacements carried over by correspondence; lips and lids meet
face                 a face, and the place on it that each vertex of another belongs to
face_lines           the edges of lips and lids, which both faces have, as ways along edges
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.adoption.carrying import Adoption as Adoption, adopt as adopt
    from elocute.adoption.characters.open_character import open_character as open_character
    from elocute.adoption.flame import (
        adopt_flame as adopt_flame,
        with_flame_landmarks as with_flame_landmarks,
    )
    from elocute.adoption.mesh_without_shapes import (
        MeshAdoption as MeshAdoption,
        adopt_mesh as adopt_mesh,
        open_mesh_head as open_mesh_head,
    )
    from elocute.adoption.motion_files import (
        OpenedMotion as OpenedMotion,
        open_motion as open_motion,
    )
    from elocute.adoption.registry import open_speaking_head as open_speaking_head
    from elocute.adoption.shapes_in_file import with_arkit_shapes as with_arkit_shapes

__getattr__, __dir__ = lazy(__name__, __file__)
