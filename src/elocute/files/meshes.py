"""Mesh files, parsed by trimesh, which is given bytes and never a path.

A mesh may name a material file, and that one pictures. They are looked for in the mesh's own
folder only, as regular files of limited size, and a picture's size is known before it is decoded.
"""

from __future__ import annotations

import io
import logging
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.files.reading import bytes_text, read_bytes
from elocute.files.unpacked_size import unpacked_limit

SUFFIXES = (".obj", ".ply")
MATERIAL_MAX_BYTES = 1_000_000
PICTURE_MAX_BYTES = 200_000_000
PICTURES_MAX = 16
PICTURE_FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "WEBP", "TGA")
UNPACKED_MIN_BYTES = 4 * 4096 * 4096
"""A mesh or a picture may unpack to this much, however small its file is."""
VERTEX_BYTES = 24
SILENT = logging.NullHandler()


@dataclass(frozen=True, eq=False)
class MeshParts:
    """What a mesh file holds.

    Attributes
    ----------
    vertices : (vertex, 3) float64
        In the file's unit.
    triangles : (face, 3) int64
        Corners, all of them vertices of the mesh.
    colors : (vertex, 3) uint8 or None
        sRGB, of the vertices or a texture.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    colors: NDArray[np.uint8] | None


def read_mesh_file(
    path: str | Path, *, max_bytes: int, error: type[InputError], coloured: bool = False
) -> MeshParts:
    """Read a mesh, with its vertices in the order of the file.

    Parameters
    ----------
    path : str or Path
        An .obj or .ply.
    max_bytes : int
        Largest size of the file, bytes.
    error : type of InputError
        The class to raise.
    coloured : bool
        Whether colours are read, and so the material file and pictures in the same folder.

    Returns
    -------
    MeshParts
        Vertices, triangles and colours.

    Raises
    ------
    InputError
        Of the class `error`, for a file that is missing, too large or not a mesh, or whose
        materials are not regular files or unpack to far more than their size.
    """
    path = Path(path)
    kind = path.suffix.lower().removeprefix(".")
    data = read_bytes(path, max_bytes=max_bytes, allowed="a mesh", error=error)
    if kind == "obj":
        data = checked_text(data, path, error)
    folder = Folder(path, error)
    try:
        parts = _parts(data, kind, folder if coloured else None)
    except Exception as problem:  # trimesh raises whatever its parsers meet
        if folder.refused is not None:
            raise folder.refused from None
        raise error.about(
            path, found="no mesh that can be read", allowed=f"a mesh ({' '.join(SUFFIXES)})"
        ) from problem
    if folder.refused is not None:  # trimesh itself would go on without colours
        raise folder.refused
    points, faces = parts.vertices, parts.triangles
    if not len(points) or not len(faces):
        raise error.about(
            path, found=f"{len(points)} vertices, {len(faces)} triangles", allowed="a mesh"
        )
    if faces.min() < 0 or faces.max() >= len(points):
        raise error.about(path, found=f"triangles that point past {len(points)} vertices")
    return parts


def check_picture(
    data: bytes, subject: str | Path, error: type[InputError] = InputError
) -> tuple[int, int]:
    """Check a picture before its pixels are decoded.

    Parameters
    ----------
    data : bytes
        The file's content.
    subject : str or Path
        Where it is from, for the message.
    error : type of InputError
        The class to raise.

    Returns
    -------
    width, height : int
        Pixels.

    Raises
    ------
    InputError
        Of the class `error`, for anything but a picture of `PICTURE_FORMATS`, and for one that
        would unpack to far more than its size.
    """
    from PIL import Image

    allowed = f"a picture ({', '.join(PICTURE_FORMATS)})"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(data), formats=PICTURE_FORMATS) as picture:
                width, height = picture.size
    except Image.DecompressionBombError as problem:
        found = f"a picture of far too many pixels in {bytes_text(len(data))}"
        raise error.about(subject, found=found, allowed=allowed) from problem
    except Exception as problem:  # PIL's parsers raise of every kind
        raise error.about(subject, found="no picture", allowed=allowed) from problem
    limit = unpacked_limit(len(data), UNPACKED_MIN_BYTES)
    if 4 * width * height > limit:
        raise error.about(
            subject,
            found=f"a picture of {width} × {height} pixels in {bytes_text(len(data))}",
            allowed=f"up to {bytes_text(limit)} unpacked",
        )
    return width, height


def checked_text(data: bytes, path: Path, error: type[InputError]) -> bytes:
    """An .obj as UTF-8, once its groups are known to be few: each holds a copy of all vertices."""
    groups = len(set(re.findall(rb"(?m)^\s*usemtl[^\n]*", data)))
    vertices = len(re.findall(rb"(?m)^\s*v\s", data))
    limit = unpacked_limit(len(data), UNPACKED_MIN_BYTES)
    _check_places(data, path, error)
    if (groups + 1) * vertices * VERTEX_BYTES > limit:
        raise error.about(path, found=f"{groups} materials on {vertices} vertices", allowed="fewer")
    try:
        data.decode("utf-8")
        return data
    except UnicodeDecodeError:
        return data.decode("latin-1").encode("utf-8")


def _check_places(data: bytes, path: Path, error: type[InputError]) -> None:
    """Refuse faces whose numbers are far beyond what is there: a list as long would be made."""
    there = len(re.findall(rb"(?m)^\s*v[tn]?\s", data))
    digits = len(str(there)) + 1
    if re.search(rb"(?m)^\s*f\s[^\n]*[0-9]{%d}" % digits, data):
        raise error.about(path, found=f"faces that point past {there} vertices", allowed="a mesh")


def _parts(data: bytes, kind: str, folder: Folder | None) -> MeshParts:
    """The mesh in the bytes of a file; without a folder no material is looked for."""
    import trimesh

    # It would print a traceback for each picture that is not there.
    logging.getLogger("trimesh").addHandler(SILENT)
    resolver: Any = folder or Nothing()
    if folder is None:  # trimesh would give each material its own copy of the vertices
        data = re.sub(rb"(?m)^\s*usemtl\b[^\n]*", b"", data) if kind == "obj" else data
    mesh: Any = trimesh.load(
        io.BytesIO(data),
        file_type=kind,
        resolver=resolver,
        process=False,
        maintain_order=True,
        force="mesh",
        skip_materials=folder is None,
        fix_texture=folder is not None,  # which splits vertices at the seams of a texture
    )
    points = np.asarray(mesh.vertices, np.float64).reshape(-1, 3)
    faces = np.asarray(mesh.faces, np.int64).reshape(-1, 3)
    colors = None if folder is None else _colors(mesh, len(points))
    return MeshParts(points, faces, colors)


def _colors(mesh: Any, count: int) -> NDArray[np.uint8] | None:
    """(vertex, 3) from the vertices or the texture; None where there is neither."""
    kind = mesh.visual.kind
    if kind == "texture":
        if getattr(mesh.visual.material, "image", None) is None:
            return None
        mesh = mesh.copy()
        mesh.visual = mesh.visual.to_color()
    if kind not in ("texture", "vertex"):
        return None
    colors = np.asarray(mesh.visual.vertex_colors)[:, :3].astype(np.uint8)
    return colors if len(colors) == count else None


class Nothing:
    """A resolver, as trimesh calls it, that finds no other file."""

    def get(self, name: str) -> bytes:
        """Raise FileNotFoundError."""
        raise FileNotFoundError(name)

    __getitem__ = get

    def keys(self) -> tuple[str, ...]:
        """No name."""
        return ()


class Folder(Nothing):
    """A resolver that finds regular files of limited size beside a mesh, by their bare names."""

    def __init__(self, path: Path, error: type[InputError]) -> None:
        self._folder, self._error, self.file_name = path.parent, error, path.name
        self._pictures = 0
        self.refused: InputError | None = None

    def get(self, name: str) -> bytes:
        """The bytes of a file; `refused` keeps an error, which trimesh would pass over."""
        bare = Path(name.strip().replace("\\", "/")).name
        path = self._folder / bare
        if not bare or not path.exists():
            raise FileNotFoundError(bare)
        try:
            return self._read(path)
        except InputError as error:
            self.refused = error
            raise

    __getitem__ = get

    def _read(self, path: Path) -> bytes:
        """The bytes of a material file or a picture."""
        if path.suffix.lower() == ".mtl":
            return read_bytes(
                path, max_bytes=MATERIAL_MAX_BYTES, allowed="a material file", error=self._error
            )
        self._pictures += 1
        if self._pictures > PICTURES_MAX:
            raise self._error.about(
                path, found=f"more than {PICTURES_MAX} pictures", allowed="one texture"
            )
        data = read_bytes(path, max_bytes=PICTURE_MAX_BYTES, allowed="a picture", error=self._error)
        check_picture(data, path, self._error)
        return data
