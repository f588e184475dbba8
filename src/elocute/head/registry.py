"""Opens any head by name or file: the built-in one, FLAME, a stored head, a mesh."""

from __future__ import annotations

from pathlib import Path

from elocute.errors import HeadError
from elocute.files.reading import path_of
from elocute.head.builtin import load_builtin_head
from elocute.head.flame import load_flame
from elocute.head.flame_to_head import head_from_flame
from elocute.head.mesh import head_from_mesh
from elocute.head.model import HeadModel
from elocute.head.store import load_head
from elocute.meshes.gltf_document import SUFFIXES as CHARACTER_SUFFIXES
from elocute.meshes.mesh_file import SUFFIXES as MESH_SUFFIXES

BUILTIN = "builtin"
ALLOWED = f"{BUILTIN}, a FLAME model (.pkl), a head (.npz) or a mesh (.obj, .ply)"


def open_head(choice: str | Path) -> HeadModel:
    """Open any head by its name or file.

    Parameters
    ----------
    choice : str or Path
        "builtin", a FLAME model (.pkl), a stored head (.npz) or a mesh (.obj, .ply). A mesh in the
        built-in topology becomes the built-in head with another neutral face.

    Returns
    -------
    HeadModel

    Raises
    ------
    HeadError
        For a file that is missing or no head; InputError for a pickle that is damaged.
    """
    if not isinstance(choice, str):
        choice = path_of(choice, HeadError)
    if str(choice) == BUILTIN:
        return load_builtin_head()
    path = Path(choice)
    suffix = path.suffix.lower()
    if suffix == ".pkl":
        return head_from_flame(load_flame(path))
    if suffix == ".npz":
        return load_head(path)
    if suffix in MESH_SUFFIXES:
        return head_from_mesh(path)
    if suffix in CHARACTER_SUFFIXES:
        found = "a character's file, whose mesh stays in it"
        remedy = "`elocute animate` moves it, `elocute info` describes it"
        raise HeadError.about(path, found=found, allowed=ALLOWED, remedy=remedy)
    found = f"suffix {suffix!r}" if suffix else "unknown"
    raise HeadError.about(str(choice) or "head ''", found=found, allowed=ALLOWED)
