"""Opens any head by name or file, with the shapes that speech models move."""

from __future__ import annotations

import contextlib
import importlib.util
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from elocute.errors import HeadError, MachineError
from elocute.files.reading import path_of
from elocute.head.builtin import load_builtin_head
from elocute.head.mesh import FILE_MAX_BYTES
from elocute.head.model import HeadModel
from elocute.head.registry import open_head
from elocute.meshes.gltf_document import SUFFIXES as CHARACTER_SUFFIXES, read_gltf
from elocute.meshes.mesh_file import SUFFIXES as KNOWN_SUFFIXES, read_mesh_file

FLAME_SUFFIX = ".pkl"
KEPT = 2  # heads that stay in memory, so that a folder of recordings adopts one once


def open_speaking_head(choice: str | Path, mesh: str | None = None) -> HeadModel:
    """Open any head, ready for every speech model.

    Parameters
    ----------
    choice : str or Path
        As `elocute.head.open_head` takes it, or a character's file (.glb, .gltf, .vrm, .fbx).
    mesh : str, optional
        The name of a mesh of the head that is meant, in a character's file with several.

    Returns
    -------
    HeadModel
        As it is where it has the built-in head's shapes. A FLAME model, or a mesh of FLAME's 5023
        vertices, gets them carried over. Any other mesh is taken for a scan, and becomes the
        built-in head with its face and colours, also in glTF; other stored heads stay as they are.
        A character's file becomes the built-in head with that file as its `character`.

    Raises
    ------
    HeadError
        For a file that is missing or no head, a FLAME model that no shapes can be carried over to,
        and a character without shapes of a mouth; CaptureError for a mesh without a face;
        MachineError where SciPy is needed and not installed.
    """
    path = Path(choice) if isinstance(choice, str) else path_of(choice, HeadError)
    if path.suffix.lower() in CHARACTER_SUFFIXES:
        from elocute.adoption.characters.given_names import names_path

        return _character(path, (*_version(path), *_version(names_path(path))), mesh)
    if mesh is not None:
        raise HeadError.about(
            "`mesh`", found=repr(mesh), allowed=f"for a head in {', '.join(CHARACTER_SUFFIXES)}"
        )
    if path.suffix.lower() in _ADOPTED_SUFFIXES and path.is_file():
        return _adopted(path, *_version(path))
    return open_head(choice)


def _version(path: Path) -> tuple[int, int]:
    """What tells versions of a file apart; it need not be there."""
    try:
        stamp = path.stat()
    except (OSError, ValueError):
        return 0, 0
    return stamp.st_mtime_ns, stamp.st_size


@lru_cache(maxsize=KEPT)
def _character(path: Path, version: tuple[int, ...], mesh: str | None) -> HeadModel:
    """The head that stands for the character of a file; without any shapes it is a scan."""
    from elocute.adoption.characters.open_character import character_head, open_character

    if mesh is None and is_scan(path):
        return _scanned(path)
    return character_head(open_character(path, mesh).character)


def _scanned(path: Path) -> HeadModel:
    _need_scipy(path)
    from elocute.capture.scanned_head import open_scanned_head

    return open_scanned_head(path).head


_ADOPTED_SUFFIXES = (FLAME_SUFFIX, *KNOWN_SUFFIXES, ".stl", ".npz")


@lru_cache(maxsize=KEPT)
def _adopted(path: Path, changed: int, size: int) -> HeadModel:
    """The head of a file; `changed` and `size` tell its versions apart."""
    from elocute.adoption.flame_places import FLAME_VERTICES

    if path.suffix.lower() == FLAME_SUFFIX:
        from elocute.head.flame import load_flame

        model = load_flame(path)
        _need_scipy(path)
        from elocute.adoption.flame import adopt_flame

        with _about(path):
            return adopt_flame(model).head
    if is_scan(path):
        return _scanned(path)
    head = open_head(path)
    if head.vertex_count != FLAME_VERTICES or _speaks(head):
        return head
    _need_scipy(path)
    from elocute.adoption.carrying import adopt
    from elocute.adoption.flame import with_flame_landmarks

    with _about(path):
        return adopt(load_builtin_head(), with_flame_landmarks(head)).head


def is_scan(path: Path) -> bool:
    """Whether a file is a mesh without shapes and of no topology that is known.

    Raises HeadError for a file that is no mesh.
    """
    from elocute.adoption.characters.morphs import morph_meshes
    from elocute.adoption.flame_places import FLAME_VERTICES

    suffix = path.suffix.lower()
    if suffix in CHARACTER_SUFFIXES:
        return not morph_meshes(read_gltf(path, error=HeadError))
    if suffix not in KNOWN_SUFFIXES:
        return suffix == ".stl"
    parts = read_mesh_file(path, max_bytes=FILE_MAX_BYTES, error=HeadError)
    return len(parts.vertices) not in (FLAME_VERTICES, load_builtin_head().vertex_count)


@contextlib.contextmanager
def _about(path: Path) -> Iterator[None]:
    """What is wrong with a face is told with its file."""
    try:
        yield
    except HeadError as error:
        raise HeadError.about(path, found=str(error)) from error


def _speaks(head: HeadModel) -> bool:
    """Whether a head has shapes by the names that models drive."""
    return "jawOpen" in head.expression_names


def _need_scipy(path: Path) -> None:
    """Raises MachineError where the extra is not installed."""
    if importlib.util.find_spec("scipy") is None:
        raise MachineError(
            f"{path}: carrying shapes over needs scipy; install it: pip install 'elocute[capture]'"
        )
