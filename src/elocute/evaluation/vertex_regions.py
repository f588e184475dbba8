"""Named regions of vertices with a hash, since published errors differ in whose lips they mean."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.corpus.topologies import Topology, published_indices
from elocute.errors import CorpusError, InputError
from elocute.files.array_reading import read_npy, read_npz
from elocute.files.json_records import INTEGER_MAX_DIGITS, read_json
from elocute.files.picked_points import PICKED_SUFFIX, picked_points
from elocute.files.pickles.closed_pickle import read_pickle
from elocute.files.reading import FileKind, read_text
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.one_line_repr import one_line

FILE_MAX_BYTES = 16_000_000
HASH_DIGITS = 12
BUILTIN_REGIONS = ("lips", "upper_face", "eyes")
ALLOWED = "vertex numbers (.json, .txt, .npy), regions by name (.pkl, .npz), or picked points (.pp)"
REGIONS_FILE = FileKind(ALLOWED, FILE_MAX_BYTES, CorpusError)
PICKED_OFF_SHARE = 0.02
"""A picked point may lie so far off the mesh, as a share of its size."""


@dataclass(frozen=True, eq=False)
class VertexRegion:
    """A named set of vertices that a metric is computed over.

    Attributes
    ----------
    name : str
        With its origin: `builtin:…`, `published:…` or `file:…`.
    indices : (vertex,) int64
        Rising, each once.
    """

    name: str
    indices: NDArray[np.int64]

    __repr__ = one_line

    @property
    def digest(self) -> str:
        """The first 12 hexadecimal digits of the SHA-256 of the indices as little-endian int64."""
        return hashlib.sha256(self.indices.astype("<i8").tobytes()).hexdigest()[:HASH_DIGITS]

    def record(self) -> dict[str, Any]:
        """Name, number of vertices and hash, for reports."""
        return {"name": self.name, "vertices": len(self.indices), "sha256": self.digest}


def builtin_region(which: str) -> VertexRegion:
    """A region of the built-in head.

    Parameters
    ----------
    which : str
        `lips`: the skin of both lips up to the vermilion border; `upper_face`: the face from the
        lower edge of the eye areas upwards, with brows and lashes; `eyes`: the skin around both
        eyes, lids included.

    Returns
    -------
    VertexRegion
        Called `builtin:WHICH`.

    Raises
    ------
    CorpusError
        For another name.
    """
    if which not in BUILTIN_REGIONS:
        raise CorpusError.about(
            f"vertex list {which!r}", found="unknown", allowed=", ".join(BUILTIN_REGIONS)
        )
    return VertexRegion(f"builtin:{which}", _places(load_builtin_head(), which))


def published_region(topology: Topology, which: str) -> VertexRegion:
    """The region that published figures of a topology were computed over.

    Parameters
    ----------
    topology : Topology
        `FLAME` or `BIWI`.
    which : str
        `lips` or `upper_face`.

    Returns
    -------
    VertexRegion
        Called `published:…` after its source.

    Raises
    ------
    CorpusError
        For another name.
    """
    indices = published_indices(topology, which)
    return VertexRegion(f"published:{topology.published[which]}", indices)


def _places(head: HeadModel, which: str) -> NDArray[np.int64]:
    """Indices of a region of the built-in head."""
    eyes = np.union1d(head.regions["eye_area_left"], head.regions["eye_area_right"])
    if which == "eyes":
        return eyes.astype(np.int64)
    if which == "lips":
        return np.unique(head.regions["lips"]).astype(np.int64)
    face = head.regions["face"]
    above = face[head.template[face, 1] >= head.template[eyes, 1].min()]
    parts = (above, eyes, head.regions["brows"], head.regions["lashes"])
    return np.unique(np.concatenate(parts)).astype(np.int64)


def read_vertex_region(
    path: str | Path,
    vertex_count: int,
    *,
    region: str = "",
    template: NDArray[np.floating] | None = None,
) -> VertexRegion:
    """Read a region from a file, FLAME's lips for example.

    Parameters
    ----------
    path : str or Path
        Vertex numbers from 0 in any order, or a truth value for each vertex: a list in a .json,
        numbers with white space or commas between them in a .txt, an array in a .npy. A .pkl
        (FLAME_masks.pkl), .npz or .json may hold several regions by name: FILE:NAME takes one. A
        .pp has points picked in MeshLab, of which each means the nearest vertex.
    vertex_count : int
        Vertices of the topology.
    region : str
        Which of several regions is meant where `path` does not say it.
    template : (vertex, 3), optional
        The mesh that points were picked on, in their unit.

    Returns
    -------
    VertexRegion
        Called `file:NAME`.

    Raises
    ------
    CorpusError
        For anything else, an empty list, or numbers beyond the topology.
    """
    path, named = _of_several(Path(path))
    suffix = path.suffix.lower()
    if suffix == PICKED_SUFFIX:
        numbers = _picked(path, template)
    elif suffix in _READERS:
        value = _READERS[suffix](path)
        if isinstance(value, dict):
            value, named = _chosen(path, value, named, region)
        numbers = _numbers(path, value, vertex_count)
    else:
        raise CorpusError.about(path, found=f"suffix {path.suffix!r}", allowed=ALLOWED)
    _check(path, numbers, vertex_count)
    name = f"file:{path.name}" + (f":{named}" if named else "")
    return VertexRegion(name, np.unique(numbers.astype(np.int64)))


def _of_several(path: Path) -> tuple[Path, str]:
    """The file and the region of FILE:NAME; a file that is called so goes first."""
    file, colon, name = path.name.rpartition(":")
    if colon and Path(file).suffix.lower() in _READERS and not path.exists():
        return path.with_name(file), name
    return path, ""


def _chosen(path: Path, regions: dict[Any, Any], named: str, region: str) -> tuple[Any, str]:
    """One of several regions, and its name. Raises CorpusError where none is meant."""
    names = {str(name): value for name, value in regions.items()}
    for wanted in (named, region):
        alike = [n for n in names if n.casefold().replace(" ", "_") == wanted.casefold()]
        if wanted and alike:
            return names[alike[0]], alike[0]
        if named:
            break
    if len(names) == 1 and not named:
        return next(iter(names.values())), ""
    raise CorpusError.about(
        path,
        found=f"no region {(named or region)[:60]!r}",
        allowed=", ".join(sorted(names))[:300] or "named regions",
        remedy=f"say which: {path.name}:NAME",
    )


def _numbers(path: Path, value: Any, vertex_count: int) -> NDArray[Any]:
    """Vertex numbers, of a list or of a truth value for each vertex."""
    if isinstance(value, list | tuple) and all(type(each) in (int, bool) for each in value):
        value = np.array(value, None if value else np.int64)
    if not isinstance(value, np.ndarray) or value.dtype == object:
        raise CorpusError.about(path, found="no list of numbers", allowed=ALLOWED)
    line = value.reshape(-1) if value.size == max(value.shape, default=0) else value
    if line.shape == (vertex_count,) and np.isin(line, (0, 1)).all() and vertex_count > 2:
        return np.flatnonzero(line)
    return line


def _picked(path: Path, template: NDArray[np.floating] | None) -> NDArray[np.int64]:
    """The vertices nearest to points that were picked. Raises CorpusError for points elsewhere."""
    if template is None:
        raise CorpusError.about(path, found="picked points", allowed="with a mesh beside them")
    text = read_text(path, REGIONS_FILE)
    rows = [row for row in picked_points(text, path) if row is not None]
    if not rows:
        raise CorpusError.about(path, found="no picked points", allowed=ALLOWED)
    mesh = np.asarray(template, np.float64)
    size = float(np.ptp(mesh, axis=0).max())
    vertices = []
    for row in rows:
        away = np.linalg.norm(mesh - np.array(row), axis=1)
        vertices.append(int(away.argmin()))
        if away.min() > PICKED_OFF_SHARE * size:
            raise CorpusError.about(
                path,
                found=f"a point {float(away.min()):.3g} off the neutral face, {size:.3g} large",
                allowed="points picked on it, in its unit",
            )
    return np.array(vertices, np.int64)


def _check(path: Path, numbers: NDArray[Any], vertex_count: int) -> None:
    """Raise CorpusError for anything but a list of vertices of the topology."""
    if numbers.ndim != 1 or not len(numbers) or numbers.dtype.kind not in "iu":
        kind = f"{numbers.dtype} of shape {numbers.shape}"
        raise CorpusError.about(path, found=kind, allowed="one list of whole numbers")
    if numbers.min() < 0 or numbers.max() >= vertex_count:
        wrong = numbers.min() if numbers.min() < 0 else numbers.max()
        raise CorpusError.about(
            path, found=f"vertex {wrong}", allowed=f"0 to {vertex_count - 1}, this topology"
        )


def _from_json(path: Path) -> Any:
    return read_json(path, REGIONS_FILE)


def _from_text(path: Path) -> NDArray[Any]:
    """Whole numbers with white space or commas between them."""
    text = read_text(path, REGIONS_FILE)
    words = text.replace(",", " ").split()
    for word in words:
        digits = word.removeprefix("-")
        if not digits.isascii() or not digits.isdigit() or len(digits) > INTEGER_MAX_DIGITS:
            raise CorpusError.about(path, found="no list of numbers", allowed=ALLOWED)
    return np.array([int(word) for word in words], np.int64)


def _from_pickle(path: Path) -> Any:
    try:
        return read_pickle(path, max_bytes=FILE_MAX_BYTES)
    except InputError as error:
        raise CorpusError(str(error)) from None


_READERS: dict[str, Callable[[Path], Any]] = {
    ".json": _from_json,
    ".txt": _from_text,
    ".npy": partial(read_npy, kind=REGIONS_FILE),
    ".npz": partial(read_npz, kind=REGIONS_FILE),
    ".pkl": _from_pickle,
}
